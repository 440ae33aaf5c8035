#include "analyzers/analysis.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "analyzers/core/finding_store.h"
#include "analyzers/core/lossy_capture.h"
#include "analyzers/core/rule.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/startup/comparison.h"
#include "analyzers/startup/startup_recorder.h"
#include "analyzers/stats/al_history.h"
#include "analyzers/stats/drive_history.h"
#include "analyzers/stats/mailbox_summary.h"
#include "analyzers/stats/prediction_statistics.h"
#include "analyzers/stats/summary.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/timeline/analyse.h"
#include "analyzers/timeline/timeline_collector.h"
#include "decoder/pipeline.h"

namespace ecaudit {
namespace {

/// Hands each event to the rules that subscribed to it, then to the model; and each model event to the rules.
class Dispatcher final : public track::EventSink, public model::ModelSink, public FrameObserver {
 public:
  using model::ModelSink::On;
  using track::EventSink::On;

  explicit Dispatcher(const std::vector<std::unique_ptr<Rule>>& rules, const FindingStore& store) {
    for (const auto& rule : rules) {
      if (store.IsOff(rule->info())) continue;
      for (const Topic topic : rule->topics()) listeners_[static_cast<std::size_t>(topic)].push_back(rule.get());
    }
  }
  void SetModel(model::BusModel& model) { model_ = &model; }
  void SetContext(const RuleContext& context) { context_ = &context; }
  [[nodiscard]] const PredictionSummary& predictions() const { return predictions_.summary(); }
  void SetHistory(AlHistory& history) { history_ = &history; }
  [[nodiscard]] const MailboxStatistics& mailboxes() const { return mailboxes_; }
  void SetDrives(DriveHistory& drives) { drives_ = &drives; }
  void SetSync(sync::SyncModel& sync) { sync_ = &sync; }
  void SetTimeline(timeline::TimelineCollector& timeline) { timeline_ = &timeline; }
  void SetStartup(startup::StartupRecorder& startup) { startup_ = &startup; }

  void OnFrame(const wire::FrameView& frame, bus::Direction direction) override { sync_->OnFrame(frame, direction); }

