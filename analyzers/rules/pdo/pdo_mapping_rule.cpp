#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_mapping_rule {
namespace {

constexpr FindingKind kTooManyPdos{
    .name = "too-many-pdos",
    .title = "{pdos} PDOs assigned in {object:number}, at most {most_pdos} allowed",
    .message = R"(The master downloads {value} to {written} in {frame}. Then {object} has {pdos} PDOs. {manual} allows
{most_pdos}. {outcome}[ with {abort_code}].)",
    .next = "Map the objects into fewer PDOs, or leave some out.",
    .identity = "object"};

constexpr FindingKind kTooManyEntries{
    .name = "too-many-entries",
    .title = "{entries} entries in {object:number}, at most {most_entries} allowed",
    .message = R"(The master downloads {value} to {written} in {frame}. Then {object} has {entries} entries. {manual}
allows {most_entries}. {outcome}[ with {abort_code}].)",
    .next = "Spread the objects over several PDOs, or leave some out.",
    .identity = "object"};

constexpr FindingKind kTooManyBytes{
    .name = "too-many-bytes",
    .title = "{bytes} bytes mapped into {object:number}, at most {most_bytes} allowed",
    .message = R"(The master downloads {value} to {written} in {frame}. Then {object} has {bytes} bytes. {manual} allows
{most_bytes}. {outcome}[ with {abort_code}].)",
    .next = "Spread the objects over several PDOs, or leave some out.",
    .identity = "object"};

constexpr FindingKind kOddLength{
    .name = "odd-length",
    .title = "{direction} mapping has an odd length of {bytes}",
    .message = R"(The master requests SAFEOP in {frame}. At this time {pdos} {pdos?has|have} {bytes}. {manual} requires
an even number of bytes.[{?own_default} The master keeps this default mapping of the drive.])",
    .next =
        "[{?room}Fill the mapping up with [{padding}][{!padding}a padding object], or leave objects out.][{!room}Leave "
        "objects out: filled up, the mapping is longer than {limit:number}.]",
    .identity = "direction"};

constexpr FindingKind kOddPdo{
    .name = "odd-pdo",
    .title = "{pdo:number} has an odd length of {pdo_bytes}",
    .message = R"(The master requests SAFEOP in {frame}. At this time {pdo} of the {direction} mapping has {pdo_bytes}.
{manual} requires an even number of bytes in each PDO.[{?own_default} The master keeps this default mapping of the
drive.])",
    .next =
        "[{?room}Fill {pdo:number} up with [{padding}][{!padding}a padding object], or leave an object out.]"
        "[{!room}Leave an object out of {pdo:number}: filled up, the mapping is longer than {limit:number}.]",
    .identity = "direction pdo"};

constexpr FindingKind kNotCleared{
    .name = "unused-not-cleared",
    .title = "{pdos} not cleared: {manual_short} wants unused PDOs cleared",
    .message = R"(The master assigns {assigned} for free mapping before it requests SAFEOP in {request_frame}. It does
not clear {pdos}, which it does not assign. By {manual} unused PDOs must be cleared with writing 0 to the subindex 0.[
The slave refuses SAFEOP with AL status code {al_status_code} ({frame}).])",
    .next = "Write 0 to subindex 0 of {pdos} in the start-up list.",
    .identity = "direction"};

constexpr FindingKind kFixedKept{
    .name = "fixed-pdo-kept",
    .title = "{fixed:number} stays assigned beside {assigned}",
    .message = R"(The master requests SAFEOP in {frame} with {fixed} and {assigned} assigned in {object}. By {manual}
the fixed mapping {fixed:number} has to be switched off for the flexible mapping: then up to {most_pdos} free PDOs can
be used instead.)",
    .next = "Leave {fixed:number} out of {object:number}, or assign it alone.",
    .identity = "direction fixed"};

constexpr FindingKind kTooLong{
    .name = "too-long",
    .title = "{direction} mapping of {bytes} is longer than {limit:number}",
    .message = R"(The master requests SAFEOP in {frame}. At this time {pdos} {pdos?has|have} {bytes}. {manual} allows at
most {limit}[ ({limit_condition})].[ It allows {higher_limit} with {higher_condition}.][{!higher_condition} It allows
{higher_limit} with newer firmware.][{?own_default} The master keeps this default mapping of the drive.])",
    .next = "Map fewer objects.",
    .identity = "direction"};

