/// Analyses and evaluates one capture: the work that check and batch have in common.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "cli/baseline.h"
#include "cli/capture_options.h"
#include "cli/console.h"
#include "cli/report/report.h"
#include "cli/stream/spool.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Baselines by path, so that many captures read each once.
class BaselineShelf {
 public:
  /// Reads `path` unless it is known; an empty path is no baseline.
  [[nodiscard]] std::optional<Error> Load(const std::string& path);
  /// Null for an empty path.
  [[nodiscard]] const Baseline* Find(const std::string& path) const;
  /// Reports, once, which entries do not hold any more.
  void WarnOfExpired(Console& console);
  /// Reports which entries match no finding of the captures that were compared with them.
  void WarnOfUnmatched(const std::vector<report::CaptureDigest>& captures, Console& console) const;

 private:
  std::map<std::string, Baseline> baselines_;
  bool warned_ = false;
};

/// Why there is nothing to examine: none of the packets of `capture` lies in the range of `selection`.
[[nodiscard]] Error EmptyRange(const std::string& capture, report::Selection selection);

/// What costs time of its own, and only some reports show.
struct WantedExtras {
  bool timeline = false;      ///< what happened over time
  bool decode_lines = false;  ///< where findings stand in the text of `decode`
};

struct CheckedCapture {
  report::CaptureReport report;
  bool lacks_slave = false;          ///< --slave names none of its slaves
  std::string slaves_there;          ///< what it has instead: "slaves count from 0, and there is 0 (AKD, 0x1001)"
  std::vector<std::string> missing;  ///< slaves of --slave that it does not show, when it shows others of them
  std::vector<std::string> unmet;    ///< slaves that --profile or --parameter name and the capture does not show
  std::vector<std::string> notices;  ///< sentences about the range that the user may not expect
};

/// @param paths     one capture, or the files of one ring buffer
/// @param baseline  null: none
/// @param progress  called now and then with bytes done, bytes in all, and frames; may be empty
/// @param wanted    what reports show besides the result
/// @param reached   holds the number of the packet at hand; null: not wanted
/// @return fails when the capture cannot be opened, and when none of its packets lies in the range; damage after its
/// header is a finding
[[nodiscard]] Result<CheckedCapture> CheckCapture(
    std::span<const std::string> paths, const Settings& settings, const Baseline* baseline,
    const std::atomic<bool>& stop, std::function<void(std::uint64_t, std::uint64_t, std::uint64_t)> progress,
    const WantedExtras& wanted = {}, std::atomic<FrameNo>* reached = nullptr);

/// Places the moments of the range in the capture and warns of what the user may not expect of it.
[[nodiscard]] std::optional<Error> PlaceMoments(Settings& settings, const CapturePaths& paths, Console& console);

/// Evaluates the whole capture, whatever its settings leave out, so that findings have the numbers that `check` gives
/// them; warns of damage. An interrupted result is incomplete.
/// @param label  what the progress on the terminal is called
/// @return fails when the capture cannot be opened, or has none of the slaves of --slave
[[nodiscard]] Result<AnalysisResult> EvaluateWhole(const CaptureOptions& capture, const Settings& settings,
                                                   const CapturePaths& paths, const std::string& label,
                                                   Console& console);

}  // namespace ecaudit::cli
