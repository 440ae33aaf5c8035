/// Datagrams in words.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/stream/datagram_row.h"

namespace ecaudit::cli {

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

/// "outbound", "returned", "unknown"
[[nodiscard]] std::string_view DirectionName(bus::Direction direction);
/// Appends "FPRD"; a command that does not exist by its number.
void AppendCommand(std::string& out, const wire::DatagramView& datagram);
/// The command has the address of a slave and a register.
[[nodiscard]] bool HasEscAddress(const wire::DatagramView& datagram);
[[nodiscard]] bool IsUnsound(const wire::FrameView& frame);
/// What is wrong with a frame; empty when it is sound.
[[nodiscard]] std::string ProblemText(const wire::FrameView& frame);
/// Lines that `decode` writes as text for a frame when it shows all slaves.
[[nodiscard]] std::size_t LinesOf(const wire::FrameView& frame);

}  // namespace ecaudit::cli
