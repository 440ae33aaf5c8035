#include <algorithm>
#include <array>
#include <bitset>
#include <memory>
#include <optional>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/words/address_text.h"
#include "decoder/base/time.h"
#include "decoder/bus/direction.h"
#include "decoder/bus/two_index_sequences.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/pipeline.h"
#include "decoder/track/network.h"

namespace ecaudit::bus_second_master {
namespace {

/// The turn has to pass this number of times from one to the other and back, and the second must have this number of
/// own frames.
constexpr std::uint64_t kTurns = 3;
/// Both are active at the same time if the other one sends again within this.
constexpr std::int64_t kAtOnceNs = 1'000'000'000;
/// Two masters on one segment would not have set up the same process data side by side, so often and nearly always.
constexpr std::uint64_t kExchanged = 16;
constexpr std::uint64_t kOtherOneIn = 8;
/// ESC type: every slave has it, as it has AL status.
constexpr EscAddress kEscType = 0x0000;
/// A redundant port sends what the first one sends, at once.
constexpr std::int64_t kCopyNs = 100'000;

constexpr FindingKind kSecondMaster{
    .name = "second-master",
    .title = "A second master is active: {second_master}",
    .message = R"(Slaves answered {second_master} in {answered}, in turn with {first_master}, whose frames go
on.[ Station address {shared_station} answered both.][ {slaves} counted the broadcasts of both.] Neither master knows what
the other one writes: station addresses, AL states and mailboxes are not under the control of one master.)",
    .next = "Remove the second master from the segment.",
    .identity = "second_master"};
constexpr FindingKind kSameCard{
    .name = "same-card",
    .title = "Two masters send from one network card",
    .message = R"(The frames of {card} carry two index sequences that alternate ({turns}, from {frame} to
{last_frame}; one at {index}, the other at {other_index}). So two programs send as masters from one network card.[ {unanswered}
of one of them to station addresses returned with working counter 0, since the other one wrote the station addresses of
all slaves.][{?set_up_twice} Both gave a station address to the same slave.] Neither knows what the other one writes:
station addresses, AL states and mailboxes are not under the control of one master.)",
    .next = "Stop the second program: only one may use the network card. Look for a service that was left running.",
    .identity = "card"};
constexpr const FindingKind* kKinds[] = {&kSecondMaster, &kSameCard};

constexpr RuleInfo kInfo{.id = "bus-second-master",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "Two masters address slaves on one segment",
                         .needs = "frames of both senders that slaves took part in",
                         .source = "ETG1000.4, frame processing: a segment has one master",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether frames of two source addresses, turn by turn, are answered by slaves of one segment.

## Why it matters
Slaves do not distinguish masters. A second master (a configuration tool, a scan from a laptop, a second controller at
the same switch) overwrites station addresses, states and mailboxes of the first one. The consequences look like faults
of the slaves.

## How it is decided
Working counters above 0 show that slaves took part. The turn has to pass from one sender to the other at least three
times, each time within a second. The frames of both go on: at least three of each are answered.

- It is the same segment if the same station address answers both, or if the same number of slaves counts the broadcast
  reads of AL status or type of both.
- It is another segment if the number of slaves differs, or if both exchange process data at the same logical addresses:
  then two segments run the same program.
- A redundant port is no second master: it sends the same as the first port at the same time.
- Frames of two capture interfaces are not compared.
- Two programs can send from one network card as well. Then its frames carry two index sequences that alternate.
- One master may number its frames like that, too. So two sequences are two masters only if slaves take part in the
  frames of both, and one undoes the set-up of the other. Both give a station address to the same slave, or one writes
  the station addresses of all slaves, and the other no longer reaches those that it gave.

## Example
tests/rules/bus-second-master/violates.trace

## What to do
Find the device with the second address (its first three bytes name the manufacturer of the network card), and remove it
from the segment. If the recorder joins two segments with the same addresses on one interface, record each alone.
)"};

constexpr Word kSegment{"segment-of-second-sender", "the segment of the second sender"};
constexpr Word kSameSegment{"same-segment", "whether two senders are on one segment"};

/// Place and size of process data; never 0.
std::uint64_t ImageOf(const wire::DatagramView& datagram) {
  return std::uint64_t{1} << 63U | static_cast<std::uint64_t>(datagram.length()) << 40U |
         static_cast<std::uint64_t>(datagram.command_byte()) << 32U | datagram.logical_address();
}

/// What the slaves' answers to one sender show.
struct Sender {
  std::uint64_t mac = 0;
  std::uint16_t interface_index = 0;
  FrameRef first;
  FrameRef last;
  std::uint64_t answered = 0;
  std::uint64_t copies = 0;               ///< frames that the other one sent at the same time
  std::uint64_t exchanged = 0;            ///< datagrams with process data
  std::array<std::uint64_t, 8> images{};  ///< where the last ones of these lie
  std::uint64_t key = 0;                  ///< of the last frame
  std::uint64_t sent = 0;                 ///< frames on their way out ...
  std::uint64_t echoes = 0;               ///< ... that the other one had sent just before
  std::bitset<65536> stations;
  std::optional<std::uint16_t> slaves;  ///< that count a broadcast read of what each ESC has

