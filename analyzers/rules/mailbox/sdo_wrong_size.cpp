#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/bytes.h"
#include "decoder/esc/al.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::sdo_wrong_size {
namespace {

constexpr FindingKind kWrongSize{.name = "wrong-size",
                                 .title = "{bytes} written to {object:number}[, which is {type} ({expected_bytes})]",
                                 .message = R"(The master writes {bytes} to {object} in {frame}. The object [is {type},
{expected_bytes} ({source})][{!type}has another size ({source})].[{?accepted} The slave accepted the download. The
capture does not show which value it used.][ The slave aborted the download with {abort_code}.])",
                                 .next = "Correct the data type in the start-up list of the master.",
                                 .identity = "object"};

constexpr FindingKind kTextTooLong{.name = "text-too-long",
                                   .title = "{bytes} written to {object:number}, at most {most_bytes} allowed",
                                   .message = R"(The master writes a text of {bytes} to {object} in {frame}. The manual
prints a length of {most_bytes} ({source}).[{?accepted} The slave accepted the download. The capture does not show how
much of the text it kept.][ The slave aborted the download with {abort_code}.])",
                                   .next = "Shorten the text in the start-up list of the master.",
                                   .identity = "object"};

constexpr FindingKind kNoPadding{
    .name = "no-padding",
    .title = "{list:number} written without its padding byte[: it reads back as {read:number}]",
    .message = R"(The master writes {list:number} by complete access in {frame}: {bytes} for {entries}. There, subindex
0 fills 2 bytes: the number of entries and a padding byte. {expected_bytes} are needed. So the slave takes each entry
one byte too late: {shifted:number} instead of {meant:number}.[ {read_object:number} is {read:number} in
{read_frame}.][{?aborted} The slave aborted the download with {abort_code}.])",
    .next = "Write a padding byte after the number of entries, or write the entries one by one.",
    .identity = "list"};

constexpr const FindingKind* kKinds[] = {&kWrongSize, &kTextTooLong, &kNoPadding};

constexpr Word kType{"object-type", "the data type of an object"};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sdo-write-read-only"};

constexpr RuleInfo kInfo{.id = "sdo-wrong-size",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .subject = Subject::kCoe,
                         .title = "A download has another size than the object",
                         .needs = "the object's type in the dictionary of the family or of the standard",
                         .source = "ETG1000.6, CoE objects; CIA402, standard objects; MKD, 5.2, 5.3",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
The size of SDO downloads against the type of the object: 2 bytes for INT16, and so on.

## Why it matters
The drive aborts with 0x06070010, 0x06070012 or 0x06070013, or it uses only a part of the value.

## How it is decided
The type in the dictionary of the slave's family decides. If the manual of the family has no dictionary (AKD, Pilz),
these decide: the objects that the standards define for all devices, and then its list of cyclic objects (AKD 20A4h). A
text counts if the manual prints its longest length. If the drive accepts the download, the finding is a warning.

Not evaluated are:

- texts whose length the manual does not print, records, and objects whose type is not known
- downloads by complete access, except the lists of PDOs; expedited downloads that indicate no size
- uploads: the drive knows its own objects

A list of PDOs (1C12h, 1C13h, 16xxh, 1Axxh) that is written by complete access has 2 bytes before its first entry. With
one byte less each entry is shifted. This is an error if the slave aborts the download, refuses SAFEOP or shows a
shifted entry. It is an info if the slave goes to SAFEOP without that.

## Example
samples/captures/sdo-aborts.pcapng: 2 bytes written to 60FFh:0, an INT32.

## What to do
Correct the data type of this line in the start-up list of the master.
)"};

class SdoWrongSize final : public Rule {
 public:
  SdoWrongSize() : Rule(kInfo) {
    Subscribe<mailbox::SdoTransfer>(&SdoWrongSize::On);
    Subscribe<model::AlRequestJudged>(&SdoWrongSize::On);
    Subscribe<model::AlAnswered>(&SdoWrongSize::On);
  }

  void On(const model::AlRequestJudged& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return;
    for (const Unpadded& list : unpadded_) {
      if (list.slave == e.slave) context().ExplainRequest(e.slave, e.request.frame.number, list.finding);
    }
  }

