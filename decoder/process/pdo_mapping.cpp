#include "decoder/process/pdo_mapping.h"

#include <algorithm>

#include "decoder/base/bytes.h"

namespace ecaudit::process {
namespace {

/// Up to four bytes, little endian.
std::uint32_t Value(ByteSpan bytes) {
  return static_cast<std::uint32_t>(UnsignedOf(Slice(bytes, 0, 4)));
}

}  // namespace

std::vector<PdoValue> PdoValuesOf(const mailbox::SdoTransfer& transfer) {
  std::vector<PdoValue> values;
  if (transfer.data.empty()) return values;
  if (!transfer.complete_access) {
    values.push_back({transfer.subindex, Value(transfer.data)});
    return values;
  }
  const std::size_t width = IsAssignment(transfer.index) ? 2 : 4;
  ByteSpan rest = transfer.data;
  unsigned subindex = transfer.subindex;
  if (subindex == 0) {
    values.push_back({0, rest[0]});
    rest = Slice(rest, 2);
    subindex = 1;
  }
  for (; subindex <= 255 && rest.size() >= width; ++subindex, rest = rest.subspan(width)) {
    values.push_back({static_cast<std::uint8_t>(subindex), Value(rest.first(width))});
  }
  return values;
}

std::optional<std::vector<std::uint32_t>> PdoObject::Contents() const {
  const std::uint8_t* known_count = count.if_known();
  if (known_count == nullptr) return std::nullopt;
  std::vector<std::uint32_t> contents;
  contents.reserve(*known_count);
  for (unsigned i = 1; i <= *known_count; ++i) {
    const auto value = values.find(static_cast<std::uint8_t>(i));
    if (value == values.end()) return std::nullopt;
    contents.push_back(value->second);
  }
  return contents;
}

std::uint8_t PdoObject::left_out() const {
  std::uint8_t next = 1;
  for (const auto& [subindex, value] : values) {
    if (subindex != next) return next;
    if (subindex == UINT8_MAX) break;
    ++next;
  }
  return 0;
}

bool PdoMapping::Apply(const mailbox::SdoTransfer& transfer) {
  constexpr std::uint32_t kNoObject = 0x06020000;
  if (!transfer.has_object || !IsPdoObject(transfer.index)) return false;
  const bool aborted = transfer.outcome == mailbox::SdoOutcome::kAborted &&
                       transfer.aborted_by == mailbox::Direction::kIn && transfer.abort_code == kNoObject;
  if (aborted && transfer.service == mailbox::SdoService::kUpload && missing_.size() < kMaxMissing) {
    if (MissingSince(transfer.index) == nullptr) missing_.push_back({transfer.index, transfer.last.number});
  }
  if (transfer.data_gap || transfer.data.empty()) return false;
  Certainty certainty = Certainty::kObserved;
  if (transfer.outcome == mailbox::SdoOutcome::kNotCaptured && transfer.service == mailbox::SdoService::kDownload) {
    certainty = Certainty::kInferred;
  } else if (transfer.outcome != mailbox::SdoOutcome::kCompleted) {
    return false;
  }
  const FrameNo frame = transfer.response.seen() ? transfer.response.number : transfer.request.number;
  std::erase_if(missing_, [&](const Missing& missing) { return missing.pdo == transfer.index; });
  bool changed = false;
  for (const PdoValue& value : PdoValuesOf(transfer)) {
    changed |= Set(transfer.index, value.subindex, value.value, certainty, frame);
  }
  return changed;
}

bool PdoMapping::Set(std::uint16_t index, std::uint8_t subindex, std::uint32_t value, Certainty certainty,
                     FrameNo frame) {
  const auto known = [&](std::uint8_t v) {
    return certainty == Certainty::kObserved ? Known<std::uint8_t>::Observed(v, frame)
                                             : Known<std::uint8_t>::Inferred(v, frame);
  };
  const bool is_new = objects_.find(index) == objects_.end();
  if (is_new && (values_ >= kMaxValues || !TakeFrom(allowance_, 1))) return false;
  PdoObject& object = objects_[index];
  if (subindex == 0) {
    const std::uint8_t* before = object.count.if_known();
    const auto count = static_cast<std::uint8_t>(value);
    const bool changed = before == nullptr || *before != count;
    object.count = known(count);
    object.count_lost = false;
    if (!changed) return false;
  } else {
    const auto before = object.values.find(subindex);
    if (before != object.values.end() && before->second == value) return false;
    if (before == object.values.end()) {
      if (values_ >= kMaxValues || !TakeFrom(allowance_, 1)) return false;
      ++values_;
    }
    object.values[subindex] = value;
  }
  object.since = frame;
  ++version_;
  return true;
}

bool PdoMapping::Forget(std::uint16_t index, std::uint8_t subindex, bool whole) {
  const auto found = objects_.find(index);
  if (found == objects_.end()) return false;
  PdoObject& object = found->second;
  bool known = false;
  if (whole || subindex == 0) {
    known = object.count.if_known() != nullptr;
    object.count = {};
    object.count_lost = true;
  }
  if (whole || subindex != 0) {
    const std::size_t before = object.values.size();
    if (whole) {
      object.values.clear();
    } else {
      object.values.erase(subindex);
    }
    const std::size_t gone = before - object.values.size();
    values_ -= gone;
    if (allowance_ != nullptr) allowance_->GiveBack(gone);
    known = known || gone > 0;
  }
  if (known) ++version_;
  return known;
}

void PdoMapping::Clear() {
  if (allowance_ != nullptr) allowance_->GiveBack(values_ + objects_.size());
  objects_.clear();
  missing_.clear();
  values_ = 0;
  ++version_;
}

const PdoObject* PdoMapping::Find(std::uint16_t index) const {
  const auto found = objects_.find(index);
  return found == objects_.end() ? nullptr : &found->second;
}

const FrameNo* PdoMapping::MissingSince(std::uint16_t pdo) const {
  const auto found = std::ranges::find(missing_, pdo, &Missing::pdo);
  return found == missing_.end() ? nullptr : &found->aborted;
}

std::optional<std::vector<std::uint16_t>> PdoMapping::Assigned(std::uint16_t assignment) const {
  const PdoObject* object = Find(assignment);
  const auto contents = object != nullptr ? object->Contents() : std::nullopt;
  if (!contents) return std::nullopt;
  std::vector<std::uint16_t> pdos;
  pdos.reserve(contents->size());
  for (const std::uint32_t value : *contents) pdos.push_back(static_cast<std::uint16_t>(value));
  return pdos;
}

std::optional<std::vector<MappingEntry>> PdoMapping::Mapped(std::uint16_t pdo) const {
  const PdoObject* object = Find(pdo);
  const auto contents = object != nullptr ? object->Contents() : std::nullopt;
  if (!contents) return std::nullopt;
  std::vector<MappingEntry> entries;
  entries.reserve(contents->size());
  for (const std::uint32_t value : *contents) entries.push_back(MappingEntry::FromValue(value));
  return entries;
}

}  // namespace ecaudit::process
