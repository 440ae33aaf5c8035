#include <cstdint>
#include <map>
#include <utility>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "decoder/esc/al.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"
#include "decoder/track/events.h"

namespace ecaudit::pdo_not_kept {
namespace {

constexpr FindingKind kNotKept{
    .name = "not-kept",
    .title = "{object:number} reads back as {read:number} instead of {written:number}",
    .message = R"(The master writes {written} to {object} in {write_frame}, and the slave confirms it. In {frame} the
slave gives {read}. The master did not write it again in between. So the slave did not keep the value that it
confirmed.)",
    .next = R"(Check whether PDO assignment and mapping of this slave are fixed (its ESI, its manual), or need another
object first. Then configure the process data that the slave gives.)",
    .identity = "index"};
constexpr const FindingKind* kKinds[] = {&kNotKept};

// Several rules may explain one refusal: the later one names the nearer cause.
constexpr std::string_view kAfter[] = {"pdo-assign-order"};

constexpr RuleInfo kInfo{.id = "pdo-not-kept",
                         .group = "PDO mapping",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .subject = Subject::kMappingWrites,
                         .title = "The slave confirms a PDO assignment or mapping, but does not keep it",
                         .needs = "a download that the slave confirmed, and a later upload of the same entry",
                         .source = "ETG1000.6, PDO assignment and PDO mapping",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Uploads of 1C12h, 1C13h and the mapping objects 1600h-17FFh and 1A00h-1BFFh against the values that the master wrote
before.

## Why it matters
No abort and no AL status code shows it. The process data stay as they were: the master writes and reads them at other
places than it means, or with other lengths.

## How it is decided
The slave confirmed the download. A later upload of the same subindex gives another value.

- A write of 0 to subindex 0 clears the list: older entries do not count.
- A request of INIT, another start-up and a capture gap end the comparison: a slave may set its defaults again.
- Each object has one finding.
- The finding explains a later refusal of SAFEOP.

## Example
tests/rules/pdo-not-kept/violates.trace

## What to do
Use the assignment and mapping that the slave gives. Some slaves have fixed PDOs and confirm writes nevertheless.
)"};

class PdoNotKept final : public Rule {
 public:
  PdoNotKept() : Rule(kInfo) {
    Subscribe<mailbox::SdoTransfer>(&PdoNotKept::On);
    Subscribe<model::AlRequestJudged>(&PdoNotKept::On);
    Subscribe<track::RunBegan>(&PdoNotKept::On);
    Subscribe<track::CaptureGap>(&PdoNotKept::On);
  }

  void On(const mailbox::SdoTransfer& t) {
    const bool whole = t.has_object && t.outcome == mailbox::SdoOutcome::kCompleted && !t.data_gap && !t.data.empty() &&
                       t.certainty == Certainty::kObserved;
    if (!whole || !process::IsPdoObject(t.index)) return;
    if (t.service == mailbox::SdoService::kDownload) {
      Keep(t);
    } else if (t.service == mailbox::SdoService::kUpload) {
      Compare(t);
    }
  }
  void On(const model::AlRequestJudged& e) {
    const std::uint8_t state = e.request.control.state();
    if (state == static_cast<std::uint8_t>(esc::AlState::INIT)) Forget(e.slave);
    if (state != static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return;
    for (const auto& [at, list] : lists_) {
      if (at.first == e.slave && list.finding != kNoFinding) {
        context().ExplainRequest(e.slave, e.request.frame.number, list.finding);
      }
    }
  }
  void On(const track::RunBegan&) { lists_.clear(); }
  void On(const track::CaptureGap&) { lists_.clear(); }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  static constexpr std::size_t kMostLists = 1000;

  struct Entry {
    std::uint32_t value = 0;
    FrameNo written = 0;
  };
  struct List {
    std::map<std::uint8_t, Entry> entries;  ///< by subindex
    FindingIndex finding = kNoFinding;      ///< an entry that the slave did not keep
  };

  void Keep(const mailbox::SdoTransfer& t) {
    const auto at = std::pair{t.slave, t.index};
    if (!lists_.contains(at) && lists_.size() >= kMostLists) return;
    List& list = lists_[at];
    for (const process::PdoValue& value : process::PdoValuesOf(t)) {
      if (value.subindex == 0 && (value.value == 0 || t.complete_access)) list = {};
      list.entries[value.subindex] = {value.value, t.last.number};
    }
  }

  void Compare(const mailbox::SdoTransfer& t) {
    const auto found = lists_.find({t.slave, t.index});
    if (found == lists_.end()) return;
    for (const process::PdoValue& value : process::PdoValuesOf(t)) {
      const auto entry = found->second.entries.find(value.subindex);
      if (entry == found->second.entries.end() || entry->second.value == value.value) continue;
      found->second.finding = ReportEntry(t, value, entry->second);
    }
  }

  FindingIndex ReportEntry(const mailbox::SdoTransfer& t, const process::PdoValue& read, const Entry& written) {
    if (const FindingIndex repeated = Repeat(t.slave, t.index, t.last); repeated != kNoFinding) return repeated;
    Finding finding = Found(kNotKept, t.slave, t.last);
    finding.Set("object", arg::Object(t.index, read.subindex))
        .Set("index", arg::Hex(t.index))
        .Set("read", ValueOf(t.index, read.subindex, read.value))
        .Set("written", ValueOf(t.index, read.subindex, written.value))
        .Set("write_frame", arg::Frame(written.written));
    AddRelated(finding, written.written);
    return Report(t.index, std::move(finding));
  }

  static Value ValueOf(std::uint16_t list, std::uint8_t subindex, std::uint32_t value) {
    if (subindex == 0) return arg::Number(value);
    if (process::IsAssignment(list)) return arg::Object(static_cast<std::uint16_t>(value & 0xFFFFU));
    return arg::Hex(value, 8);
  }

  void Forget(SlaveId slave) {
    std::erase_if(lists_, [slave](const auto& list) { return list.first.first == slave; });
  }

  std::map<std::pair<SlaveId, std::uint16_t>, List> lists_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoNotKept>};

}  // namespace
}  // namespace ecaudit::pdo_not_kept