  [[nodiscard]] bool OnlyEchoes() const { return sent > 0 && echoes * 2 >= sent; }
  void Add(const wire::FrameView& frame) {
    if (answered++ == 0) first = frame.ref();
    last = frame.ref();
    key = frame.key();
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const wire::DatagramView datagram = frame[i];
      if (datagram.wkc() == 0) continue;
      if (wire::IsLogical(datagram.command())) images[exchanged++ % images.size()] = ImageOf(datagram);
      if (wire::IsNodeAddressed(datagram.command())) stations.set(datagram.adp());
      const bool of_all =
          datagram.command() == wire::Command::BRD && (datagram.ado() == esc::kAlStatus || datagram.ado() == kEscType);
      if (of_all) slaves = std::max(slaves.value_or(0), datagram.wkc());
    }
  }
};

class BusSecondMaster final : public Rule {
 public:
  BusSecondMaster() : Rule(kInfo) { Subscribe<FrameSeen>(&BusSecondMaster::On); }

  void On(const FrameSeen& e) {
    if (e.frame.empty()) return;
    const std::uint64_t mac = e.frame.sender();
    if (e.direction == bus::Direction::kOutbound) {
      FollowSent(mac, e.frame);
      sequences_.FollowSent(e.frame);
      if (sequences_.turns() >= kTurns) FollowTurns(mac);
      return;
    }
    sequences_.FollowReturned(e.frame);
    if (mac == first_mac_ && second_ == nullptr) {
      last_of_first_ = e.frame.ref();
      return;
    }
    if (!bus::AnyWorkingCounter(e.frame)) return;
    // The first answers may be those of the bus of another interface, which is not evaluated.
    const bool foreign = e.direction == bus::Direction::kForeign;
    if (first_is_foreign_ && !foreign && second_ == nullptr && e.frame.interface_index() != first_interface_) {
      first_mac_ = kNoSender;
    }
    if (first_mac_ == kNoSender) {
      first_mac_ = mac;
      first_is_foreign_ = foreign;
      first_interface_ = e.frame.interface_index();
      last_of_first_ = e.frame.ref();
      return;
    }
    if (e.frame.interface_index() != first_interface_) return;
    if (second_ == nullptr) Begin(mac);
    Sender* sender = mac == first_->mac ? first_.get() : mac == second_->mac ? second_.get() : nullptr;
    if (sender != nullptr) Add(*sender, e.frame);
  }

