/// The mailbox of a simulated slave: CANopen over EtherCAT with SDO up- and downloads of every kind, emergencies, a
/// small SDO information service, and error replies for every other protocol (esc-reference 8).
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "decoder/base/ids.h"
#include "samples/builder/esc.h"
#include "samples/builder/object_dictionary.h"

namespace ecaudit::samples {

inline constexpr std::size_t kMailboxHeader = 6;  ///< bytes

inline constexpr std::uint32_t kAbortToggle = 0x05030000;
inline constexpr std::uint32_t kAbortCommand = 0x05040001;
inline constexpr std::uint32_t kAbortUnsupportedAccess = 0x06010000;
inline constexpr std::uint32_t kAbortWriteOnly = 0x06010001;
inline constexpr std::uint32_t kAbortReadOnly = 0x06010002;
inline constexpr std::uint32_t kAbortSubindexZeroFirst = 0x06010003;
inline constexpr std::uint32_t kAbortNoObject = 0x06020000;
inline constexpr std::uint32_t kAbortNotMappable = 0x06040041;
inline constexpr std::uint32_t kAbortLength = 0x06070010;
inline constexpr std::uint32_t kAbortTooLong = 0x06070012;
inline constexpr std::uint32_t kAbortTooShort = 0x06070013;
inline constexpr std::uint32_t kAbortNoSubindex = 0x06090011;
inline constexpr std::uint32_t kAbortRange = 0x06090030;
inline constexpr std::uint32_t kAbortState = 0x08000022;

struct CoeBehaviour {
  TimeNs response_time = 800'000;
  bool complete_access = false;
  bool answers = true;                       ///< false: requests are read and never answered
  bool reads_requests = true;                ///< false: the mailbox stays full
  std::optional<std::uint32_t> foe_error{};  ///< answers what comes by FoE with this error; else it knows no FoE
  std::uint8_t abort_service = 2;            ///< CoE service of aborts: 2 or 3, both exist
};

class CoeServer {
 public:
  /// Asked before a download is stored: 0 to go on, or an abort code.
  using DownloadCheck = std::function<std::uint32_t(std::uint16_t index, std::uint8_t subindex, ByteView value)>;

  CoeServer(CoeBehaviour behaviour, DownloadCheck check) : behaviour_(behaviour), check_(std::move(check)) {}

  /// The slave entered PREOP: both counters start anew.
  void Start(Esc& esc);
  void Stop();
  /// Works on what happened up to `now`.
  void Run(TimeNs now, Esc& esc, ObjectDictionary& objects);
  /// Sends an emergency as soon as the mailbox is empty after `at`.
  void QueueEmergency(TimeNs at, std::uint16_t code, std::uint8_t error_register, Bytes data);
  /// Answers with the next counter left out once.
  void SkipCounterOnce() { counter_ = Next(counter_); }
  CoeBehaviour& behaviour() { return behaviour_; }

 private:
  struct Pending {
    TimeNs at = 0;
    std::uint8_t type = 3;
    Bytes service{};  // what follows the mailbox header
  };

  static std::uint8_t Next(std::uint8_t counter) { return static_cast<std::uint8_t>(counter % 7 + 1); }
  std::optional<Bytes> Answer(ByteView service, ObjectDictionary& objects, std::size_t capacity);
  std::optional<Bytes> Sdo(ByteView service, ObjectDictionary& objects, std::size_t capacity);
  Bytes Information(ByteView service, const ObjectDictionary& objects, std::size_t capacity);
  Bytes Abort(std::uint16_t index, std::uint8_t subindex, std::uint32_t code);
  Bytes InitiateUpload(std::uint16_t index, std::uint8_t subindex, bool complete, const ObjectDictionary& objects,
                       std::size_t capacity);
  Bytes UploadSegment(std::uint8_t command, std::size_t capacity);
  Bytes InitiateDownload(ByteView service, ObjectDictionary& objects);
  Bytes DownloadSegment(ByteView service, ObjectDictionary& objects);
  std::uint32_t Store(std::uint16_t index, std::uint8_t subindex, bool complete, ByteView data,
                      ObjectDictionary& objects);
  std::uint32_t StoreOne(std::uint16_t index, std::uint8_t subindex, ByteView data, ObjectDictionary& objects);

  struct Transfer {
    bool upload = false;
    bool complete = false;
    std::uint16_t index = 0;
    std::uint8_t subindex = 0;
    Bytes data{};
    std::size_t size = 0;  // announced
    std::size_t position = 0;
    bool toggle = false;
  };

  CoeBehaviour behaviour_;
  DownloadCheck check_;
  bool running_ = false;
  std::uint8_t counter_ = 0;
  std::uint8_t last_request_counter_ = 0;
  std::deque<Pending> queue_;
  std::optional<Transfer> transfer_;
  Bytes last_sent_;
};

}  // namespace ecaudit::samples