  /// The slave decides: it may take such a list as the master means it.
  void On(const model::AlAnswered& e) {
    if (unpadded_.empty() || e.request.control.state() < static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return;
    const bool refused = e.outcome == model::AlAnswered::Outcome::kRefused;
    std::erase_if(unpadded_, [&](const Unpadded& list) {
      if (list.slave != e.slave || (!refused && list.shown)) return false;
      context().store.Regrade(list.finding, refused ? Severity::kError : Severity::kInfo);
      return true;
    });
  }

  void On(const mailbox::SdoTransfer& t) {
    if (!unpadded_.empty()) Compare(t);
    if (t.complete_access) CheckPadding(t);
    if (t.service != mailbox::SdoService::kDownload || !t.has_object || !t.request.seen() || t.complete_access) return;
    const std::optional<std::uint64_t> bytes = SizeOf(t);
    if (!bytes || DeniesObject(t)) return;
    const device::DeviceDescription& family = *context().slave(t.slave).profile;
    const device::DictionaryObject* object = family.object(t.index, t.subindex);
    std::optional<device::DictionaryObject> cyclic;
    if (object == nullptr || object->types.empty()) {
      cyclic = CyclicObject(family, t);
      if (cyclic) object = &*cyclic;
    }
    if (object == nullptr || object->types.empty()) {
      NotEvaluable(t.slave, ReasonCode::kNotInProfile, kType, t.request.number);
      return;
    }
    const bool too_long = object->max_bytes != 0 && *bytes > object->max_bytes;
    if (!too_long && Allows(*object, t.subindex, *bytes)) return;
    const bool accepted = t.outcome == mailbox::SdoOutcome::kCompleted;
    const bool aborted = t.outcome == mailbox::SdoOutcome::kAborted;
    const std::uint64_t key = static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.subindex) << 16U |
                              (accepted ? 1ULL << 24U : 0U) | (*bytes & 0xFFFFFFFFU) << 32U;
    FindingIndex index = Repeat(t.slave, key, t.request);
    if (index == kNoFinding) {
      const device::DataType type = object->TypeOf(t.subindex);
      Finding finding = Found(too_long ? kTextTooLong : kWrongSize, t.slave, t.request);
      finding.confidence = aborted || accepted ? ConfidenceOf(t.certainty) : Confidence::kInferred;
      finding.reference = ReferenceTo(object->source);
      SetObject(finding, t, family);
      finding.Set("bytes", arg::Count(*bytes, "byte"));
      if (too_long) {
        finding.Set("most_bytes", arg::Count(object->max_bytes, "byte"));
      } else if (type != device::DataType::kUnknown) {
        finding.Set("type", arg::Text(device::DataTypeName(type)))
            .Set("expected_bytes", arg::Count((device::BitsOf(type) + 7U) / 8U, "byte"));
      }
      finding.Set("outcome", OutcomeValue(t.outcome))
          .Set("accepted", arg::Flag(accepted))
          .Set("source", arg::Text(object->source));
      if (aborted) finding.Set("abort_code", arg::Code(t.abort_code, mailbox::AbortCodeText(t.abort_code), 8));
      AddRelated(finding, t.response.number);
      index = Report(key, accepted ? Severity::kWarning : Severity::kError, std::move(finding));
    }
    if (AbortFits(t)) ExplainAbort(context(), t, index);
  }

 private:
  static constexpr std::size_t kMostUnpadded = 64;
  static constexpr std::size_t kMostEntries = 16;

  /// A list of PDOs or of their entries, written without padding.
  struct Unpadded {
    SlaveId slave = kNoSlave;
    std::uint16_t index = 0;
    FindingIndex finding = kNoFinding;
    bool shown = false;                  ///< the slave showed an entry as it takes it
    std::vector<std::uint32_t> shifted;  ///< entries as the slave takes them
  };

  static std::uint32_t EntryAt(ByteSpan bytes, std::size_t at, std::size_t width) {
    return static_cast<std::uint32_t>(UnsignedOf(Slice(bytes, at, width)));
  }

  static Value EntryValue(std::uint32_t entry, std::size_t width) {
    return width == 2 ? arg::Object(static_cast<std::uint16_t>(entry)) : arg::Hex(entry, 8);
  }

