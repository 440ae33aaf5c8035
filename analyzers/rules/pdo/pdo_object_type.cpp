#include <algorithm>
#include <cstdlib>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_places.h"
#include "analyzers/model/process_image.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/steady_inputs.h"
#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/lasting.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/words/what.h"
#include "decoder/device/object_dictionary.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"
#include "decoder/track/events.h"

namespace ecaudit::pdo_object_type {
namespace {

using device::PdoDirection;

constexpr FindingKind kLength{
    .name = "length",
    .title = "{object:number} is mapped with {mapped}, its type has {expected}",
    .message =
        R"(The mapping of {pdo} holds {object} with {mapped}.[{?standard} By CiA 402 the object has
{expected}.][{!standard} Its description states {expected}.][ What follows it in the process data
({following}) may be read {shift} beside its place.][ The drive confirms this: 6061h is {by_sdo} by SDO and
{by_process_data} in the process data ({differs_frame}).])",
    .next = "Map {object:number} with {expected}.",
    .identity = "object mapped"};

constexpr FindingKind kDiffers{
    .name = "value-differs",
    .title = "6061h is {by_sdo} by SDO, but {by_process_data} in the process data",
    .message =
        R"(The master read {by_sdo} from 6061h by SDO in {frame}. The process data show {by_process_data} for the same
object from {since_frame} on, for {lasted_ms}. The master reads the inputs at a wrong place.)",
    .next = "Compare the PDO mapping (1A00h to 1BFFh) and the length of SM3 with what the slave sends.",
    .identity = "by_sdo by_process_data"};

constexpr FindingKind kObjectDiffers{
    .name = "object-differs",
    .title = "{object:number} is {by_sdo} by SDO, but {by_process_data} in the process data",
    .message =
        R"(The master read {by_sdo} from {object} by SDO ({frame}). The process data hold {by_process_data} at its place
before and after that ({since_frame} to {until_frame}).[ The value lies {distance} {side} its place: what the slave
sends is shifted.] So the master reads these inputs at a wrong place, or the slave does not update them.)",
    .next = "Compare the PDO mapping (1A00h to 1BFFh) and the length of SM3 with what the slave sends.",
    .identity = "object"};

constexpr FindingKind kNoLength{
    .name = "no-length",
    .title = "{object:number} is mapped with 255 bits, which no object has",
    .message =
        R"(The mapping of {pdo} holds {object} with 255 bits: the length byte of the entry is 0xff. The type of the
object is not in the capture.[ What follows it in the process data ({following}) is read at a wrong place.])",
    .next = "Map {object:number} with the length of its type.",
    .identity = "object"};

constexpr const FindingKind* kKinds[] = {&kLength, &kDiffers, &kObjectDiffers, &kNoLength};

constexpr RuleInfo kInfo{
    .id = "pdo-object-type",
    .group = "PDO mapping",
    .severity = Severity::kError,
    .subject = Subject::kMapping,
    .title = "A mapped object has another length than its type, or another value than by SDO",
    .needs = "the mapping, and the type of the object from the slave, an ESI, the manual or CiA 402",
    .source = "CIA402, object dictionary; ETG1000.6, 5.6.7.4",
    .kinds = kKinds,
    .doc = R"(
## What it checks
Whether each entry that the master maps is as long as the type of its object. Whether the slave shows the same value of
an object by SDO and in the process data.

## Why it matters
The drive sends as many bits as its object has. All that follows in the process data is then read at a wrong place,
although lengths and working counters are right.

## How it is decided
- The type comes from the slave's own dictionary, its ESI or manual. A wrong length is a warning: some slaves fill the
  entry.
- If none of them has the object, and the axis shows a control or status word, the type of CiA 402 counts. A wrong
  length is then an inferred info: the slave accepted the mapping, and its object may be longer than in the standard.
- A difference of 6061h counts if the process data held the other value for at least 100 ms before the answer, and hold
  it for 50 ms after it.
- A wrong length is an error if 6061h differs as well.
- 255 bits are a warning for an object of any type: the length byte is 0xFF.
- Any object that the inputs hold and that the master reads by SDO in OP is compared. It counts if the process data did
  not change from 100 ms before the request to 100 ms after the answer, in at least 5 frames each. It is a warning.
- Not compared: objects whose manual gives a scale by SDO, and values of which one is 10, 100, ... times the other
  (another unit). Of 16 bits and more, a difference below 8 is the noise of a measurement.

## Example
tests/rules/pdo-object-type/violates.trace: 6077h with 32 bits.

## What to do
Correct the length of the entry in the start-up list of the master, or choose a PDO that the slave offers.
)"};

