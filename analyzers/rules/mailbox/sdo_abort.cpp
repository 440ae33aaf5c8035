#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <iterator>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::sdo_abort {
namespace {

constexpr FindingKind kAborted{
    .name = "aborted",
    .title = R"([{!other}[{mapped:number} not mapped in {object:number}][{assigned:number} not assigned in
{object:number}]][{?other}SDO {service}[ of {object:number}] aborted]
[{!displaced_abort_code}({abort_code:number})[{!meant}: [{!one_entry}{reason}][complete access of
{one_entry}]][: {meant:number}, bytes swapped?]][({displaced_abort_code:number}, misplaced)])",
    .message =
        R"(The slave aborts the {service} of [{object}[{?complete_access} (complete access)]][{!object}an object that is
not in the capture][ (request in {request_frame})]. The abort code is {abort_code}.[{?undefined} The standard does not
define this code.][ 4 bytes later the message has {displaced_abort_code}. The slave put its code in the wrong
place.][ The master wrote {size}[ ({value}[{?value_cut}...])].][ This maps {mapped}, {mapped_bits}.][ This assigns
{assigned}.])",
    .next = "{advice}.",
    .identity = "service object abort_code"};

constexpr FindingKind kAbortedByMaster{
    .name = "aborted-by-master",
    .title = R"(SDO {service}[ of {object:number}] aborted by the master ({abort_code:number}))",
    .message =
        R"(The master aborts its {service} of [{object}[{?complete_access} (complete access)]][{!object}an object that
is not in the capture][ (request in {request_frame})]. The abort code is {abort_code}.[{?undefined} The standard does
not define this code.][ 4 bytes later the message has {displaced_abort_code}. The master put its code in the wrong
place.][ The master wrote {size}[ ({value}[{?value_cut}...])].])",
    .next = "Check in the master why it gave up the transfer.",
    .identity = "service object abort_code"};

constexpr FindingKind kNotOffered{
    .name = "not-offered",
    .title = "SDO {service}[ of {object:number}] aborted ({abort_code:number})[: {reason}]",
    .message =
        R"(The slave aborts the {service} of [{object}[{?complete_access} (complete access)]][{!object}an object that is
not in the capture][ (request in {request_frame})]. The abort code is {abort_code}. Nothing is changed: the master only
finds out what the slave does not offer.)",
    .next = "",
    .identity = "service object abort_code"};

constexpr FindingKind kCountTooLarge{
    .name = "count-too-large",
    .title = "{count_object:number} has {entries}, but {object:number} does not exist",
    .message =
        R"(The slave gave {entries:number} as the number of entries in {count_object} ({count_frame}). It aborts the upload of
{object} (request in {request_frame}) with {abort_code}. So {count_object:number} has more entries than exist. A master that
reads as many entries as the count states stops here.)",
    .next =
        R"(Write the right number to {count_object:number} in the init commands (0: no entry). Or let the master use the
EEPROM or the ESI file.)",
    .identity = "object"};

constexpr NoteKind kCountExceeds{
    .name = "count-exceeds-shown",
    .text =
        R"(The master wrote {entries:number} to {object:number}, but the capture shows [only {shown}][{!shown}no entry] of
{list:number}.)"};
constexpr NoteKind kEntryLeftOut{
    .name = "entry-left-out",
    .text =
        R"(The master wrote {entries:number} to {object:number}, but the capture shows no {entry}, only entries after it.
The entries of a list have no gap.)"};
constexpr NoteKind kIsRegister{
    .name = "register-address",
    .text =
        R"(Objects of an application begin at 1000h. {address} may be meant as the address of a register of the slave
controller: an SDO does not reach it. Use FPRD to read the register, and FPWR to write it.)"};
constexpr NoteKind kIndexSwapped{
    .name = "index-bytes-swapped",
    .text = R"({object:number} is {meant} with its two bytes exchanged. CoE sends the low byte of an index first.)"};
constexpr NoteKind kEntrySwapped{
    .name = "entry-bytes-swapped",
    .text = R"(The entry {entry} is {right} in another byte order, which maps {meant}. The low byte of an
entry is sent first: the length, then the subindex, then the index.)"};
constexpr NoteKind kMappedOutput{
    .name = "mapped-in-outputs",
    .text = R"({object:number} is in the outputs ({pdo}), which the master sends. Such an object gets its value from the
process data, and many drives reject it by SDO.)"};
constexpr NoteKind kOneEntry{
    .name = "complete-access-of-one-entry",
    .text =
        R"(The master wrote {one_entry} by complete access from subindex {first} on. That transfers all subindices of
{object:number} without gaps, and {one_entry} are the length of a single entry.)"};
constexpr NoteKind kNoCompleteAccessInEsi{.name = "esi-no-complete-access",
                                          .text = "The ESI of the slave does not offer complete access."};