constexpr FindingKind kOddLengthSuspected{
    .name = "odd-length-suspected",
    .title = "{direction} mapping has an odd length of {bytes}[{?by_code}: may be why SAFEOP is refused]",
    .message =
        R"(The master requests SAFEOP in {request_frame}. The slave refuses it with AL status code {al_status_code}
({frame}). {pdos} {pdos?has|have} {bytes}. {relative} forbids an odd length for free mapping. {manual} describes no free
mapping[{?by_code}, so this reason is an inference].[{?own_default} The master keeps this default mapping of the drive.])",
    .next =
        "Assign PDOs of even total length: one of the fixed PDOs, or map the objects again, each once, and fill up.",
    .identity = "direction al_status_code"};

constexpr const FindingKind* kKinds[] = {&kTooManyPdos, &kTooManyEntries, &kTooManyBytes, &kOddLength,         &kOddPdo,
                                         &kTooLong,     &kNotCleared,     &kFixedKept,    &kOddLengthSuspected};

// ExplainRequest(): the later rule names the nearer cause. It also adds its suspicion to a refusal.
constexpr std::string_view kAfter[] = {"pdo-assign-state", "al-refused"};

constexpr RuleInfo kInfo{
    .id = "pdo-mapping-rule",
    .group = "PDO mapping",
    .severity = Severity::kError,
    .of_family = true,
    .title = "Free mapping breaks a rule of the manual: odd length or too long",
    .needs = "the rules of free mapping in the family's manual, and the assignment and mapping in force",
    .source = "MKD, 4.6; MKD, 4.6.1; MKD, 5.3",
    .kinds = kKinds,
    .after = kAfter,
    .doc = R"(
## What it checks
Families whose manual describes free mapping (MKD):

- At each download: a PDO has at most as many bytes (8) and entries (8), and a direction at most as many PDOs (4), as
  the manual allows.
- When SAFEOP is requested: the length of each PDO and of each direction is even, and the latter not above the limit
  (Tx 32 bytes, Rx 20 or 32).
- At that time no fixed PDO (1701h) is assigned beside PDOs for free mapping, and the unused ones of these are cleared:
  the master or the drive showed 0 in subindex 0. Unused ones that still hold a mapping which was seen are an info.

## Why it matters
The drive aborts the download or refuses SAFEOP.

## How it is decided
From SDO transfers in the capture, or an ENI file.

- A default mapping that the master keeps counts like one that it writes.
- The manual prints 20 bytes Rx for all firmware. Newer firmware accepts up to 32, so this is a warning.
- If the drive goes to SAFEOP with the mapping, the finding becomes an info.

A family without such rules (AKD): the rules of a drive of the same maker serve as a hint. This needs a SAFEOP that was
refused with 0x0017, 0x001D, 0x001E, 0x0024 or 0x0025 and no other cause. Then a mapping of odd length in the PDOs for
free mapping is a warning, marked inferred, and the refusal names it as its cause.

## Example
samples/captures/pdo-odd-mapping.pcapng

## What to do
Fill the mapping up with the padding object of the manual (Rx 0002h:0, Tx 2002h), or leave objects out. Leave unused
PDOs unassigned.
)"};

class PdoMappingRule final : public PdoRule {
 public:
  using PdoRule::On;
  PdoMappingRule() : PdoRule(kInfo, WhenAccepted::kBecomesInfo) { Subscribe<model::AlErrorCode>(&PdoMappingRule::On); }

  void On(const model::AlAnswered& e) override {
    PdoRule::On(e);
    if (const auto confirmed = suspicions_.On(context(), e)) Suspect(e.slave, *confirmed);
  }
  void On(const model::AlErrorCode& e) {
    if (const auto confirmed = suspicions_.On(context(), e)) Suspect(e.slave, *confirmed);
  }

 private:
  using Free = device::FlexibleMapping;

