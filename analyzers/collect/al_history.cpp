#include "analyzers/collect/al_history.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace ecaudit {

AlHistory::AlHistory(const model::BusModel& model, const Pipeline& pipeline, EventBus& bus)
    : model_(model), room_(pipeline, kAtOnce, kBytesAStep) {
  // After the model, which shows what an error bit means.
  bus.ListenTo<track::AlRequest, track::AlStatusRead, track::AlStatusCodeRead>(Stage::kAfterModel, *this);
}

AlHistory::Story& AlHistory::Get(SlaveId slave) {
  while (stories_.size() <= slave) stories_.emplace_back();
  return stories_[slave];
}

void AlHistory::Summarise(AnalysisResult& result) {
  for (SlaveSummary& slave : result.slaves) {
    if (slave.id >= stories_.size()) continue;  // never asked
    Story& story = stories_[slave.id];
    slave.al_status = story.status;
    slave.al_status_code = story.code;
    slave.al_echo = story.echo;
    slave.al_history = std::move(story.steps);
    slave.al_history_left_out = story.left_out;
  }
}

void AlHistory::Add(Story& story, const AlStep& step, std::size_t place) {
  const bool own = story.steps.size() < kOwnSteps;
  const bool kept = own || (story.steps.size() < kMaxSteps && shared_steps_ < kMaxAllSteps);
  if (kept && room_.HasRoomFor(all_steps_)) {
    ++all_steps_;
    if (!own) ++shared_steps_;
    story.steps.insert(story.steps.begin() + static_cast<std::ptrdiff_t>(std::min(place, story.steps.size())), step);
  } else {
    ++story.left_out;
  }
}

void AlHistory::On(const track::AlRequest& request) {
  Story& story = Get(request.slave);
  AlStep step;
  step.kind = AlStep::Kind::kRequest;
  step.frame = request.frame();
  step.from = story.status.value_or(0);
  step.to = request.control.raw;
  step.refused_by_wkc = request.acceptance == track::Acceptance::kRefused;
  if (!step.refused_by_wkc && esc::AlWord{step.from}.state() != request.control.state()) story.asked_away = true;
  std::size_t place = story.steps.size();
  // That a frame was lost shows when later ones came back, which may have shown another state.
  while (!request.returned.seen() && place > 0 && story.steps[place - 1].frame.number > step.frame.number) {
    if (story.steps[--place].kind == AlStep::Kind::kState) step.from = story.steps[place].from;
  }
  Add(story, step, place);
}

void AlHistory::On(const track::AlStatusRead& read) {
  Story& story = Get(read.slave);
  if (!read.changed() && !read.status_code && !story.asked_away) return;  // polls nearly always show the same
  const bool changed = !story.status || *story.status != read.status.raw;
  // The master requested another state, never read whether the slave got there, and requested this one again.
  const bool again = story.asked_away && !story.steps.empty() && story.steps.back().kind == AlStep::Kind::kRequest &&
                     !story.steps.back().refused_by_wkc && read.asked() > story.steps.back().frame.number &&
                     esc::AlWord{story.steps.back().to}.state() == read.status.state();
  if (changed || again) {
    story.asked_away = false;
    AlStep step;
    step.frame = read.frame;
    step.from = story.status.value_or(0);
    step.to = read.status.raw;
    step.status_code = read.status_code;
    step.echo = read.status.bit4() && read.slave < model_.size() && model_.slave(read.slave).al.echoes();
    Add(story, step, story.steps.size());
    story.echo = step.echo;
    story.status = read.status.raw;
    if (!read.status_code) story.code.reset();
  }
  if (read.status_code) {
    if (!story.steps.empty() && !story.steps.back().status_code && *read.status_code != 0 &&
        story.steps.back().kind == AlStep::Kind::kState) {
      story.steps.back().status_code = read.status_code;
    }
    story.code = read.status_code;
  }
}

void AlHistory::On(const track::AlStatusCodeRead& read) {
  Story& story = Get(read.slave);
  if (!story.steps.empty() && !story.steps.back().status_code && read.code != 0 &&
      story.steps.back().kind == AlStep::Kind::kState) {
    story.steps.back().status_code = read.code;
  }
  story.code = read.code;
}

}  // namespace ecaudit
