#include "decoder/track/mapped_mailboxes.h"

#include <algorithm>

#include "decoder/track/mailbox_window.h"

namespace ecaudit::track {

void MappedMailboxes::Find() {
  const auto before = [](const Mapped& mapped, SlaveId id) { return mapped.slave < id; };
  for (std::size_t s = 0; s < mappings_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (mappings_.changed(id) <= version_) continue;
    std::erase_if(mapped_, [id](const Mapped& mapped) { return mapped.slave == id; });
    const MailboxWindow window = MailboxWindowOf(states_[id]);
    if (window.in_use != MailboxUse::kOn) continue;
    auto at = std::lower_bound(mapped_.begin(), mapped_.end(), id, before);
    for (const auto& [number, fmmu] : mappings_.fmmus(id, states_[id]).active) {
      if (fmmu.reads() && fmmu.byte_aligned() && fmmu.physical_start < window.in_start + window.in_length &&
          fmmu.physical_end() > window.in_start) {
        at = mapped_.insert(at, {id, fmmu}) + 1;
      }
    }
  }
  version_ = mappings_.version();
}

std::optional<SlaveAccess> MappedMailboxes::Mapped::Read(const DatagramPair& d) const {
  const std::uint32_t first = d.any.logical_address();
  const esc::BitRange overlap = fmmu.Overlap(first, d.any.length());
  if (overlap.empty() || !d.has_sent || !d.has_returned) return std::nullopt;
  const auto offset = static_cast<std::size_t>(overlap.first / 8 - first);
  const std::size_t length = static_cast<std::size_t>(overlap.count / 8);
  const ByteSpan sent = Slice(d.sent().data(), offset, length);
  const ByteSpan returned = Slice(d.any.data(), offset, length);
  if (std::ranges::equal(sent, returned)) return std::nullopt;
  SlaveAccess access;
  access.slave = slave;
  access.sent = d.transaction.sent_ref();
  access.returned = d.transaction.returned_ref();
  access.command = d.command();
  access.datagram = d.any.ordinal();
  access.address = static_cast<EscAddress>(fmmu.physical_start + (overlap.first / 8 - fmmu.logical_start));
  access.read = returned;
  access.acceptance = Acceptance::kAccepted;
  return access;
}

}  // namespace ecaudit::track