constexpr NoteKind kAssignmentFixed{.name = "esi-fixed-assignment",
                                    .text = "The ESI of the slave has a fixed PDO assignment (PdoAssign)."};
constexpr NoteKind kMappingFixed{.name = "esi-fixed-mapping",
                                 .text = "The ESI of the slave has a fixed PDO mapping (PdoConfig)."};
constexpr NoteKind kWrittenSingly{
    .name = "written-one-by-one",
    .text = "Then the master wrote the same entries one by one, the last in {written_frame}. No entry is missing."};
constexpr NoteKind kWrittenLater{.name = "accepted-later",
                                 .text = "In {accepted_frame} the slave accepted the same value."};

constexpr const FindingKind* kKinds[] = {&kAborted, &kAbortedByMaster, &kNotOffered, &kCountTooLarge};
constexpr const NoteKind* kNotes[] = {&kCountExceeds,    &kEntryLeftOut, &kIsRegister,    &kIndexSwapped,
                                      &kEntrySwapped,    &kMappedOutput, &kOneEntry,      &kNoCompleteAccessInEsi,
                                      &kAssignmentFixed, &kMappingFixed, &kWrittenSingly, &kWrittenLater};

constexpr RuleInfo kInfo{.id = "sdo-abort",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .subject = Subject::kCoe,
                         .title = "An SDO transfer is aborted",
                         .needs = "the messages in the mailbox of the slave",
                         .source = "ETG1000.6, SDO abort codes; CIA301, SDO abort codes",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
SDO transfers that end with an abort by the slave or the master, and the abort code. Further aborts with the same object
and code count as repetitions.

## Why it matters
The value was not written or not read. After a configuration that is aborted half-way the drive has a mixture of old and
new settings.

## How it is decided
An aborted download is an error: the change did not happen. An aborted upload is an error too, except for these codes,
which make it an info:

- object does not exist (0x06020000)
- subindex does not exist (0x06090011)
- complete access not supported (0x06010004)

Masters use such uploads to find out what a slave offers (slaveinfo of SOEM, optional objects of TwinCAT). Nothing is
changed.

- An upload of an entry of 1C1xh, 16xxh or 1Axxh that does not exist, although subindex 0 counts it, is a warning. It is
  an info if the slave reaches SAFEOP later.
- A download with complete access that the slave does not support becomes an info if the master then writes the same
  PDOs or entries and their number one by one.
- If the slave accepts the same value later, the finding notes it.
- An index or a mapping entry that is an object of the slave in another byte order, and none as it is, is named as such.
- A write of an object that the outputs hold is named as such.
- A download by complete access that has the length of a single entry is named as such, if the code is about the length
  or the access.
- If the model knows why the slave had to abort, caused_by names that finding (sdo-write-read-only, sdo-wrong-size,
  sdo-unknown-object, sdo-toggle).
- The top three bits of the command byte of an abort are those of 0x80. Some slave stacks leave bits of the request in
  the byte. Some put the code 4 bytes too late, which the finding reports.
- Aborts of SDO information services are no SDO transfers.

## Example
samples/captures/sdo-aborts.pcapng: a download of 2 bytes to 60FFh:0 (INT32), aborted with 0x06070013.

## What to do
Use the class of the abort code:

- 0x0601xxxx: access
- 0x0602xxxx, 0x0609001x: the object
- 0x0607xxxx: the size
- 0x0609003x: the value
- 0x0800002x: the state of the drive (many objects are writable only in PREOP, or while the drive is disabled)

Some codes have another meaning than their class:

- 0x06010004: complete access
- 0x06010005: longer than the mailbox
- 0x06040043: other parameters
- 0x06090033: modules
- 0x08000023: no dictionary
- 0x08000024: no value yet
)"};

constexpr std::uint32_t kNoObject = 0x06020000;
constexpr std::uint32_t kNoSubindex = 0x06090011;
constexpr std::uint32_t kNoCompleteAccess = 0x06010004;

/// Of a code: the reason in a title, and what to do.
struct CodeWords {
  std::uint32_t code = 0;
  Word reason;
  Word advice;
};

