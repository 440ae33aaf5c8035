#include "cli/copy/copy_run.h"

#include <cstdint>
#include <filesystem>
#include <utility>

#include "cli/capture_check.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/progress.h"
#include "cli/stream/spool.h"
#include "cli/version.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/capture/pcapng_writer.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kCopyBufferBytes = std::size_t{1} << 20U;

ExitStatus InterruptedCopy(Console& console, const std::string& name, const std::string& what = "nothing was written") {
  console.Error(name + ": interrupted; " + what);
  return ExitStatus::kInterrupted;
}

/// EtherCAT of any kind, whole or broken: what may leave the house without being asked for.
bool IsEtherCat(const capture::CapturedFrame& frame) {
  const wire::FrameView view = wire::FrameView::Parse(frame);
  return view.kind() != wire::FrameKind::kOther || view.has_ethercat_header();
}

/// A file, or standard output.
class ByteOutput {
 public:
  [[nodiscard]] std::optional<Error> Open(const std::string& path, Console& console) {
    console_ = &console;
    if (path == "-") return std::nullopt;
    Result<OutputFile> file = OutputFile::Create(path);
    if (!file) return file.error();
    file_.emplace(std::move(*file));
    return std::nullopt;
  }
  [[nodiscard]] std::optional<Error> Write(std::string& bytes) {
    auto error = file_ ? file_->Write(bytes) : console_->Write(bytes);
    bytes.clear();
    return error;
  }
  [[nodiscard]] bool reader_gone() const { return !file_ && console_->reader_gone(); }
  [[nodiscard]] std::optional<Error> Finish() { return file_ ? file_->Finish() : std::nullopt; }

 private:
  Console* console_ = nullptr;
  std::optional<OutputFile> file_;
};

/// What went into the copy.
struct Copied {
  std::uint64_t packets = 0;
  std::uint64_t other_left_out = 0;  ///< without EtherCAT, although chosen
  std::uint64_t with_findings = 0;
};

class Copier {
 public:
  Copier(capture::FrameSource& source, CopyRun::Wish& wish, const FrameComments& comments, bool all_traffic)
      : source_(source), wish_(wish), comments_(comments), all_traffic_(all_traffic) {}

  /// @param interfaces  all of the capture, as the first pass found them
  [[nodiscard]] std::optional<Error> Run(const std::vector<capture::Interface>& interfaces, const std::string& about,
                                         ByteOutput& output, Progress& progress) {
    capture::PcapngWriter writer(buffer_);
    writer.BeginSection("ecaudit " + std::string(Version()), about);
    for (const capture::Interface& interface : interfaces) writer.AddInterface(interface);
    capture::CapturedFrame frame;
    std::uint64_t read = 0;
    while (!InterruptFlag() && source_.Next(frame) == capture::ReadStatus::kFrame &&
           frame.number <= wish_.choice.last()) {
      if ((++read & 0xFFFFU) == 0) progress.Update(source_.bytes_read(), source_.bytes_total(), read);
      if (frame.has_time && !origin_) origin_ = frame.time;
      TakeComments(frame.number);
      if (!wish_.choice.Contains(frame.number, Seconds(frame))) continue;
      if (!all_traffic_ && !IsEtherCat(frame)) {
        ++copied_.other_left_out;
        continue;
      }
      writer.AddPacket(frame, texts_);
      ++copied_.packets;
      if (buffer_.size() >= kCopyBufferBytes) {
        if (auto error = output.Write(buffer_)) return error;
        if (output.reader_gone()) return std::nullopt;
      }
    }
    if (InterruptFlag()) return std::nullopt;
    writer.AddStatistics(interfaces);
    return output.Write(buffer_);
  }
  [[nodiscard]] const Copied& copied() const { return copied_; }

 private:
  [[nodiscard]] std::optional<double> Seconds(const capture::CapturedFrame& frame) const {
    std::int64_t ns = 0;
    if (!origin_ || !frame.has_time || __builtin_sub_overflow(frame.time, *origin_, &ns)) return std::nullopt;
    return static_cast<double>(ns) / 1e9;
  }

  /// Ours first, then those that the packet has in the capture itself.
  void TakeComments(FrameNo frame) {
    texts_.clear();
    const auto found = comments_.find(frame);
    if (found != comments_.end()) {
      texts_ = found->second;
    } else if (wish_.number_every_packet) {
      texts_.push_back("frame " + std::to_string(frame));
    }
    const std::vector<capture::Comment>& own = source_.info().comments;
    for (; next_own_ < own.size(); ++next_own_) {
      if (own[next_own_].frame == frame) texts_.push_back(own[next_own_].text);
    }
  }

  capture::FrameSource& source_;
  CopyRun::Wish& wish_;
  const FrameComments& comments_;
  bool all_traffic_;
  std::string buffer_;
  std::vector<std::string> texts_;
  std::size_t next_own_ = 0;
  std::optional<TimeNs> origin_;
  Copied copied_;
};

}  // namespace

void CopyRun::Declare(OptionSet& options) {
  capture_.Declare(options);
  options.Values("--rule", "ID=SEVERITY", rules_, "error, warning, info, or off for one rule (repeatable)");
  options.Group("Output");
  options.Values("-o,--output", "PATH", outputs_, "the pcapng file to write; - is standard output");
  options.Flag("--all-traffic", all_traffic_, "also copy other packets (default: only EtherCAT)");
  options.Flag("--force", force_, "overwrite PATH when it exists");
}

