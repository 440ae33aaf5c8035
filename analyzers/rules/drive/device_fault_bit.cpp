#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_events.h"
#include "analyzers/model/process_image.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/object_words.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/events.h"

namespace ecaudit::device_fault_bit {
namespace {

using device::BitSign;

/// One bit that shows a fault or a warning.
struct Sign {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint8_t bit = 0;
  BitSign sign = BitSign::kNone;
  const std::string& name;
  const std::string& meaning;
  const std::string& source;
};

/// Calls `visit(const Sign&)` for each such bit of the family.
template <typename Visit>
void ForEachSign(const device::DeviceDescription& family, Visit visit) {
  for (const device::ObjectBits& row : family.object_bits) {
    if (row.sign == BitSign::kNone || row.first != row.last) continue;
    visit(Sign{row.index, row.subindex, row.first, row.sign, row.name, row.meaning, row.source});
  }
  if (!family.drive) return;
  for (const device::WordBit& row : family.drive->status_bits) {
    if (row.sign == BitSign::kNone) continue;
    visit(Sign{model::kStatusWord, 0, row.bit, row.sign, row.name, row.meaning, row.source});
  }
}

bool HasSigns(const device::DeviceDescription& family) {
  bool any = false;
  ForEachSign(family, [&any](const Sign&) { any = true; });
  return any;
}

constexpr FindingKind kSet{
    .name = "bit-set",
    .title = "Bit {bit} of {object:number}, {name}, is 1[: {reason}]",
    .message =
        R"([{?first}Bit {bit} of {object} is already 1 when the capture shows it first, in {frame} ({value}).][{!first}Bit
{bit} of {object} changes to 1 in {frame} ({value}).] By the manual ({source}) it shows: {name}[ ({meaning})].[
{reason_object}, read in {reason_frame}, reports {reason}.][{!reason} The number of the fault or warning is not in the
capture.][ The bit is 0 again in {gone_frame}.])",
    .next =
        "[{!reason}Read [{read_object}][{!read_object}1003h:1] from the device. ]Find the number in its manual, and "
        "remove the cause.",
    .identity = "object bit"};

constexpr const FindingKind* kKinds[] = {&kSet};

constexpr Word kBits{"fault-bits", "the object whose bits show faults of the device"};

constexpr RuleInfo kInfo{.id = "device-fault-bit",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .subject = Subject::kFaultBits,
                         .title = "A bit of an object shows a fault or a warning of the device",
                         .needs = "an object whose bits show faults by the manual, in the inputs or read by SDO",
                         .source = "MKD, 5.2; PILZ, 4.4.3",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Bits that the manual of the family calls a sign of a fault or a warning, beside the states of a drive:

- An MKD-C has no status word 6041h: bits 8 and 15 of 1002h are all that its inputs show, and bit 0 of 1001h by SDO.
- The status word of Pilz drives has bit 8 (position error) and bit 13 (homing error).

## Why it matters
An MKD-C supplies all drives of a string. None of them shows why it is in a fault. Or a homing has failed, and the drive
stays enabled.

## How it is decided
- The bit changes to 1, or is 1 when the capture shows it first: in inputs that the slave gave, or in the answer to an
  upload.
- A fault is an error, a warning is an info. A bit that stands for both is a warning.
- A number that the master reads while the bit is 1 is the reason (MKD-C 2001h: 562 is F562, 2000h: 501 is n501).
- An answer by SDO does not count if newer inputs hold the same object: the slave may have prepared the answer before.
- The frame in which the bit is 0 again is that of its last occurrence. After a capture gap it is not known.

## Example
tests/rules/device-fault-bit/violates.trace

## What to do
Find the number in the manual of the device, remove the cause, and clear the fault.
)"};

class DeviceFaultBit final : public Rule {
 public:
  DeviceFaultBit() : Rule(kInfo) {
    Subscribe<model::InputsGiven>(&DeviceFaultBit::On);
    Subscribe<mailbox::SdoTransfer>(&DeviceFaultBit::On);
    Subscribe<track::CaptureGap>(&DeviceFaultBit::On);
    Subscribe<track::RunBegan>(&DeviceFaultBit::On);
  }

  void On(const track::CaptureGap&) { Forget(); }
  void On(const track::RunBegan&) { Forget(); }