constexpr Word kCheckToggle{"check-toggle-bits", "Check the toggle bits of the segments"};
constexpr Word kCheckCommand{"check-command", "Check the SDO command, and the state of the slave at that time"};
constexpr Word kCheckAccess{
    "check-access", "Find the access rights of the object in the dictionary of the drive: it does not allow this"};
constexpr Word kCheckObject{"check-object", "Check the index and the firmware: the drive does not have this object"};
constexpr Word kCheckMapping{"check-mapping", "Compare the PDO mapping with what the drive allows"};
constexpr Word kCheckMapped{"check-mapped-object",
                            "Map only objects that the drive has: compare with its PDO mapping and its dictionary"};
constexpr Word kCheckLength{"check-length", "Compare the length with the type of the object"};
constexpr Word kCheckValue{"check-value", "Compare the subindex and the value with the limits of the object"};
constexpr Word kCheckState{"check-state", "Check the state of the drive: AL state, enabled, local control"};
constexpr Word kCheckCount{"check-count", "Write to subindex 0 the number of entries that exist"};
constexpr Word kLeftOut{"entry-left-out", "an entry was left out"};
constexpr Word kWithoutGap{"write-without-gap",
                           "Write the entries from subindex 1 on without a gap, then their number"};
constexpr Word kUseRegister{"use-register-access",
                            "Use FPRD or FPWR for a register, or an index from 1000h on for an object"};
constexpr Word kCheckByteOrder{"check-byte-order", "Write each number with its low byte first"};
constexpr Word kUseProcessData{"use-process-data",
                               "Write the object in the process data, or take it out of the mapping"};
constexpr Word kWriteOneEntry{"write-one-entry",
                              "Write a single entry without complete access: switch it off for this download"};
constexpr Word kIsMapped{"mapped-in-outputs", "it is in the outputs"};
constexpr Word kFindObject{"find-object", "Find the object in the dictionary of the drive"};

/// Codes of ETG.1000.6, sorted.
constexpr CodeWords kCodes[] = {
    {0x05030000, {"toggle-bit", "toggle bit repeated"}, kCheckToggle},
    {0x05040000, {"time-out", "time-out"}, kCheckCommand},
    {0x05040001, {"unknown-command", "unknown command"}, kCheckCommand},
    {0x05040002, {"block-size", "invalid block size"}, kCheckCommand},
    {0x05040003, {"sequence-number", "invalid sequence number"}, kCheckCommand},
    {0x05040004, {"block-crc", "block CRC error"}, kCheckCommand},
    {0x05040005, {"out-of-memory", "out of memory"}, kCheckCommand},
    {0x06010000, {"access", "access not supported"}, kCheckAccess},
    {0x06010001, {"write-only", "object is write-only"}, kCheckAccess},
    {0x06010002, {"read-only", "object is read-only"}, kCheckAccess},
    {0x06010003,
     {"subindex-0", "subindex 0 is not 0"},
     {"write-subindex-0", "Write 0 to subindex 0 first, then the other subindices, then subindex 0"}},
    {kNoCompleteAccess,
     {"complete-access", "no complete access"},
     {"write-one-by-one",
      "Transfer the subindices one by one: switch complete access off for this slave in the master"}},
    {0x06010005,
     {"mailbox-size", "longer than the mailbox"},
     {"use-segments",
      "Transfer the object in segments or one subindex at a time, or set up longer mailboxes if the device has them"}},
    {0x06010006,
     {"mapped", "mapped to an RxPDO"},
     {"unmap", "Remove the object from the mapping of the outputs, or write it by process data"}},
    {kNoObject, {"no-object", "object does not exist"}, kCheckObject},
    {0x06040041, {"not-mappable", "object not mappable"}, kCheckMapping},
    {0x06040042, {"pdo-length", "PDO would be too long"}, kCheckMapping},
    {0x06040043,
     {"parameters", "parameters incompatible"},
     {"check-parameters", "Check the parameters written before, and their order: the value contradicts one of them"}},
    {0x06040047,
     {"internal", "internal incompatibility"},
     {"device-diagnosis", "Read the diagnosis of the device itself, and try again after a power cycle"}},
    {0x06060000, {"hardware", "hardware error"}, kFindObject},
    {0x06070010, {"length", "type or length is wrong"}, kCheckLength},
    {0x06070012, {"too-long", "value is too long"}, kCheckLength},
    {0x06070013, {"too-short", "value is too short"}, kCheckLength},
    {kNoSubindex, {"no-subindex", "subindex does not exist"}, kCheckValue},
    {0x06090030, {"value-range", "value out of range"}, kCheckValue},
    {0x06090031, {"too-high", "value is too high"}, kCheckValue},
    {0x06090032, {"too-low", "value is too low"}, kCheckValue},
    {0x06090033,
     {"modules", "wrong modules detected"},
     {"compare-modules", "Compare F030h with F050h: the device has other modules than the master configures"}},
    {0x06090036,
     {"minimum-maximum", "maximum below minimum"},
     {"reorder-limits", "Write minimum and maximum in another order"}},
    {0x060A0023, {"resource", "resource not available"}, kFindObject},
    {0x08000000, {"general", "general error"}, kCheckState},
    {0x08000020, {"not-transferred", "cannot be transferred"}, kCheckState},
    {0x08000021,
     {"local-control", "local control"},
     {"end-local-control", "Switch off the local control at the device or in its tool"}},
    {0x08000022, {"device-state", "wrong device state"}, kCheckState},
    {0x08000023,
     {"no-dictionary", "no object dictionary"},
     {"ask-later",
      "Read the diagnosis of the device itself, and repeat the request later: its dictionary is not ready"}},
    {0x08000024, {"no-value", "no data available"}, {"value-later", "Repeat the request when the device has a value"}}};