std::optional<Error> CopyRun::CheckOutput(CommandFiles& files) {
  if (outputs_.empty()) return Error{"give the pcapng file to write with -o PATH (- is standard output)"};
  if (outputs_.size() > 1) return Error{"only one pcapng file can be written; give -o once"};
  output_ = outputs_.front();
  if (output_ == "-") return std::nullopt;
  if (system::IsFile(output_)) {
    if (auto error = files.Claims(output_)) return error;
    if (!force_) return Error{output_ + " exists; give --force to overwrite it"};
    return std::nullopt;
  }
  return files.Writes(output_);
}

/// What the command line comes to.
struct CopyRun::Plan {
  std::string name;       ///< of the capture, as typed
  std::string file_name;  ///< without its folder
  Settings settings;
  FrameRange range;
  CapturePaths paths;
};

ExitStatus CopyRun::Run(Console& console, std::string_view command, const std::optional<std::string>& frames,
                        const Decide& decide) {
  // Everything that can be wrong with the command line is found before the capture is read.
  if (capture_.captures.size() > 1 && !capture_.join) {
    return Fail(console, Error{std::string(command) +
                               " reads one capture; give --join when these are files of one ring buffer"});
  }
  Plan plan;
  plan.name = capture_.captures.front();
  plan.file_name = std::filesystem::path(plan.name).filename().string();
  GateOptions gate;
  gate.rules = rules_;
  Result<Settings> settings = ResolveSettings(capture_, gate, plan.name);
  if (!settings) return Fail(console, settings.error());
  plan.settings = std::move(*settings);
  capture_.ReportSkipped(console);
  plan.paths = CapturePaths(capture_.captures, plan.settings.analysis.interfaces);
  const bool place = plan.settings.moments.needs_capture();
  if (place) {
    if (const auto error = plan.paths.MakeReadableTwice()) return Fail(console, *error);
    if (const auto error = PlaceMoments(plan.settings, plan.paths, console)) return Fail(console, *error);
  }
  const Result<FrameRange> range = ReadFrameRange(plan.settings.analysis, frames);
  if (!range) return Fail(console, range.error());
  plan.range = *range;
  CommandFiles files;
  if (const auto error = AddFiles(capture_, files)) return Fail(console, *error);
  AddFiles(plan.settings, files);
  if (const auto error = CheckOutput(files)) return Fail(console, *error);
  if (output_ == "-" && console.output_is_terminal()) {
    return Fail(console, Error{"a capture cannot be shown on a terminal; name a file, or pipe the output"});
  }

  ListenForInterrupt();
  if (!place) {
    if (const auto error = plan.paths.MakeReadableTwice()) return Fail(console, *error);
  }
  const Result<AnalysisResult> result =
      EvaluateWhole(capture_, plan.settings, plan.paths, plan.file_name + ", first pass", console);
  if (InterruptFlag()) return InterruptedCopy(console, plan.name);
  if (!result) return Fail(console, result.error());
  Result<Wish> wish = decide(*result, plan.range);
  if (!wish) return Fail(console, Error{plan.name + ": " + wish.error().message});
  return Copy(console, plan, *result, *wish);
}

ExitStatus CopyRun::Copy(Console& console, const Plan& plan, const AnalysisResult& result, Wish& wish) const {
  auto source = plan.paths.Open();
  if (!source && InterruptFlag()) return InterruptedCopy(console, plan.name);
  if (!source) return Fail(console, source.error());
  ByteOutput output;
  if (const auto error = output.Open(output_, console)) return Fail(console, *error);
  const FrameComments comments = CommentsOf(result);
  std::string about = wish.what + " " + Printable(plan.file_name) +
                      ". Frame numbers in the comments are those of that capture" +
                      (all_traffic_ ? "." : "; packets without EtherCAT are left out.");
  if (const std::string rest = FindingsWithoutFrame(result); !rest.empty()) about += "\n" + rest;
  Progress progress(console, plan.file_name);
  Copier copier(**source, wish, comments, all_traffic_);
  const auto error = copier.Run(result.capture.file.interfaces, about, output, progress);
  progress.Clear();
  if (InterruptFlag()) {
    return output_ == "-" ? InterruptedCopy(console, plan.name, "the copy ends early")
                          : InterruptedCopy(console, plan.name);
  }
  if (error) return Fail(console, *error);
  const Copied& copied = copier.copied();
  if (copied.packets == 0 && !output.reader_gone()) {
    return Fail(console,
                Error{plan.name + ": there is nothing to write" +
                      (copied.other_left_out > 0 ? "; the chosen packets hold no EtherCAT (--all-traffic copies them)"
                                                 : " in this range")});
  }
  if (const auto failed = output.Finish()) return Fail(console, *failed);
  if (output_ == "-") return ExitStatus::kClean;
  std::string line = output_ + ": " + Grouped(copied.packets) + " of " + Count(result.capture.packets, "packet");
  if (copied.other_left_out > 0) line += ", " + Grouped(copied.other_left_out) + " without EtherCAT left out";
  if (const auto failed = console.Write(Printable(line) + "\n")) return Fail(console, *failed);
  return ExitStatus::kClean;
}

}  // namespace ecaudit::cli
