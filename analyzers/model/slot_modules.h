/// in: SDO transfers of one modular slave.  out: which module is in each of its slots.
///
/// F030h is what the master configures, F050h what the slave found; both list the idents slot by slot. A list counts
/// when its length and each of its entries were transferred.
/// Source: ETG.5001.1, objects F030h and F050h.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "decoder/mailbox/events.h"

namespace ecaudit::model {

class SlotModules {
 public:
  static constexpr std::uint16_t kConfigured = 0xF030;
  static constexpr std::uint16_t kDetected = 0xF050;

  struct List {
    struct Entry {
      std::uint32_t ident = 0;
      FrameNo since = 0;  ///< frame of the answer that transferred it
    };
    std::optional<std::uint8_t> count;
    FrameNo count_since = 0;
    std::map<std::uint8_t, Entry> entries;

    [[nodiscard]] std::optional<std::vector<std::uint32_t>> Idents() const;
  };

  [[nodiscard]] static bool IsList(std::uint16_t index) { return index == kConfigured || index == kDetected; }

  /// Takes a completed transfer of one of the lists; others change nothing.
  void Apply(const mailbox::SdoTransfer& transfer);
  /// The idents, the first slot first (0: empty); nothing until a list is whole.
  [[nodiscard]] std::optional<std::vector<std::uint32_t>> Idents() const;
  /// F030h, as far as it was transferred.
  [[nodiscard]] const List& configured() const { return configured_; }
  /// F050h, as far as it was transferred.
  [[nodiscard]] const List& detected() const { return detected_; }
  /// True once after the lists changed.
  [[nodiscard]] bool TakeChanged();

 private:
  List configured_, detected_;
  bool changed_ = false;
};

}  // namespace ecaudit::model
