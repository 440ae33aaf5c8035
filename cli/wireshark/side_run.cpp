#include "cli/wireshark/side_run.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "analyzers/observation.h"
#include "cli/capture_check.h"
#include "cli/crash.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "cli/report/finding_id.h"
#include "cli/report/sentences.h"
#include "cli/report/text_writer.h"
#include "cli/stream/event_writer.h"
#include "cli/stream/signal_writer.h"
#include "cli/stream/spool.h"
#include "cli/wireshark/side_events.h"
#include "cli/wireshark/side_rows.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"
#include "decoder/capture/capture_reader.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kCheckedBytes = 60;
constexpr std::string_view kSignature = "ecaudit-side ";

/// What the events show beside process data, clocks and registers, which have their own fields.
const char* const kEventChoice = "al-request,al-state,sdo,sdo-info,emergency,pdo-mapping,drive-state,latch,foe";

/// Frames by which the plugin recognises whether the capture is still the one that was read: their number, length and
/// first bytes. Their distance doubles whenever there are many.
class Checkpoints {
 public:
  void Add(const capture::CapturedFrame& frame) {
    last_ = frame.number;
    if (frame.number % distance_ != 1 && distance_ != 1) return;
    std::string line = "check\t" + std::to_string(frame.number) + '\t' + std::to_string(frame.original_length) + '\t';
    AppendHexBytes(line, frame.bytes.first(std::min(frame.bytes.size(), kCheckedBytes)));
    lines_.emplace_back(frame.number, std::move(line));
    if (lines_.size() < kMost) return;
    distance_ *= 2;
    std::erase_if(lines_, [this](const auto& kept) { return kept.first % distance_ != 1; });
  }
  [[nodiscard]] FrameNo packets() const { return last_; }
  void WriteTo(SideFile& side) const {
    for (const auto& [frame, line] : lines_) side.Directory(line);
  }

 private:
  static constexpr std::size_t kMost = 512;
  FrameNo distance_ = 1;
  FrameNo last_ = 0;
  std::vector<std::pair<FrameNo, std::string>> lines_;
};

std::string SecondsText(TimeNs time) {
  constexpr TimeNs kSecond = 1'000'000'000;
  std::string fraction = std::to_string(time % kSecond);
  fraction.insert(0, 9 - fraction.size(), '0');
  return std::to_string(time / kSecond) + '.' + fraction;
}

/// Reads the packets only: of what the analysis reads the clocks of two interfaces may have been aligned.
Result<FirstFrame> ReadPackets(const std::string& path, Checkpoints& checks) {
  auto source = capture::OpenCapture(path, &InterruptFlag());
  if (!source) return source.error();
  FirstFrame first;
  capture::CapturedFrame frame;
  while ((*source)->Next(frame) == capture::ReadStatus::kFrame) {
    if (frame.number == 1) {
      first.length = frame.original_length;
      if (frame.has_time && frame.time >= 0) first.time = SecondsText(frame.time);
    }
    checks.Add(frame);
  }
  return first;
}

/// Only a side file may be replaced.
std::optional<Error> CheckReplaced(const std::string& path) {
  std::ifstream file(std::filesystem::path(path), std::ios::binary);
  if (!file) return std::nullopt;
  std::string begin(kSignature.size(), '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (file.gcount() == 0 || begin == kSignature) return std::nullopt;
  return Error{path + " exists and is no side file; name another one with -o"};
}

std::string Absolute(const std::string& path) {
  std::error_code failed;
  const std::filesystem::path absolute = std::filesystem::absolute(path, failed);
  return failed ? path : absolute.lexically_normal().string();
}

bool FitsALine(const std::string& path) {
  return path.find_first_of("\t\r\n") == std::string::npos;
}

/// One pass over the capture, with its progress on the terminal.
void RunShown(Observation& observation, TimedSource& source, Progress& progress) {
  PipelineOptions options;
  options.stop = &InterruptFlag();
  options.reached = &ReachedFrame();
  options.progress = [&progress](std::uint64_t done, std::uint64_t total, std::uint64_t frames) {
    progress.Update(done, total, frames);
  };
  observation.Run(source, options);
  progress.Clear();
}

}  // namespace

struct SideRun::Plan {
  std::string name;
  std::string side_path;
  Settings settings;
  FrameRange range;
  CapturePaths paths;
  FirstFrame first;
  PluginFiles plugin;
  std::vector<SignalField> fields;
};

void SideRun::Declare(OptionSet& options) {
  options.Arguments("CAPTURE", capture_.captures, "a pcap or pcapng file, also compressed by gzip or zstd");
  capture_.DeclareSettings(options);
  options.Values("--rule", "ID=SEVERITY", rules_, "error, warning, info, or off for one rule (repeatable)");
  options.Group("Output");
  options.Value("-o,--output", "PATH", output_, "the side file (default: CAPTURE.ecaudit beside the capture)");
  options.Flag("--install", install_, "put the plugin and a profile 'ecaudit' into Wireshark's personal folders");
  options.Value("--folder", "DIR", folder_, "folder of the plugin in place of Wireshark's own; no profile is written");
}

