/// `ecaudit signals`: process data by name over time.
#include <charconv>
#include <memory>
#include <string>
#include <vector>

#include "cli/commands/command.h"
#include "cli/stream/signal_writer.h"
#include "cli/stream/stream_formats.h"
#include "cli/stream/stream_run.h"

namespace ecaudit::cli {
namespace {

class SignalsCommand : public Command {
 public:
  SignalsCommand()
      : Command("signals", "signals CAPTURE", "Write process data by name over time, as a table for plots") {}

  void Declare(OptionSet& options) override {
    run_.Declare(options, StreamFormats::OfSignals());
    options.Group("What to read");
    options.Values("--signal,--object", "NAME,...", signals_,
                   "only these, by name or object, with * and ?: 'position*', 6041h, 's0.*' (repeatable)");
    options.Flag("--changes", changes_, "only rows in which a value differs from the last one shown");
    options.Value("--every", "N", every_, "of the frames of each kind, only the first of every N");
    options.Group("Output");
    options.Flag("--states", states_,
                 "control and status words also as command and state of the drive; other values in words");
    options.Flag("--scaled", scaled_, "divide values by their scale where it is known (default: as on the wire)");
    options.Footer(
        "\nA row is a frame with process data; columns: time_s (seconds from the first packet), dc_time_ns (system "
        "time\n"
        "read in the same frame, where there is one), frame, then one a signal: S0 is the first slave (see "
        "--count-from).\n"
        "Empty: not in this frame, or the working counter does not show that the slave gave it. The capture is read\n"
        "twice, "
        "so that the columns of all its mappings are above the first row; after a change of the mapping\n"
        "the columns of the old one stay empty. Where the meaning of bytes is not known, they are one column in\n"
        "hexadecimal, and standard error gives the reason; --eni and --esi help. With jsonl a line for each column "
        "comes "
        "first.\n"
        "Example: ecaudit signals --signal 'position*,6041h' --states -o axis.csv trace.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    SignalOptions options;
    Result<std::vector<std::string>> patterns = SignalChoice::ParsePatterns(signals_);
    if (!patterns) return Fail(console, patterns.error().message);
    options.choice = {std::move(*patterns), states_, scaled_};
    options.changes = changes_;
    if (every_) {
      const char* end = every_->data() + every_->size();
      const auto [stop, error] = std::from_chars(every_->data(), end, options.every);
      if (error != std::errc() || stop != end || options.every == 0) {
        return Fail(console, "--every is '" + *every_ + "' but must be a number of frames from 1 on");
      }
    }
    SignalWriter writer(std::move(options));
    return run_.Run(console, writer, name());
  }

 private:
  static ExitStatus Fail(Console& console, const std::string& message) {
    console.Error(message);
    return ExitStatus::kUsage;
  }

  StreamRun run_;
  std::vector<std::string> signals_;
  std::optional<std::string> every_;
  bool changes_ = false;
  bool states_ = false;
  bool scaled_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeSignalsCommand() {
  return std::make_unique<SignalsCommand>();
}

}  // namespace ecaudit::cli