class PdoObjectType final : public Rule {
 public:
  PdoObjectType() : Rule(kInfo) {
    Subscribe<mailbox::SdoTransfer>(&PdoObjectType::On);
    Subscribe<model::InputsGiven>(&PdoObjectType::On);
    Subscribe<track::CaptureGap>(&PdoObjectType::On);
    Subscribe<track::RunBegan>(&PdoObjectType::On);
  }

  void On(const track::CaptureGap&) { Forget(); }
  void On(const track::RunBegan&) { Forget(); }

  /// Follows the inputs of the slaves that have a mailbox, where they lie in one piece.
  void On(const model::InputsGiven& e) {
    const model::ImagePart& part = e.cycle.part;
    if (part.slave >= held_.size()) return;
    Held& held = held_[part.slave];
    if (held.serial == part.serial || (held.with_sdo && Begin(held, part))) TakeInputs(held, e.cycle);
  }

  void On(const mailbox::SdoTransfer& transfer) {
    if (transfer.slave >= held_.size()) held_.resize(transfer.slave + std::size_t{1});
    held_[transfer.slave].with_sdo = true;
    Compare(transfer);
    const bool mapping = process::IsRxMapping(transfer.index) || process::IsTxMapping(transfer.index);
    if (!transfer.has_object || !mapping || transfer.service != mailbox::SdoService::kDownload ||
        transfer.outcome != mailbox::SdoOutcome::kCompleted) {
      return;
    }
    written_.emplace(transfer.slave, transfer.index);
  }

  void Finish() override {
    for (SlaveId id = 0; id < context().slave_count(); ++id) {
      const model::SlaveModel& slave = context().slave(id);
      bool reported = false;
      for (const PdoDirection direction : {PdoDirection::kRx, PdoDirection::kTx}) {
        reported = Evaluate(id, slave, direction) || reported;
      }
      if (!reported) ReportDifference(id);
    }
  }

 private:
  static constexpr std::size_t kMostCompared = 16;
  static constexpr TimeNs kSettledNs = 100'000'000;
  /// Before the request and after the answer: of slow inputs 100 ms may be one cycle.
  static constexpr std::uint32_t kLeastFrames = progress::Lasting::kLeastFrames;

  /// An object that had another value by SDO than in the process data.
  struct Compared {
    model::ImagePart::Place place;
    std::uint64_t by_process_data = 0;
    std::uint64_t by_sdo = 0;
    std::uint32_t bits = 0;  ///< of the value by SDO
    FrameRef since;          ///< the process data held their value
    FrameRef answer;
    std::uint32_t frames_after = 0;  ///< of the process data, since the answer
  };
  /// The inputs of one slave in one datagram.
  struct Held {
    bool with_sdo = false;  ///< the slave has a mailbox
    std::uint64_t serial = 0;
    std::uint32_t begin = 0;  ///< bit of the datagram where they begin
    std::uint32_t bytes = 0;
    std::vector<model::ImagePart::Place> places;
    model::SteadyInputs inputs;
    std::vector<Compared> compared;

    void Forget() {
      serial = 0;
      inputs.Forget();
      compared.clear();
    }
    /// The value at a place, at most 64 bits of it.
    [[nodiscard]] std::uint64_t ValueAt(const model::ImagePart::Place& place) const {
      std::uint64_t value = 0;
      for (std::uint32_t i = 0; i < std::min<std::uint32_t>(place.bits, 64); ++i) {
        const std::size_t bit = place.bit - begin + i;
        if (bit / 8 >= inputs.bytes().size()) break;
        value |= std::uint64_t{static_cast<std::uint8_t>(inputs.bytes()[bit / 8] >> bit % 8 & 1)} << i;
      }
      return value;
    }
  };

  void Forget() {
    for (Held& held : held_) held.Forget();
  }
  [[gnu::noinline]] static void Forget(Held& held) { held.Forget(); }

