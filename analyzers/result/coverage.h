/// How far each rule could be evaluated: plain data for the writers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/base/names.h"

namespace ecaudit {

enum class Coverage : std::uint8_t {
  kJudged,
  kPartly,        ///< but not at every moment: a line in AnalysisResult::not_evaluable gives the reason
  kNotJudged,     ///< such a line gives the reason
  kNotApplicable  ///< there is nothing that the rule is about
};

/// Why a rule does not apply.
enum class NotApplicable : std::uint8_t {
  kApplies,
  kSwitchedOff,
  kNoExpectation,
  kNoOtherPackets,
  kEepromUnread,
  kNoRequest,
  kInInit,
  kMailboxUnused,
  kNoCoe,
  kNoEoe,
  kMappingUntouched,
  kNoProcessData,
  kNoCycle,
  kNoDrive,
  kNoFaultBits,
  kClockUnused,
  kNoLatch,
  kLatchUnused
};
inline constexpr Named<NotApplicable> kNotApplicableTexts[] = {
    {NotApplicable::kApplies, ""},
    {NotApplicable::kSwitchedOff, "switched off by --rule or the configuration file"},
    {NotApplicable::kNoExpectation, "no expectation of the start-up is given (startup --expect)"},
    {NotApplicable::kNoOtherPackets, "no packets of other protocols are in the capture"},
    {NotApplicable::kEepromUnread, "the EEPROM is not read"},
    {NotApplicable::kNoRequest, "no state is requested of the slave"},
    {NotApplicable::kInInit, "the slave stays in INIT, where it needs no sync manager"},
    {NotApplicable::kMailboxUnused, "the mailbox is not used"},
    {NotApplicable::kNoCoe, "the mailbox is not used for CoE"},
    {NotApplicable::kNoEoe, "the mailbox is not used for EoE"},
    {NotApplicable::kMappingUntouched, "no PDO assignment or mapping is written or read"},
    {NotApplicable::kNoProcessData, "no process data are exchanged with the slave"},
    {NotApplicable::kNoCycle, "no cycle time is set in the capture"},
    {NotApplicable::kNoDrive, "the slave is not used as a drive: no control or status word"},
    {NotApplicable::kNoFaultBits, "no object of the slave is known to show faults by its bits"},
    {NotApplicable::kClockUnused, "the distributed clock is not used"},
    {NotApplicable::kNoLatch, "the slave has no latches that are known"},
    {NotApplicable::kLatchUnused, "no latch word is exchanged"},
};
static_assert(NamesAll(kNotApplicableTexts, NotApplicable::kLatchUnused));
/// "its mailbox is not used"; empty for kApplies.
[[nodiscard]] constexpr std::string_view Describe(NotApplicable why) {
  return NameIn(kNotApplicableTexts, why);
}

/// One rule for one slave.
struct SlaveCoverage {
  SlaveId slave = kNoSlave;  ///< kNoSlave: the whole bus
  Coverage coverage = Coverage::kJudged;
  NotApplicable why = NotApplicable::kApplies;  ///< of kNotApplicable
};

/// One rule: an entry for each slave, in the order of the slaves, or one for the bus where the rule is about the bus,
/// or no slave is known.
struct RuleCoverage {
  std::string_view rule;     ///< id in the catalogue
  std::string_view chapter;  ///< the catalogue's heading; both live as long as the program
  std::vector<SlaveCoverage> slaves;
};

/// What another capture of the same machine should hold, so that more can be evaluated.
struct CaptureAdvice {
  std::string text;              ///< "read AL Status (0x0130) of slave 1", without a full stop
  std::uint64_t judgements = 0;  ///< rules that it may open, each once for a slave
};

}  // namespace ecaudit
