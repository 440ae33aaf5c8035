/// `ecaudit wireshark`: what was found, in Wireshark's own packet list.
#include <memory>

#include "cli/commands/command.h"
#include "cli/wireshark/side_run.h"

namespace ecaudit::cli {
namespace {

class WiresharkCommand : public Command {
 public:
  WiresharkCommand()
      : Command("wireshark", "wireshark CAPTURE", "Show findings, states and process data inside Wireshark") {}

  void Declare(OptionSet& options) override {
    run_.Declare(options);
    options.Footer(
        "\nWrites a side file, CAPTURE.ecaudit, from which a plugin shows in each frame: process data by name, states\n"
        "of drives, AL states, SDO transfers with both their frames, the phase of the clocks, and findings as expert\n"
        "information. Filters: ecaudit.finding, ecaudit.al.state, ecaudit.drive.state == \"Fault\", ecaudit.sdo,\n"
        "ecaudit.dc.phase, ecaudit.signal.s0.status_word. Run it again after the capture has changed.\n"
        "After one --install, an installed plugin finds the side files of other captures.\n"
        "Example: ecaudit wireshark --install trace.pcapng && wireshark -C ecaudit trace.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override { return run_.Run(console); }

 private:
  SideRun run_;
};

}  // namespace

std::unique_ptr<Command> MakeWiresharkCommand() {
  return std::make_unique<WiresharkCommand>();
}

}  // namespace ecaudit::cli