class SdoAbort final : public Rule {
 public:
  SdoAbort() : Rule(kInfo) {
    Subscribe<mailbox::SdoTransfer>(&SdoAbort::On);
    Subscribe<model::AlAnswered>(&SdoAbort::On);
  }

  /// The slave decides: its master got on nevertheless.
  void On(const model::AlAnswered& e) {
    const std::uint8_t state = e.request.control.state();
    if (e.outcome == model::AlAnswered::Outcome::kRefused || state < static_cast<std::uint8_t>(esc::AlState::SAFEOP))
      return;
    std::erase_if(counts_, [&](const Count& count) {
      if (count.slave != e.slave) return false;
      context().store.Regrade(count.finding, Severity::kInfo);
      context().store[count.finding].Add(kStateReached,
                                         {{"state", arg::State(state)}, {"reached_frame", arg::Frame(e.frame.number)}});
      return true;
    });
  }

  void On(const mailbox::SdoTransfer& t) {
    if (t.outcome == mailbox::SdoOutcome::kCompleted) {
      WrittenSingly(t);
      WrittenLater(t);
    }
    if (t.outcome != mailbox::SdoOutcome::kAborted) return;
    const bool by_slave = t.aborted_by == mailbox::Direction::kIn;
    const std::uint64_t key = static_cast<std::uint64_t>(t.abort_code) | static_cast<std::uint64_t>(t.index) << 32U |
                              static_cast<std::uint64_t>(t.subindex) << 48U |
                              static_cast<std::uint64_t>(t.service) << 56U | (by_slave ? 0U : 1ULL << 60U) |
                              (t.has_object ? 0U : 1ULL << 61U) | (t.complete_access ? 1ULL << 62U : 0U);
    if (const FindingIndex known = Repeat(t.slave, key, t.last); known != kNoFinding) {
      AddRelated(context().store[known], t.request.number);
      RememberWhole(t, known);
      Remember(t, known);
      return;
    }
    if (ReportCount(t, key)) return;
    const std::uint32_t code = t.displaced_abort_code.value_or(t.abort_code);
    Finding finding = Found(IsProbe(t) ? kNotOffered : by_slave ? kAborted : kAbortedByMaster, t.slave, t.last);
    finding.confidence = t.has_object ? ConfidenceOf(t.certainty) : Confidence::kObserved;
    finding.Set("service", ServiceValue(t.service));
    SetObject(finding, t, *context().slave(t.slave).profile);
    const std::string_view meaning = mailbox::AbortCodeText(t.abort_code);
    finding.Set("abort_code", arg::Code(t.abort_code, meaning, 8)).Set("undefined", arg::Flag(meaning.empty()));
    if (t.displaced_abort_code) {
      finding.Set("displaced_abort_code",
                  arg::Code(*t.displaced_abort_code, mailbox::AbortCodeText(*t.displaced_abort_code), 8));
    }
    const CodeWords* words = WordsOf(code);
    if (words != nullptr) finding.Set("reason", arg::Of(words->reason));
    finding.Set("meaning", arg::Text(mailbox::AbortCodeText(code)))
        .Set("aborted_by", SenderValue(t.aborted_by))
        .Set("advice", arg::Of(words != nullptr ? words->advice : AdviceForClass(code)));
    if (t.request.seen()) finding.Set("request_frame", arg::Frame(t.request.number));
    if (t.service == mailbox::SdoService::kDownload) SetValue(finding, t);
    if (by_slave) AddEsiNote(finding, t);
    SetMapping(finding, t, code);
    if (by_slave && t.has_object && t.index < kFirstObject) {
      finding.Add(kIsRegister, {{"address", arg::Hex(t.index)}}).Set("advice", arg::Of(kUseRegister));
    }
    if (by_slave) AddByteOrder(finding, t, code);
    if (by_slave) AddMappedOutput(finding, t, code);
    if (by_slave) AddOneEntry(finding, t, code);
    AddRelated(finding, t.request.number);
    const FindingIndex index = Report(key, IsProbe(t) ? Severity::kInfo : Severity::kError, std::move(finding));
    RememberWhole(t, index);
    Remember(t, index);
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  static constexpr std::uint16_t kFirstObject = 0x1000;

  /// Subindex 0 of a list of PDOs or entries counts more than there are.
  struct Count {
    SlaveId slave = kNoSlave;
    FindingIndex finding = kNoFinding;
  };

  bool ReportCount(const mailbox::SdoTransfer& t, std::uint64_t key) {
    const bool no_entry = t.service == mailbox::SdoService::kUpload && t.has_object && !t.complete_access &&
                          t.aborted_by == mailbox::Direction::kIn && t.abort_code == kNoSubindex && t.subindex > 0;
    if (!no_entry || !process::IsPdoObject(t.index) || t.certainty != Certainty::kObserved) return false;
    const model::SlaveModel& slave = context().slave(t.slave);
    const model::ObjectValue* count = slave.objects.Find(t.index, 0);
    if (count == nullptr || count->written || count->raw < t.subindex || count->raw > 0xFF) return false;
    Finding finding = Found(kCountTooLarge, t.slave, t.last);
    SetObject(finding, t, *slave.profile);
    finding.Set("service", ServiceValue(t.service))
        .Set("count_object", arg::Object(t.index, 0))
        .Set("entries", arg::Count(count->raw, "entry"))
        .Set("count_frame", arg::Frame(count->since))
        .Set("abort_code", arg::Code(t.abort_code, mailbox::AbortCodeText(t.abort_code), 8));
    if (t.request.seen()) finding.Set("request_frame", arg::Frame(t.request.number));
    AddRelated(finding, t.request.number);
    AddRelated(finding, count->since);
    const FindingIndex index = Report(key, Severity::kWarning, std::move(finding));
    if (index != kNoFinding && counts_.size() < FindingStore::kMaxFindings) counts_.push_back({t.slave, index});
    return true;
  }

  /// What an entry of 16xxh, 1Axxh or 1C1xh means. The abort is about the object in it as much as about the entry.
  void SetMapping(Finding& finding, const mailbox::SdoTransfer& t, std::uint32_t code) const {
    const bool entry = t.service == mailbox::SdoService::kDownload && t.has_object && !t.complete_access &&
                       t.subindex > 0 && t.aborted_by == mailbox::Direction::kIn;
    const bool about_value = code == kNoObject || code >> 16U == 0x0604 || code >> 16U == 0x0609;
    bool other = true;
    if (entry && process::IsAssignment(t.index) && t.data.size() == 2) {
      finding.Set("assigned", arg::Object(LittleEndian<std::uint16_t>(t.data, 0)));
      other = !about_value;
    } else if (entry && process::IsPdoObject(t.index) && !process::IsAssignment(t.index) && t.data.size() == 4) {
      const auto value = LittleEndian<std::uint32_t>(t.data, 0);
      finding.Set("mapped", MappedValue(value, *context().slave(t.slave).profile))
          .Set("mapped_bits", arg::Count(value & 0xFFU, "bit"));
      other = !about_value;
      if (code == kNoObject) finding.Set("advice", arg::Of(kCheckMapped));
    }
    finding.Set("other", arg::Flag(other));
    AddCount(finding, t);
  }

  static std::uint16_t Swapped(std::uint16_t value) { return static_cast<std::uint16_t>(value << 8U | value >> 8U); }

  /// Titles name it instead of the reason.
  static void SetMeant(Finding& finding, Value meant) {
    finding.Set("meant", std::move(meant)).Set("advice", arg::Of(kCheckByteOrder));
  }

  /// An index, or an entry of a list of PDOs, that is an object of the slave if its bytes stand in another order, and
  /// none as it is.
  void AddByteOrder(Finding& finding, const mailbox::SdoTransfer& t, std::uint32_t code) const {
    const device::DeviceDescription& family = *context().slave(t.slave).profile;
    const bool about_value = code == kNoObject || code >> 16U == 0x0604 || code >> 16U == 0x0609;
    if (!t.has_object || !about_value) return;
    const bool entry = t.service == mailbox::SdoService::kDownload && !t.complete_access && t.subindex > 0;
    if (entry && process::IsAssignment(t.index) && t.data.size() == 2) {
      const auto assigned = LittleEndian<std::uint16_t>(t.data, 0);
      const std::uint16_t swapped = Swapped(assigned);
      const bool rx = t.index == process::kRxAssignment;
      if (rx ? !process::IsRxMapping(swapped) : !process::IsTxMapping(swapped)) return;
      finding.Add(kIndexSwapped, {{"object", arg::Object(assigned)}, {"meant", arg::Object(swapped)}});
      SetMeant(finding, arg::Object(swapped));
    } else if (entry && process::IsPdoObject(t.index) && t.data.size() == 4) {
      AddEntryOrder(finding, t.data, family);
    } else if (code == kNoObject && family.object(t.index, t.subindex) == nullptr) {
      const std::uint16_t swapped = Swapped(t.index);
      if (swapped < kFirstObject || swapped == t.index || family.object(swapped, t.subindex) == nullptr) return;
      Value meant = arg::Object(swapped, t.subindex, family.object_name(swapped, t.subindex));
      finding.Add(kIndexSwapped, {{"object", arg::Object(t.index)}, {"meant", meant}});
      SetMeant(finding, std::move(meant));
    }
  }

  /// With all four bytes reversed, or with its two halves exchanged.
  static void AddEntryOrder(Finding& finding, ByteSpan data, const device::DeviceDescription& family) {
    const auto value = LittleEndian<std::uint32_t>(data, 0);
    const auto written = process::MappingEntry::FromValue(value);
    if (family.object(written.index, written.subindex) != nullptr) return;
    const std::uint32_t halves = std::rotl(value, 16);
    for (const std::uint32_t right : {BigEndian<std::uint32_t>(data, 0), halves}) {
      const auto meant = process::MappingEntry::FromValue(right);
      const device::DictionaryObject* const object = family.object(meant.index, meant.subindex);
      if (object == nullptr || meant.bits == 0 || device::BitsOf(object->TypeOf(meant.subindex)) != meant.bits)
        continue;
      finding.Add(
          kEntrySwapped,
          {{"entry", arg::Hex(value, 8)}, {"right", arg::Hex(right, 8)}, {"meant", MappedValue(right, family)}});
      return SetMeant(finding, MappedValue(right, family));
    }
  }

  /// Complete access from subindex 1 on that has the bytes of one entry: the master may mean that entry only.
  static void AddOneEntry(Finding& finding, const mailbox::SdoTransfer& t, std::uint32_t code) {
    const bool whole = t.service == mailbox::SdoService::kDownload && t.has_object && t.complete_access &&
                       t.subindex == 1 && t.aborted_by == mailbox::Direction::kIn && !process::IsPdoObject(t.index);
    const bool one = std::has_single_bit(t.size) && t.size <= sizeof(std::uint64_t);
    constexpr std::uint32_t kAccess = 0x06010000, kGeneral = 0x08000000;
    const bool fits = code >> 16U == 0x0607 || code == kAccess || code == kGeneral || code == kNoSubindex;
    if (!whole || !one || !fits) return;
    const Value bytes = arg::Count(t.size, "byte");
    finding.Add(kOneEntry,
                {{"one_entry", bytes}, {"first", arg::Number(t.subindex)}, {"object", arg::Object(t.index)}});
    finding.Set("one_entry", bytes).Set("advice", arg::Of(kWriteOneEntry));
  }

  /// An object that the slave takes from the process data.
  void AddMappedOutput(Finding& finding, const mailbox::SdoTransfer& t, std::uint32_t code) const {
    constexpr std::uint32_t kAccess = 0x06010000, kReadOnly = 0x06010002;
    const bool write = t.service == mailbox::SdoService::kDownload && t.has_object && !process::IsPdoObject(t.index);
    if (!write || (code != kAccess && code != kReadOnly)) return;
    const model::SlaveModel& slave = context().slave(t.slave);
    const model::Signal* const signal = slave.process.rx().Find(t.index, t.subindex);
    if (signal == nullptr || slave.outputs.exchanged == 0) return;
    finding.Add(kMappedOutput, {{"object", arg::Object(t.index, t.subindex)}, {"pdo", arg::Object(signal->pdo)}});
    finding.Set("reason", arg::Of(kIsMapped)).Set("advice", arg::Of(kUseProcessData));
  }

  /// Subindex 0 of a list, set to more entries than the capture shows.
  void AddCount(Finding& finding, const mailbox::SdoTransfer& t) const {
    const bool count = t.service == mailbox::SdoService::kDownload && t.has_object && !t.complete_access &&
                       t.subindex == 0 && t.aborted_by == mailbox::Direction::kIn && process::IsPdoObject(t.index) &&
                       t.data.size() == 1;
    if (!count || t.data[0] == 0) return;
    const process::PdoObject* const list = context().slave(t.slave).process.seen().Find(t.index);
    if (list == nullptr || list->since == 0) return;
    const std::uint8_t shown = list->highest();
    if (shown == t.data[0]) AddLeftOut(finding, t.index, *list);
    if (shown >= t.data[0]) return;
    Arguments arguments{{"object", arg::Object(t.index, 0)},
                        {"entries", arg::Count(t.data[0], "entry")},
                        {"list", arg::Object(t.index)}};
    if (shown > 0) arguments.Set("shown", arg::Count(shown, "entry"));
    finding.Add(kCountExceeds, std::move(arguments));
    finding.Set("advice", arg::Of(kCheckCount));
  }

  static void AddLeftOut(Finding& finding, std::uint16_t index, const process::PdoObject& list) {
    const std::uint8_t left_out = list.left_out();
    if (left_out == 0) return;
    finding.Add(kEntryLeftOut, {{"object", arg::Object(index, 0)},
                                {"entry", arg::Object(index, left_out)},
                                {"entries", arg::Count(list.highest(), "entry")}});
    finding.Set("reason", arg::Of(kLeftOut)).Set("advice", arg::Of(kWithoutGap));
  }

  /// Complete access that was refused, and the entries that the master has to write one by one instead.
  struct Whole {
    SlaveId slave = kNoSlave;
    FindingIndex finding = kNoFinding;
    std::uint16_t index = 0;
    std::uint8_t count = 0;               ///< subindex 0
    std::array<std::uint32_t, 16> value;  ///< of subindices 1 to count
    std::bitset<17> missing;              ///< subindices
  };

  /// Values of assignments (2 bytes) and mappings (4 bytes) after the count and a byte of padding. The sizes of the
  /// entries of other objects are not known here.
  void RememberWhole(const mailbox::SdoTransfer& t, FindingIndex finding) {
    if (finding == kNoFinding || t.service != mailbox::SdoService::kDownload || !t.complete_access ||
        t.abort_code != kNoCompleteAccess || t.subindex != 0 || t.data.size() < 2 || !process::IsPdoObject(t.index)) {
      return;
    }
    const std::size_t bytes = process::IsAssignment(t.index) ? 2 : 4;
    Whole whole{.slave = t.slave, .finding = finding, .index = t.index, .count = t.data[0], .value = {}, .missing = {}};
    if (whole.count > whole.value.size() || t.data.size() < 2 + whole.count * bytes) return;
    for (std::size_t n = 0; n <= whole.count; ++n) {
      whole.missing.set(n);
      if (n > 0)
        whole.value[n - 1] = static_cast<std::uint32_t>(UnsignedOf(t.data.subspan(2 + (n - 1) * bytes, bytes)));
    }
    whole_[next_whole_++ % whole_.size()] = whole;
  }

  void WrittenSingly(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kDownload || t.complete_access || !t.has_object) return;
    for (Whole& whole : whole_) {
      if (whole.finding == kNoFinding || whole.slave != t.slave || whole.index != t.index) continue;
      if (t.subindex > whole.count || t.data.size() > 4) continue;
      const std::uint32_t wanted = t.subindex == 0 ? whole.count : whole.value[t.subindex - 1U];
      whole.missing.set(t.subindex, UnsignedOf(t.data) != wanted);
      if (whole.missing.any()) continue;
      Finding& finding = context().store[whole.finding];
      finding.Add(kWrittenSingly, {{"written_frame", arg::Frame(t.last.number)}});
      AddRelated(finding, t.last.number);
      context().store.Regrade(whole.finding, Severity::kInfo);
      whole.finding = kNoFinding;
    }
  }