  /// Inputs in several datagrams, or other ones than before.
  /// @return false: they are not in one piece, or not known
  [[gnu::noinline]] static bool Begin(Held& held, const model::ImagePart& part) {
    if (part.by_eni || part.places.empty() || part.runs.size() != 1) return false;
    const model::BitRun& run = part.runs[0];
    if (run.in_datagram % 8 != 0 || run.bits % 8 != 0) return false;
    held.Forget();
    held.serial = part.serial;
    held.places = part.places;
    held.begin = run.in_datagram;
    held.bytes = run.bits / 8;
    return true;
  }

  void TakeInputs(Held& held, const model::ProcessCycle& cycle) {
    if (!cycle.frame().has_time) return Forget(held);
    held.inputs.Take(Slice(cycle.data, held.begin / 8, held.bytes), cycle.frame());
    if (!held.compared.empty()) Confirm(held, cycle);
  }

  static std::uint64_t Mask(std::uint32_t bits) {
    return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
  }

  void Compare(const mailbox::SdoTransfer& t) {
    const bool read = t.service == mailbox::SdoService::kUpload && t.outcome == mailbox::SdoOutcome::kCompleted &&
                      t.has_object && !t.complete_access && t.certainty == Certainty::kObserved && !t.data_gap;
    if (!read || t.data.empty() || t.data.size() > 8 || t.data.size() != t.size) return;
    Held& held = held_[t.slave];
    if (held.inputs.bytes().empty() || !t.request.has_time || !t.response.has_time) return;
    const auto axis = progress::AxisOf(t.index);
    if (axis && axis->second == model::kModesDisplay) return;  // the model of the axis compares it
    if (!context().slave(t.slave).al.SettledIn(esc::AlState::OP)) return;
    const model::Signal* const signal = context().slave(t.slave).process.tx().Find(t.index, t.subindex);
    if (signal == nullptr || signal->scaled_by_sdo) return;
    const std::uint32_t object = std::uint32_t{t.index} << 8U | t.subindex;
    for (const model::ImagePart::Place& place : held.places) {
      if (place.object != object || place.bit < held.begin) continue;
      const std::uint64_t value = held.ValueAt(place);
      const auto bits = static_cast<std::uint32_t>(8 * t.data.size());
      const std::uint32_t common = std::min<std::uint32_t>(bits, place.bits);
      const std::uint64_t mask = Mask(common);
      const std::uint64_t by_sdo = UnsignedOf(t.data);
      if ((value & mask) == (by_sdo & mask) || MayBeEqual(value & mask, by_sdo & mask, common)) return;
      const FrameRef since = held.inputs.SteadySince(place.bit - held.begin, place.bits, kLeastFrames);
      if (!since.seen() || Elapsed(since.time, t.request.time) < kSettledNs) return;
      if (held.compared.size() < kMostCompared)
        held.compared.push_back({place, value, by_sdo, bits, since, t.response});
      return;
    }
  }

  /// Two readings of one value: the last bits of a measurement, or the same in another unit.
  static bool MayBeEqual(std::uint64_t by_process_data, std::uint64_t by_sdo, std::uint32_t bits) {
    constexpr std::uint32_t kLeastBits = 16;  // shorter ones are states and flags
    constexpr std::int64_t kNoise = 8;
    constexpr std::int64_t kLeastRounded = 10;  // a smaller number rounds to too many others
    if (bits < kLeastBits) return false;
    std::int64_t less = progress::Bounded(SignExtend(by_process_data, bits));
    std::int64_t more = progress::Bounded(SignExtend(by_sdo, bits));
    if (std::abs(more - less) < kNoise) return true;
    if (less == 0 || more == 0 || (less < 0) != (more < 0)) return false;
    less = std::abs(less);
    more = std::abs(more);
    if (less > more) std::swap(less, more);
    for (std::int64_t factor = 10; factor <= more; factor *= 10) {
      if (less > more / factor + 1) return false;
      const std::int64_t off = std::abs(more - less * factor);
      if (off == 0 || (less >= kLeastRounded && off <= factor / 2)) return true;
    }
    return false;
  }

