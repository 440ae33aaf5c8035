#include "analyzers/collect/mapping_history.h"

#include <vector>

#include "decoder/process/pdo_mapping.h"
#include "decoder/track/network.h"

namespace ecaudit {
namespace {

using mailbox::SdoOutcome;

constexpr std::size_t kOutputManager = 2;
constexpr std::size_t kInputManager = 3;

std::size_t EntriesOf(const MappingHistory::Configuration& configuration) {
  std::size_t entries = 0;
  for (const auto& [index, list] : configuration.lists) entries += list.size();
  return entries;
}

}  // namespace

MappingHistory::MappingHistory(const model::BusModel& model, EventBus& bus) : model_(model) {
  bus.ListenTo<mailbox::SdoTransfer, track::AlRequest, track::RunBegan>(Stage::kBeforeModel, *this);
}

MappingHistory::Configuration* MappingHistory::Open(SlaveId slave, FrameNo frame) {
  while (slaves_.size() <= slave) slaves_.emplace_back();
  Slave& of = slaves_[slave];
  if (!of.configurations.empty() && !of.configurations.back().closed) return &of.configurations.back();
  Configuration next;
  if (!of.configurations.empty() && !of.forgotten) next.lists = of.configurations.back().lists;
  const std::size_t kept = EntriesOf(next);
  if (entries_ + kept >= kMaxEntries) return nullptr;
  entries_ += kept;
  of.forgotten = false;
  next.first = frame;
  of.configurations.push_back(std::move(next));
  if (of.configurations.size() > kMaxConfigurations) {
    entries_ -= EntriesOf(of.configurations.front());
    of.configurations.pop_front();
  }
  return &of.configurations.back();
}

void MappingHistory::On(const mailbox::SdoTransfer& transfer) {
  const bool download = transfer.service == mailbox::SdoService::kDownload;
  const bool answered =
      transfer.outcome == SdoOutcome::kCompleted ||
      (download && transfer.outcome == SdoOutcome::kAborted && transfer.aborted_by == mailbox::Direction::kIn);
  if (!answered || !transfer.has_object || !process::IsPdoObject(transfer.index) || transfer.data_gap) return;
  if (!download && transfer.service != mailbox::SdoService::kUpload) return;
  const std::vector<process::PdoValue> values = process::PdoValuesOf(transfer);
  const FrameNo frame = transfer.request.seen() ? transfer.request.number : transfer.last.number;
  Configuration* const configuration = values.empty() ? nullptr : Open(transfer.slave, frame);
  if (configuration == nullptr) return;
  List& list = configuration->lists[transfer.index];
  // Written again: from the number 0 on, or as a whole.
  const bool anew = download && transfer.outcome == SdoOutcome::kCompleted && values.front().subindex == 0 &&
                    (transfer.complete_access || values.front().value == 0);
  if (anew) {
    entries_ -= list.size();
    list.clear();
  }
  for (const process::PdoValue& value : values) {
    const auto at = list.find(value.subindex);
    if (at == list.end()) {
      if (entries_ >= kMaxEntries) return;
      ++entries_;
    }
    Entry& entry = at == list.end() ? list[value.subindex] : at->second;
    if (!download) {
      entry.read = value.value;
      continue;
    }
    // The slave keeps what it had; after the list was cleared that is not known.
    std::optional<std::uint32_t> kept;
    if (transfer.outcome == SdoOutcome::kAborted) kept = entry.accepted() ? std::optional(entry.value) : entry.read;
    entry = {.written = true,
             .value = value.value,
             .outcome = transfer.outcome,
             .abort_code = transfer.abort_code,
             .frame = frame,
             .read = kept};
  }
}

void MappingHistory::On(const track::AlRequest& request) {
  if (request.slave >= slaves_.size() || slaves_[request.slave].configurations.empty()) return;
  Configuration& configuration = slaves_[request.slave].configurations.back();
  if (configuration.closed) return;
  configuration.closed = true;
  configuration.managers = {ManagerNow(request.slave, kOutputManager), ManagerNow(request.slave, kInputManager)};
}

void MappingHistory::On(const track::RunBegan& /*began*/) {
  for (Slave& slave : slaves_) {
    if (!slave.configurations.empty()) slave.configurations.back().closed = true;
    slave.forgotten = true;
  }
}

std::optional<MappingHistory::Manager> MappingHistory::ManagerNow(SlaveId slave, std::size_t number) const {
  const track::SlaveState& state = model_.network().state(slave);
  const auto manager = state.sync_manager(number, Certainty::kInferred);
  if (!manager || !manager->enabled()) return std::nullopt;
  return Manager{manager->length, state.sync_manager_since[number]};
}

const MappingHistory::Configuration* MappingHistory::Of(SlaveId slave, FrameNo frame) const {
  if (slave >= slaves_.size()) return nullptr;
  const std::deque<Configuration>& all = slaves_[slave].configurations;
  for (auto configuration = all.rbegin(); configuration != all.rend(); ++configuration) {
    if (configuration->first <= frame) return &*configuration;
  }
  return nullptr;
}

std::optional<MappingHistory::Manager> MappingHistory::ManagerOf(SlaveId slave, const Configuration& configuration,
                                                                 device::PdoDirection direction) const {
  const bool outputs = direction == device::PdoDirection::kRx;
  if (configuration.closed) return configuration.managers[outputs ? 0 : 1];
  return ManagerNow(slave, outputs ? kOutputManager : kInputManager);
}

}  // namespace ecaudit
