/// One line for each datagram, as JSON or for people.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "cli/stream/columns.h"
#include "decoder/base/ids.h"
#include "decoder/bus/direction.h"
#include "decoder/mailbox/diagnosis_message.h"
#include "decoder/mailbox/header.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::cli {

/// A datagram and what is known of it as of its frame.
struct DatagramRow {
  const wire::FrameView& frame;
  wire::DatagramView datagram;
  bus::Direction direction = bus::Direction::kForeign;
  std::optional<std::int64_t> since_start_ns;  ///< from the first packet
  std::string_view seconds;                    ///< that as text
  std::optional<SlavePos> slave;               ///< the slave it addresses
  std::optional<mailbox::Direction> mailbox;   ///< it accesses the mailbox of the slave from its first byte on
  TimeColumn time;
  const mailbox::DiagnosisTexts* diagnosis_texts = nullptr;  ///< of the slave; null: none

  [[nodiscard]] bool outbound() const { return direction == bus::Direction::kOutbound; }
  [[nodiscard]] bool returned() const { return direction == bus::Direction::kReturned; }
};

/// Names of accesses as JSON text; the same few come again and again.
class RegisterNames {
 public:
  /// null when there is none.
  const std::string& Find(EscAddress address, std::uint16_t length);

 private:
  static constexpr std::size_t kMaxEntries = 4096;
  std::unordered_map<std::uint32_t, std::string> names_;
};

/// What a JSON line shows of a datagram between its time and its data, but for the index, which every frame has another
/// one of. A cycle mostly shows what the one before reported in the same place.
class DatagramFields {
 public:
  struct Key {
    std::uint64_t header = 0;  ///< command, address, length and flags
    std::uint16_t irq = 0;
    std::uint16_t wkc = 0;
    std::optional<SlavePos> slave;
    bus::Direction direction = bus::Direction::kForeign;
    bool operator==(const Key&) const = default;
  };
  struct Place {
    Key key;
    std::string ahead;   ///< of the index
    std::string behind;  ///< up to the first digit of the data
  };

  /// Valid until the next call.
  const Place& Find(const DatagramRow& row);

 private:
  void Write(const DatagramRow& row, Place& place);

  static constexpr std::size_t kPlaces = 128;
  std::array<Place, kPlaces> places_;
  RegisterNames names_;
};

/// Appends the object that contract and docs/json.md describe, without a line break.
void AppendDatagramJson(std::string& out, const DatagramRow& row, DatagramFields& fields);

/// Contents of datagrams in words. A cycle mostly shows what the one before reported in the same place.
class ContentTexts {
 public:
  /// Valid until the next call.
  const std::string& Find(const DatagramRow& row);

 private:
  static constexpr std::size_t kPlaces = 128;
  struct Place {
    std::vector<std::uint8_t> bytes;  ///< of the datagram
    bus::Direction direction = bus::Direction::kForeign;
    std::optional<mailbox::Direction> mailbox;
    std::string text;
  };
  std::array<Place, kPlaces> places_;
};

/// The line above all others.
[[nodiscard]] std::string DatagramTextHeader(const TimeColumn& time, bool color);
/// Appends frame, time, direction, command, slave, address, length, working counter and contents in columns.
void AppendDatagramText(std::string& out, const DatagramRow& row, ContentTexts& contents, bool color);
/// Lines that `decode` writes for a frame when it shows all slaves.
[[nodiscard]] std::size_t LinesOf(const wire::FrameView& frame);
/// What is wrong with a frame, as a line of its own; nothing when it is sound.
[[nodiscard]] std::optional<std::string> FrameProblemText(const wire::FrameView& frame,
                                                          std::optional<std::int64_t> since_start_ns,
                                                          const TimeColumn& time, bool color);

}  // namespace ecaudit::cli