  [[gnu::noinline]] void Confirm(Held& held, const model::ProcessCycle& cycle) {
    std::erase_if(held.compared, [&](Compared& compared) {
      if (held.ValueAt(compared.place) != compared.by_process_data) return true;
      const bool settled = Elapsed(compared.answer.time, cycle.frame().time) >= kSettledNs;
      if (++compared.frames_after < kLeastFrames || !settled) return false;
      ReportObject(held, compared, cycle);
      return true;
    });
  }

  void ReportObject(const Held& held, const Compared& compared, const model::ProcessCycle& cycle) {
    const model::ImagePart::Place& place = compared.place;
    const std::uint64_t key = std::uint64_t{1} << 40U | place.object;
    if (Repeat(cycle.part.slave, key, compared.answer) != kNoFinding) return;
    const model::Signal& signal = cycle.part.layout->signals[place.signal];
    Finding finding = Found(kObjectDiffers, cycle.part.slave, compared.answer);
    finding.Set("object", arg::Object(signal.index, signal.subindex, signal.name));
    finding.Set("by_sdo", arg::Hex(compared.by_sdo, static_cast<int>(compared.bits / 4)))
        .Set("by_process_data", arg::Hex(compared.by_process_data, std::max(1, (place.bits + 3) / 4)))
        .Set("since_frame", arg::Frame(compared.since.number))
        .Set("until_frame", arg::Frame(cycle.frame().number));
    SetDistance(finding, held, compared);
    AddRelated(finding, compared.since.number);
    AddRelated(finding, cycle.frame().number);
    (void)Report(key, Severity::kWarning, std::move(finding));
  }

  /// Where else in the inputs the value lies, if there is one such place and the value is no small number.
  static void SetDistance(Finding& finding, const Held& held, const Compared& compared) {
    constexpr std::uint64_t kSmall = 0xFF;
    const std::size_t bytes = compared.bits / 8;
    if (compared.by_sdo <= kSmall || bytes < 2 || compared.by_sdo == Mask(compared.bits)) return;
    const std::int64_t own = std::int64_t{compared.place.bit} - held.begin;
    std::optional<std::int64_t> found;
    for (std::size_t at = 0; at + bytes <= held.inputs.bytes().size(); ++at) {
      if (UnsignedOf(held.inputs.bytes().subspan(at, bytes)) != compared.by_sdo) continue;
      if (found) return;
      found = static_cast<std::int64_t>(8 * at);
    }
    if (!found || *found == own) return;
    finding.Set("distance", arg::Count(static_cast<std::uint64_t>(std::abs(*found - own)), "bit"))
        .Set("side", arg::Of(*found < own ? kBefore : kAfter));
  }

  /// @return whether a length is wrong
  bool Evaluate(SlaveId id, const model::SlaveModel& slave, PdoDirection direction) {
    const model::ProcessLayout& layout = slave.process.Layout(direction);
    const model::ProcessTraffic& traffic = direction == PdoDirection::kRx ? slave.outputs : slave.inputs;
    if (traffic.exchanged == 0) return false;
    if (!layout.known()) {
      NotEvaluable(id, ReasonCode::kNotInCapture, what::kMapping);
      return false;
    }
    bool wrong = false;
    for (std::size_t i = 0; i < layout.signals.size(); ++i) {
      const model::Signal& signal = layout.signals[i];
      // What the slave offers by itself is its own affair.
      if (signal.gap() || !written_.contains({id, signal.pdo})) continue;
      bool standard = false;
      const std::uint16_t bits = BitsOfType(slave, signal, standard);
      if (bits == 0 && signal.bits == kNoBits) {
        ReportNoLength(id, layout, i, traffic.first);
        wrong = true;
      }
      if (bits == 0 || bits == signal.bits || (bits == 1 && signal.bits == 8)) continue;
      wrong = true;
      Finding finding = Found(kLength, id, traffic.first);
      finding.Set("object", arg::Object(signal.index, signal.subindex, signal.name));
      finding.Set("mapped", arg::Count(signal.bits, "bit")).Set("expected", arg::Count(bits, "bit"));
      finding.Set("pdo", arg::Object(signal.pdo));
      if (standard) finding.Set("standard", arg::Flag());
      SetFollowing(finding, layout, i, signal.bits, bits);
      AddRelated(finding, layout.since);
      const progress::AxisRecord* const differs = direction == PdoDirection::kTx ? DifferenceOf(id) : nullptr;
      if (differs != nullptr) {
        finding.Set("by_sdo", arg::Number(differs->a)).Set("by_process_data", arg::Number(differs->b));
        finding.Set("differs_frame", arg::Frame(differs->frame.number));
        AddRelated(finding, differs->frame.number);
      }
      if (standard && differs == nullptr) finding.confidence = Confidence::kInferred;
      const Severity alone = standard ? Severity::kInfo : Severity::kWarning;
      const std::uint64_t key = std::uint64_t{signal.index} << 8U | signal.subindex;
      (void)Report(key, differs != nullptr ? Severity::kError : alone, std::move(finding));
    }
    return wrong;
  }