  static const CodeWords* WordsOf(std::uint32_t code) {
    const auto* found =
        std::lower_bound(std::begin(kCodes), std::end(kCodes), code,
                         [](const CodeWords& words, std::uint32_t value) { return words.code < value; });
    return found != std::end(kCodes) && found->code == code ? found : nullptr;
  }

  /// What the ESI states about a feature that the transfer needs.
  void AddEsiNote(Finding& finding, const mailbox::SdoTransfer& t) const {
    const device::DeviceDescription& device = *context().slave(t.slave).profile;
    if (!device.esi || !t.has_object) return;
    if (t.complete_access && !device.mailbox.complete_access) {
      finding.Add(kNoCompleteAccessInEsi);
      return;
    }
    if (t.service != mailbox::SdoService::kDownload) return;
    constexpr std::uint16_t kFirstAssignment = 0x1C10, kLastAssignment = 0x1C2F;
    if (t.index >= kFirstAssignment && t.index <= kLastAssignment && device.esi->pdo_assign == false) {
      finding.Add(kAssignmentFixed);
      return;
    }
    const bool mapping = (t.index >= 0x1600 && t.index < 0x1800) || (t.index >= 0x1A00 && t.index < 0x1C00);
    if (mapping && device.esi->pdo_config == false) finding.Add(kMappingFixed);
  }