  void On(const track::SlaveFound& e) override {
    model_->Apply(e);  // first: rules look the slave up
    ToRules(Topic::kSlaveFound, e);
  }
  void On(const track::AddressAssigned& e) override { RulesThenModel(Topic::kAddressAssigned, e); }
  void On(const track::IdentityLearned& e) override { RulesThenModel(Topic::kIdentityLearned, e); }
  void On(const track::SlaveCount& e) override { ToRules(Topic::kSlaveCount, e); }
  void On(const track::AlRequest& e) override {
    history_->On(e);
    startup_->On(e);
    RulesThenModel(Topic::kAlRequest, e);
  }
  void On(const track::AlStatusRead& e) override {
    if (e.changed() || e.status_code) history_->On(e);  // what is polled says the same nearly always
    startup_->On(e);
    RulesThenModel(Topic::kAlStatusRead, e);
  }
  bool OnAlPoll(const FrameRef& frame, esc::AlWord status, std::span<const SlaveId> slaves) override {
    return Listeners(Topic::kAlStatusRead).empty() && startup_->IsOver(slaves) &&
           model_->ApplyPoll(frame, status, slaves);
  }
  void On(const track::AlStatusCodeRead& e) override {
    history_->On(e);
    model_->Apply(e);
  }
  void On(const track::AlStateForgotten& e) override { RulesThenModel(Topic::kAlStateForgotten, e); }
  void On(const track::LogicalAccess& e) override {
    sync_->On(e);
    if (timeline_ != nullptr) timeline_->On(e);
    predictions_.On(e, *model_);
    RulesThenModel(Topic::kLogicalAccess, e);
  }
  void On(const track::Answered& e) override {
    startup_->On(e);
    if (!e.returned.seen()) return;  // there is no answer to judge
    sync_->On(e);
    ToRules(Topic::kAnswered, e);
  }
  void On(const track::EventFieldChanged& e) override { model_->Apply(e); }
  void On(const track::CaptureHole& e) override {
    sync_->On(e);
    RulesThenModel(Topic::kCaptureHole, e);
  }
  void On(const track::FrameLost& e) override {
    if (timeline_ != nullptr) timeline_->On(e);
    RulesThenModel(Topic::kFrameLost, e);
  }
  void On(const track::FrameDuplicated& e) override { ToRules(Topic::kFrameDuplicated, e); }
  void On(const track::FrameUnusable& e) override { ToRules(Topic::kFrameUnusable, e); }
  void On(const mailbox::MailboxMessage& e) override {
    mailboxes_.On(e);
    if (timeline_ != nullptr) timeline_->On(e);
    ToRules(Topic::kMailboxMessage, e);
  }
  void On(const mailbox::MailboxRefused& e) override { ToRules(Topic::kMailboxRefused, e); }
  void On(const mailbox::MailboxReadLost& e) override { ToRules(Topic::kMailboxReadLost, e); }
  void On(const mailbox::MailboxUnanswered& e) override {
    mailboxes_.On(e);
    ToRules(Topic::kMailboxUnanswered, e);
  }
  void On(const mailbox::MailboxErrorReply& e) override {
    mailboxes_.On(e);
    ToRules(Topic::kMailboxErrorReply, e);
  }
  void On(const mailbox::SdoTransfer& e) override {
    mailboxes_.On(e);
    startup_->On(e);
    RulesThenModel(Topic::kSdoTransfer, e);
    if (timeline_ != nullptr) timeline_->On(e);
    sync_->On(e);  // last: it looks at the objects as the transfer left them
  }
  void On(const track::EepromRead& e) override {
    model_->Apply(e);
    startup_->On(e);
  }
  void On(const track::EepromWrite& e) override {
    model_->Apply(e);
    startup_->On(e);
  }
  void On(const mailbox::SdoUnexpected& e) override { ToRules(Topic::kSdoUnexpected, e); }
  void On(const mailbox::SdoInfo& e) override { RulesThenModel(Topic::kSdoInfo, e); }
  void On(const mailbox::Emergency& e) override {
    mailboxes_.On(e);
    RulesThenModel(Topic::kEmergency, e);
  }
  void OnAccess(const track::SlaveAccess& e) override {
    for (Rule* rule : Listeners(Topic::kAccess)) rule->OnAccess(e);
    model_->Apply(e);
    sync_->OnAccess(e);
    if (timeline_ != nullptr) timeline_->OnAccess(e);
    startup_->OnAccess(e);
  }
  void OnAlRequestSent(SlaveId slave, const FrameRef& frame, esc::AlWord control) override {
    model_->ApplyAlRequestSent(slave, frame, control);
  }