  void ReportNoLength(SlaveId id, const model::ProcessLayout& layout, std::size_t at, const FrameRef& frame) {
    const model::Signal& signal = layout.signals[at];
    Finding finding = Found(kNoLength, id, frame);
    finding.Set("object", arg::Object(signal.index, signal.subindex, signal.name)).Set("pdo", arg::Object(signal.pdo));
    SetFollowing(finding, layout, at, 1, 0);
    AddRelated(finding, layout.since);
    (void)Report(std::uint64_t{2} << 40U | std::uint64_t{signal.index} << 8U | signal.subindex, Severity::kWarning,
                 std::move(finding));
  }

  static void SetFollowing(Finding& finding, const model::ProcessLayout& layout, std::size_t at, std::uint16_t mapped,
                           std::uint16_t expected) {
    constexpr std::size_t kMost = 4;
    std::vector<Value> following;
    for (std::size_t i = at + 1; i < layout.signals.size() && following.size() < kMost; ++i) {
      const model::Signal& signal = layout.signals[i];
      if (!signal.gap()) following.push_back(arg::Object(signal.index, signal.subindex));
    }
    if (following.empty()) return;
    finding.Set("following", arg::List(std::move(following)));
    finding.Set("shift",
                arg::Count(static_cast<std::uint64_t>(std::max(mapped, expected) - std::min(mapped, expected)), "bit"));
  }

  /// The slave's own word where there is one; 0: not known.
  static std::uint16_t BitsOfType(const model::SlaveModel& slave, const model::Signal& signal, bool& standard) {
    const std::uint16_t own = device::BitsOf(device::DataTypeFromCode(static_cast<std::uint16_t>(signal.type)));
    if (own != 0 && !signal.type_standard) return own;
    const auto axis = progress::AxisOf(signal.index);
    if (!axis || !slave.profile->drive || !slave.drives.seen()) return 0;
    const auto seen = [&](const model::DriveUnit& unit) { return unit.axis() == axis->first; };
    if (!slave.drives.Any(seen)) return 0;
    standard = true;
    for (const device::DictionaryObject& object : slave.profile->drive->objects) {
      if (object.index == axis->second && object.Covers(signal.subindex)) {
        return device::BitsOf(object.TypeOf(signal.subindex));
      }
    }
    return 0;
  }

  [[nodiscard]] const progress::AxisRecord* DifferenceOf(SlaveId id) const {
    const progress::AxisRecord* found = nullptr;
    context().progress().ForEachAxis([&](SlaveId slave, std::uint8_t, const progress::AxisWatch& axis) {
      if (slave != id || found != nullptr) return;
      found = axis.records().Find(progress::AxisFact::kModeShifted);
    });
    return found;
  }

  void ReportDifference(SlaveId id) {
    const progress::AxisRecord* const differs = DifferenceOf(id);
    if (differs == nullptr) return;
    Finding finding = Found(kDiffers, id, differs->frame);
    finding.Set("by_sdo", arg::Number(differs->a)).Set("by_process_data", arg::Number(differs->b));
    finding.Set("since_frame", arg::Frame(differs->since.number)).Set("lasted_ms", arg::Ms(differs->lasted));
    AddRelated(finding, differs->since.number);
    (void)Report(1, Severity::kWarning, std::move(finding));
  }

  static constexpr std::uint16_t kNoBits = 0xFF;
  static constexpr Word kBefore{"before", "before"};
  static constexpr Word kAfter{"after", "after"};

  std::vector<Held> held_;                               ///< by slave
  std::set<std::pair<SlaveId, std::uint16_t>> written_;  ///< mapping objects that the master wrote
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoObjectType>};

}  // namespace
}  // namespace ecaudit::pdo_object_type