  void CheckPadding(const mailbox::SdoTransfer& t) {
    constexpr std::size_t kCountBytes = 2;
    const bool list = t.service == mailbox::SdoService::kDownload && t.has_object && t.subindex == 0 &&
                      process::IsPdoObject(t.index) && !t.data_gap && t.data.size() > 1 && t.data.size() == t.size;
    if (!list) return;
    std::erase_if(unpadded_, [&](const Unpadded& old) { return old.slave == t.slave && old.index == t.index; });
    const std::size_t width = process::IsAssignment(t.index) ? 2 : 4;
    const std::size_t entries = t.data[0];
    if (t.size != 1 + entries * width) return;
    const bool aborted = t.outcome == mailbox::SdoOutcome::kAborted;
    const std::uint64_t key = std::uint64_t{1} << 63U | t.index;
    FindingIndex index = Repeat(t.slave, key, t.request);
    if (index == kNoFinding) {
      Finding finding = Found(kNoPadding, t.slave, t.request);
      finding.confidence = ConfidenceOf(t.certainty);
      finding.Set("list", arg::Object(t.index))
          .Set("bytes", arg::Count(t.size, "byte"))
          .Set("expected_bytes", arg::Count(kCountBytes + entries * width, "byte"))
          .Set("entries", arg::Count(entries, "entry"))
          .Set("meant", EntryValue(EntryAt(t.data, 1, width), width))
          .Set("shifted", EntryValue(EntryAt(t.data, kCountBytes, width), width))
          .Set("outcome", OutcomeValue(t.outcome))
          .Set("aborted", arg::Flag(aborted));
      if (aborted) finding.Set("abort_code", arg::Code(t.abort_code, mailbox::AbortCodeText(t.abort_code), 8));
      AddRelated(finding, t.response.number);
      index = Report(key, aborted ? Severity::kError : Severity::kWarning, std::move(finding));
    }
    if (aborted) return ExplainAbort(context(), t, index);
    if (index == kNoFinding || unpadded_.size() >= kMostUnpadded) return;
    Unpadded taken{t.slave, t.index, index, false, {}};
    for (std::size_t at = kCountBytes; at + width <= t.data.size() && taken.shifted.size() < kMostEntries;
         at += width) {
      taken.shifted.push_back(EntryAt(t.data, at, width));
    }
    unpadded_.push_back(std::move(taken));
  }

  /// With what the slave shows of such a list: an entry as it takes it, or an object that such an entry leads to.
  [[gnu::noinline]] void Compare(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kUpload || !t.has_object || t.complete_access) return;
    for (Unpadded& list : unpadded_) {
      if (list.slave != t.slave) continue;
      const bool leads = std::find(list.shifted.begin(), list.shifted.end(), t.index) != list.shifted.end();
      if (leads && process::IsAssignment(list.index)) ExplainAbort(context(), t, list.finding);
      const bool entry = t.index == list.index && t.subindex > 0 && t.subindex <= list.shifted.size() &&
                         t.outcome == mailbox::SdoOutcome::kCompleted;
      if (!entry || list.shown || UnsignedOf(t.data) != list.shifted[t.subindex - 1U]) continue;
      list.shown = true;
      Finding& finding = context().store[list.finding];
      finding.Set("read", EntryValue(list.shifted[t.subindex - 1U], process::IsAssignment(t.index) ? 2 : 4))
          .Set("read_object", arg::Object(t.index, t.subindex))
          .Set("read_frame", arg::Frame(t.last.number));
      context().store.Regrade(list.finding, Severity::kError);
    }
  }

  /// The object in the list of cyclic objects, where a manual prints no dictionary.
  static std::optional<device::DictionaryObject> CyclicObject(const device::DeviceDescription& family,
                                                              const mailbox::SdoTransfer& t) {
    for (const device::CyclicObject& row : family.pdo.cyclic) {
      if (row.index != t.index || row.subindex != t.subindex || row.type == device::DataType::kUnknown) continue;
      device::DictionaryObject object;
      object.index = row.index;
      object.subindex = object.last_subindex = row.subindex;
      object.types = {row.type};
      object.name = row.name;
      object.source = row.source;
      return object;
    }
    return std::nullopt;
  }

  /// What the master announced, else what a download in one piece carried; nothing if only a part is in the capture.
  static std::optional<std::uint64_t> SizeOf(const mailbox::SdoTransfer& t) {
    if (t.declared_size) return *t.declared_size;
    if (t.kind == mailbox::SdoTransferKind::kNormal) return t.size;
    return std::nullopt;
  }

  static bool Allows(const device::DictionaryObject& object, std::uint8_t subindex, std::uint64_t bytes) {
    if (bytes > 0xFFFF) return object.AllowsBits(subindex, 0xFFFF'FFF8U);  // only what has no fixed size
    const auto bits = static_cast<std::uint32_t>(bytes * 8U);
    return object.AllowsBits(subindex, bits) || (bits == 8 && object.AllowsBits(subindex, 1));
  }

  static bool DeniesObject(const mailbox::SdoTransfer& t) {
    constexpr std::uint32_t kNoObject = 0x06020000;
    constexpr std::uint32_t kNoSubindex = 0x06090011;
    return t.outcome == mailbox::SdoOutcome::kAborted && (t.abort_code == kNoObject || t.abort_code == kNoSubindex);
  }

  /// False if the code names another reason, for example read-only.
  static bool AbortFits(const mailbox::SdoTransfer& t) {
    const std::uint32_t code = t.displaced_abort_code.value_or(t.abort_code);
    return code >> 16U == 0x0607 || code >> 16U == 0x0800 || mailbox::AbortCodeText(code).empty();
  }

  std::vector<Unpadded> unpadded_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoWrongSize>};

}  // namespace
}  // namespace ecaudit::sdo_wrong_size