ExitStatus SideRun::Run(Console& console) {
  if (capture_.captures.size() != 1) {
    return Fail(console, Error{"wireshark takes one capture, as Wireshark opens it"});
  }
  Plan plan;
  plan.name = capture_.captures.front();
  if (!Spool::CanBeReadTwice(plan.name) || !FitsALine(plan.name)) {
    return Fail(console, Error{"wireshark needs a capture in a file with a name of one line"});
  }
  plan.side_path = Absolute(output_.value_or(plan.name + ".ecaudit"));
  GateOptions gate;
  gate.rules = rules_;
  Result<Settings> settings = ResolveSettings(capture_, gate, plan.name);
  if (!settings) return Fail(console, settings.error());
  plan.settings = std::move(*settings);
  capture_.ReportSkipped(console);
  plan.paths = CapturePaths(capture_.captures, plan.settings.analysis.interfaces);
  if (const auto error = PlaceMoments(plan.settings, plan.paths, console)) return Fail(console, *error);
  const Result<FrameRange> range = ReadFrameRange(plan.settings.analysis, std::nullopt);
  if (!range) return Fail(console, range.error());
  plan.range = *range;
  Result<PluginFiles> plugin = PluginFiles::In(folder_.value_or(""));
  if (plugin) {
    plan.plugin = std::move(*plugin);
  } else if (install_) {
    return Fail(console, plugin.error());
  }
  CommandFiles files;
  if (const auto error = AddFiles(capture_, files)) return Fail(console, *error);
  AddFiles(plan.settings, files);
  if (const auto error = CheckReplaced(plan.side_path)) return Fail(console, *error);
  if (const auto error = files.Writes(plan.side_path)) return Fail(console, *error);

  ListenForInterrupt();
  Result<SideFile> side = SideFile::Create(plan.side_path);
  if (!side) return Fail(console, side.error());
  Written written;
  if (const ExitStatus status = Write(console, plan, *side, written); status != ExitStatus::kClean) return status;

  std::string text = output_.value_or(plan.name + ".ecaudit") + ": " + Count(written.packets, "packet") + ", " +
                     Count(written.findings, "finding") + ", " + Count(written.rows, "row") + " of " +
                     Count(written.signals, "signal") + "\n";
  if (const auto error = UpdatePlugin(console, plan, text)) return Fail(console, *error);
  if (const auto error = console.Write(text)) return Fail(console, *error);
  return ExitStatus::kClean;
}

ExitStatus SideRun::Write(Console& console, Plan& plan, SideFile& side, Written& written) {
  const auto interrupted = [&] {
    console.Error(plan.name + ": interrupted; nothing was written");
    return ExitStatus::kInterrupted;
  };
  Checkpoints checks;
  const Result<FirstFrame> first = ReadPackets(plan.name, checks);
  if (InterruptFlag()) return interrupted();
  if (!first) return Fail(console, first.error());
  plan.first = *first;
  const std::optional<system::FileStatus> status = system::StatusOf(plan.name);
  if (!status) return Fail(console, Error{plan.name + ": " + system::ReasonText(errno)});
  side.Directory("capture\t" + std::to_string(status->bytes) + '\t' + std::to_string(checks.packets()) + '\t' +
                 first->time + '\t' + std::to_string(first->length) + '\t' + Absolute(plan.name));
  checks.WriteTo(side);
  written.packets = checks.packets();

  auto error = WriteFindings(console, plan, side, written);
  if (!error && !InterruptFlag()) error = WriteEvents(console, plan, side);
  if (!error && !InterruptFlag()) error = WriteSignals(console, plan, side, written);
  if (InterruptFlag()) return interrupted();
  if (!error) error = side.Finish();
  return error ? Fail(console, *error) : ExitStatus::kClean;
}