  void Finish() override {
    if (same_card_ != kNoFinding) {
      Finding& finding = context().store[same_card_];
      finding.last = last_turn_;
      finding.Set("turns", arg::Count(finding.count, "time"));
    }
    if (second_ == nullptr) return;
    // Polls of one sender that are those of the other may meet by chance; those of a redundant port always do.
    if (second_->OnlyEchoes() || first_->OnlyEchoes()) return;
    if (second_->copies * 2 >= second_->answered || turns_ < kTurns || second_->answered < kTurns) return;
    if (first_->answered < kTurns) return;  // its frames do not go on
    if (first_->slaves && second_->slaves && *first_->slaves != *second_->slaves) return;
    if (first_->exchanged >= kExchanged && second_->exchanged >= kExchanged &&
        (second_->exchanged - same_images_) * kOtherOneIn <= second_->exchanged) {
      NotEvaluable(kNoSlave, ReasonCode::kAmbiguous, kSegment);
      return;
    }
    const std::bitset<65536> shared = first_->stations & second_->stations;
    const bool same_number = first_->slaves && first_->slaves == second_->slaves;
    if (shared.none() && !same_number) return NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, kSameSegment);
    Finding finding = Found(kSecondMaster, kNoSlave, second_->first);
    finding.confidence = Confidence::kInferred;
    finding.last = second_->last;
    finding.count = second_->answered;
    finding.Set("answered", arg::Count(second_->answered, "frame"));
    if (shared.any()) {
      std::size_t station = 0;
      while (!shared.test(station)) ++station;
      finding.Set("shared_station", arg::Hex(station))
          .Set("shared_stations", arg::Number(static_cast<std::int64_t>(shared.count())));
    } else {
      finding.Set("slaves", arg::Count(*second_->slaves, "slave"));
    }
    finding.Set("first_master", arg::Text(AddressText(first_->mac)))
        .Set("second_master", arg::Text(AddressText(second_->mac)))
        .Set("turns", arg::Number(static_cast<std::int64_t>(turns_)));
    AddRelated(finding, before_second_.number);
    Report(0, std::move(finding));
  }

 private:
  /// An Ethernet address has fewer bits.
  static constexpr std::uint64_t kNoSender = ~std::uint64_t{0};

  void Begin(std::uint64_t mac) {
    first_ = std::make_unique<Sender>();
    second_ = std::make_unique<Sender>();
    first_->mac = first_mac_;
    second_->mac = mac;
    first_->last = before_second_ = last_of_first_;
    // All that is known of the bus up to here comes from answers to the first one.
    const track::Network& network = context().network();
    for (std::size_t s = 0; s < network.slaves().size(); ++s) {
      const std::uint16_t* station = network.slaves()[static_cast<SlaveId>(s)].station.if_known();
      if (station != nullptr) first_->stations.set(*station);
    }
    if (const std::uint16_t* count = network.slave_count().if_known()) first_->slaves = *count;
  }

  /// While a redundant line is broken, slaves answer one of its ports only. Equal sent frames show that both are ports.
  void FollowSent(std::uint64_t mac, const wire::FrameView& frame) {
    Sender* sender = second_ == nullptr    ? nullptr
                     : mac == second_->mac ? second_.get()
                     : mac == first_->mac  ? first_.get()
                                           : nullptr;
    if (sender != nullptr) {
      ++sender->sent;
      const bool echo = sent_by_ != mac && sent_key_ == frame.key() && Within(sent_, frame.ref(), kCopyNs);
      if (echo) ++sender->echoes;
    }
    sent_by_ = mac;
    sent_key_ = frame.key();
    sent_ = frame.ref();
  }

  void Add(Sender& sender, const wire::FrameView& frame) {
    Sender& other = &sender == first_.get() ? *second_ : *first_;
    if (other.last.seen() && &sender != turn_) {
      if (&sender == second_.get() && Within(other.last, frame.ref(), kAtOnceNs)) ++turns_;
      turn_ = &sender;
    }
    if (other.answered > 0 && other.key == frame.key() && Within(other.last, frame.ref(), kCopyNs)) {
      ++(&sender == second_.get() ? sender : other).copies;
    }
    for (std::size_t i = 0; &sender == second_.get() && i < frame.size(); ++i) {
      const wire::DatagramView datagram = frame[i];
      if (datagram.wkc() == 0 || !wire::IsLogical(datagram.command())) continue;
      const std::uint64_t image = ImageOf(datagram);
      if (std::ranges::find(other.images, image) != other.images.end()) ++same_images_;
    }
    sender.Add(frame);
  }

  /// Two index sequences alternate.
  void FollowTurns(std::uint64_t mac) {
    if (sequences_.turns() == turns_seen_ || second_ != nullptr) return;
    turns_seen_ = sequences_.turns();
    if (!Within(sequences_.other().last, sequences_.current().last, kAtOnceNs)) return;
    last_turn_ = sequences_.current().last;
    if (same_card_ != kNoFinding) {
      ++context().store[same_card_].count;
      return;
    }
    const bool collide = sequences_.Collide();
    if (!collide && !sequences_.SetUpTwice()) return;
    Finding finding = Found(kSameCard, kNoSlave, sequences_.later().began);
    if (!collide) finding.confidence = Confidence::kInferred;
    finding.last = last_turn_;
    finding.count = turns_seen_;
    finding.Set("card", arg::Text(AddressText(mac)))
        .Set("index", arg::Hex(sequences_.current().first_index, 2))
        .Set("other_index", arg::Hex(sequences_.other().first_index, 2))
        .Set("set_up_twice", arg::Flag(sequences_.SetUpTwice()));
    if (collide) {
      finding.Set("unanswered", arg::Count(sequences_.unanswered(), "frame"));
    }
    AddRelated(finding, sequences_.other().last.number);
    AddRelated(finding, last_turn_.number);
    same_card_ = Report(kSameCardKey, std::move(finding));
  }

  static bool Within(const FrameRef& a, const FrameRef& b, std::int64_t limit) {
    return a.has_time && b.has_time && Elapsed(a.time, b.time) <= limit;
  }

  static constexpr std::uint64_t kSameCardKey = 1;
  bus::TwoIndexSequences sequences_;
  std::uint64_t turns_seen_ = 0;
  FrameRef last_turn_;
  FindingIndex same_card_ = kNoFinding;
  std::uint64_t first_mac_ = kNoSender;
  bool first_is_foreign_ = false;
  std::uint16_t first_interface_ = 0;
  FrameRef last_of_first_, before_second_;
  std::uint64_t sent_by_ = kNoSender;  ///< of the last outbound frame: its sender, ...
  std::uint64_t sent_key_ = 0;         ///< ... key ...
  FrameRef sent_;                      ///< ... and number
  std::unique_ptr<Sender> first_, second_;
  const Sender* turn_ = nullptr;
  std::uint64_t same_images_ = 0;  ///< process data of the second one where those of the first one lie
  std::uint64_t turns_ = 0;        ///< from the first to the second
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusSecondMaster>};

}  // namespace
}  // namespace ecaudit::bus_second_master
