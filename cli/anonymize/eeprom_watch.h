/// The EEPROM as the capture reads it: which words an access to 0x0508 carries, and which bytes of them name something.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "cli/anonymize/text_runs.h"
#include "decoder/esc/sii.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::cli::anonymize {

class EepromWatch {
 public:
  /// Every datagram with an ESC address, in file order.
  void Subscribe(const wire::DatagramView& datagram);
  /// The slave that a datagram addresses, as one number for both copies of it and for position and station address.
  [[nodiscard]] std::uint32_t SlaveOf(const wire::DatagramView& datagram) const;
  /// The word that the first byte of 0x0508 belongs to; nothing where the capture does not show which was asked for.
  [[nodiscard]] std::optional<std::uint32_t> WordAsked(std::uint32_t slave) const;

  /// Keeps what a read of 0x0508 returned; in the first pass.
  void Learn(const wire::DatagramView& datagram);
  /// Decides which bytes of each EEPROM are to go, after the first pass; addresses start again.
  void EndLearning(Secrets& secrets);
  /// @param byte  of the EEPROM
  /// @return nothing where it is unknown what it is
  [[nodiscard]] std::optional<bool> IsSecret(std::uint32_t slave, std::uint32_t byte) const;

 private:
  struct Asked {
    std::uint32_t word = 0;
    std::uint64_t when = 0;
  };
  struct Image {
    esc::SiiImage words;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> secret;  ///< bytes, [begin, end)
    std::uint32_t known_until = 0;                                ///< byte after the chain of categories
  };
  static constexpr std::uint32_t kByPosition = 0x10000;

  std::uint64_t now_ = 0;
  std::map<std::uint32_t, Asked> asked_;
  std::optional<Asked> asked_all_;
  std::map<std::uint32_t, bool> eight_bytes_;
  std::uint16_t slaves_ = 0;                         ///< as broadcasts count them
  std::map<std::uint32_t, std::uint32_t> stations_;  ///< by position
  std::map<std::uint32_t, Image> images_;
};

}  // namespace ecaudit::cli::anonymize