std::optional<Error> SideRun::WriteFindings(Console& console, const Plan& plan, SideFile& side,
                                            Written& written) const {
  const std::string label = std::filesystem::path(plan.name).filename().string() + ", findings";
  const Result<AnalysisResult> evaluated = EvaluateWhole(capture_, plan.settings, plan.paths, label, console);
  if (!evaluated) return evaluated.error();
  if (InterruptFlag()) return std::nullopt;
  const AnalysisResult& result = *evaluated;
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    const Finding& finding = result.findings[i];
    const std::string place = std::to_string(i);
    const std::string cause =
        finding.caused_by < result.findings.size() ? report::FindingId(result, finding.caused_by) : std::string();
    side.Directory("finding\t" + place + '\t' + report::FindingId(result, static_cast<FindingIndex>(i)) + '\t' +
                   std::string(Name(finding.severity)) + '\t' + std::string(finding.rule) + '\t' +
                   SideField(report::SlaveLabel(result, finding.slave)) + '\t' + std::to_string(finding.count) + '\t' +
                   cause + '\t' + SideField(report::TitleOf(finding)) + '\t' +
                   SideField(report::MessageOf(finding, result)));
    const auto mark = [&](FrameNo frame, std::string_view role) {
      side.Directory("mark\t" + std::to_string(frame) + '\t' + place + '\t' + std::string(role));
    };
    // What concerns the whole file stands on its first frame.
    mark(finding.first.seen() ? finding.first.number : 1, finding.first.seen() ? "first" : "file");
    const bool repeats = finding.last.seen() && finding.last.number != finding.first.number;
    if (repeats) mark(finding.last.number, "last");
    for (const FrameNo frame : finding.related_frames) {
      if (frame != 0 && frame != finding.first.number && !(repeats && frame == finding.last.number)) {
        mark(frame, "related");
      }
    }
  }
  written.findings = result.findings.size();
  return std::nullopt;
}

std::optional<Error> SideRun::WriteEvents(Console& console, const Plan& plan, SideFile& side) const {
  auto opened = plan.paths.Open();
  if (!opened) return opened.error();
  TimedSource source(**opened, plan.range);
  const Result<EventTypes> types = EventTypes::Parse({kEventChoice});
  if (!types) return types.error();
  Observation observation(plan.settings.analysis, Depth::kClocks);
  SideEvents events(side, observation.pipeline().network(), plan.settings.analysis.slave_names);
  const StreamContext context{source, plan.settings, plan.range, {}, report::TimeMode::kRelative};
  EventWriter writer(*types, &events);
  writer.Begin(observation, context);
  observation.bus().Listen<sync::PhaseMeasured>(Stage::kAfterModel, events, &SideEvents::On);
  Progress progress(console, std::filesystem::path(plan.name).filename().string() + ", events");
  RunShown(observation, source, progress);
  writer.End();
  if (events.too_late() > 0) {
    console.Warning(Count(events.too_late(), "event") + " became known too late for the side file; 'ecaudit events' " +
                    "shows them");
  }
  return side.error();
}

std::optional<Error> SideRun::WriteSignals(Console& console, Plan& plan, SideFile& side, Written& written) const {
  SideRows rows(side, plan.fields);
  SignalOptions wish;
  wish.choice.states = wish.choice.scaled = true;
  wish.sink = &rows;
  SignalWriter writer(std::move(wish));
  const std::string label = std::filesystem::path(plan.name).filename().string() + ", process data";
  bool learning = true;
  for (int pass = 0;; ++pass) {
    auto opened = plan.paths.Open();
    if (!opened) return opened.error();
    TimedSource source(**opened, plan.range);
    Observation observation(writer.Adapt(plan.settings.analysis), writer.depth());
    const StreamContext context{source, plan.settings, plan.range, {}, report::TimeMode::kRelative};
    if (learning) {
      writer.BeginLearning(observation, context);
    } else {
      writer.Begin(observation, context);
    }
    Progress progress(console, label);
    RunShown(observation, source, progress);
    if (InterruptFlag()) return std::nullopt;
    if (!learning) break;
    if (auto error = writer.EndLearning(console)) return error;
    if (writer.learns_again()) continue;
    learning = false;
    if (!writer.kept()) continue;
    if (auto error = writer.WriteKept(context)) return error;
    break;
  }
  writer.End();
  written.rows = rows.rows();
  written.signals = plan.fields.size();
  return side.error();
}

std::optional<Error> SideRun::UpdatePlugin(Console& console, const Plan& plan, std::string& summary) const {
  const PluginFiles& plugin = plan.plugin;
  if (install_) {
    if (auto error = plugin.Install()) return error;
  }
  if (plugin.folder().empty() || !plugin.installed()) {
    summary += "Wireshark has no plugin for it yet: ecaudit wireshark --install " + Printable(plan.name) + "\n";
    return std::nullopt;
  }
  if (plugin.differs()) {
    console.Warning(plugin.plugin() + " is of another version of ecaudit; --install replaces it");
  }
  const Result<std::size_t> added = plugin.AddFields(plan.fields);
  if (!added) return added.error();
  if (FitsALine(plan.side_path)) {
    if (auto error = plugin.AddCapture(plan.first, plan.side_path)) return error;
  }
  summary += "plugin: " + Printable(plugin.plugin()) + "\n";
  if (install_ && !plugin.profile().empty()) {
    summary += "profile 'ecaudit' with columns and colours: " + Printable(plugin.profile()) + "\n";
  }
  if (*added > 0) {
    summary += Count(*added, "new field") + ": restart Wireshark, or choose Analyze, Reload Lua Plugins\n";
  }
  return std::nullopt;
}

}  // namespace ecaudit::cli
