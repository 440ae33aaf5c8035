#include "analyzers/model/slot_modules.h"

#include <utility>

#include "decoder/base/bytes.h"

namespace ecaudit::model {

void SlotModules::Apply(const mailbox::SdoTransfer& transfer) {
  if (!transfer.has_object || !IsList(transfer.index) || transfer.outcome != mailbox::SdoOutcome::kCompleted ||
      transfer.data_gap || transfer.size_mismatch || transfer.data.empty()) {
    return;
  }
  // The detected list cannot be written; an attempt shows nothing of the slots.
  const bool download = transfer.service == mailbox::SdoService::kDownload;
  if (!download && transfer.service != mailbox::SdoService::kUpload) return;
  if (download && transfer.index == kDetected) return;
  List& list = transfer.index == kConfigured ? configured_ : detected_;
  changed_ = true;
  const FrameNo since = transfer.last.number;
  if (!transfer.complete_access) {
    if (transfer.subindex == 0) {
      list.count = transfer.data[0];
      list.count_since = since;
    } else if (transfer.data.size() == 4) {
      list.entries[transfer.subindex] = {LittleEndian<std::uint32_t>(transfer.data, 0), since};
    }
    return;
  }
  // Subindex 0 comes with a byte of padding.
  const std::size_t begin = transfer.subindex == 0 ? 2 : 0;
  list.entries.clear();
  list.count.reset();
  if (transfer.subindex == 0) {
    list.count = transfer.data[0];
    list.count_since = since;
  }
  std::uint8_t subindex = 0;
  for (std::size_t at = begin; Fits(transfer.data, at, 4) && subindex < 0xFF; at += 4) {
    list.entries[++subindex] = {LittleEndian<std::uint32_t>(transfer.data, at), since};
  }
}

std::optional<std::vector<std::uint32_t>> SlotModules::List::Idents() const {
  if (!count) return std::nullopt;
  std::vector<std::uint32_t> idents;
  for (unsigned subindex = 1; subindex <= *count; ++subindex) {
    const auto entry = entries.find(static_cast<std::uint8_t>(subindex));
    if (entry == entries.end()) return std::nullopt;
    idents.push_back(entry->second.ident);
  }
  return idents;
}

std::optional<std::vector<std::uint32_t>> SlotModules::Idents() const {
  auto idents = configured_.Idents();
  // Its length is 0 while a master writes the list again.
  if (idents && !idents->empty()) return idents;
  if (auto detected = detected_.Idents()) return detected;
  return idents;
}

bool SlotModules::TakeChanged() {
  return std::exchange(changed_, false);
}

}  // namespace ecaudit::model