  static bool IsProbe(const mailbox::SdoTransfer& t) {
    // A transfer whose request is not in the capture may have been an upload.
    if (t.service == mailbox::SdoService::kDownload || t.aborted_by != mailbox::Direction::kIn) return false;
    return t.abort_code == kNoObject || t.abort_code == kNoSubindex || t.abort_code == kNoCompleteAccess;
  }

  static void SetValue(Finding& finding, const mailbox::SdoTransfer& t) {
    constexpr std::size_t kShown = 8;
    finding.Set("size", arg::Count(t.size, "byte"));
    if (t.data.empty()) return;
    finding.Set("value", arg::Bytes(t.data.first(std::min(kShown, t.data.size()))))
        .Set("value_cut", arg::Flag(t.data.size() > kShown));
  }

  static const Word& AdviceForClass(std::uint32_t code) {
    switch (code >> 16U) {
      case 0x0503:
        return kCheckToggle;
      case 0x0504:
        return kCheckCommand;
      case 0x0601:
        return kCheckAccess;
      case 0x0602:
        return kCheckObject;
      case 0x0604:
        return kCheckMapping;
      case 0x0607:
        return kCheckLength;
      case 0x0609:
        return kCheckValue;
      case 0x0800:
        return kCheckState;
      default:
        return kFindObject;
    }
  }