  void On(const model::InputsGiven& e) {
    const model::ImagePart& part = e.cycle.part;
    Placed* placed = part.slave < placed_.size() ? &placed_[part.slave] : nullptr;
    if (placed == nullptr || placed->serial != part.serial || placed->family != part.model->profile) {
      placed = Place(part);
    }
    if (placed != nullptr && !placed->places.empty()) TakeInputs(*placed, e.cycle);
  }

  void On(const mailbox::SdoTransfer& t) {
    const bool read = t.service == mailbox::SdoService::kUpload && t.outcome == mailbox::SdoOutcome::kCompleted;
    if (!read || !t.has_object || t.complete_access || t.data_gap || t.data.empty() || t.data.size() > 8) return;
    const device::DeviceDescription& family = *context().slave(t.slave).profile;
    if (!InputsAreNewer(t)) {
      Evaluate({t.slave, t.index, t.subindex, UnsignedOf(t.data), static_cast<std::uint16_t>(8 * t.data.size()),
                ConfidenceOf(t.certainty)},
               family, t.response);
    }
    AddReason(t, family);
  }

  void Finish() override {
    NotEvaluableFor([this](const model::SlaveModel& slave) -> std::optional<Reason> {
      if (seen_.contains(&slave) || !HasSigns(*slave.profile)) return std::nullopt;
      return Reason::Of(ReasonCode::kNotRead, kBits);
    });
  }

 private:
  struct Seen {
    SlaveId slave;
    std::uint16_t index;
    std::uint8_t subindex;
    std::uint64_t value;
    std::uint16_t bits;
    Confidence confidence;
  };
  /// Where the inputs of one slave have such objects.
  struct Placed {
    std::uint64_t serial = 0;
    const device::DeviceDescription* family = nullptr;
    FrameNo newest = 0;  ///< frame that brought them last
    struct One {
      model::ImagePart::Place place;
      std::optional<std::uint64_t> last;  ///< value in the frame before
    };
    std::vector<One> places;
  };
  /// The finding of one bit, for all times at which it was 1.
  struct Episode {
    FindingIndex finding = kNoFinding;
    bool open = false;  ///< the bit is still 1
  };
  using Key = std::pair<SlaveId, std::uint64_t>;

  static std::uint64_t KeyOf(const Sign& row) {
    return std::uint64_t{row.index} << 16U | std::uint64_t{row.subindex} << 8U | row.bit;
  }

  void Forget() {
    last_.clear();
    for (auto& [key, episode] : episodes_) episode.open = false;
    for (Placed& placed : placed_) {
      for (Placed::One& one : placed.places) one.last.reset();
    }
  }

  [[gnu::noinline]] void TakeInputs(Placed& placed, const model::ProcessCycle& cycle) {
    const model::ImagePart& part = cycle.part;
    placed.newest = cycle.frame().number;
    for (Placed::One& one : placed.places) {
      const model::ImagePart::Place& place = one.place;
      const auto value = cycle.Value(place);
      if (!value || one.last == value) continue;  // nearly always
      one.last = value;
      Evaluate(
          {part.slave, static_cast<std::uint16_t>(place.object >> 8U), static_cast<std::uint8_t>(place.object & 0xFFU),
           *value, place.bits, part.layout->assumed ? Confidence::kInferred : Confidence::kObserved},
          *part.model->profile, cycle.frame());
    }
  }

  /// @return null: it is not known what is in the part
  [[gnu::noinline]] Placed* Place(const model::ImagePart& part) {
    if (part.places.empty()) return nullptr;
    if (part.slave >= placed_.size()) placed_.resize(part.slave + std::size_t{1});
    Placed& placed = placed_[part.slave];
    placed = {part.serial, part.model->profile, 0, {}};
    ForEachSign(*part.model->profile, [&](const Sign& row) {
      const model::ImagePart::Place* place = part.Find(row.index, row.subindex);
      const bool other =
          placed.places.empty() || (place != nullptr && placed.places.back().place.object != place->object);
      if (place != nullptr && other) placed.places.push_back({*place, {}});
    });
    return &placed;
  }

  /// Inputs that came after the request hold the object that the answer holds. Else the next inputs are evaluated even
  /// if they are as before: the answer may have changed what is known.
  bool InputsAreNewer(const mailbox::SdoTransfer& t) {
    if (t.slave >= placed_.size()) return false;
    Placed& placed = placed_[t.slave];
    const std::uint32_t object = std::uint32_t{t.index} << 8U | t.subindex;
    for (Placed::One& one : placed.places) {
      if (one.place.object != object) continue;
      if (one.last && placed.newest > t.request.number) return true;
      one.last.reset();
    }
    return false;
  }

