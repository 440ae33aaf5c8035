#include "cli/stream/stream_run.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "cli/capture_check.h"
#include "cli/crash.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "cli/stream/spool.h"
#include "decoder/base/text.h"
#include "decoder/capture/capture_reader.h"

namespace ecaudit::cli {
namespace {

ExitStatus Interrupted(Console& console, const std::string& message) {
  console.Error(message);
  return ExitStatus::kInterrupted;
}

Result<std::vector<LineTarget>> OpenTargets(const std::vector<OutputTarget>& plan, bool color, Console& console) {
  std::vector<LineTarget> targets;
  for (const OutputTarget& target : plan) {
    if (target.standard()) {
      targets.push_back({target.format, color, LineOutput::ToConsole(console)});
      continue;
    }
    Result<LineOutput> file = LineOutput::ToFile(target.path);
    if (!file) return file.error();
    targets.push_back({target.format, false, std::move(*file)});
  }
  return targets;
}

/// The slaves of --slave, when the capture shows none of them.
std::optional<Error> MissingSlaves(const CaptureOptions& options, const Settings& settings,
                                   const track::Network& network) {
  if (settings.slaves.empty()) return std::nullopt;
  for (std::size_t id = 0; id < network.slaves().size(); ++id) {
    if (SelectsSlave(settings.slaves, network, static_cast<SlaveId>(id))) return std::nullopt;
  }
  std::string slaves;
  for (const std::string& slave : options.slaves) slaves += (slaves.empty() ? "" : " or ") + slave;
  return Error{options.captures.front() + " has no slave " + slaves};
}

/// A range that lies beside the capture shows nothing, which must not look like nothing having happened.
std::optional<Error> NothingInRange(const std::string& name, const TimedSource& source, const FrameRange& range,
                                    const std::vector<std::uint16_t>& interfaces) {
  if (source.reached_range() || source.info().packets == 0) return std::nullopt;
  return EmptyRange(name, {range.from_s, range.to_s, range.from_frame, range.to_frame, {}, interfaces});
}

}  // namespace

bool SelectsAddress(std::span<const SlaveSelector> selectors, std::optional<SlavePos> position,
                    std::optional<StationAddress> station) {
  if (selectors.empty()) return true;
  return std::ranges::any_of(selectors, [&](const SlaveSelector& selector) {
    if (!selector.by_address && selector.or_address != 0 && station == selector.or_address) return true;
    return selector.by_address ? station == selector.value : position == selector.value;
  });
}

bool SelectsSlave(std::span<const SlaveSelector> selectors, const track::Network& network, SlaveId slave) {
  if (selectors.empty()) return true;
  if (slave >= network.slaves().size()) return false;
  const bus::SlaveAddress& address = network.slaves()[slave];
  const SlavePos* position = address.position.if_known();
  const StationAddress* station = address.station.if_known();
  for (const SlaveSelector& selector : selectors) {
    const std::uint16_t* const own = selector.by_address ? station : position;
    if (own != nullptr && *own == selector.value) return true;
    if (selector.or_address != 0 && station != nullptr && *station == selector.or_address) return true;
  }
  return false;
}

void LineWriter::BeginLearning(Observation&, const StreamContext&) {}

std::optional<Error> LineWriter::EndLearning(Console&) {
  return std::nullopt;
}

std::optional<Error> LineWriter::WriteKept(const StreamContext&) {
  return std::nullopt;
}

bool LineWriter::ShowsUnmet(std::span<const SlaveSelector>) const {
  return false;
}

/// What the command line comes to.
struct StreamRun::Plan {
  CapturePaths paths;
  const Settings& settings;
  const FrameRange& range;
};

/// One reading of the captures, and what was understood of them.
struct StreamRun::Pass {
  Pass(std::unique_ptr<capture::FrameSource> capture, LineWriter& writer, const Plan& plan)
      : opened(std::move(capture)),
        source(*opened, plan.range),
        options(writer.Adapt(plan.settings.analysis)),
        observation(options, writer.depth()) {}

