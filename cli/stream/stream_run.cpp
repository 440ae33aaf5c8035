#include "cli/stream/stream_run.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "cli/interrupt.h"
#include "cli/progress.h"
#include "decoder/base/text.h"
#include "decoder/capture/capture_reader.h"

namespace ecaudit::cli {
namespace {

constexpr std::array kFormats{OutputFormat{"text", ".txt"}, OutputFormat{"jsonl", ".jsonl"}};

ExitStatus Fail(Console& console, const Error& error) {
  console.Error(error.message);
  return ExitStatus::kUsage;
}

Result<std::vector<LineTarget>> OpenTargets(const std::vector<OutputTarget>& plan, bool color, Console& console) {
  std::vector<LineTarget> targets;
  for (const OutputTarget& target : plan) {
    const LineFormat format = target.format == 0 ? LineFormat::kText : LineFormat::kJsonLines;
    if (target.standard()) {
      targets.push_back({format, color && format == LineFormat::kText, LineOutput::ToConsole(console)});
      continue;
    }
    Result<LineOutput> file = LineOutput::ToFile(target.path);
    if (!file) return file.error();
    targets.push_back({format, false, std::move(*file)});
  }
  return targets;
}

bool Selects(const SlaveSelector& selector, const bus::SlaveAddress& address) {
  if (selector.by_address) {
    const StationAddress* station = address.station.if_known();
    return station != nullptr && *station == selector.value;
  }
  const SlavePos* position = address.position.if_known();
  return position != nullptr && *position == selector.value;
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

}  // namespace

bool SelectsSlave(std::span<const SlaveSelector> selectors, const track::Network& network, SlaveId slave) {
  if (selectors.empty()) return true;
  if (slave >= network.slaves().size()) return false;
  const bus::SlaveAddress& address = network.slaves()[slave];
  return std::any_of(selectors.begin(), selectors.end(),
                     [&](const SlaveSelector& selector) { return Selects(selector, address); });
}

void StreamRun::Declare(OptionSet& options) {
  capture_.Declare(options);
  options.Group("What to read");
  options.Value("--frames", "A-B", frames_, "only these frames: 743-800, 760, 743- or -800");
  output_.Declare(options, "text (default) or jsonl: one JSON object a line");
}

ExitStatus StreamRun::Run(Console& console, LineWriter& writer, std::string_view command) {
  // Everything that can be wrong with the command line is found before the capture is read.
  if (capture_.captures.size() > 1 && !capture_.join) {
    return Fail(console, Error{std::string(command) +
                               " reads one capture; give --join when these are files of one ring buffer"});
  }
  const std::string& name = capture_.captures.front();
  const Result<Settings> settings = ResolveSettings(capture_, GateOptions{}, name);
  if (!settings) return Fail(console, settings.error());
  const Result<FrameRange> range = ReadFrameRange(settings->analysis, frames_);
  if (!range) return Fail(console, range.error());
  const Result<std::vector<OutputTarget>> plan = PlanOutputs(output_, kFormats, capture_.captures);
  if (!plan) return Fail(console, plan.error());
  auto opened = capture_.captures.size() > 1 ? capture::OpenJoined(capture_.captures) : capture::OpenCapture(name);
  if (!opened) return Fail(console, opened.error());
  Result<std::vector<LineTarget>> targets = OpenTargets(*plan, console.color() && !output_.no_color, console);
  if (!targets) return Fail(console, targets.error());

  TimedSource source(**opened);
  const StreamContext context{source, *settings, *range, *targets};
  Pipeline pipeline(writer.events(), writer.frames());
  writer.Begin(pipeline, context);

  ListenForInterrupt();
  Progress progress(console, std::filesystem::path(name).filename().string());
  const bool show_progress = !console.output_is_terminal();  // else the lines themselves show it
  PipelineOptions options;
  options.stop = &InterruptFlag();
  options.progress = [&](std::uint64_t done, std::uint64_t total, std::uint64_t frames) {
    if (show_progress) progress.Update(done, total, frames);
  };
  if (writer.stops_at_range_end()) {
    options.to_frame = range->to_frame;
    options.to_s = range->to_s;
  }
  pipeline.Run(source, options);
  const bool all_closed =
      std::all_of(targets->begin(), targets->end(), [](const LineTarget& t) { return t.output.closed(); });
  const bool interrupted = InterruptFlag() && !all_closed;
  writer.End();
  progress.Clear();

  if (!all_closed && !interrupted) {
    if (const auto error = MissingSlaves(capture_, *settings, pipeline.network())) return Fail(console, *error);
  }
  ExitStatus status = ExitStatus::kClean;
  for (LineTarget& target : *targets) {
    if (const auto error = target.output.Finish()) status = Fail(console, *error);
  }
  if (status != ExitStatus::kClean) return status;
  const PipelineStatistics& statistics = pipeline.statistics();
  if (interrupted) {
    return Fail(console, Error{name + ": interrupted behind " + Count(statistics.packets, "packet")});
  }
  if (all_closed) return status;
  if (const auto& damage = source.info().damage) {
    console.Warning(name + " is damaged: " + damage->message + "; everything up to frame " +
                    std::to_string(damage->after_frame) + " was read");
  } else if (statistics.ethercat_frames == 0) {
    console.Warning(name + (source.info().packets == 0
                                ? " holds no packets"
                                : ": no EtherCAT frame among " + Count(source.info().packets, "packet")));
  }
  return status;
}

}  // namespace ecaudit::cli