  void On(const model::AlRequestJudged& e) override { ToRules(Topic::kAlRequestJudged, e); }
  void On(const model::AlAnswered& e) override {
    predictions_.On(e, context_->ExplanationOf(e.slave, e.request.frame.number) != kNoFinding);
    startup_->On(e);
    ToRules(Topic::kAlAnswered, e);
  }
  void On(const model::AlErrorRepeated& e) override { ToRules(Topic::kAlErrorRepeated, e); }
  void On(const model::AlChangedByItself& e) override {
    predictions_.On(e);
    ToRules(Topic::kAlChangedByItself, e);
    sync_->On(e);
  }
  void On(const model::AlErrorCode& e) override {
    startup_->On(e);
    ToRules(Topic::kAlErrorCode, e);
    sync_->On(e);
  }
  void On(const model::AlErrorCleared& e) override { ToRules(Topic::kAlErrorCleared, e); }
  void On(const model::AlOverdue& e) override {
    predictions_.On(e);
    ToRules(Topic::kAlOverdue, e);
  }
  void On(const model::Predicted& e) override { predictions_.On(e); }
  void On(const model::LatchMisuse& e) override { ToRules(Topic::kLatchMisuse, e); }
  void On(const model::LatchNotJudged& e) override { ToRules(Topic::kLatchNotJudged, e); }
  void On(const model::DriveCommanded& e) override {
    drives_->On(e);
    startup_->On(e);
  }
  void On(const model::DriveStateChanged& e) override {
    drives_->On(e);
    startup_->On(e);
    ToRules(Topic::kDriveStateChanged, e);
  }
  void On(const model::DriveIllegalCommand& e) override { ToRules(Topic::kDriveIllegalCommand, e); }
  void On(const model::DriveIllegalChange& e) override { ToRules(Topic::kDriveIllegalChange, e); }
  void On(const model::DriveNoReaction& e) override { ToRules(Topic::kDriveNoReaction, e); }
  void On(const model::DriveCommandOutsideOp& e) override { ToRules(Topic::kDriveCommandOutsideOp, e); }
  void On(const model::DriveMode& e) override {
    drives_->On(e);
    ToRules(Topic::kDriveMode, e);
  }
  void On(const model::DriveWarning& e) override { drives_->On(e); }
  void On(const model::DriveFaultExplained& e) override {
    drives_->On(e);
    ToRules(Topic::kDriveFaultExplained, e);
  }
  void On(const model::PllMeasured& e) override { ToRules(Topic::kPllMeasured, e); }
  void On(const model::SyncSwitchedOn& e) override { ToRules(Topic::kSyncSwitchedOn, e); }
  void On(const model::OutputGap& e) override { ToRules(Topic::kOutputGap, e); }
  void On(const model::SyncSlotMiss& e) override { ToRules(Topic::kSyncSlotMiss, e); }
  void On(const model::ArrivalOff& e) override { ToRules(Topic::kArrivalOff, e); }

 private:
  [[nodiscard]] const std::vector<Rule*>& Listeners(Topic topic) const {
    return listeners_[static_cast<std::size_t>(topic)];
  }
  template <typename E>
  void ToRules(Topic topic, const E& event) {
    for (Rule* rule : Listeners(topic)) rule->On(event);
  }
  template <typename E>
  void RulesThenModel(Topic topic, const E& event) {
    ToRules(topic, event);
    model_->Apply(event);
  }

