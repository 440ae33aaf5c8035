#include "decoder/track/repeat_requests.h"

namespace ecaudit::track {
namespace {

using mailbox::MailboxRepeatRequest;

constexpr EscAddress kInConfig = 0x0808;      // sync manager 1
constexpr EscAddress kInActivate = 0x080E;    // bit 1 repeat request, toggles
constexpr EscAddress kInPdiControl = 0x080F;  // bit 1 repeat acknowledge
constexpr std::uint8_t kRepeatBit = 0x02;

}  // namespace

bool RepeatRequests::TakesSettings(const SlaveAccess& access, std::optional<bool>& bit) {
  if (access.acceptance == Acceptance::kRefused) return true;
  const ByteSpan activate = access.Covered(access.written, kInActivate, 1);
  if (activate.empty()) return true;
  if (access.Covered(access.written, kInConfig, 1).empty()) return false;
  bit = (activate[0] & kRepeatBit) != 0;
  return true;
}

void RepeatRequests::OnWrite(const SlaveAccess& access) {
  if (access.acceptance == Acceptance::kRefused) return;
  const ByteSpan activate = access.Covered(access.written, kInActivate, 1);
  if (activate.empty()) return;
  const bool bit = (activate[0] & kRepeatBit) != 0;
  const bool configuration = !access.Covered(access.written, kInConfig, 1).empty();
  const bool toggled = !configuration && (!bit_known_ || bit != bit_);
  bit_ = bit;
  bit_known_ = true;
  if (!toggled) return;
  requested_ = true;
  acknowledged_ = false;
  const FrameRef& frame = access.sent.seen() ? access.sent : access.returned;
  sink_.Publish(MailboxRepeatRequest{slave_, frame, MailboxRepeatRequest::Kind::kRequested});
}

void RepeatRequests::OnRead(const SlaveAccess& access) {
  const ByteSpan control = access.Covered(access.read, kInPdiControl, 1);
  if (control.empty() || !requested_ || acknowledged_) return;
  if (((control[0] & kRepeatBit) != 0) != bit_) return;
  acknowledged_ = true;
  sink_.Publish(MailboxRepeatRequest{slave_, access.frame(), MailboxRepeatRequest::Kind::kAcknowledged});
}

}  // namespace ecaudit::track
