#include "analyzers/model/diagnosis_history.h"

#include <algorithm>
#include <utility>

namespace ecaudit::model {

void DiagnosisHistory::Apply(const mailbox::SdoTransfer& transfer) {
  const bool message = transfer.has_object && !transfer.complete_access &&
                       mailbox::IsDiagnosisMessage(transfer.index, transfer.subindex);
  if (!message || transfer.service != mailbox::SdoService::kUpload || transfer.data_gap || transfer.size_mismatch ||
      transfer.outcome != mailbox::SdoOutcome::kCompleted || transfer.data.size() > kMaxBytes) {
    return;
  }
  const auto same_place = std::find_if(messages_.rbegin(), messages_.rend(), [&](const DiagnosisEntry& entry) {
    return entry.subindex == transfer.subindex;
  });
  const bool known = same_place != messages_.rend();
  if (known &&
      std::equal(transfer.data.begin(), transfer.data.end(), same_place->bytes.begin(), same_place->bytes.end())) {
    return;  // read once more
  }
  if (messages_.size() >= kMaxMessages) return;
  DiagnosisEntry entry;
  entry.subindex = transfer.subindex;
  entry.message = mailbox::ParseDiagnosisMessage(transfer.data);
  entry.bytes.assign(transfer.data.begin(), transfer.data.end());
  entry.request = transfer.request;
  entry.read = transfer.last;
  if (known) entry.stored_after = same_place->request.seen() ? same_place->request.number : same_place->read.number;
  messages_.push_back(std::move(entry));
}

}  // namespace ecaudit::model
