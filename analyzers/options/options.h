/// What the caller of an analysis may set.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/options/severity.h"
#include "analyzers/options/slave_names.h"
#include "decoder/base/ids.h"

namespace ecaudit {

struct DeviceFiles;
namespace startup {
struct Expectation;
}  // namespace startup

/// What to do about one rule: a severity, or switched off.
struct RuleSetting {
  bool off = false;
  Severity severity = Severity::kError;
};

/// A slave as the user names it: position ("0") or station address ("0x1001").
struct SlaveSelector {
  bool by_address = false;
  std::uint16_t value = 0;
  std::uint16_t or_address = 0;  ///< "1001" is a position, or the address 0x1001; 0: it can be no address
  std::string name = {};         ///< in place of both, as reports print it
};

/// A parameter of a drive that the capture does not show and the user knows.
struct GivenParameter {
  std::optional<SlaveSelector> slave;  ///< unset: every slave whose family has it
  std::string keyword;                 ///< as in the vendor's tool: "FBUS.SYNCDIST", "PTBASE"
  std::int64_t value = 0;
};

struct AnalysisOptions {
  SlaveNames slave_names;       ///< what sentences call a slave
  std::string default_profile;  ///< for every slave; empty: chosen by identity
  std::vector<std::pair<SlaveSelector, std::string>> slave_profiles;
  std::vector<GivenParameter> parameters;    ///< the last that fits a slave counts; what the capture shows beats them
  std::shared_ptr<const DeviceFiles> files;  ///< ESI and ENI files (device_files.h); null: none
  std::map<std::string, RuleSetting, std::less<>> rules;  ///< by rule id; rules not named keep their defaults
  /// Only frames in [from, to] are analysed; seconds from the first frame or frame numbers.
  std::optional<double> from_s, to_s;
  std::optional<FrameNo> from_frame, to_frame;
  std::vector<std::uint16_t> interfaces;  ///< of these alone the caller hands over packets; empty: of all
  /// Limits in ns that the catalogue calls configurable, by name: "al-timeout.preop", ...
  std::map<std::string, std::int64_t, std::less<>> limits;
  /// What the start-up has to be like; null: nothing is expected, and the rules of the start-up stay silent.
  std::shared_ptr<const startup::Expectation> expectation;
  std::uint32_t shuffle_rules = 0;          ///< for tests: another order that the rules allow, with the same result
  const std::atomic<bool>* stop = nullptr;  ///< set by a signal handler: ends early, capture.complete = false
  std::atomic<FrameNo>* reached = nullptr;  ///< holds the number of the packet at hand; null: not wanted
  std::function<void(std::uint64_t bytes_done, std::uint64_t bytes_total, std::uint64_t frames)>
      progress;  ///< now and then
};

}  // namespace ecaudit
