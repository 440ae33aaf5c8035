/// in: answers to datagrams for one slave.  out: addresses of the master at which no slave is.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/judge/unanswered_addresses.h"
#include "analyzers/result/finding.h"
#include "decoder/base/ids.h"
#include "decoder/track/events.h"

namespace ecaudit::wkc {

/// The last register that EveryEscAnswers() is about: AL Status.
inline constexpr EscAddress kLastOfEveryEsc = 0x0130;
/// Registers that no ESC lacks and that can always be read: type to features, station address, DL and AL status.
[[nodiscard]] bool EveryEscAnswers(EscAddress address, std::uint16_t length);

class MissingSlaves {
 public:
  struct Report {
    std::uint64_t key = 0;
    Severity severity = Severity::kWarning;
    Finding finding;
  };

  /// Of all registers.
  void On(const track::Answered& answer);
  /// ... and of those that EveryEscAnswers() may be about.
  void OnOfEveryEsc(const track::Answered& answer);
  void OnAssigned();
  void OnCount(std::uint16_t slaves);
  /// At the end of the capture.
  [[nodiscard]] std::vector<Report> Reports() const;

 private:
  void AddStation(StationAddress station, const UnansweredAddresses::Accesses& accesses,
                  std::vector<Report>& reports) const;
  void AddPosition(std::uint32_t position, const UnansweredAddresses::Accesses& accesses,
                   std::vector<Report>& reports) const;

  UnansweredAddresses stations_, beyond_end_;
  std::uint16_t most_slaves_ = 0;  ///< at any time
  bool answered_ = false;          ///< some slave answered
  bool assigned_ = false;          ///< station addresses were assigned in the capture
};

}  // namespace ecaudit::wkc
