/// `ecaudit slice`: the evidence of a finding as a capture of its own.
#include <algorithm>
#include <charconv>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "cli/commands/command.h"
#include "cli/copy/copy_run.h"

namespace ecaudit::cli {
namespace {

constexpr FrameNo kFindingContext = 10;

class SliceCommand : public Command {
 public:
  SliceCommand() : Command("slice", "slice CAPTURE", "Copy the frames of a finding into a capture with comments") {}

  void Declare(OptionSet& options) override {
    run_.Declare(options);
    options.Group("What to read");
    options.Values("--finding", "ID,...", findings_,
                   "the frames of this finding and of its causes: f1 as in the report, or a rule (repeatable)");
    options.Words(RuleIds());
    options.Value("--frames", "A-B", frames_, "these frames: 743-800, 760, 743- or -800");
    options.Value("--context", "N", context_,
                  "also N packets before and after each (default: 10 with --finding, 0 with --frames)");
    options.Footer(
        "\nFrames are copied byte by byte with their time stamps. Each has its number in the capture as comment, and\n"
        "what was found in it; 'frame.comment contains \"error\"' finds them in Wireshark. Findings have the numbers\n"
        "that 'ecaudit check' gives them with the same options.\n"
        "Example: ecaudit slice trace.pcapng --finding f1 -o evidence.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    if (findings_.empty() && !frames_) return Fail(console, "give --finding ID or --frames A-B");
    if (!findings_.empty() && frames_) return Fail(console, "give either --finding ID or --frames A-B, not both");
    FrameNo context = frames_ ? 0 : kFindingContext;
    if (context_) {
      const char* const end = context_->data() + context_->size();
      const auto [stop, error] = std::from_chars(context_->data(), end, context);
      if (error != std::errc() || stop != end || context > kMostContext) {
        return Fail(console, "--context is '" + *context_ + "' but must be a number of packets");
      }
    }
    const auto decide = [&](const AnalysisResult& result, const FrameRange& range) -> Result<CopyRun::Wish> {
      if (frames_) return CopyRun::Wish{FrameChoice(Widened(range, context)), true, "Frames " + *frames_ + " of"};
      const Result<std::vector<std::size_t>> found = FindingsNamed(result, Split(findings_));
      if (!found) return found.error();
      std::vector<FrameNo> frames;
      for (const std::size_t finding : *found) {
        const std::vector<FrameNo> evidence = EvidenceFrames(result, finding);
        frames.insert(frames.end(), evidence.begin(), evidence.end());
      }
      if (frames.empty()) return Error{"the finding concerns the whole capture and cites no frame"};
      std::string names;
      for (const std::string& name : Split(findings_)) names += (names.empty() ? "" : ", ") + name;
      return CopyRun::Wish{FrameChoice(range, std::move(frames), context), true, "Evidence of " + names + " in"};
    };
    return run_.Run(console, name(), frames_, decide);
  }

 private:
  static constexpr FrameNo kMostContext = 1'000'000'000;
  static constexpr FrameNo kMostFrames = std::numeric_limits<FrameNo>::max() - kMostContext;

  static ExitStatus Fail(Console& console, const std::string& message) {
    console.Error(message);
    return ExitStatus::kUsage;
  }

  static FrameRange Widened(FrameRange range, FrameNo context) {
    if (range.from_frame) range.from_frame = *range.from_frame > context ? *range.from_frame - context : 1;
    if (range.to_frame && *range.to_frame < kMostFrames) *range.to_frame += context;
    return range;
  }

  /// "f1,f2" is two names.
  static std::vector<std::string> Split(const std::vector<std::string>& lists) {
    std::vector<std::string> names;
    for (const std::string& list : lists) {
      for (std::size_t at = 0; at <= list.size();) {
        const std::size_t comma = std::min(list.find(',', at), list.size());
        names.push_back(list.substr(at, comma - at));
        at = comma + 1;
      }
    }
    return names;
  }

  CopyRun run_;
  std::vector<std::string> findings_;
  std::optional<std::string> frames_;
  std::optional<std::string> context_;
};

}  // namespace

std::unique_ptr<Command> MakeSliceCommand() {
  return std::make_unique<SliceCommand>();
}

}  // namespace ecaudit::cli
