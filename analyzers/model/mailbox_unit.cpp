#include "analyzers/model/mailbox_unit.h"

#include "decoder/esc/sync_manager.h"

namespace ecaudit::model {
namespace {

constexpr std::uint8_t kMailboxFull = 0x08;
constexpr EscAddress kOutStatus = esc::SyncManagerAddress(0) + 5;
constexpr EscAddress kInStatus = esc::SyncManagerAddress(1) + 5;

FrameNo SentNumber(const track::SlaveAccess& access) {
  return access.sent.seen() ? access.sent.number : access.returned.number;
}

}  // namespace

void MailboxUnit::Forget() {
  out_empty_ = false;
  in_full_ = false;
}

void MailboxUnit::OnAccess(const track::SlaveAccess& access) {
  if (access.address < esc::kSyncManagerBase) return;  // nearly all accesses of a start-up
  if (window_version_ != state_.mapping_version) {
    window_version_ = state_.mapping_version;
    const track::MailboxWindow window = track::MailboxWindowOf(state_);
    if (!(window == window_)) Forget();
    window_ = window;
  }
  if (access.broadcast) return;
  LearnStatus(access);
  CheckWrite(access);
  CheckRead(access);
}

void MailboxUnit::LearnStatus(const track::SlaveAccess& access) {
  if (access.acceptance != track::Acceptance::kAccepted) return;
  if (SentNumber(access) < last_use_) return;  // overtaken by a frame that used the mailbox
  if (const ByteSpan status = access.Covered(access.read, kOutStatus, 1); !status.empty()) {
    out_empty_ = (status[0] & kMailboxFull) == 0;
  }
  if (const ByteSpan status = access.Covered(access.read, kInStatus, 1); !status.empty()) {
    in_full_ = (status[0] & kMailboxFull) != 0;
  }
}

void MailboxUnit::CheckWrite(const track::SlaveAccess& access) {
  if (window_.out_length == 0 || access.written.empty()) return;
  const std::uint32_t end = std::uint32_t{access.address} + static_cast<std::uint32_t>(access.written.size());
  if (access.address >= window_.out_start + window_.out_length || end <= window_.out_start) return;
  last_use_ = SentNumber(access);
  if (out_empty_ && access.address == window_.out_start) CompareOpening(access);
  out_empty_ = false;  // the slave may take the message at any time, or has not yet
}

void MailboxUnit::CompareOpening(const track::SlaveAccess& access) {
  const bool accepted = access.acceptance == track::Acceptance::kAccepted;
  if (!accepted && access.acceptance != track::Acceptance::kRefused) return;
  Predicted e;
  e.kind = Predicted::Kind::kMailbox;
  e.slave = slave_;
  e.frame = access.frame();
  e.held = accepted;
  sink_.Publish(e);
}

void MailboxUnit::CheckRead(const track::SlaveAccess& access) {
  // Of a refused read the capture does not show the length; it opens the mailbox where it begins at its first byte.
  if (window_.in_length == 0 || !access.written.empty() || access.address < window_.in_start ||
      access.address >= window_.in_start + window_.in_length) {
    return;
  }
  last_use_ = SentNumber(access);
  if (in_full_ && access.address == window_.in_start) CompareOpening(access);
  in_full_ = false;
}

}  // namespace ecaudit::model
