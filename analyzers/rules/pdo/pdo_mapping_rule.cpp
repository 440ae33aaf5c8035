#include <algorithm>

#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_mapping_rule {
namespace {

constexpr RuleInfo kInfo{
    .id = "pdo-mapping-rule",
    .group = "PDO mapping",
    .severity = Severity::kError,
    .of_family = true,
    .title = "Free mapping breaks a rule of the manual: odd length, too many bytes, entries or PDOs",
    .needs = "the rules of free mapping in the family's manual, and the assignment and mapping in force",
    .source = "MKD, 4.6; MKD, 5.3",
    .doc = R"(
## What it checks
For families whose manual describes free mapping (MKD): at each download, that a PDO gets no more bytes (8) and entries
(8), and a direction no more PDOs (4), than the manual allows; when SAFEOP is requested, that the total length of each
direction is even and not above the limit (Tx 32 bytes, Rx 20 or 32).

## Why it matters
The drive aborts the download or refuses SAFEOP.

## How it is decided
From SDO transfers in the capture, or an ENI file. A default mapping that the master keeps counts like one it writes.
20 bytes Rx is what the manual prints for all firmware; up to 32, which newer firmware takes, is a warning. Where the
drive goes to SAFEOP with the mapping, the finding becomes an info.

For a family without such rules (AKD) those of a drive of the same maker serve as a hint, and only when SAFEOP was
refused with 0x0017, 0x001D, 0x001E, 0x0024 or 0x0025 and nothing else explains it: then a mapping of odd length in the
PDOs for free mapping is a warning, marked inferred, and the refusal names it as its cause.

## Example
samples/captures/pdo-odd-mapping.pcapng

## What to do
Fill the mapping up with the padding object of the manual (Rx 0002h:0, Tx 2002h), or leave objects out; unused PDOs stay
unassigned.
)"};

class PdoMappingRule final : public PdoRule {
 public:
  using PdoRule::On;
  PdoMappingRule() : PdoRule(kInfo, WhenAccepted::kBecomesInfo) { Subscribe<model::AlErrorCode>(&PdoMappingRule::On); }

  void On(const model::AlAnswered& e) override {
    PdoRule::On(e);
    if (const auto ripe = suspicions_.On(context(), e)) Suspect(e.slave, *ripe);
  }
  void On(const model::AlErrorCode& e) {
    if (const auto ripe = suspicions_.On(context(), e)) Suspect(e.slave, *ripe);
  }
  void Finish() override {
    PdoRule::Finish();
    suspicions_.Finish(context());
  }

 private:
  using Free = device::FlexibleMapping;

  static const std::vector<std::uint16_t>& PdosOf(const Free& free, device::PdoDirection direction) {
    return direction == device::PdoDirection::kRx ? free.rx_pdos : free.tx_pdos;
  }
  static bool AllFree(const Free& free, device::PdoDirection direction, const std::vector<std::uint16_t>& pdos) {
    const auto& all = PdosOf(free, direction);
    return !pdos.empty() && std::all_of(pdos.begin(), pdos.end(), [&](std::uint16_t pdo) {
      return std::find(all.begin(), all.end(), pdo) != all.end();
    });
  }

  // --- what a download breaks at once

  void OnDownload(const mailbox::SdoTransfer& e, const std::vector<Write>& writes) override {
    const auto& free = context().slave(e.slave).profile->pdo.flexible;
    if (!free || AbortedAsReadOnly(e)) return;
    if (process::IsAssignment(e.index)) {
      if (!free->max_pdos) return;
      for (const Write& write : writes) {
        const std::uint32_t pdos = write.subindex == 0 ? write.value : write.subindex;
        if (pdos > *free->max_pdos && (write.subindex == 0 || write.value != 0)) {
          TellLimit(e, write, Count(pdos, "PDO") + " assigned in " + ObjectName(e.index), "pdos", pdos, *free->max_pdos,
                    free->max_pdos.source);
          return;
        }
      }
      return;
    }
    const auto& own = PdosOf(*free, DirectionOf(e.index));
    if (std::find(own.begin(), own.end(), e.index) == own.end()) return;
    std::uint32_t bits = 0;
    if (writes.front().subindex > 1) bits = BitsBefore(e, writes.front().subindex);
    for (const Write& write : writes) {
      const std::uint32_t entries = write.subindex == 0 ? write.value : write.subindex;
      if (free->max_entries_per_pdo && entries > *free->max_entries_per_pdo &&
          (write.subindex == 0 || write.value != 0)) {
        TellLimit(e, write, std::to_string(entries) + " entries in " + ObjectName(e.index), "entries", entries,
                  *free->max_entries_per_pdo, free->max_entries_per_pdo.source);
        return;
      }
      if (write.subindex == 0) continue;
      bits += process::MappingEntry::FromValue(write.value).bits;
      const std::uint32_t bytes = (bits + 7) / 8;
      if (free->max_bytes_per_pdo && bytes > *free->max_bytes_per_pdo) {
        TellLimit(e, write, Count(bytes, "byte") + " mapped into " + ObjectName(e.index), "bytes", bytes,
                  *free->max_bytes_per_pdo, free->max_bytes_per_pdo.source);
        return;
      }
    }
  }

