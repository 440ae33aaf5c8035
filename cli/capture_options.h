/// What commands that evaluate captures have in common: their options, and what options and configuration file come to.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "analyzers/options/options.h"
#include "cli/command_files.h"
#include "cli/console.h"
#include "cli/moments.h"
#include "cli/options.h"
#include "cli/report/report.h"
#include "cli/requirements.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Options as typed.
struct CaptureOptions {
  std::vector<std::string> captures;
  bool join = false;
  std::vector<std::string> profiles;
  std::vector<std::string> families;  ///< files and folders of --profiles
  std::vector<std::string> parameters;
  std::vector<std::string> esi;
  std::optional<std::string> eni;
  std::vector<std::string> slaves;
  std::optional<std::string> count_from;  ///< --count-from: "0" or "1"
  std::vector<std::string> interfaces;
  std::optional<std::string> from, to, around, window;
  bool isolate = false;     ///< packets outside the range are not evaluated
  std::string isolates;     ///< name of a command that does so always; empty: the option decides
  bool local_time = false;  ///< clock times without a zone are those of this machine
  std::optional<std::string> config;
  bool no_config = false;  ///< neither --config nor a file beside the capture
  /// ESI, ENI and families by the names of their files; kept by ResolveSettings() so that many captures read them once.
  mutable std::map<std::tuple<std::vector<std::string>, std::optional<std::string>, std::vector<std::string>>,
                   std::shared_ptr<const DeviceFiles>>
      files;

  /// What ResolveSettings() left out and why; ReportSkipped() warns of it once.
  mutable std::vector<std::string> skipped;
  void ReportSkipped(Console& console) const;

  void Declare(OptionSet& options);
  /// All but the captures themselves and --join.
  void DeclareSettings(OptionSet& options);
  /// For commands that evaluate the whole capture and show what touches the range.
  void DeclareIsolate(OptionSet& options);
};

/// Options of the commands whose exit status shows what was found.
struct GateOptions {
  std::optional<std::string> fail_on;
  std::vector<std::string> rules;
  std::optional<std::string> baseline;
  std::optional<std::string> write_baseline;
  std::optional<std::string> require;

  void Declare(OptionSet& options);
};

/// How one capture is analysed and evaluated.
struct Settings {
  AnalysisOptions analysis;
  std::vector<SlaveSelector> slaves;  ///< empty: all
  MomentRange moments;                ///< limits that must be placed in each capture; the others stand in `analysis`
  std::string isolated_by;            ///< option or command that evaluates the range alone; empty: all is evaluated
  report::FailOn fail_on = report::FailOn::kError;
  Requirements required;
  std::string config;                 ///< path; empty: none
  std::string baseline;               ///< path; empty: none
  std::vector<std::string> esi;       ///< paths of the files in `analysis.files`
  std::vector<std::string> families;  ///< likewise: of --profiles and of the configuration
  std::optional<std::string> eni;     ///< likewise
};

/// Joins what was typed with the configuration file that belongs to `capture` (--config, or found beside it). What was
/// typed wins. All names are checked here, ESI and ENI files are read; errors in a file begin with its path.
[[nodiscard]] Result<Settings> ResolveSettings(const CaptureOptions& options, const GateOptions& gate,
                                               const std::string& capture);

/// Registers in `files` those that `settings` were read from.
void AddFiles(const Settings& settings, CommandFiles& files);
/// The same for the captures of the command line.
/// @return which of the captures to join is named twice
[[nodiscard]] std::optional<Error> AddFiles(const CaptureOptions& options, CommandFiles& files);
/// A baseline of a part of a capture would lack the entries for the rest of it.
[[nodiscard]] std::optional<Error> CheckBaselineIsWhole(const CaptureOptions& options, const GateOptions& gate);
/// Asks whether the baseline can be written there; it may take the place of the one that is read.
[[nodiscard]] std::optional<Error> PlanBaseline(const std::optional<std::string>& write_baseline, CommandFiles& files);

/// "al-refused", ...: for completion.
/// @param suffix  follows each of them
[[nodiscard]] std::vector<std::string> RuleIds(std::string_view suffix = {});

// The parts, for tests.

/// "0" is a position, "0x1001" a station address.
/// @param names  how `text` counts slaves
[[nodiscard]] Result<SlaveSelector> ParseSlave(std::string_view text, const SlaveNames& names = {});
/// The same for --slave, as reports print slaves: also "1001" for the address 0x1001, and a name such as "AKD".
[[nodiscard]] Result<SlaveSelector> ParseShownSlave(std::string_view text, const SlaveNames& names = {});
/// "0" is the first interface of a capture.
[[nodiscard]] Result<std::uint16_t> ParseInterface(std::string_view text);
/// "al-timeout=warning", "sdo-abort=off".
[[nodiscard]] std::optional<Error> AddRuleSetting(std::string_view text, AnalysisOptions& analysis);
/// What AddRuleSetting() read, for reports: id and severity, or "off"; sorted by id.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> RuleSettingTexts(const AnalysisOptions& analysis);
/// "generic", or "0x1001=generic".
[[nodiscard]] std::optional<Error> AddProfile(std::string_view text, AnalysisOptions& analysis);
/// "FBUS.SYNCDIST=500", or "0x1001:PTBASE=8": a value of a drive that captures do not show; decimal, or 0x and
/// hexadecimal. The name must be one that some family's profile knows.
[[nodiscard]] std::optional<Error> AddParameter(std::string_view text, AnalysisOptions& analysis);

}  // namespace ecaudit::cli