  /// A download that was refused: the master may write the same value again, in a state that allows it.
  struct Refused {
    SlaveId slave = kNoSlave;
    FindingIndex finding = kNoFinding;
    std::uint16_t index = 0;
    std::uint8_t subindex = 0;
    std::uint8_t bytes = 0;
    std::array<std::uint8_t, 8> value{};
  };

  void Remember(const mailbox::SdoTransfer& t, FindingIndex finding) {
    Refused refused{
        .slave = t.slave, .finding = finding, .index = t.index, .subindex = t.subindex, .bytes = 0, .value = {}};
    const bool whole = t.has_object && !t.complete_access && t.size == t.data.size() && t.size <= refused.value.size();
    if (finding == kNoFinding || t.service != mailbox::SdoService::kDownload || !whole || t.data.empty()) return;
    refused.bytes = static_cast<std::uint8_t>(t.data.size());
    std::copy(t.data.begin(), t.data.end(), refused.value.begin());
    refused_[next_refused_++ % refused_.size()] = refused;
  }

  void WrittenLater(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kDownload || t.complete_access || !t.has_object) return;
    for (Refused& refused : refused_) {
      const bool same =
          refused.finding != kNoFinding && refused.slave == t.slave && refused.index == t.index &&
          refused.subindex == t.subindex &&
          std::equal(t.data.begin(), t.data.end(), refused.value.begin(), refused.value.begin() + refused.bytes);
      if (!same) continue;
      const FindingIndex index = std::exchange(refused.finding, kNoFinding);
      if (noted_.contains(index)) continue;
      noted_.insert(index);
      Finding& finding = context().store[index];
      finding.Add(kWrittenLater, {{"accepted_frame", arg::Frame(t.last.number)}});
      AddRelated(finding, t.last.number);
    }
  }

  std::vector<Count> counts_;
  std::array<Refused, 32> refused_{};  // the newest
  std::size_t next_refused_ = 0;
  std::set<FindingIndex> noted_;
  std::array<Whole, 32> whole_{};  // the newest
  std::size_t next_whole_ = 0;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoAbort>};

}  // namespace
}  // namespace ecaudit::sdo_abort
