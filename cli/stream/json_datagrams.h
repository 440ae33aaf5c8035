/// Datagrams as JSON objects.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

#include "cli/stream/datagram_row.h"

namespace ecaudit::cli {

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

class DatagramObjects {
 public:
  /// Appends the object that docs/json.md describes, without a line break.
  void Append(std::string& out, const DatagramRow& row);

 private:
  DatagramFields fields_;
  FrameNo frame_ = 0;    ///< of seconds_
  std::string seconds_;  ///< from the first packet
};

}  // namespace ecaudit::cli
