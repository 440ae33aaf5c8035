#include "analyzers/judge/wkc/missing_slaves.h"

#include <algorithm>
#include <optional>

#include "analyzers/judge/wkc/kinds.h"
#include "analyzers/judge/wkc/thresholds.h"
#include "decoder/esc/register_map.h"
#include "decoder/mailbox/header.h"

namespace ecaudit::wkc {
namespace {

/// A message to a mailbox. Process data of another master, which may stand there as well, do not look so.
bool IsMailboxMessage(const track::Answered& answer) {
  return answer.address >= esc::kProcessRam && mailbox::LooksLikeMessage(answer.sent_data, mailbox::Direction::kOut);
}

bool IsConfigured(wire::Command command) {
  return command == wire::Command::FPRD || command == wire::Command::FPWR || command == wire::Command::FPRW;
}

}  // namespace

bool EveryEscAnswers(EscAddress address, std::uint16_t length) {
  return length > 0 && (address < 0x000A || address == 0x0010 || address == 0x0110 || address == 0x0130);
}

void MissingSlaves::On(const track::Answered& answer) {
  if (answer.wkc != 0) {  // nearly always
    answered_ = true;
    if (IsConfigured(answer.command)) stations_.Remove(answer.adp);
    return;
  }
  const bool writes = answer.command == wire::Command::FPWR && assigned_ && answer.returned.seen();
  const bool other_register = answer.address > kLastOfEveryEsc && answer.address < esc::kProcessRam;
  if (writes && answer.slave == kNoSlave && (other_register || IsMailboxMessage(answer))) {
    stations_.Add(answer.adp, answer);
  }
  if (!wire::IncrementsAdp(answer.command) || wire::IsBroadcast(answer.command)) return;
  // A position after the last slave. The datagram itself counts the slaves that it passes.
  constexpr std::uint16_t kMostPositions = 0x8000;  // above: slaves before the tap have counted already
  const auto position = static_cast<std::uint16_t>(0x10000U - answer.adp);
  if (!answer.sent.seen() || !answer.slaves_passed || *answer.slaves_passed == 0) return;
  if (position >= *answer.slaves_passed && position < kMostPositions) beyond_end_.Add(position, answer);
}

/// Accesses to a station address that no slave has: of registers that every ESC has. If the master assigned others in
/// the capture, of any register up to the last of these, and writes to any register.
void MissingSlaves::OnOfEveryEsc(const track::Answered& answer) {
  if (!IsConfigured(answer.command) || answer.slave != kNoSlave || answer.wkc != 0) return;
  if (assigned_ || EveryEscAnswers(answer.address, answer.length)) stations_.Add(answer.adp, answer);
}

void MissingSlaves::OnAssigned() {
  assigned_ = true;
  stations_.Clear();
}

void MissingSlaves::OnCount(std::uint16_t slaves) {
  most_slaves_ = std::max(most_slaves_, slaves);
}

std::vector<MissingSlaves::Report> MissingSlaves::Reports() const {
  std::vector<Report> reports;
  for (const auto& [station, accesses] : stations_.all()) {
    AddStation(static_cast<StationAddress>(station), accesses, reports);
  }
  for (const auto& [position, accesses] : beyond_end_.all()) AddPosition(position, accesses, reports);
  return reports;
}

/// A master that has set its bus up accesses the slaves that it has found, or that it is configured for.
void MissingSlaves::AddStation(StationAddress station, const UnansweredAddresses::Accesses& accesses,
                               std::vector<Report>& reports) const {
  const std::optional<TimeNs> lasted = accesses.Lasted();
  if (!lasted || !answered_) return;
  const bool looks = *lasted < (assigned_ ? threshold::kLookingNs : threshold::kStationNs) ||
                     (assigned_ && accesses.count < threshold::kLookingAccesses);
  // A master that looks for slaves reads. It writes to those that it takes for present.
  const bool writes = assigned_ && accesses.writes > 0;
  if (looks && !writes) return;
  Finding finding = Found(kNoSlaveThere, kNoSlave, accesses.first);
  finding.last = accesses.last;
  if (!assigned_) finding.confidence = Confidence::kInferred;
  finding.Set("working_counter", arg::Number(0))
      .Set("expected", arg::Number(1))
      .Set("station_address", arg::Hex(station))
      .Set("register", arg::Hex(accesses.address))
      .Set("accesses", arg::Count(accesses.count, "time"))
      .Set("assigned", arg::Flag(assigned_));
  if (writes) {
    finding.Set("written_register", arg::Hex(accesses.written))
        .Set("mailbox", arg::Flag(accesses.written >= esc::kProcessRam));
  }
  const Severity severity = assigned_ && !looks ? Severity::kError : Severity::kWarning;
  reports.push_back({0x2000000000000000ULL | station, severity, finding});
}

void MissingSlaves::AddPosition(std::uint32_t position, const UnansweredAddresses::Accesses& accesses,
                                std::vector<Report>& reports) const {
  const std::optional<TimeNs> lasted = accesses.Lasted();
  if (position < most_slaves_ || accesses.count < threshold::kLookingAccesses) return;
  if (!lasted || *lasted < threshold::kLookingNs) return;
  if (*lasted / static_cast<TimeNs>(accesses.count - 1) >= threshold::kNewSlavesNs) return;
  Finding finding = Found(kNoSlaveAtPosition, kNoSlave, accesses.first);
  finding.last = accesses.last;
  finding.Set("working_counter", arg::Number(0))
      .Set("position", arg::Number(position))
      .Set("register", arg::Hex(accesses.address))
      .Set("accesses", arg::Count(accesses.count, "time"))
      .Set("slaves", arg::Count(most_slaves_, "slave"))
      .Set("last_position", arg::Number(most_slaves_ - 1));
  reports.push_back({0x1000000000000000ULL | position, Severity::kWarning, finding});
}

}  // namespace ecaudit::wkc
