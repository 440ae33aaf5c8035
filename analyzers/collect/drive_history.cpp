#include "analyzers/collect/drive_history.h"

#include "analyzers/words/drive_text.h"

namespace ecaudit {
namespace {

using device::DriveState;

std::vector<std::uint8_t> NumbersOf(const model::DrivePath& path) {
  return {path.numbers.begin(), path.numbers.begin() + path.count};
}

bool IsFault(std::optional<DriveState> state) {
  return state == DriveState::kFault || state == DriveState::kFaultReactionActive;
}

}  // namespace

DriveHistory::DriveHistory(const model::BusModel& model, EventBus& bus) : model_(model) {
  bus.ListenTo<model::DriveCommanded, model::DriveStateChanged, model::DriveMode, model::DriveWarning,
               model::DriveFaultExplained>(Stage::kBeforeModel, *this);
}

DriveHistory::Story& DriveHistory::Get(SlaveId slave, std::uint8_t axis) {
  return stories_[{slave, axis}];
}

void DriveHistory::Add(Story& story, DriveStep step) {
  if (story.steps.size() < kMaxSteps && all_steps_ < kMaxAllSteps) {
    ++all_steps_;
    story.steps.push_back(std::move(step));
  } else {
    ++story.left_out;
  }
}

void DriveHistory::On(const model::DriveCommanded& event) {
  DriveStep step;
  step.kind = DriveStep::Kind::kCommand;
  step.frame = event.frame;
  step.text = CommandText(*model_.slave(event.slave).profile->drive, event);
  step.word = event.word;
  step.transitions = NumbersOf(event.path);
  step.by_sdo = event.by_sdo;
  step.inferred = event.inferred;
  Add(Get(event.slave, event.axis), std::move(step));
}

void DriveHistory::On(const model::DriveStateChanged& event) {
  Story& story = Get(event.slave, event.axis);
  if (event.from && IsFault(event.to) && !IsFault(event.from)) ++story.faults;
  if (event.to == DriveState::kSwitchedOn) story.switched_on = event.frame;
  if (event.to == DriveState::kOperationEnabled && event.from && event.from != event.to) {
    std::string text;
    const FrameRef& on = story.switched_on;
    if (event.from == DriveState::kSwitchedOn && on.seen()) {
      text = "switched on at frame " + std::to_string(on.number) + ", operation enabled ";
      text += on.has_time && event.frame.has_time ? MillisecondsText(event.frame.time - on.time) + " later"
                                                  : "at frame " + std::to_string(event.frame.number);
    } else {
      text = "operation enabled at frame " + std::to_string(event.frame.number);
    }
    if (story.enabled.size() < kMaxEnabled) story.enabled.push_back(std::move(text));
  }
  DriveStep step;
  step.kind = DriveStep::Kind::kState;
  step.frame = event.frame;
  step.text = StateChangeText(event);
  if (event.from) step.from = StateText(event.from);
  step.to = StateText(event.to);
  step.word = event.word;
  step.transitions = NumbersOf(event.path);
  step.command_frame = event.command.number;
  step.reaction = event.reaction;
  step.by_sdo = event.by_sdo;
  step.inferred = event.inferred;
  Add(story, std::move(step));
}

void DriveHistory::On(const model::DriveMode& event) {
  DriveStep step;
  step.kind = DriveStep::Kind::kMode;
  step.frame = event.frame;
  step.text = std::string(event.shown ? "mode of operation shown: " : "mode of operation requested: ") +
              ModeText(*model_.slave(event.slave).profile->drive, event.value);
  step.by_sdo = event.by_sdo;
  step.inferred = event.inferred;
  Add(Get(event.slave, event.axis), std::move(step));
}

void DriveHistory::On(const model::DriveWarning& event) {
  DriveStep step;
  step.kind = DriveStep::Kind::kWarning;
  step.frame = event.frame;
  step.text = event.set ? "warning" : "no warning any more";
  step.word = event.word;
  step.inferred = event.inferred;
  Add(Get(event.slave, event.axis), std::move(step));
}

void DriveHistory::On(const model::DriveFaultExplained& event) {
  DriveStep step;
  step.kind = DriveStep::Kind::kFault;
  step.frame = event.frame;
  step.text = FaultText(*model_.slave(event.slave).profile, event);
  Add(Get(event.slave, event.axis), std::move(step));
}

void DriveHistory::Summarise(AnalysisResult& result) {
  for (SlaveSummary& slave : result.slaves) {
    std::vector<DriveSummary> axes = SummariseSlave(slave.id);
    if (axes.empty()) continue;
    slave.drive = std::move(axes.front());
    axes.erase(axes.begin());
    slave.further_axes = std::move(axes);
  }
}

std::vector<DriveSummary> DriveHistory::SummariseSlave(SlaveId slave) const {
  std::vector<DriveSummary> axes;
  const model::SlaveModel& model = model_.slave(slave);
  if (!model.profile->drive) return axes;
  model.drives.ForEachSeen([&](const model::DriveUnit& unit) { axes.push_back(SummariseAxis(slave, unit)); });
  return axes;
}

DriveSummary DriveHistory::SummariseAxis(SlaveId slave, const model::DriveUnit& unit) const {
  const device::DriveProfile& drive = *model_.slave(slave).profile->drive;
  DriveSummary summary;
  summary.axis = unit.axis();
  if (unit.status().state) summary.state = StateText(unit.status().state);
  summary.status_word = unit.status().word;
  summary.control_word = unit.control().taken;
  summary.mode_requested = unit.modes().requested();
  summary.mode_shown = unit.modes().shown();
  const auto name = [&drive](std::optional<std::int8_t> mode) {
    const device::OperationMode* known = mode ? drive.FindMode(*mode) : nullptr;
    return known == nullptr ? std::string() : known->name;
  };
  summary.mode_requested_name = name(summary.mode_requested);
  summary.mode_shown_name = name(summary.mode_shown);
  if (summary.status_word) summary.status_bits = SetBits(drive.status_bits, *summary.status_word);
  if (summary.control_word) {
    const auto mode = summary.mode_shown ? summary.mode_shown : summary.mode_requested;
    summary.control_bits = SetBits(drive.control_bits, *summary.control_word, BitsOfMode(drive, mode));
  }
  summary.by_sdo = unit.status().by_sdo;
  if (const auto found = stories_.find({slave, unit.axis()}); found != stories_.end()) {
    const Story& story = found->second;
    summary.faults = story.faults;
    summary.enabled = story.enabled;
    summary.history = story.steps;
    summary.history_left_out = story.left_out;
  }
  return summary;
}

}  // namespace ecaudit