  void Evaluate(const Seen& seen, const device::DeviceDescription& family, const FrameRef& frame) {
    ForEachSign(family, [&](const Sign& row) {
      if (row.index != seen.index || row.subindex != seen.subindex || row.bit >= seen.bits) return;
      const bool set = (seen.value >> row.bit & 1U) != 0;
      seen_.insert(&context().slave(seen.slave));
      const Key key{seen.slave, KeyOf(row)};
      const auto [known, first] = last_.try_emplace(key, set);
      const bool before = !first && known->second;
      known->second = set;
      if (set == before) return;
      if (set) {
        ReportBit(seen, row, family, frame, first);
      } else if (const auto found = episodes_.find(key); found != episodes_.end() && found->second.open) {
        context().store[found->second.finding].Set("gone_frame", arg::Frame(frame.number));
        found->second.open = false;
      }
    });
  }

  void ReportBit(const Seen& seen, const Sign& row, const device::DeviceDescription& family, const FrameRef& frame,
                 bool first) {
    if (const FindingIndex again = Repeat(seen.slave, KeyOf(row), frame); again != kNoFinding) {
      context().store[again].arguments.Remove("gone_frame");
      episodes_[{seen.slave, KeyOf(row)}] = {again, true};
      return;
    }
    Finding finding = Found(kSet, seen.slave, frame);
    finding.confidence = seen.confidence;
    finding.reference = ReferenceTo(row.source);
    finding.Set("bit", arg::Number(row.bit))
        .Set("object",
             arg::Object(row.index, row.subindex == 0 ? -1 : row.subindex, family.object_name(row.index, row.subindex)))
        .Set("name", arg::Text(row.name))
        .Set("value", arg::Hex(seen.value, (seen.bits + 3) / 4))
        .Set("source", arg::Text(row.source));
    if (first) finding.Set("first", arg::Flag());
    if (!row.meaning.empty()) finding.Set("meaning", arg::Text(row.meaning));
    if (const device::FaultObject* object = NumberObject(family, row.sign)) {
      finding.Set("read_object", arg::Object(object->index, object->subindex));
    }
    const Severity severity = row.sign == BitSign::kFault     ? Severity::kError
                              : row.sign == BitSign::kWarning ? Severity::kInfo
                                                              : Severity::kWarning;
    const FindingIndex index = Report(KeyOf(row), severity, std::move(finding));
    if (index != kNoFinding) episodes_[{seen.slave, KeyOf(row)}] = {index, true};
  }

  static bool Fits(BitSign sign, device::FaultValue kind) {
    const bool warning = kind == device::FaultValue::kWarningNumber;
    return sign == BitSign::kEither || warning == (sign == BitSign::kWarning);
  }

  static const device::FaultObject* NumberObject(const device::DeviceDescription& family, BitSign sign) {
    for (const device::FaultObject& row : family.reported_objects) {
      if (Fits(sign, row.kind)) return &row;
    }
    return nullptr;
  }

  /// The number of a fault or warning, read while a bit shows one.
  void AddReason(const mailbox::SdoTransfer& t, const device::DeviceDescription& family) {
    const device::FaultObject* object = family.number_object(t.index, t.subindex);
    const std::uint64_t number = UnsignedOf(t.data);
    if (object == nullptr || number == 0) return;
    const std::string words = events::NumberWords(family, *object, number);
    if (words.empty()) return;
    ForEachSign(family, [&](const Sign& row) {
      if (!Fits(row.sign, object->kind)) return;
      const auto found = episodes_.find({t.slave, KeyOf(row)});
      if (found == episodes_.end() || !found->second.open) return;
      Finding& finding = context().store[found->second.finding];
      if (finding.arguments.Has("reason")) return;
      finding.Set("reason", arg::Text(words))
          .Set("reason_object", arg::Object(t.index, t.subindex))
          .Set("reason_frame", arg::Frame(t.response.number));
      AddRelated(finding, t.response.number);
    });
  }

  std::vector<Placed> placed_;               // by slave
  std::map<Key, bool> last_;                 // of each slave and bit: as last seen
  std::map<Key, Episode> episodes_;          // of each slave and bit with a finding
  std::set<const model::SlaveModel*> seen_;  // slaves of which a value was seen
};

const RuleRegistration kRegistration{kInfo, MakeRule<DeviceFaultBit>};

}  // namespace
}  // namespace ecaudit::device_fault_bit