  static const std::vector<std::uint16_t>& PdosOf(const Free& free, device::PdoDirection direction) {
    return direction == device::PdoDirection::kRx ? free.rx_pdos : free.tx_pdos;
  }
  static bool AllFree(const Free& free, device::PdoDirection direction, const std::vector<std::uint16_t>& pdos) {
    const auto& all = PdosOf(free, direction);
    return !pdos.empty() &&
           std::ranges::all_of(pdos, [&](std::uint16_t pdo) { return std::ranges::find(all, pdo) != all.end(); });
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
          ReportLimit(e, write, {kTooManyPdos, "pdos", "most_pdos", pdos, *free->max_pdos, free->max_pdos.source});
          return;
        }
      }
      return;
    }
    const auto& own = PdosOf(*free, DirectionOf(e.index));
    if (std::ranges::find(own, e.index) == own.end()) return;
    std::uint32_t bits = 0;
    if (writes.front().subindex > 1) bits = BitsBefore(e, writes.front().subindex);
    for (const Write& write : writes) {
      const std::uint32_t entries = write.subindex == 0 ? write.value : write.subindex;
      if (free->max_entries_per_pdo && entries > *free->max_entries_per_pdo &&
          (write.subindex == 0 || write.value != 0)) {
        ReportLimit(e, write,
                    {kTooManyEntries, "entries", "most_entries", entries, *free->max_entries_per_pdo,
                     free->max_entries_per_pdo.source});
        return;
      }
      if (write.subindex == 0) continue;
      bits += process::MappingEntry::FromValue(write.value).bits;
      const std::uint32_t bytes = (bits + 7) / 8;
      if (free->max_bytes_per_pdo && bytes > *free->max_bytes_per_pdo) {
        ReportLimit(
            e, write,
            {kTooManyBytes, "bytes", "most_bytes", bytes, *free->max_bytes_per_pdo, free->max_bytes_per_pdo.source});
        return;
      }
    }
  }

  /// Bits of the present entries before `subindex`; 0 if one is unknown.
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

  /// A limit that a download exceeds.
  struct Exceeded {
    const FindingKind& kind;
    std::string_view name, limit_name;  ///< of the arguments
    std::uint32_t value = 0, limit = 0;
    const std::string& source;
  };

  void ReportLimit(const mailbox::SdoTransfer& e, const Write& write, const Exceeded& exceeded) {
    Finding finding = Found(exceeded.kind, e.slave, FrameOf(e));
    finding.Set(exceeded.name, arg::Number(exceeded.value))
        .Set(exceeded.limit_name, arg::Number(exceeded.limit))
        .Set("object", arg::Object(e.index))
        .Set("written", arg::Object(e.index, write.subindex))
        .Set("value", arg::Hex(write.value))
        .Set("manual", ManualOf(e.slave));
    finding.reference = ReferenceTo(exceeded.source);
    const std::uint64_t key = std::uint64_t{e.index} << 16U | std::uint64_t{exceeded.value} << 8U |
                              static_cast<std::uint8_t>(exceeded.name.front());
    ReportDownload(e, e.index, key, std::move(finding));
  }

  [[nodiscard]] Value ManualOf(SlaveId slave) const { return arg::Text(context().slave(slave).profile->title); }

  // --- what the whole breaks

  void OnSafeopRequest(const model::AlRequestJudged& e) override {
    std::vector<MappingSuspicions::Suspect> suspects;
    for (const auto direction : {device::PdoDirection::kRx, device::PdoDirection::kTx}) {
      const model::ProcessLayout& layout = context().slave(e.slave).process.Layout(direction);
      const bool given = layout.source == model::LayoutSource::kObserved || layout.source == model::LayoutSource::kEni;
      const device::DeviceDescription& family = *context().slave(e.slave).profile;
      if (!given || !layout.known() || layout.bits == 0) {
        if (family.pdo.flexible && !(given && layout.known())) {
          NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kMapping, e.request.frame.number);
        }
        continue;
      }
      if (family.pdo.flexible) {
        if (AllFree(*family.pdo.flexible, direction, layout.pdos)) {
          Evaluate(e, direction, layout, *family.pdo.flexible);
          CheckUnused(e, direction, layout, *family.pdo.flexible, suspects);
        } else {
          CheckMixed(e, direction, layout, *family.pdo.flexible);
        }
        continue;
      }
      if (layout.bytes() % 2 == 0) continue;
      for (const device::DeviceDescription* relative : events::Relatives(family)) {
        const auto& free = relative->pdo.flexible;
        if (!free || !free->even_length || !*free->even_length || !AllFree(*free, direction, layout.pdos)) continue;
        suspects.push_back({direction,
                            &kOddMappingMayExplain,
                            {{"direction", PdoDirectionValue(direction)},
                             {"bytes", arg::Count(layout.bytes(), "byte")},
                             {"manual", arg::Text(relative->title)}},
                            false});
        relative_ = relative->title;
        relative_source_ = free->even_length.source;
        break;
      }
    }
    suspicions_.Add(e.slave, e.request.frame, std::move(suspects));
  }

  void Evaluate(const model::AlRequestJudged& e, device::PdoDirection direction, const model::ProcessLayout& layout,
                const Free& free) {
    const std::uint32_t bytes = layout.bytes();
    const auto& limits = direction == device::PdoDirection::kRx ? free.max_rx_bytes : free.max_tx_bytes;
    if (free.even_length && *free.even_length) {
      Arguments advice = PaddingAdvice(free, direction, bytes);
      if (bytes % 2 != 0) {
        ReportWhole(e, direction, layout, kOddLength, Severity::kError, advice, free.even_length.source);
      } else {
        CheckEachPdo(e, direction, layout, free, advice);
      }
    }
    if (limits.empty() || bytes <= limits.front().bytes) return;
    const bool beyond_all = bytes > limits.back().bytes;
    const device::ByteLimit& limit = beyond_all ? limits.back() : limits.front();
    Arguments arguments{{"limit", arg::Count(limit.bytes, "byte")}};
    if (!limit.condition.empty()) arguments.Set("limit_condition", arg::Text(limit.condition));
    if (!beyond_all) {
      arguments.Set("higher_limit", arg::Number(limits.back().bytes));
      if (!limits.back().condition.empty()) arguments.Set("higher_condition", arg::Text(limits.back().condition));
    }
    ReportWhole(e, direction, layout, kTooLong, beyond_all ? Severity::kError : Severity::kWarning, arguments,
                limit.source);
  }

  /// What may fill a gap, and whether the mapping is still short enough then.
  static Arguments PaddingAdvice(const Free& free, device::PdoDirection direction, std::uint32_t bytes) {
    const auto& limits = direction == device::PdoDirection::kRx ? free.max_rx_bytes : free.max_tx_bytes;
    Arguments advice;
    const auto padding = std::ranges::find_if(
        free.paddings, [&](const device::Padding& row) { return row.direction == direction && row.index != 0; });
    const bool room = padding != free.paddings.end() && (limits.empty() || bytes + 1 <= limits.back().bytes);
    advice.Set("room", arg::Flag(room));
    if (padding != free.paddings.end()) {
      advice.Set("padding", arg::Object(padding->index, padding->first_subindex));
    }
    if (!limits.empty()) advice.Set("limit", arg::Count(limits.back().bytes, "byte"));
    return advice;
  }

  /// The sum may be even though two PDOs are not.
  void CheckEachPdo(const model::AlRequestJudged& e, device::PdoDirection direction, const model::ProcessLayout& layout,
                    const Free& free, const Arguments& advice) {
    for (const std::uint16_t pdo : layout.pdos) {
      std::uint32_t bits = 0;
      for (const model::Signal& signal : layout.signals) bits += signal.pdo == pdo ? signal.bits : 0U;
      const std::uint32_t bytes = (bits + 7) / 8;
      if (bytes % 2 == 0) continue;
      Arguments arguments = advice;
      arguments.Set("pdo", arg::Object(pdo)).Set("pdo_bytes", arg::Count(bytes, "byte"));
      ReportWhole(e, direction, layout, kOddPdo, Severity::kError, arguments, free.even_length.source, pdo);
    }
  }

  /// Step 2 of the manual: PDOs for free mapping that are not assigned hold nothing.
  void CheckUnused(const model::AlRequestJudged& e, device::PdoDirection direction, const model::ProcessLayout& layout,
                   const Free& free, std::vector<MappingSuspicions::Suspect>& suspects) {
    if (!free.clear_unused || !*free.clear_unused) return;
    std::vector<std::uint16_t> kept;
    std::vector<std::uint16_t> unseen;  // they hold what the drive has by itself
    for (const std::uint16_t pdo : PdosOf(free, direction)) {
      if (std::ranges::find(layout.pdos, pdo) != layout.pdos.end()) continue;
      const process::PdoObject* object = context().slave(e.slave).process.seen().Find(pdo);
      const std::uint8_t* count = object == nullptr ? nullptr : object->count.if_known();
      if (object != nullptr && object->count_lost) continue;
      if (count == nullptr) {
        unseen.push_back(pdo);
      } else if (*count != 0) {
        kept.push_back(pdo);
      }
    }
    if (kept.empty() && !unseen.empty()) {
      suspects.push_back(
          {direction,
           &kUnusedMayExplain,
           {{"pdos", PdosValue(unseen)}, {"manual", ManualOf(e.slave)}, {"assigned", PdosValue(layout.pdos)}},
           false});
    }
    if (kept.empty()) return;
    const std::uint64_t key = 4ULL << 60U | std::uint64_t{direction == device::PdoDirection::kRx} << 50U;
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      Finding finding = Found(kNotCleared, e.slave, e.request.frame);
      finding.Set("direction", PdoDirectionValue(direction))
          .Set("pdos", PdosValue(kept))
          .Set("assigned", PdosValue(layout.pdos))
          .Set("manual_short", arg::Text(Shortened(context().slave(e.slave).profile->document, 16)))
          .Set("request_frame", arg::Frame(e.request.frame.number))
          .Set("manual", ManualOf(e.slave));
      finding.reference = ReferenceTo(free.clear_unused.source);
      AddRelated(finding, layout.since);
      index = Report(key, Severity::kWarning, std::move(finding));
    }
    Predict(e, direction, index);
  }

  /// A fixed PDO that is not switched off.
  void CheckMixed(const model::AlRequestJudged& e, device::PdoDirection direction, const model::ProcessLayout& layout,
                  const Free& free) {
    const auto& all = PdosOf(free, direction);
    const auto is_free = [&](std::uint16_t pdo) { return std::ranges::find(all, pdo) != all.end(); };
    std::vector<std::uint16_t> used;
    std::optional<std::uint16_t> fixed;
    for (const std::uint16_t pdo : layout.pdos) {
      if (is_free(pdo)) used.push_back(pdo);
      if (!is_free(pdo) && context().slave(e.slave).profile->pdo.FindFixed(pdo) != nullptr) fixed = pdo;
    }
    if (used.empty() || !fixed || !free.clear_unused || !*free.clear_unused) return;
    const std::uint64_t key = 5ULL << 60U | std::uint64_t{direction == device::PdoDirection::kRx} << 50U | *fixed;
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      Finding finding = Found(kFixedKept, e.slave, e.request.frame);
      const bool rx = direction == device::PdoDirection::kRx;
      finding.Set("direction", PdoDirectionValue(direction))
          .Set("fixed", arg::Object(*fixed))
          .Set("assigned", PdosValue(used))
          .Set("object", arg::Object(rx ? process::kRxAssignment : process::kTxAssignment))
          .Set("most_pdos", arg::Number(free.max_pdos ? *free.max_pdos : 4))
          .Set("manual", ManualOf(e.slave));
      finding.reference = ReferenceTo(free.clear_unused.source);
      AddRelated(finding, layout.since);
      index = Report(key, Severity::kError, std::move(finding));
    }
    Predict(e, direction, index);
  }

  void ReportWhole(const model::AlRequestJudged& e, device::PdoDirection direction, const model::ProcessLayout& layout,
                   const FindingKind& kind, Severity severity, const Arguments& arguments, const std::string& source,
                   std::uint16_t pdo = 0) {
    const std::uint64_t number = &kind == &kTooLong ? 2 : &kind == &kOddPdo ? 6 : 1;
    const std::uint64_t key = number << 60U | std::uint64_t{pdo} << 32U |
                              std::uint64_t{direction == device::PdoDirection::kRx} << 50U | layout.bits;
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      const bool written = WrittenByMaster(e.slave, direction, layout.pdos);
      Finding finding = Found(kind, e.slave, e.request.frame);
      SetMapping(finding, direction, layout);
      for (const Argument& argument : arguments) finding.Set(argument.name, argument.value);
      finding.Set("own_default", arg::Flag(!written));
      if (layout.assumed || e.request.assumed || !written) finding.confidence = Confidence::kInferred;
      finding.reference = ReferenceTo(source);
      index = Report(key, severity, std::move(finding));
    }
    Predict(e, direction, index);
  }

  void SetMapping(Finding& finding, device::PdoDirection direction, const model::ProcessLayout& layout) const {
    finding.Set("direction", PdoDirectionValue(direction))
        .Set("bytes", arg::Count(layout.bytes(), "byte"))
        .Set("pdos", PdosValue(layout.pdos))
        .Set("manual", ManualOf(finding.slave));
    AddRelated(finding, layout.since);
  }

  // --- what may be the reason why a drive without documented rules refused

  void Suspect(SlaveId slave, const MappingSuspicions::Suspicion& suspicion) {
    const device::DeviceDescription& family = *context().slave(slave).profile;
    for (const MappingSuspicions::Suspect& suspect : suspicion.suspects) {
      if (suspect.note == &kUnusedMayExplain) {
        SuspectUnused(slave, suspicion, suspect, family);
        continue;
      }
      const model::ProcessLayout& layout = context().slave(slave).process.Layout(suspect.direction);
      const std::uint64_t key =
          3ULL << 60U | std::uint64_t{suspect.direction == device::PdoDirection::kRx} << 50U | layout.bits;
      FindingIndex index = Repeat(slave, key, suspicion.shown);
      if (index == kNoFinding) {
        Finding finding = Found(kOddLengthSuspected, slave, suspicion.shown);
        AddRelated(finding, suspicion.request.number);
        finding.confidence = Confidence::kInferred;
        SetMapping(finding, suspect.direction, layout);
        finding.Set("request_frame", arg::Frame(suspicion.request.number))
            .Set("al_status_code", CodeValue(suspicion.code, family))
            .Set("relative", arg::Text(relative_))
            .Set("by_code", arg::Flag(suspect.by_code))
            .Set("own_default", arg::Flag(!WrittenByMaster(slave, suspect.direction, layout.pdos)));
        finding.reference = ReferenceTo(relative_source_);
        index = Report(key, suspect.by_code ? Severity::kWarning : Severity::kInfo, std::move(finding));
      }
      if (suspect.by_code) MappingSuspicions::Blame(context(), suspicion, index);
    }
  }

  /// A PDO for free mapping that is not used and was never cleared.
  void SuspectUnused(SlaveId slave, const MappingSuspicions::Suspicion& suspicion,
                     const MappingSuspicions::Suspect& suspect, const device::DeviceDescription& family) {
    if (!suspect.by_code) return;
    const std::uint64_t key = 7ULL << 60U | std::uint64_t{suspect.direction == device::PdoDirection::kRx} << 50U;
    FindingIndex index = Repeat(slave, key, suspicion.shown);
    if (index == kNoFinding) {
      Finding finding = Found(kNotCleared, slave, suspicion.shown);
      AddRelated(finding, suspicion.request.number);
      finding.confidence = Confidence::kInferred;
      finding.reference = ReferenceTo(family.pdo.flexible->clear_unused.source);
      finding.Set("direction", PdoDirectionValue(suspect.direction))
          .Set("request_frame", arg::Frame(suspicion.request.number))
          .Set("al_status_code", CodeValue(suspicion.code, family))
          .Set("manual_short", arg::Text(Shortened(family.document, 16)));
      for (const Argument& argument : suspect.arguments) finding.Set(argument.name, argument.value);
      index = Report(key, Severity::kInfo, std::move(finding));
    }
    MappingSuspicions::Blame(context(), suspicion, index);
  }

  MappingSuspicions suspicions_;
  std::string relative_, relative_source_;  ///< the drive of the same maker, and where it forbids an odd length
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoMappingRule>};

}  // namespace
}  // namespace ecaudit::pdo_mapping_rule