  /// Bits of the entries in front of `subindex` as they stand; 0 where one is unknown.
  [[nodiscard]] std::uint32_t BitsBefore(const mailbox::SdoTransfer& e, std::uint8_t subindex) const {
    const process::PdoObject* object = context().slave(e.slave).process.seen().Find(e.index);
    std::uint32_t bits = 0;
    for (unsigned n = 1; n < subindex; ++n) {
      if (object == nullptr) return 0;
      const auto value = object->values.find(static_cast<std::uint8_t>(n));
      if (value == object->values.end()) return 0;
      bits += process::MappingEntry::FromValue(value->second).bits;
    }
    return bits;
  }

  void TellLimit(const mailbox::SdoTransfer& e, const Write& write, const std::string& what, const char* name,
                 std::uint32_t value, std::uint32_t limit, const std::string& source) {
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    Finding finding;
    finding.title = what + ", at most " + std::to_string(limit) + " are allowed";
    finding.message = "With the download of " + Hex(write.value) + " to " + ObjectName(e.index, write.subindex) +
                      " in frame " + std::to_string(FrameOf(e).number) + " there are " + what + "; " + family.title +
                      " allows " + std::to_string(limit) + "." + OutcomeText(e) +
                      (std::string_view(name) == "pdos" ? " Map the objects into fewer PDOs, or leave some out."
                                                        : " Spread the objects over several PDOs, or leave some out.");
    finding.evidence.push_back(Number(name, value));
    finding.evidence.push_back(Number(std::string("most_") + name, limit));
    finding.reference = ReferenceTo(source);
    Tell(e, e.index, std::uint64_t{e.index} << 16U | std::uint64_t{value} << 8U | static_cast<std::uint8_t>(name[0]),
         std::move(finding));
  }

  // --- what the whole breaks

  void OnSafeopRequest(const model::AlRequestJudged& e) override {
    std::vector<MappingSuspicions::Suspect> suspects;
    for (const auto direction : {device::PdoDirection::kRx, device::PdoDirection::kTx}) {
      const model::ProcessLayout& layout = context().slave(e.slave).process.Layout(direction);
      const bool given = layout.source == model::LayoutSource::kObserved || layout.source == model::LayoutSource::kEni;
      const device::DeviceDescription& family = *context().slave(e.slave).profile;
      if (!given || !layout.known() || layout.bits == 0) {
        if (family.pdo.flexible && !(given && layout.known())) {
          NotEvaluable(e.slave, "what PDOs are assigned and mapped is not known", e.request.frame.number);
        }
        continue;
      }
      if (family.pdo.flexible) {
        if (AllFree(*family.pdo.flexible, direction, layout.pdos)) Judge(e, direction, layout, *family.pdo.flexible);
        continue;
      }
      if (layout.bytes() % 2 == 0) continue;
      for (const device::DeviceDescription* relative : events::Relatives(family)) {
        const auto& free = relative->pdo.flexible;
        if (!free || !free->even_length || !*free->even_length || !AllFree(*free, direction, layout.pdos)) continue;
        suspects.push_back({direction,
                            "the " + std::string(DirectionName(direction)) + " mapping is " +
                                Count(layout.bytes(), "byte") + " long, an odd number, which the manual of " +
                                relative->title + " forbids for free mapping",
                            false});
        relative_source_ = free->even_length.source;
        break;
      }
    }
    suspicions_.Add(e.slave, e.request.frame, std::move(suspects));
  }

  void Judge(const model::AlRequestJudged& e, device::PdoDirection direction, const model::ProcessLayout& layout,
             const Free& free) {
    const std::uint32_t bytes = layout.bytes();
    const std::string name(DirectionName(direction));
    if (free.even_length && *free.even_length && bytes % 2 != 0) {
      TellWhole(e, direction, layout, Severity::kError, name + " mapping has an odd length of " + Count(bytes, "byte"),
                "an even number of bytes", free.even_length.source, 1);
    }
    const auto& limits = direction == device::PdoDirection::kRx ? free.max_rx_bytes : free.max_tx_bytes;
    if (limits.empty() || bytes <= limits.front().bytes) return;
    const bool beyond_all = bytes > limits.back().bytes;
    const device::ByteLimit& limit = beyond_all ? limits.back() : limits.front();
    std::string law = "at most " + Count(limit.bytes, "byte");
    if (!limit.condition.empty()) law += " (" + limit.condition + ")";
    if (!beyond_all) {
      law += "; " + std::to_string(limits.back().bytes) + " with " +
             (limits.back().condition.empty() ? "newer firmware" : limits.back().condition);
    }
    TellWhole(e, direction, layout, beyond_all ? Severity::kError : Severity::kWarning,
              name + " mapping of " + Count(bytes, "byte") + " is longer than " + std::to_string(limit.bytes), law,
              limit.source, 2);
  }

