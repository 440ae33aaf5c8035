/// Fuzzes the mailbox tracker with a series of accesses.
///
/// Input: flags (1: bit 0 sync managers unknown, 1 small mailboxes), then
///   | flags | where | bytes | repeat | data ... |, flags: bit 0 write, 1 read, 3:2 acceptance, 4 broadcast, 5 in the
///   frame of the access before, 6 sent long ago, 7 something else happens first (reset, gap, sync managers off or on).
/// where: 7:6 base 0x0800, mailbox out, mailbox in, end of a mailbox; 5:0 added to it. The data are repeated until
/// `bytes` times 1 + (repeat % 8) are there, so that whole mailboxes need few bytes of input.
#include <vector>

#include "decoder/track/mailbox_tracker.h"
#include "tests/fuzz/mailbox_input.h"

namespace ecaudit {
namespace {

constexpr track::MailboxWindow kLarge{0x1800, 512, 0x1C00, 512, track::MailboxUse::kOn, track::MailboxUse::kOn};
constexpr track::MailboxWindow kSmall{0x1800, 32, 0x1C00, 32, track::MailboxUse::kOn, track::MailboxUse::kOn};

EscAddress AddressOf(unsigned where, const track::MailboxWindow& window) {
  const unsigned add = where & 0x3FU;
  switch (where >> 6U) {
    case 0:
      return static_cast<EscAddress>(0x0800 + add);
    case 1:
      return static_cast<EscAddress>(0x1800 + add);
    case 2:
      return static_cast<EscAddress>(0x1C00 + add);
    default:
      return static_cast<EscAddress>(((add & 1U) != 0 ? 0x1800 : 0x1C00) + window.out_length - 1 - (add >> 4U));
  }
}

void Run(ByteSpan input) {
  mailbox::CheckingSink sink;
  track::MailboxTracker tracker(1, sink);
  const track::MailboxWindow window = (input[0] & 2U) != 0 ? kSmall : kLarge;
  if ((input[0] & 1U) == 0) tracker.SetWindow(window, {1, 0, false});
  FrameNo frame = 1000;
  std::vector<std::uint8_t> bytes;
  for (std::size_t at = 1; Fits(input, at, 4);) {
    const unsigned flags = input[at];
    if ((flags & 0x20U) == 0) frame += 2;
    const FrameRef sent{(flags & 0x40U) != 0 ? frame - 500 : frame, static_cast<TimeNs>(frame), true};
    if ((flags & 0x80U) != 0) {
      track::MailboxWindow off = window;
      off.out_use = off.in_use = track::MailboxUse::kOff;
      switch (input[at + 3] >> 5U) {
        case 0:
          tracker.Reset(sent);
          break;
        case 1:
          tracker.Forget(sent);
          break;
        case 2:
          tracker.SetWindow(off, sent);
          break;
        case 3:
          tracker.SetWindow(window, sent);
          break;
        default:
          tracker.SetWindow({}, sent);
          break;
      }
    }
    const ByteSpan data = Slice(input, at + 4, input[at + 2]);
    bytes.clear();
    for (unsigned i = 0; i <= input[at + 3] % 8U; ++i) bytes.insert(bytes.end(), data.begin(), data.end());
    track::SlaveAccess access;
    access.slave = 1;
    access.sent = sent;
    access.acceptance = static_cast<track::Acceptance>(flags >> 2U & 3U);
    if (access.acceptance != track::Acceptance::kAssumed && access.acceptance != track::Acceptance::kUnknown) {
      access.returned = {frame + 1, static_cast<TimeNs>(frame + 1), true};
    }
    access.command = (flags & 1U) != 0 ? wire::Command::FPWR : wire::Command::FPRD;
    access.address = AddressOf(input[at + 1], window);
    access.broadcast = (flags & 0x10U) != 0;
    if ((flags & 1U) != 0) access.written = bytes;
    if ((flags & 2U) != 0 && access.acceptance == track::Acceptance::kAccepted) access.read = bytes;
    tracker.OnAccess(access);
    at += 4 + data.size();
  }
  tracker.Finish();
}

}  // namespace
}  // namespace ecaudit

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2 || size > 65536) return 0;
  ecaudit::Run(ecaudit::ByteSpan(data, size));
  return 0;
}
