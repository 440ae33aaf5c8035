/// in: writes to the out mailbox of a slave whose frames were overtaken.  out: the request, once an answer shows that
/// the slave has it.
///
/// keeps: one request, as far as it was written.
///
/// That a frame is lost is known only many frames later, after the answer to the request that it carried. Frames do
/// not overtake each other on the wire, so the answer is proof enough.
#pragma once

#include <cstdint>

#include "decoder/base/allowance.h"
#include "decoder/mailbox/message_bytes.h"
#include "decoder/track/access.h"

namespace ecaudit::track {

class DoubtfulRequest {
 public:
  /// @param bytes what all slaves share for messages in the making; null: no common limit; else must outlive this
  explicit DoubtfulRequest(Allowance* bytes) : bytes_(0xFFFF, bytes) {}

  /// A write that touches the mailbox of `length` bytes at `start`.
  void Keep(const SlaveAccess& access, EscAddress start, std::uint16_t length);
  /// What became of the frame is known.
  void Known(FrameNo sent) {
    if (sent == sent_.number) Forget();
  }
  void Forget();

  /// Not seen() when there is none, or not all of it.
  [[nodiscard]] FrameRef sent() const { return whole_ ? sent_ : FrameRef{}; }
  [[nodiscard]] ByteSpan message() const { return bytes_; }
  /// @param answer what the slave put into its own mailbox
  [[nodiscard]] bool IsAnsweredBy(ByteSpan answer) const;

 private:
  FrameRef sent_;
  bool whole_ = false;
  mailbox::MessageBytes bytes_;
};

}  // namespace ecaudit::track
