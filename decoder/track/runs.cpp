#include "decoder/track/runs.h"

#include "decoder/esc/register_addresses.h"

namespace ecaudit::track {

void Runs::BeginRecording(const FrameRef& frame) {
  in_use_ = false;
  events_.Publish(RunBegan{frame, RunBegan::Reason::kClock});
}

void Runs::OnBroadcastWrite(const DatagramPair& d) {
  if (!in_use_ || (!d.assumed() && d.wkc() == 0)) return;
  const ByteSpan written = d.written();
  const auto covered = [&](EscAddress at) {
    return CoversByte(d.address(), written.size(), at) ? Slice(written, static_cast<std::size_t>(at - d.address()), 2)
                                                       : ByteSpan{};
  };
  const ByteSpan control = covered(esc::kAlControl);
  const ByteSpan station = covered(esc::kStationAddress);
  const bool init =
      !control.empty() && esc::AlWord{WordOrByte(control)}.state() == static_cast<std::uint8_t>(esc::AlState::INIT);
  if (!init && (station.size() < 2 || WordOrByte(station) != 0)) return;
  in_use_ = false;
  events_.Publish(RunBegan{d.transaction.first_ref(), RunBegan::Reason::kInitialised});
}

}  // namespace ecaudit::track
