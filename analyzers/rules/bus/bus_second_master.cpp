#include <algorithm>
#include <array>
#include <bitset>
#include <memory>
#include <optional>
#include <string>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/bus/direction.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/pipeline.h"
#include "decoder/track/network.h"

namespace ecaudit::bus_second_master {
namespace {

/// So often the word has to go from one to the other and back, and so many frames of the second have to be its own.
constexpr std::uint64_t kTurns = 3;
/// Both are at work at the same time where the other one is heard of again within this.
constexpr std::int64_t kAtOnceNs = 1'000'000'000;
/// Two masters on one segment would not have set up the same process data side by side, so often and nearly always.
constexpr std::uint64_t kExchanged = 16;
constexpr std::uint64_t kOtherOneIn = 8;
/// ESC type: every slave has it, as it has AL status.
constexpr EscAddress kEscType = 0x0000;
/// A redundant port sends what the first one sends, at once.
constexpr std::int64_t kCopyNs = 100'000;

constexpr RuleInfo kInfo{.id = "bus-second-master",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .title = "Two masters address slaves on one segment",
                         .needs = "frames of both senders that slaves took part in",
                         .source = "ETG1000.4, frame processing: a segment has one master",
                         .doc = R"(
## What it checks
Frames of two source addresses, turn by turn, that slaves of one segment took part in.

## Why it matters
Slaves do not know who asks. A second master (a configuration tool, a scan from a laptop, a second controller in the
same switch) writes over station addresses, states and mailboxes of the first one; what falls out looks like a fault of
the slaves.

## How it is decided
Working counters above 0 show that slaves took part. The turn has to pass from one sender to the other three times at
least, each within a second. It is the same segment where the same station address answers both, or where equally many
slaves count their broadcast reads of AL status or type; where other numbers of slaves count them it is another segment,
and so it is where both exchange process data at the same logical addresses: equal programs of two segments.
A redundant port is none: what it sends is what the first one sends, at the same time. Frames of two capture interfaces
are not compared.

## Example
tests/rules/bus-second-master/violates.trace

## What to do
Look who has the second address (its first three bytes name the manufacturer of the network card), and take it off the
segment. If the recorder joins two segments with the same addresses on one interface, record each alone.
)"};

std::string NameOf(std::uint64_t mac) {
  std::array<std::uint8_t, 6> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(mac >> (40U - 8U * i) & 0xFFU);
  return MacText(bytes);
}

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
  void Took(const wire::FrameView& frame) {
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
    const std::uint64_t mac = bus::SenderOf(e.frame);
    if (e.direction == bus::Direction::kOutbound) {
      FollowSent(mac, e.frame);
      return;
    }
    if (mac == first_mac_ && second_ == nullptr) {
      last_of_first_ = e.frame.ref();
      return;
    }
    if (!bus::AnyWorkingCounter(e.frame)) return;
    if (first_mac_ == kNobody) {
      first_mac_ = mac;
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
    if (second_ == nullptr) return;
    // Polls of one sender that are those of the other may meet by chance; those of a redundant port always do.
    if (second_->OnlyEchoes() || first_->OnlyEchoes()) return;
    if (second_->copies * 2 >= second_->answered || turns_ < kTurns || second_->answered < kTurns) return;
    if (first_->slaves && second_->slaves && *first_->slaves != *second_->slaves) return;
    if (first_->exchanged >= kExchanged && second_->exchanged >= kExchanged &&
        (second_->exchanged - same_images_) * kOtherOneIn <= second_->exchanged) {
      NotEvaluable(kNoSlave, "slaves exchange process data with " + NameOf(first_->mac) + " and " +
                                 NameOf(second_->mac) +
                                 " at the same logical addresses: most likely each has a segment of its own");
      return;
    }
    const std::bitset<65536> shared = first_->stations & second_->stations;
    const bool same_number = first_->slaves && first_->slaves == second_->slaves;
    if (shared.none() && !same_number) {
      NotEvaluable(kNoSlave, "slaves answered " + NameOf(first_->mac) + " and " + NameOf(second_->mac) +
                                 ", and nothing shows whether these are on one segment");
      return;
    }
    Finding finding;
    finding.confidence = Confidence::kInferred;
    finding.first = second_->first;
    finding.last = second_->last;
    finding.count = second_->answered;
    finding.title = "A second master at work: " + NameOf(second_->mac);
    finding.message = "Slaves answered " + NameOf(second_->mac) + " in " + Count(second_->answered, "frame") +
                      ", in turn with " + NameOf(first_->mac) + ", whose frames go on; ";
    if (shared.any()) {
      std::size_t station = 0;
      while (!shared.test(station)) ++station;
      finding.message += "station address " + Hex(station, 4) + " answered both";
      finding.evidence.push_back(Number("shared_stations", static_cast<std::int64_t>(shared.count())));
    } else {
      finding.message += Count(*second_->slaves, "slave") + " counted the broadcasts of both";
    }
    finding.message +=
        ". What one writes the other does not know of: station addresses, AL states and mailboxes are "
        "no longer one master's. Take the second one off the segment.";
    AddRelated(finding, before_second_.number);
    finding.evidence.push_back(Text("first_master", NameOf(first_->mac)));
    finding.evidence.push_back(Text("second_master", NameOf(second_->mac)));
    finding.evidence.push_back(Number("turns", static_cast<std::int64_t>(turns_)));
    Report(0, std::move(finding));
  }

 private:
  /// No Ethernet address has so many bits.
  static constexpr std::uint64_t kNobody = ~std::uint64_t{0};

  void Begin(std::uint64_t mac) {
    first_ = std::make_unique<Sender>();
    second_ = std::make_unique<Sender>();
    first_->mac = first_mac_;
    second_->mac = mac;
    first_->last = before_second_ = last_of_first_;
    // What is known of the bus up to here the slaves told the first one.
    const track::Network& network = context().network();
    for (std::size_t s = 0; s < network.slaves().size(); ++s) {
      const std::uint16_t* station = network.slaves()[static_cast<SlaveId>(s)].station.if_known();
      if (station != nullptr) first_->stations.set(*station);
    }
    if (const std::uint16_t* count = network.slave_count().if_known()) first_->slaves = *count;
  }

  /// While a redundant line is broken, slaves answer one of its ports only: that both sent the same tells.
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
      if (std::find(other.images.begin(), other.images.end(), image) != other.images.end()) ++same_images_;
    }
    sender.Took(frame);
  }

  static bool Within(const FrameRef& a, const FrameRef& b, std::int64_t limit) {
    return a.has_time && b.has_time && Elapsed(a.time, b.time) <= limit;
  }

  std::uint64_t first_mac_ = kNobody;
  std::uint16_t first_interface_ = 0;
  FrameRef last_of_first_, before_second_;
  std::uint64_t sent_by_ = kNobody;  ///< of the last outbound frame: its sender, ...
  std::uint64_t sent_key_ = 0;       ///< ... key ...
  FrameRef sent_;                    ///< ... and number
  std::unique_ptr<Sender> first_, second_;
  const Sender* turn_ = nullptr;
  std::uint64_t same_images_ = 0;  ///< process data of the second one where those of the first one lie
  std::uint64_t turns_ = 0;        ///< from the first to the second
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusSecondMaster>};

}  // namespace
}  // namespace ecaudit::bus_second_master
