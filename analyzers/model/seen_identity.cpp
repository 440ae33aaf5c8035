#include "analyzers/model/seen_identity.h"

#include <array>
#include <optional>
#include <utility>

#include "decoder/base/bytes.h"

namespace ecaudit::model {
namespace {

constexpr std::uint16_t kIdentityObject = 0x1018;
constexpr std::uint16_t kDeviceName = 0x1008;
constexpr std::size_t kLongestName = 128;  // bytes; names of devices are much shorter

bool IsWholeAnswer(const mailbox::SdoTransfer& transfer) {
  return transfer.service == mailbox::SdoService::kUpload && transfer.outcome == mailbox::SdoOutcome::kCompleted &&
         !transfer.data_gap;
}

}  // namespace

bool SeenIdentity::Learn(const track::IdentityLearned& event) {
  const auto differs = [](const auto& a, const auto& b) { return a && b && *a != *b; };
  const bool other = differs(known_.vendor_id, event.vendor_id) || differs(known_.product_code, event.product_code);
  if (other) known_.model.clear();
  const auto take = [](auto& to, const auto& from) {
    if (from) to = from;
  };
  take(known_.vendor_id, event.vendor_id);
  take(known_.product_code, event.product_code);
  take(known_.revision, event.revision);
  take(known_.serial, event.serial);
  known_.frame = event.frame;
  known_.source = event.source;
  return other;
}

bool SeenIdentity::Learn(const mailbox::SdoTransfer& transfer) {
  if (!transfer.has_object || !IsWholeAnswer(transfer)) return false;
  if (transfer.index == kIdentityObject) return LearnNumbers(transfer);
  return transfer.index == kDeviceName && LearnName(transfer);
}

/// Object 1018h shows what the EEPROM did not.
bool SeenIdentity::LearnNumbers(const mailbox::SdoTransfer& transfer) {
  if (transfer.size_mismatch) return false;
  const bool by_object = known_.source == track::IdentityLearned::Source::kObject1018;
  const bool first = !known_.vendor_id && !known_.product_code && !known_.revision && !known_.serial;
  const auto product = known_.product_code;
  bool learned = false;
  const auto learn = [&](std::optional<std::uint32_t>& to, std::size_t at) {
    if (!Fits(transfer.data, at, 4)) return;
    const auto value = LittleEndian<std::uint32_t>(transfer.data, at);
    if (to == value || (to && !by_object)) return;
    to = value;
    learned = true;
  };
  const std::array fields{&known_.vendor_id, &known_.product_code, &known_.revision, &known_.serial};
  if (transfer.complete_access) {
    // Subindex 0 comes with a byte of padding.
    const std::size_t begin = transfer.subindex == 0 ? 2 : 0;
    for (std::size_t i = 0; i < fields.size(); ++i) learn(*fields[i], begin + 4 * i);
  } else if (transfer.subindex >= 1 && transfer.subindex <= fields.size() && transfer.data.size() == 4) {
    learn(*fields[transfer.subindex - 1U], 0);
  }
  // The family hangs on the product.
  if (learned && (first || by_object || known_.product_code != product)) {
    known_.source = track::IdentityLearned::Source::kObject1018;
    known_.frame = transfer.response;
  }
  return learned;
}

/// Object 1008h, the manufacturer's name of the device.
bool SeenIdentity::LearnName(const mailbox::SdoTransfer& transfer) {
  if (transfer.complete_access || transfer.data.size() > kLongestName || !known_.model.empty()) return false;
  std::string name(transfer.data.begin(), transfer.data.end());
  while (!name.empty() && (name.back() == '\0' || name.back() == ' ')) name.pop_back();
  return LearnModel(std::move(name), transfer.response);
}

bool SeenIdentity::LookInto(const esc::SiiImage& eeprom) {
  if (!eeprom_read_.seen() || looks_ >= kLooks || !known_.model.empty()) return false;
  ++looks_;
  const FrameRef read = std::exchange(eeprom_read_, {});
  return LearnModel(esc::ParseSii(eeprom).VendorText(esc::kSiiVendorCategory), read);
}

bool SeenIdentity::LearnModel(std::string model, const FrameRef& frame) {
  if (model.empty() || known_.model == model) return false;
  known_.model = std::move(model);
  if (!known_.frame.seen()) known_.frame = frame;
  return true;
}

}  // namespace ecaudit::model
