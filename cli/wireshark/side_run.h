/// `ecaudit wireshark`: analyses a capture and writes its side file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/capture_options.h"
#include "cli/console.h"
#include "cli/exit_status.h"
#include "cli/stream/frame_range.h"
#include "cli/wireshark/plugin_files.h"
#include "cli/wireshark/side_file.h"

namespace ecaudit::cli {

class SideRun {
 public:
  void Declare(OptionSet& options);
  [[nodiscard]] ExitStatus Run(Console& console);

 private:
  struct Plan;
  struct Written {
    std::uint64_t packets = 0;
    std::uint64_t rows = 0;
    std::size_t signals = 0;
    std::size_t findings = 0;
  };
  [[nodiscard]] ExitStatus Write(Console& console, Plan& plan, SideFile& side, Written& written);
  [[nodiscard]] std::optional<Error> WriteFindings(Console& console, const Plan& plan, SideFile& side,
                                                   Written& written) const;
  [[nodiscard]] std::optional<Error> WriteEvents(Console& console, const Plan& plan, SideFile& side) const;
  [[nodiscard]] std::optional<Error> WriteSignals(Console& console, Plan& plan, SideFile& side, Written& written) const;
  [[nodiscard]] std::optional<Error> UpdatePlugin(Console& console, const Plan& plan, std::string& summary) const;

  CaptureOptions capture_;
  std::vector<std::string> rules_;
  std::optional<std::string> output_;
  std::optional<std::string> folder_;
  bool install_ = false;
};

}  // namespace ecaudit::cli
