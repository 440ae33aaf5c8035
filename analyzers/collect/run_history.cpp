#include "analyzers/collect/run_history.h"

#include <algorithm>
#include <utility>

namespace ecaudit {
namespace {

constexpr std::uint8_t kRequestedPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);
constexpr std::uint8_t kBoot = static_cast<std::uint8_t>(esc::AlState::BOOT);
constexpr std::uint8_t kOp = static_cast<std::uint8_t>(esc::AlState::OP);

}  // namespace

RunHistory::RunHistory(const sync::SyncModel* sync, const Pipeline& pipeline, EventBus& bus)
    : sync_(sync), pipeline_(pipeline) {
  // Before the clocks forget what they measured.
  bus.ListenTo<track::RunBegan, track::AlRequest, track::AlStatusRead>(Stage::kBeforeModel, *this);
}

void RunHistory::On(const track::RunBegan& run) {
  // A master that shuts down and starts again requests INIT twice: there is no run in between.
  if (IsIdle() && run.reason != track::RunBegan::Reason::kClock) return;
  End();
  now_ = {};
  now_.first = run.frame;
  now_.why = run.reason == track::RunBegan::Reason::kClock ? RunSummary::Why::kClock : RunSummary::Why::kInitialised;
}

void RunHistory::On(const track::AlRequest& request) {
  if (request.control.state() != kRequestedPreop || request.acceptance == track::Acceptance::kRefused) return;
  if (request.slave >= preop_requests_.size()) preop_requests_.resize(std::size_t{request.slave} + 1);
  const std::uint32_t requests = ++preop_requests_[request.slave];
  now_.preop_requests = std::max<std::uint64_t>(now_.preop_requests, requests);
}

void RunHistory::On(const track::AlStatusRead& read) {
  if (!read.changed()) return;
  const std::uint8_t state = read.status.state();
  if (state != kBoot) now_.highest = std::max(now_.highest, state);
  if (state != kOp) return;
  if (read.slave >= in_op_.size()) in_op_.resize(std::size_t{read.slave} + 1);
  if (in_op_[read.slave]) return;
  in_op_[read.slave] = true;
  ++now_.slaves_in_op;
}

void RunHistory::End() {
  if (sync_ != nullptr) now_.cycle_us = sync_->SummariseRun().median_us;
  in_op_.clear();
  preop_requests_.clear();
  if (runs_.size() < kMaxRuns) runs_.push_back(std::move(now_));
}

void RunHistory::Summarise(AnalysisResult& result) {
  if (runs_.empty() || !IsIdle() || now_.why == RunSummary::Why::kClock) End();
  runs_.front().first = pipeline_.statistics().first;
  for (std::size_t i = 0; i + 1 < runs_.size(); ++i) {
    runs_[i].last.number = runs_[i + 1].first.number - 1;
  }
  runs_.back().last = pipeline_.statistics().last;
  result.bus.runs = runs_;
}

}  // namespace ecaudit