  void TellWhole(const model::AlRequestJudged& e, device::PdoDirection direction, const model::ProcessLayout& layout,
                 Severity severity, std::string title, const std::string& law, const std::string& source,
                 std::uint64_t kind) {
    const std::uint64_t key = kind << 60U | std::uint64_t{direction == device::PdoDirection::kRx} << 50U | layout.bits;
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      const bool written = WrittenByMaster(e.slave, direction, layout.pdos);
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.request.frame;
      finding.title = std::move(title);
      finding.message = "When the master requests SAFEOP in frame " + std::to_string(e.request.frame.number) + ", " +
                        PdoList(layout) + " fill " + Count(layout.bytes(), "byte") + "; " +
                        context().slave(e.slave).profile->title + " asks for " + law + ". " +
                        (written ? "" : "It is the drive's own default, which the master keeps. ") +
                        "Fill it up with the padding objects of the manual, or leave objects out.";
      AddNumbers(finding, direction, layout);
      if (layout.assumed || e.request.assumed || !written) finding.confidence = Confidence::kInferred;
      finding.reference = ReferenceTo(source);
      index = Report(key, severity, std::move(finding));
    }
    Predict(e, direction, index);
  }

  static std::string PdoList(const model::ProcessLayout& layout) {
    std::string pdos;
    for (const std::uint16_t pdo : layout.pdos) pdos += (pdos.empty() ? "" : ", ") + ObjectName(pdo);
    return pdos;
  }
  static void AddNumbers(Finding& finding, device::PdoDirection direction, const model::ProcessLayout& layout) {
    finding.evidence.push_back(Text("direction", std::string(DirectionName(direction))));
    finding.evidence.push_back(Number("bytes", layout.bytes()));
    finding.evidence.push_back(Text("pdos", PdoList(layout)));
    AddRelated(finding, layout.since);
  }

  // --- what may be why a drive without documented rules refused

  void Suspect(SlaveId slave, const MappingSuspicions::Suspicion& suspicion) {
    const device::DeviceDescription& family = *context().slave(slave).profile;
    for (const MappingSuspicions::Suspect& suspect : suspicion.suspects) {
      const model::ProcessLayout& layout = context().slave(slave).process.Layout(suspect.direction);
      const std::uint64_t key =
          3ULL << 60U | std::uint64_t{suspect.direction == device::PdoDirection::kRx} << 50U | layout.bits;
      FindingIndex index = Repeat(slave, key, suspicion.shown);
      if (index == kNoFinding) {
        const std::string name(DirectionName(suspect.direction));
        Finding finding;
        finding.slave = slave;
        finding.first = suspicion.shown;
        AddRelated(finding, suspicion.request.number);
        finding.confidence = Confidence::kInferred;
        finding.title = name + " mapping has an odd length of " + Count(layout.bytes(), "byte") +
                        (suspect.by_code ? ", which may be why SAFEOP is refused" : "");
        finding.message = "SAFEOP, requested in frame " + std::to_string(suspicion.request.number) +
                          ", is refused with AL status code " + CodeText(suspicion.code, family) + " (frame " +
                          std::to_string(suspicion.shown.number) + "). " + PdoList(layout) + ": " + suspect.text +
                          ". " +
                          (WrittenByMaster(slave, suspect.direction, layout.pdos)
                               ? ""
                               : "It is the drive's own default, which the master keeps. ") +
                          "That this is the reason is an inference: the manual of " + family.title +
                          " describes no free mapping. Assign PDOs of even total length: one of the fixed PDOs, or map "
                          "the objects anew, each once, and fill up.";
        AddNumbers(finding, suspect.direction, layout);
        finding.evidence.push_back(HexNumber("al_status_code", suspicion.code));
        finding.reference = ReferenceTo(relative_source_);
        index = Report(key, suspect.by_code ? Severity::kWarning : Severity::kInfo, std::move(finding));
      }
      if (suspect.by_code) suspicions_.Blame(context(), suspicion, index);
    }
  }

  MappingSuspicions suspicions_;
  std::string relative_source_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoMappingRule>};

}  // namespace
}  // namespace ecaudit::pdo_mapping_rule
