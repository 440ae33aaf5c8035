#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/options/device_files.h"
#include "analyzers/options/options.h"
#include "decoder/base/time.h"
#include "decoder/bus/slave_set.h"
#include "decoder/device/eni_reader.h"
#include "decoder/esc/al.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"
#include "decoder/track/sii_tracker.h"

namespace ecaudit::identity_repeated {
namespace {

/// A scan reads the identity once, and some masters twice or three times.
constexpr std::uint64_t kEnoughReads = 6;
constexpr TimeNs kLongEnough = 2'000'000'000;
constexpr std::uint32_t kVendorWord = 0x0008;
constexpr std::size_t kIdentityWords = 4;  // vendor ID and product code

constexpr FindingKind kRepeated{
    .name = "repeated",
    .title =
        "[{?expected_vendor}Identity is {vendor}, {product}, not {expected_vendor}, {expected_product}]"
        "[{!expected_vendor}Identity read {reads} in INIT: maybe not the expected device]",
    .message =
        R"(From {frame} to {last_frame} ({lasted_ms}) the master reads the identity in the EEPROM {reads}. The answer is
always vendor {vendor}, product {product}. The master requests no state above INIT.[ The ENI has vendor
{expected_vendor}, product {expected_product} at this place.] A master does this if it does not find the device of its
configuration.)",
    .next =
        "Compare vendor ID and product code with the configuration of the master, and the order of the slaves on the "
        "bus.",
    .identity = "vendor product"};
constexpr const FindingKind* kKinds[] = {&kRepeated};

constexpr RuleInfo kInfo{.id = "identity-repeated",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .subject = Subject::kEeprom,
                         .title = "The master reads the identity of a slave again and again, and requests no state",
                         .needs = "the identity in the EEPROM (words 0x0008 to 0x000B), read in the capture",
                         .source = "ETG1000.4, slave information interface",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether a master that reads the identity of a slave goes on to PREOP.

## Why it matters
The bus works and the slave answers, but its device is not the one that the master is configured for. The master stays
in INIT and tries again. Nothing on the bus is wrong by itself, so no slave reports an error.

## How it is decided
- The master reads vendor ID and product code at least 6 times within at least 2 s, and the answer is always the same.
- The slave is in INIT, and the master requests no higher state of it in the whole capture.
- A blank identity belongs to eeprom-invalid.
- With an ENI file that has another device at this place, the finding names both. Without one it is inferred.

## Example
tests/rules/identity-repeated/violates.trace

## What to do
Compare vendor ID, product code and revision with the configuration of the master. Two slaves may have changed places.
)"};

class IdentityRepeated final : public Rule {
 public:
  IdentityRepeated() : Rule(kInfo) {
    Subscribe<track::EepromRead>(&IdentityRepeated::On);
    Subscribe<track::AlRequest>(&IdentityRepeated::On);
    Subscribe<track::AlRequestOfAll>(&IdentityRepeated::On);
  }

  void On(const track::EepromRead& e) {
    if (e.address >= kVendorWord + kIdentityWords || e.address + e.words.size() <= kVendorWord) return;
    Slave& slave = slaves_[e.slave];
    for (std::size_t i = 0; i < e.words.size(); ++i) {
      const std::uint32_t word = e.address + static_cast<std::uint32_t>(i);
      if (word < kVendorWord || word >= kVendorWord + kIdentityWords) continue;
      std::optional<std::uint16_t>& known = slave.words.at(word - kVendorWord);
      if (known && *known != e.words[i]) slave.differs = true;
      known = e.words[i];
      if (word != kVendorWord) continue;
      if (slave.reads++ == 0) slave.first = e.frame;
      slave.last = e.frame;
    }
  }
  void On(const track::AlRequest& e) {
    if (LeadsOn(e.control)) slaves_[e.slave].goes_on = true;
  }
  void On(const track::AlRequestOfAll& e) { all_go_on_ = all_go_on_ || LeadsOn(e.control); }

  void Finish() override {
    if (NotEvaluableWithoutReturns() || NotEvaluableWithoutSent() || all_go_on_) return;
    for (const auto& [id, slave] : slaves_) Evaluate(id, slave);
  }

 private:
  struct Slave {
    std::array<std::optional<std::uint16_t>, kIdentityWords> words;
    std::uint64_t reads = 0;
    FrameRef first, last;
    bool differs = false;  ///< another answer at another time
    bool goes_on = false;  ///< the master requested a state above INIT
  };

  static bool LeadsOn(const esc::AlWord& control) {
    return control.state() != 0 && control.state() != static_cast<std::uint8_t>(esc::AlState::INIT);
  }

  void Evaluate(SlaveId id, const Slave& slave) {
    if (slave.goes_on || slave.differs || slave.reads < kEnoughReads) return;
    if (!slave.first.has_time || !slave.last.has_time) return;
    const TimeNs lasted = Elapsed(slave.first.time, slave.last.time);
    if (lasted < kLongEnough) return;
    const auto vendor = Dword(slave, 0), product = Dword(slave, 2);
    if (!vendor || !product || IsBlank(*vendor, *product)) return;
    const auto state = context().network().state(id).al_status.if_known();
    if (state && state->state() != static_cast<std::uint8_t>(esc::AlState::INIT)) return;
    Finding finding = Found(kRepeated, id, slave.first);
    finding.last = slave.last;
    finding.Set("vendor", arg::Hex(*vendor, 8))
        .Set("product", arg::Hex(*product, 8))
        .Set("reads", arg::Count(slave.reads, "time"))
        .Set("lasted_ms", arg::Ms(lasted));
    const device::EniSlave* eni = Configured(id);
    const bool other = eni != nullptr && eni->vendor_id && eni->product_code &&
                       (*eni->vendor_id != *vendor || *eni->product_code != *product);
    if (other) {
      finding.Set("expected_vendor", arg::Hex(*eni->vendor_id, 8))
          .Set("expected_product", arg::Hex(*eni->product_code, 8));
    } else {
      finding.confidence = Confidence::kInferred;
    }
    Report(0, other ? Severity::kError : Severity::kWarning, std::move(finding));
  }

  /// What the ENI has at this place, also if it is another device.
  [[nodiscard]] const device::EniSlave* Configured(SlaveId id) const {
    const auto& files = context().options().files;
    if (files == nullptr || !files->eni) return nullptr;
    const device::EniConfig& config = files->eni->content;
    const bus::SlaveAddress& address = context().network().slaves()[id];
    if (const StationAddress* station = address.station.if_known()) {
      if (const device::EniSlave* slave = config.FindByAddress(*station)) return slave;
    }
    const SlavePos* position = address.position.if_known();
    return position != nullptr ? config.FindByPosition(*position) : nullptr;
  }

  static std::optional<std::uint32_t> Dword(const Slave& slave, std::size_t word) {
    const auto& low = slave.words.at(word);
    const auto& high = slave.words.at(word + 1);
    if (!low || !high) return std::nullopt;
    return std::uint32_t{*low} | std::uint32_t{*high} << 16U;
  }
  static bool IsBlank(std::uint32_t vendor, std::uint32_t product) {
    constexpr std::uint32_t kErased = 0xFFFF'FFFF;
    return (vendor == kErased && product == kErased) || (vendor == 0 && product == 0);
  }

  std::map<SlaveId, Slave> slaves_;
  bool all_go_on_ = false;
};

const RuleRegistration kRegistration{kInfo, MakeRule<IdentityRepeated>};

}  // namespace
}  // namespace ecaudit::identity_repeated
