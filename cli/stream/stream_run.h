/// What `decode`, `events` and `signals` share: one capture, its range, and lines that leave while it is read.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analyzers/observation.h"
#include "cli/capture_options.h"
#include "cli/console.h"
#include "cli/exit_status.h"
#include "cli/output_plan.h"
#include "cli/stream/columns.h"
#include "cli/stream/frame_range.h"
#include "cli/stream/line_output.h"
#include "cli/stream/stream_formats.h"

namespace ecaudit::cli {

/// One destination.
struct LineTarget {
  std::size_t format = 0;  ///< place in LineWriter::formats()
  bool color = false;
  LineOutput output;
};

/// What was chosen, ready to run.
struct StreamContext {
  const TimedSource& source;
  const Settings& settings;
  const FrameRange& range;
  std::span<LineTarget> targets;
  report::TimeMode time_mode = report::TimeMode::kRelative;

  /// Only while the capture is read: the first packet shows the origin.
  [[nodiscard]] TimeColumn time() const { return {time_mode, source.origin()}; }
};

/// Writes lines while a capture is read.
class LineWriter {
 public:
  virtual ~LineWriter() = default;
  /// What it can write, the default first.
  [[nodiscard]] virtual std::span<const OutputFormat> formats() const = 0;
  /// What it needs to know.
  [[nodiscard]] virtual Depth depth() const = 0;
  /// The analysis as the writer wants it, where that is not as the user set it.
  [[nodiscard]] virtual const AnalysisOptions& Adapt(const AnalysisOptions& options) { return options; }
  /// Before the first packet: listens to what it shows. `observation` and `context` outlive the writer's work.
  virtual void Begin(Observation& observation, const StreamContext& context) = 0;
  /// After the last packet.
  virtual void End() {}
  /// True when it must read the capture once before it can write; then BeginLearning() and EndLearning() frame a pass.
  [[nodiscard]] virtual bool learns() const { return false; }
  /// True after EndLearning() when what it found makes another such pass necessary.
  [[nodiscard]] virtual bool learns_again() const { return false; }
  /// `context` is gone after EndLearning(), and has no targets; `observation` lives until all is written.
  virtual void BeginLearning(Observation& observation, const StreamContext& context);
  /// @return why nothing can be written
  [[nodiscard]] virtual std::optional<Error> EndLearning(Console& console);
  /// True after EndLearning() when it has kept what it writes: WriteKept() then takes the place of another pass.
  [[nodiscard]] virtual bool kept() const { return false; }
  /// @return what went wrong
  [[nodiscard]] virtual std::optional<Error> WriteKept(const StreamContext& context);
  /// Whether one of the slaves of --slave is shown that no frame of the capture addresses.
  [[nodiscard]] virtual bool ShowsUnmet(std::span<const SlaveSelector> selectors) const;
  /// True when nothing after --to can change what is shown, so that reading may stop there.
  [[nodiscard]] virtual bool stops_at_range_end() const = 0;
};

class StreamRun {
 public:
  void Declare(OptionSet& options, const StreamFormats& formats);
  /// Reads the capture and lets `writer` write. What goes wrong is reported on `console`, once.
  [[nodiscard]] ExitStatus Run(Console& console, LineWriter& writer, std::string_view command);

 private:
  struct Plan;
  struct Pass;
  [[nodiscard]] ExitStatus Learn(Console& console, LineWriter& writer, const Plan& plan, Pass& pass);
  [[nodiscard]] ExitStatus Write(Console& console, LineWriter& writer, const Plan& plan, Pass& pass,
                                 std::vector<LineTarget>& targets);

  CaptureOptions capture_;
  OutputOptions output_;
  std::optional<std::string> frames_;
};

/// Whether a slave with these addresses is one of those; true when there are no selectors.
[[nodiscard]] bool SelectsAddress(std::span<const SlaveSelector> selectors, std::optional<SlavePos> position,
                                  std::optional<StationAddress> station);
/// Whether --slave asks for this slave; true when it was not given.
[[nodiscard]] bool SelectsSlave(std::span<const SlaveSelector> selectors, const track::Network& network, SlaveId slave);

}  // namespace ecaudit::cli
