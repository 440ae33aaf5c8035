#include "cli/requirements.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <system_error>
#include <utility>

#include "cli/report/coverage_tally.h"
#include "cli/report/layout.h"
#include "cli/suggest.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

constexpr std::array<std::string_view, 5> kParts{"slaves", "state", "axis", "sync", "judged"};
constexpr std::array<std::string_view, 3> kAxisRungs{"enabled", "commanded", "follows"};
constexpr std::array<esc::AlState, 5> kStates{esc::AlState::INIT, esc::AlState::PREOP, esc::AlState::BOOT,
                                              esc::AlState::SAFEOP, esc::AlState::OP};

Error Wrong(std::string_view text, const std::string& why) {
  return Error{"--require is '" + std::string(text) + "' but " + why + "; for example slaves=3,state=OP,judged"};
}

std::optional<esc::AlState> ParseState(std::string_view text) {
  for (const esc::AlState state : kStates) {
    if (esc::StateName(static_cast<std::uint8_t>(state)) == text) return state;
  }
  return std::nullopt;
}

std::optional<std::uint16_t> ParseNumber(std::string_view text) {
  std::uint16_t number = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (text.empty() || code != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string Slaves(const std::set<unsigned>& positions) {
  return (positions.size() == 1 ? "slave " : "slaves ") + report::Ranges(positions);
}

/// "slave 1 is in PREOP+ERR", "slaves 2-3 are in SAFEOP", "the AL state of slave 4 is not in the capture"
void AddOtherStates(esc::AlState wanted, const AnalysisResult& result, std::vector<std::string>& missing) {
  std::set<unsigned> unknown;
  std::vector<std::pair<std::uint16_t, std::set<unsigned>>> others;
  for (const SlaveSummary& slave : result.slaves) {
    if (!slave.al_status) {
      unknown.insert(slave.position);
      continue;
    }
    esc::AlWord status{*slave.al_status};
    // A slave without a processor shows the acknowledge bit as its master wrote it: no error, and no other state.
    if (slave.al_echo) status = esc::AlWord{status.state()};
    if (status.state() == static_cast<std::uint8_t>(wanted) && !status.bit4()) continue;
    auto at = others.begin();
    while (at != others.end() && at->first != status.raw) ++at;
    if (at == others.end()) at = others.insert(others.end(), {status.raw, {}});
    at->second.insert(slave.position);
  }
  const std::string state = "state=" + esc::StateName(static_cast<std::uint8_t>(wanted));
  if (result.bus.al && (result.bus.al->status & 0xFU & ~static_cast<unsigned>(wanted)) != 0 && others.empty()) {
    missing.push_back(state + ": the last broadcast read shows " + esc::StatesOfAllText(result.bus.al->status) +
                      ", frame " + std::to_string(result.bus.al->last.number));
  }
  for (const auto& [status, positions] : others) {
    missing.push_back(state + ": " + Slaves(positions) + (positions.size() == 1 ? " is in " : " are in ") +
                      esc::StatusText(status) + " at the end");
  }
  if (!unknown.empty()) missing.push_back(state + ": the AL state of " + Slaves(unknown) + " is not in the capture");
}

/// "axis=enabled: slave 1 axis 2 is not there (not-asked: ...)"
void AddMissingRung(const std::string& wanted, const std::string& whose, const Rung* rung,
                    std::vector<std::string>& missing) {
  if (rung != nullptr && rung->status == RungStatus::kReached) return;
  std::string text = wanted + ": " + whose + " has the status " +
                     std::string(Name(rung != nullptr ? rung->status : RungStatus::kUnknown));
  if (rung != nullptr && rung->why != nullptr) text += " (" + std::string(rung->why->text) + ")";
  missing.push_back(std::move(text));
}

void AddMissingAxes(const std::string& code, const AnalysisResult& result, std::vector<std::string>& missing) {
  bool any = false;
  for (const SlaveSummary& slave : result.slaves) {
    for (const AxisLadder& axis : slave.axes) {
      any = true;
      std::string whose = "slave " + std::to_string(slave.position);
      if (slave.axes.size() > 1 || axis.axis > 0) whose += " axis " + std::to_string(axis.axis + 1);
      AddMissingRung("axis=" + code, whose, axis.ladder.Find(code), missing);
    }
  }
  if (!any) missing.push_back("axis=" + code + ": the capture shows no axis");
}

/// Slaves without SYNC0 have nothing to keep in step with.
void AddMissingSync(const AnalysisResult& result, std::vector<std::string>& missing) {
  bool any = false;
  for (const SlaveSummary& slave : result.slaves) {
    const Rung* const rung = slave.progress.Find("sync");
    if (rung != nullptr && rung->status == RungStatus::kNotAsked) continue;
    any = true;
    AddMissingRung("sync=ok", "slave " + std::to_string(slave.position), rung, missing);
  }
  if (!any) missing.push_back("sync=ok: the capture shows no slave with SYNC0");
}

}  // namespace

Result<Requirements> ParseRequirements(std::string_view text) {
  Requirements out;
  out.text = text;
  std::string_view rest = text;
  do {
    const std::size_t comma = rest.find(',');
    const std::string_view part = rest.substr(0, comma);
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
    const std::size_t equals = part.find('=');
    const std::string_view name = part.substr(0, equals);
    const std::string_view value = equals == std::string_view::npos ? std::string_view() : part.substr(equals + 1);
    if (name == "slaves") {
      if (out.slaves) return Wrong(text, std::string(name) + " appears twice");
      out.slaves = ParseNumber(value);
      if (!out.slaves) return Wrong(text, "slaves must be a number of slaves");
    } else if (name == "state") {
      if (out.state) return Wrong(text, std::string(name) + " appears twice");
      out.state = ParseState(value);
      if (!out.state) return Wrong(text, "state must be INIT, PREOP, BOOT, SAFEOP or OP");
    } else if (name == "axis") {
      if (!out.axis.empty()) return Wrong(text, std::string(name) + " appears twice");
      if (std::find(kAxisRungs.begin(), kAxisRungs.end(), value) == kAxisRungs.end()) {
        return Wrong(text, "axis must be enabled, commanded or follows");
      }
      out.axis = value;
    } else if (name == "sync") {
      if (out.sync) return Wrong(text, std::string(name) + " appears twice");
      if (value != "ok") return Wrong(text, "sync must be ok");
      out.sync = true;
    } else if (part == "judged") {
      if (out.judged) return Wrong(text, std::string(name) + " appears twice");
      out.judged = true;
    } else {
      const std::string known = name == "judged" ? std::string() : Suggestion(name, kParts, "");
      return Wrong(text,
                   "'" + std::string(part) + "' is none of slaves=N, state=STATE, axis=RUNG, sync=ok, judged" + known);
    }
    if (comma != std::string_view::npos && rest.empty()) return Wrong(text, "it ends with a comma");
  } while (!rest.empty());
  return out;
}

std::vector<std::string> MissingOf(const Requirements& required, const AnalysisResult& result, std::size_t slaves) {
  std::vector<std::string> missing;
  // What the last broadcast counted is there at the end; a slave that is only remembered may have left.
  const std::size_t there = result.bus.slave_count.value_or(static_cast<std::uint16_t>(slaves));
  if (required.slaves && there != *required.slaves) {
    const std::string wanted = "slaves=" + std::to_string(*required.slaves) + ": ";
    if (result.bus.slave_count) {
      missing.push_back(wanted + Count(there, "slave") + (there == 1 ? " answers" : " answer") +
                        " broadcasts at the end");
    } else {
      missing.push_back(wanted +
                        (there == 0 ? "the capture shows no slave" : "the capture shows " + Count(there, "slave")));
    }
  }
  if (required.state) {
    AddOtherStates(*required.state, result, missing);
    const std::string state = "state=" + esc::StateName(static_cast<std::uint8_t>(*required.state));
    if (result.slaves.empty()) {
      missing.push_back(state + ": the capture does not show the AL state of any slave");
    } else if (there > slaves) {
      missing.push_back(state + ": the AL state of " + Count(there - slaves, "further slave") +
                        " is not in the capture");
    }
  }
  if (!required.axis.empty()) AddMissingAxes(required.axis, result, missing);
  if (required.sync) AddMissingSync(result, missing);
  if (required.judged) {
    if (const std::string why = report::WhyLimited(result); !why.empty()) missing.push_back("judged: " + why);
  }
  return missing;
}

}  // namespace ecaudit::cli
