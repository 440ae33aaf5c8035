/// ADS over EtherCAT: an AMS header and the data of an ADS command.
///
///   | target net id 6, port 2 | source net id 6, port 2 | command 2 | state flags 2 | length 4 | error 4 | invoke id 4
///   | read request:       | index group 4 | index offset 4 | length 4 | write request:      | index group 4 | index
///   offset 4 | length 4 | data | read write request: | index group 4 | index offset 4 | read length 4 | write length 4
///   | data | responses:          | result 4 | length 4 | data |     (write: the result alone)
///
/// Source: Beckhoff Information System, ADS/AMS specification; ETG.1020 AoE.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

inline constexpr std::size_t kAmsHeaderBytes = 32;

enum class AdsCommand : std::uint16_t {
  kInvalid = 0,
  kReadDeviceInfo = 1,
  kRead = 2,
  kWrite = 3,
  kReadState = 4,
  kWriteControl = 5,
  kAddNotification = 6,
  kDeleteNotification = 7,
  kNotification = 8,
  kReadWrite = 9,
};

/// "read", "read write"; "command 12" for others.
[[nodiscard]] std::string Name(AdsCommand command);

using AmsNetId = std::array<std::uint8_t, 6>;
/// "172.16.17.10.1.1".
[[nodiscard]] std::string Text(const AmsNetId& id);

struct AmsHeader {
  AmsNetId target{};
  std::uint16_t target_port = 0;
  AmsNetId source{};
  std::uint16_t source_port = 0;
  AdsCommand command = AdsCommand::kInvalid;
  std::uint16_t state_flags = 0;  ///< bit 0 response, bit 2 ADS command
  std::uint32_t length = 0;       ///< bytes after the header
  std::uint32_t error = 0;        ///< AMS error code
  std::uint32_t invoke_id = 0;    ///< the response repeats that of its request
  ByteSpan data;                  ///< what is after the header, at most `length` bytes
  bool too_short = false;         ///< what is missing reads as 0

  [[nodiscard]] bool response() const { return (state_flags & 1U) != 0; }
};

[[nodiscard]] AmsHeader ParseAms(ByteSpan payload);

/// Parameters of the ADS commands that access data; what a command does not have is absent.
struct AdsParameters {
  std::optional<std::uint32_t> index_group, index_offset;
  std::optional<std::uint32_t> read_length;  ///< asked for, or in a response the bytes given
  std::optional<std::uint32_t> write_length;
  std::optional<std::uint32_t> result;  ///< responses: ADS error code, 0 is success
  ByteSpan data;                        ///< written or read bytes
};

[[nodiscard]] AdsParameters ParseAds(const AmsHeader& header);

/// Index group, index offset and data in one row, to compare what two requests access.
[[nodiscard]] std::vector<std::uint8_t> AccessBytes(const AdsParameters& parameters);

}  // namespace ecaudit::mailbox