  std::unique_ptr<capture::FrameSource> opened;
  TimedSource source;
  const AnalysisOptions& options;  ///< the depth depends on them
  Observation observation;
};

void StreamRun::Declare(OptionSet& options, const StreamFormats& formats) {
  capture_.Declare(options);
  options.Group("What to read");
  options.Value("--frames", "A-B", frames_, "only these frames: 743-800, 760, 743- or -800");
  output_.Declare(options, formats.outputs(), formats.Help());
  output_.text.DeclareTime(options);
}

namespace {

PipelineOptions RunOptions(const LineWriter& writer, const FrameRange& range, Progress& progress, bool show_progress) {
  PipelineOptions options;
  options.stop = &InterruptFlag();
  options.reached = &ReachedFrame();
  options.progress = [&progress, show_progress](std::uint64_t done, std::uint64_t total, std::uint64_t frames) {
    if (show_progress) progress.Update(done, total, frames);
  };
  if (writer.stops_at_range_end()) {
    options.to_frame = range.to_frame;
    options.to_s = range.to_s;
  }
  return options;
}

/// What the reader of a whole capture should know of it.
void WarnOf(Console& console, const std::string& name, const TimedSource& source,
            const PipelineStatistics& statistics) {
  if (statistics.overworked.seen()) {
    console.Warning(name + ": read up to packet " + Grouped(statistics.overworked.number) +
                    "; the rest of the capture concerns too many slaves at once");
  } else if (const auto& damage = source.info().damage) {
    console.Warning(name + " is damaged: " + damage->message + "; everything up to frame " +
                    std::to_string(damage->after_frame) + " was read");
  } else if (statistics.ethercat_frames == 0) {
    console.Warning(name + (source.info().packets == 0
                                ? " holds no packets"
                                : ": no EtherCAT frame among " + Count(source.info().packets, "packet")));
  }
}

}  // namespace

ExitStatus StreamRun::Learn(Console& console, LineWriter& writer, const Plan& plan, Pass& pass) {
  const TimedSource& source = pass.source;
  Observation& observation = pass.observation;
  const StreamContext context{source, plan.settings, plan.range, {}};
  writer.BeginLearning(observation, context);
  Progress progress(console, std::filesystem::path(capture_.captures.front()).filename().string() + ", first pass");
  observation.Run(pass.source, RunOptions(writer, plan.range, progress, true));
  progress.Clear();
  if (InterruptFlag()) {
    return Interrupted(console, capture_.captures.front() + ": interrupted before anything was written");
  }
  std::optional<Error> error =
      NothingInRange(capture_.captures.front(), source, plan.range, plan.settings.analysis.interfaces);
  if (!error && !writer.ShowsUnmet(plan.settings.slaves))
    error = MissingSlaves(capture_, plan.settings, observation.pipeline().network());
  if (!error) error = writer.EndLearning(console);
  return error ? Fail(console, *error) : ExitStatus::kClean;
}

ExitStatus StreamRun::Run(Console& console, LineWriter& writer, std::string_view command) {
  // Everything that can be wrong with the command line is found before the capture is read.
  if (capture_.captures.size() > 1 && !capture_.join) {
    return Fail(console, Error{std::string(command) +
                               " reads one capture; give --join when these are files of one ring buffer"});
  }
  capture_.local_time = output_.text.time == Name(report::TimeMode::kLocal);
  Result<Settings> settings = ResolveSettings(capture_, GateOptions{}, capture_.captures.front());
  if (!settings) return Fail(console, settings.error());
  for (const SlaveSelector& slave : settings->slaves) {
    if (slave.name.empty()) continue;
    return Fail(console, Error{"--slave is '" + slave.name + "' but " + std::string(command) +
                               " takes positions and addresses; check shows them beside the names"});
  }
  capture_.ReportSkipped(console);
  Result<FrameRange> range = ReadFrameRange(settings->analysis, frames_);
  if (!range) return Fail(console, range.error());
  CommandFiles files;
  if (const auto error = AddFiles(capture_, files)) return Fail(console, *error);
  AddFiles(*settings, files);
  const Result<std::vector<OutputTarget>> outputs = PlanOutputs(output_, writer.formats(), files);
  if (!outputs) return Fail(console, outputs.error());

  ListenForInterrupt();
  Plan plan{CapturePaths(capture_.captures, settings->analysis.interfaces), *settings, *range};
  const bool place = settings->moments.needs_capture();
  if (writer.learns() || place) {
    if (const auto error = plan.paths.MakeReadableTwice()) return Fail(console, *error);
  }
  if (place) {
    if (const auto error = PlaceMoments(*settings, plan.paths, console)) return Fail(console, *error);
    const Result<FrameRange> placed = ReadFrameRange(settings->analysis, frames_);
    if (!placed) return Fail(console, placed.error());
    *range = *placed;
  }
  auto opened = plan.paths.Open();
  if (!opened && InterruptFlag()) {
    return Interrupted(console, capture_.captures.front() + ": interrupted before anything was written");
  }
  if (!opened) return Fail(console, opened.error());
  auto pass = std::make_unique<Pass>(std::move(*opened), writer, plan);
  for (bool learns = writer.learns(); learns;) {
    const ExitStatus learned = Learn(console, writer, plan, *pass);
    if (learned != ExitStatus::kClean) return learned;
    learns = writer.learns_again();
    if (!learns && writer.kept()) break;
    opened = plan.paths.Open();
    if (!opened) return Fail(console, opened.error());
    pass = std::make_unique<Pass>(std::move(*opened), writer, plan);
  }
  Result<std::vector<LineTarget>> targets = OpenTargets(*outputs, output_.text.Colors(console), console);
  if (!targets) return Fail(console, targets.error());
  return Write(console, writer, plan, *pass, *targets);
}

ExitStatus StreamRun::Write(Console& console, LineWriter& writer, const Plan& plan, Pass& pass,
                            std::vector<LineTarget>& targets) {
  const std::string& name = capture_.captures.front();
  const TimedSource& source = pass.source;
  Observation& observation = pass.observation;
  const StreamContext context{source, plan.settings, plan.range, targets, output_.text.time_mode()};
  Progress progress(console, std::filesystem::path(name).filename().string());
  if (writer.kept()) {
    if (const auto error = writer.WriteKept(context)) return Fail(console, *error);
  } else {
    writer.Begin(observation, context);
    // On a terminal the lines themselves show it.
    observation.Run(pass.source, RunOptions(writer, plan.range, progress, !console.output_is_terminal()));
  }
  const bool all_closed = std::ranges::all_of(targets, [](const LineTarget& t) { return t.output.closed(); });
  const bool interrupted = InterruptFlag() && !all_closed;
  writer.End();
  progress.Clear();

  if (!all_closed && !interrupted) {
    if (const auto error = NothingInRange(name, source, plan.range, plan.settings.analysis.interfaces))
      return Fail(console, *error);
  }
  if (!all_closed && !interrupted && !writer.ShowsUnmet(plan.settings.slaves)) {
    if (const auto error = MissingSlaves(capture_, plan.settings, observation.pipeline().network()))
      return Fail(console, *error);
  }
  ExitStatus status = ExitStatus::kClean;
  for (LineTarget& target : targets) {
    if (const auto error = target.output.Finish()) status = Fail(console, *error);
  }
  if (status != ExitStatus::kClean) return status;
  if (interrupted) {
    return Interrupted(console,
                       name + ": interrupted after " + Count(observation.pipeline().statistics().packets, "packet"));
  }
  if (!all_closed) WarnOf(console, name, source, observation.pipeline().statistics());
  return status;
}

}  // namespace ecaudit::cli