  std::array<std::vector<Rule*>, static_cast<std::size_t>(Topic::kCount)> listeners_;
  model::BusModel* model_ = nullptr;
  const RuleContext* context_ = nullptr;
  AlHistory* history_ = nullptr;
  DriveHistory* drives_ = nullptr;
  PredictionStatistics predictions_;
  MailboxStatistics mailboxes_;
  sync::SyncModel* sync_ = nullptr;
  timeline::TimelineCollector* timeline_ = nullptr;  ///< null: nobody draws
  startup::StartupRecorder* startup_ = nullptr;
};

/// By first frame; a cause stands before what it causes, even where it was seen later. Indices in caused_by follow.
void SortFindings(std::vector<Finding>& findings) {
  std::vector<FindingIndex> order(findings.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<FindingIndex>(i);
  const auto root = [&](FindingIndex i) {
    for (int depth = 0; depth < 16 && findings[i].caused_by != kNoFinding; ++depth) i = findings[i].caused_by;
    return i;
  };
  const auto depth_of = [&](FindingIndex i) {
    int depth = 0;
    while (depth < 16 && findings[i].caused_by != kNoFinding) {
      i = findings[i].caused_by;
      ++depth;
    }
    return depth;
  };
  std::stable_sort(order.begin(), order.end(), [&](FindingIndex a, FindingIndex b) {
    const FindingIndex ra = root(a);
    const FindingIndex rb = root(b);
    if (ra != rb) {
      return std::pair(findings[ra].first.number, ra) < std::pair(findings[rb].first.number, rb);
    }
    return std::tuple(depth_of(a), findings[a].first.number, a) < std::tuple(depth_of(b), findings[b].first.number, b);
  });
  std::vector<FindingIndex> new_index(findings.size());
  for (std::size_t i = 0; i < order.size(); ++i) new_index[order[i]] = static_cast<FindingIndex>(i);
  std::vector<Finding> sorted;
  sorted.reserve(findings.size());
  for (const FindingIndex i : order) {
    sorted.push_back(std::move(findings[i]));
    if (sorted.back().caused_by != kNoFinding) sorted.back().caused_by = new_index[sorted.back().caused_by];
  }
  findings = std::move(sorted);
}

PipelineOptions ReadingOptions(const AnalysisOptions& options) {
  PipelineOptions reading;
  reading.from_s = options.from_s;
  reading.to_s = options.to_s;
  reading.from_frame = options.from_frame;
  reading.to_frame = options.to_frame;
  reading.stop = options.stop;
  reading.progress = options.progress;
  reading.read_ahead = true;
  return reading;
}

/// @param drawn  null: nothing is drawn
AnalysisResult Run(capture::FrameSource& source, const AnalysisOptions& options, Timeline* drawn) {
  FindingStore store(options.rules);
  const std::vector<std::unique_ptr<Rule>> rules = MakeAllRules();
  Dispatcher dispatcher(rules, store);
  Pipeline pipeline(dispatcher, &dispatcher);
  model::BusModel model(pipeline.network(), options, dispatcher);
  AlHistory history;
  sync::SyncModel sync(model, pipeline, dispatcher);
  dispatcher.SetModel(model);
  dispatcher.SetSync(sync);
  dispatcher.SetHistory(history);
  DriveHistory drives(model);
  dispatcher.SetDrives(drives);
  std::optional<timeline::TimelineCollector> timeline;
  if (drawn != nullptr) {
    timeline.emplace(model);
    dispatcher.SetTimeline(*timeline);
    sync.SetSamples(&*timeline);
  }
  startup::StartupRecorder startup(model);
  dispatcher.SetStartup(startup);
  RuleContext context(store, model, options);
  dispatcher.SetContext(context);
  context.pipeline = &pipeline;
  context.source = &source;
  context.sync = &sync;
  for (const auto& rule : rules) rule->Attach(context);

  pipeline.Run(source, ReadingOptions(options));
  model.Finish();
  sync.Finish();

  AnalysisResult result = Summarise(source, pipeline, model, history, dispatcher.mailboxes());
  result.bus.cycle = sync.SummariseCycle();
  result.bus.dc = sync.SummariseBus();
  result.bus.startup = startup.SummariseBus();
  for (SlaveSummary& slave : result.slaves) {
    slave.dc = sync.Summarise(slave.id);
    slave.drive = drives.Summarise(slave.id);
    slave.startup = startup.Summarise(slave.id);
  }
  startup::Comparison comparison;
  if (options.expectation != nullptr) {
    comparison = startup::Compare(*options.expectation, result);
    context.startup = &comparison;
  }
  for (const auto& rule : rules) {
    if (!store.IsOff(rule->info())) rule->Finish();
  }
  if (MissesPackets(pipeline.pairing())) WeakenWhatHistoryMayExplain(store, rules);
  store.FoldNotEvaluable(model.size());

  result.bus.predictions = dispatcher.predictions();
  if (timeline) *drawn = timeline->Finish(sync.cycle());
  result.findings = std::move(store.findings());
  SortFindings(result.findings);
  result.not_evaluable = store.not_evaluable();
  return result;
}

}  // namespace

AnalysisResult Analyse(capture::FrameSource& source, const AnalysisOptions& options) {
  return Run(source, options, nullptr);
}

AnalysisResult AnalyseWithTimeline(capture::FrameSource& source, const AnalysisOptions& options, Timeline& timeline) {
  return Run(source, options, &timeline);
}

}  // namespace ecaudit
