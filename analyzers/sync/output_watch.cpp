#include "analyzers/sync/output_watch.h"

#include <algorithm>

namespace ecaudit::sync {
namespace {

constexpr std::uint16_t kStatusWord = 0x6041;

}  // namespace

void OutputWatch::Add(const FrameTime& time, FrameNo sent, const CyclicImage* of, bool slave_in_op) {
  last = time;
  last_sent = sent;
  last_status_word = status_word;
  image = of;
  seen = true;
  may_be_hole = false;
  in_op = slave_in_op;
  fell = {};
  fell_code.reset();
  if (in_op) ++frames_in_op;
}

std::optional<FrameTime> OutputWatch::WaitsSince() const {
  if (FedInOp()) return last;
  if (!op_since.seen()) return std::nullopt;
  FrameTime since;
  since.frame = op_since;
  if (op_since.has_time) since.stamp = op_since.time;
  return since;
}

Interval OutputWatch::GapByClocks(const FrameTime& time) const {
  if (!FedInOp()) {
    const std::optional<FrameTime> since = WaitsSince();
    FrameTime by_stamp;
    by_stamp.frame = time.frame;
    by_stamp.stamp = time.stamp;
    return since ? Between(*since, by_stamp) : Interval{};
  }
  return Between(last, time);
}

OutputGap OutputWatch::Describe(SlaveId slave, const Interval& gap) const {
  OutputGap event;
  event.slave = slave;
  event.fed_before = FedInOp();
  event.before = event.fed_before ? last.frame : op_since;
  event.gap = gap;
  if (image != nullptr) {
    event.nominal_ns = image->has_nominal() ? image->nominal_ns : 0;
    event.nominal_of = image->nominal_of;
  }
  event.fell = fell;
  event.fell_to = fell_to;
  event.fell_code = fell_code;
  event.status_word = last_status_word;
  return event;
}

void OutputWatch::BeginAnew() {
  LeaveOp();
  seen = false;
  image = nullptr;
  fell = {};
  fell_code.reset();
  grid.End();
  phase.End();
}

void OutputWatch::LeaveOp() {
  op_since = {};
  in_op = false;
  rate.BeginAnew();
  phase.BeginAnew();
}

void OutputWatch::Fell(const FrameRef& frame, esc::AlWord to, std::optional<std::uint16_t> code) {
  op_since = {};
  if (!seen || !in_op || fell.seen()) return;
  fell = frame;
  fell_to = to;
  fell_code = code;
}

void OutputWatch::OnHole(const track::CaptureGap& gap) {
  if (gap.certain || gap.skip) {
    phase.End();
    grid.End();
    if (safeop_phase != nullptr) safeop_phase->End();
  }
  // Where only numbers skip the pauses are as long as they seem to be.
  may_be_hole = may_be_hole || !gap.skip || gap.likely;
  if (!gap.certain) return;
  seen = false;
  op_since = {};
  fell = {};
}

void OutputWatch::FindStatusWord(const model::SlaveModel& slave) {
  layout_version_ = slave.process.version();
  status_at_.reset();
  const model::ProcessLayout& inputs = slave.process.tx();
  const model::Signal* word = inputs.known() ? inputs.Find(kStatusWord, 0) : nullptr;
  if (word != nullptr && word->bits == 16 && word->bit_offset % 8 == 0) status_at_ = word->bit_offset / 8;
}

}  // namespace ecaudit::sync
