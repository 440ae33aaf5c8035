/// `ecaudit annotate`: the whole capture with the findings as packet comments.
#include <memory>

#include "cli/commands/command.h"
#include "cli/copy/copy_run.h"

namespace ecaudit::cli {
namespace {

class AnnotateCommand : public Command {
 public:
  AnnotateCommand() : Command("annotate", "annotate CAPTURE", "Copy a capture with each finding as a packet comment") {}

  void Declare(OptionSet& options) override {
    run_.Declare(options);
    options.Footer(
        "\nFrames are copied byte by byte with their time stamps; those of findings get comments, which Wireshark\n"
        "lists with the display filter frame.comment and under Statistics, Capture File Properties.\n"
        "Example: ecaudit annotate trace.pcapng -o annotated.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    return run_.Run(console, name(), std::nullopt,
                    [](const AnalysisResult&, const FrameRange& range) -> Result<CopyRun::Wish> {
                      return CopyRun::Wish{FrameChoice(range), false, "Annotated copy of"};
                    });
  }

 private:
  CopyRun run_;
};

}  // namespace

std::unique_ptr<Command> MakeAnnotateCommand() {
  return std::make_unique<AnnotateCommand>();
}

}  // namespace ecaudit::cli
