#include "analyzers/model/object_values.h"

namespace ecaudit::model {

void ObjectValues::Apply(const mailbox::SdoTransfer& transfer) {
  if (!transfer.has_object || transfer.complete_access || transfer.data_gap || transfer.size_mismatch) return;
  const bool written = transfer.service == mailbox::SdoService::kDownload;
  const bool assumed = transfer.outcome == mailbox::SdoOutcome::kNotCaptured && written;
  if (transfer.outcome != mailbox::SdoOutcome::kCompleted && !assumed) return;
  if (transfer.data.empty() || transfer.size != transfer.data.size() || transfer.size > 8) return;
  const auto key = std::pair(transfer.index, transfer.subindex);
  const bool is_new = values_.find(key) == values_.end();
  if (is_new && (values_.size() >= kMaxObjects || !TakeFrom(objects_, 1))) return;
  ObjectValue& value = values_[key];
  value.raw = UnsignedOf(transfer.data);
  value.bytes = static_cast<std::uint8_t>(transfer.size);
  value.written = written;
  value.certainty = assumed ? Certainty::kInferred : Certainty::kObserved;
  value.since = transfer.response.seen() ? transfer.response.number : transfer.request.number;
}

void ObjectValues::Forget(std::uint16_t index, std::uint8_t subindex) {
  if (values_.erase({index, subindex}) > 0 && objects_ != nullptr) objects_->GiveBack(1);
}

void ObjectValues::Clear() {
  if (objects_ != nullptr) objects_->GiveBack(values_.size());
  values_.clear();
}

const ObjectValue* ObjectValues::Find(std::uint16_t index, std::uint8_t subindex) const {
  const auto found = values_.find({index, subindex});
  return found == values_.end() ? nullptr : &found->second;
}

}  // namespace ecaudit::model
