/// What `slice` and `annotate` share: a capture is analysed, then read once more, and packets are copied byte by byte
/// into a pcapng file with the findings as comments.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/capture_options.h"
#include "cli/console.h"
#include "cli/copy/evidence_comments.h"
#include "cli/copy/frame_choice.h"
#include "cli/exit_status.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

class CopyRun {
 public:
  void Declare(OptionSet& options);

  /// What one command makes of the result.
  struct Wish {
    FrameChoice choice;
    bool number_every_packet = false;  ///< packets without a finding get "frame 812" as their comment
    std::string what;                  ///< for the comment of the whole file: "Evidence of f1 in"
  };
  using Decide = std::function<Result<Wish>(const AnalysisResult& result, const FrameRange& range)>;
  /// @param frames  as typed after --frames
  [[nodiscard]] ExitStatus Run(Console& console, std::string_view command, const std::optional<std::string>& frames,
                               const Decide& decide);

 private:
  struct Plan;
  [[nodiscard]] std::optional<Error> CheckOutput(CommandFiles& files);
  [[nodiscard]] ExitStatus Copy(Console& console, const Plan& plan, const AnalysisResult& result, Wish& wish) const;

  CaptureOptions capture_;
  std::vector<std::string> rules_;
  std::vector<std::string> outputs_;
  std::string output_;
  bool force_ = false;
  bool all_traffic_ = false;
};

}  // namespace ecaudit::cli
