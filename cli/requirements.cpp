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

constexpr std::array<std::string_view, 6> kParts{"slaves", "state", "reached", "axis", "sync", "judged"};
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

/// "90%"
std::optional<std::uint64_t> ParsePercent(std::string_view text) {
  if (!text.ends_with('%')) return std::nullopt;
  const std::optional<std::uint16_t> number = ParseNumber(text.substr(0, text.size() - 1));
  if (!number || *number == 0 || *number > 100) return std::nullopt;
  return *number;
}

/// "slave 1 is in PREOP+ERR", "slaves 2-3 are in SAFEOP", "the AL state of slave 4 is not in the capture"
/// @param part  --slave left out slaves, and broadcasts show those as well
void AddOtherStates(esc::AlState wanted, const AnalysisResult& result, bool part, std::vector<std::string>& missing) {
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
  if (!part && result.bus.al && (result.bus.al->status & 0xFU & ~static_cast<unsigned>(wanted)) != 0 &&
      others.empty()) {
    missing.push_back(state + ": the last broadcast read shows " + esc::StatesOfAllText(result.bus.al->status) +
                      ", frame " + std::to_string(result.bus.al->last.number));
  }
  for (const auto& [status, positions] : others) {
    missing.push_back(state + ": " + result.slave_names.Of(positions) +
                      (positions.size() == 1 ? " is in " : " are in ") + esc::StatusText(status) + " at the end");
  }
  if (!unknown.empty())
    missing.push_back(state + ": the AL state of " + result.slave_names.Of(unknown) + " is not in the capture");
}

/// "reached=OP: slave 1 never shows OP"
void AddNeverReached(esc::AlState wanted, const AnalysisResult& result, std::vector<std::string>& missing) {
  const auto is_there = [wanted](std::uint16_t status, bool echo) {
    const esc::AlWord word{status};
    return word.state() == static_cast<std::uint8_t>(wanted) && (echo || !word.bit4());
  };
  std::set<unsigned> never;
  std::set<unsigned> unknown;
  for (const SlaveSummary& slave : result.slaves) {
    bool shown = slave.al_status && is_there(*slave.al_status, slave.al_echo);
    for (const AlStep& step : slave.al_history) {
      shown = shown || (step.kind == AlStep::Kind::kState && is_there(step.to, step.echo)) ||
              (step.from != 0 && is_there(step.from, false));
    }
    if (!shown) (slave.al_history_left_out > 0 ? unknown : never).insert(slave.position);
  }
  const std::string name = esc::StateName(static_cast<std::uint8_t>(wanted));
  if (!never.empty()) {
    missing.push_back("reached=" + name + ": " + result.slave_names.Of(never) + " never " +
                      (never.size() == 1 ? "shows " : "show ") + name);
  }
  if (!unknown.empty()) {
    missing.push_back("reached=" + name + ": the AL history of " + result.slave_names.Of(unknown) +
                      " is too long to be kept");
  }
}

/// "judged=90%: 57 of 80 evaluations were possible (71%)". What the user switched off was not evaluated either.
void AddNotJudged(const Requirements& required, const AnalysisResult& result, std::vector<std::string>& missing) {
  const std::string why = report::WhyLimited(result);
  const std::string part = "judged: ";
  if (!why.empty()) missing.push_back(part + why);
  report::CoverageCount count = report::CountOf(result.coverage);
  const std::uint64_t off = report::CountSwitchedOff(result.coverage);
  count.not_judged += off;
  if (count.applicable() == 0) {
    if (why.empty()) missing.push_back(part + "no evaluation applies to the capture");
    return;
  }
  if (report::IsJudged(count, required.judged_percent)) return;
  missing.push_back("judged=" + std::to_string(required.judged_percent) +
                    "%: " + PartWas(count.judged, count.applicable(), "evaluation") + " possible (" +
                    std::to_string(count.judged * 100 / count.applicable()) + "%" +
                    (off > 0 ? "; " + Grouped(off) + (off == 1 ? " is" : " are") + " switched off" : "") + ")");
}

/// "axis=enabled: slave 1 axis 2: not-asked (...)"
void AddMissingRung(const std::string& wanted, const std::string& whose, const Rung* rung,
                    std::vector<std::string>& missing) {
  if (rung != nullptr && rung->status == RungStatus::kReached) return;
  std::string text =
      wanted + ": " + whose + ": " + std::string(Name(rung != nullptr ? rung->status : RungStatus::kUnknown));
  if (rung != nullptr && rung->why != nullptr) text += " (" + std::string(rung->why->text) + ")";
  missing.push_back(std::move(text));
}

/// @param hidden  slaves that only broadcasts show: each may have an axis
void AddMissingAxes(const std::string& code, const AnalysisResult& result, std::size_t hidden,
                    std::vector<std::string>& missing) {
  bool any = false;
  for (const SlaveSummary& slave : result.slaves) {
    for (const AxisLadder& axis : slave.axes) {
      any = true;
      std::string whose = result.slave_names.Of(slave.position);
      if (slave.axes.size() > 1 || axis.axis > 0) whose += " axis " + std::to_string(axis.axis + 1);
      AddMissingRung("axis=" + code, whose, axis.ladder.Find(code), missing);
    }
  }
  if (!any) missing.push_back("axis=" + code + ": the capture shows no axis");
  if (any && hidden > 0) {
    missing.push_back("axis=" + code + ": the axes of " + Count(hidden, "further slave") + " are not in the capture");
  }
}

/// Slaves without SYNC0 have nothing to keep in step with.
/// @param hidden  slaves that only broadcasts show: each may have SYNC0
void AddMissingSync(const AnalysisResult& result, std::size_t hidden, std::vector<std::string>& missing) {
  bool any = false;
  for (const SlaveSummary& slave : result.slaves) {
    const Rung* const rung = slave.progress.Find("sync");
    if (rung != nullptr && rung->status == RungStatus::kNotAsked) continue;
    any = true;
    AddMissingRung("sync=ok", result.slave_names.Of(slave.position), rung, missing);
  }
  if (!any) missing.push_back("sync=ok: the capture shows no slave with SYNC0");
  if (any && hidden > 0) {
    missing.push_back("sync=ok: the synchronisation of " + Count(hidden, "further slave") + " is not in the capture");
  }
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
    } else if (name == "reached") {
      if (out.reached) return Wrong(text, std::string(name) + " appears twice");
      out.reached = ParseState(value);
      if (!out.reached) return Wrong(text, "reached must be INIT, PREOP, BOOT, SAFEOP or OP");
    } else if (name == "axis") {
      if (!out.axis.empty()) return Wrong(text, std::string(name) + " appears twice");
      if (std::ranges::find(kAxisRungs, value) == kAxisRungs.end()) {
        return Wrong(text, "axis must be enabled, commanded or follows");
      }
      out.axis = value;
    } else if (name == "sync") {
      if (out.sync) return Wrong(text, std::string(name) + " appears twice");
      if (value != "ok") return Wrong(text, "sync must be ok");
      out.sync = true;
    } else if (name == "judged") {
      if (out.judged) return Wrong(text, std::string(name) + " appears twice");
      out.judged = true;
      if (const std::optional<std::uint64_t> percent = ParsePercent(value)) {
        out.judged_percent = *percent;
      } else if (equals != std::string_view::npos) {
        return Wrong(text, "its share must be from 1% to 100%, such as judged=90%");
      }
    } else {
      const std::string known = Suggestion(name, kParts, "");
      return Wrong(text, "'" + std::string(part) +
                             "' is none of slaves=N, state=STATE, reached=STATE, axis=RUNG, sync=ok, judged=90%" +
                             known);
    }
    if (comma != std::string_view::npos && rest.empty()) return Wrong(text, "it ends with a comma");
  } while (!rest.empty());
  return out;
}

std::vector<std::string> MissingOf(const Requirements& required, const AnalysisResult& result, std::size_t slaves,
                                   bool part) {
  std::vector<std::string> missing;
  // What the last broadcast counted is there at the end; a slave that is only remembered may have left.
  const std::size_t there = result.bus.slave_count.value_or(static_cast<std::uint16_t>(slaves));
  const std::size_t hidden = !part && there > slaves ? there - slaves : 0;
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
    AddOtherStates(*required.state, result, part, missing);
    const std::string state = "state=" + esc::StateName(static_cast<std::uint8_t>(*required.state));
    if (result.slaves.empty()) {
      missing.push_back(state + ": the capture does not show the AL state of any slave");
    } else if (hidden > 0) {
      missing.push_back(state + ": the AL state of " + Count(hidden, "further slave") + " is not in the capture");
    }
  }
  if (required.reached) {
    AddNeverReached(*required.reached, result, missing);
    if (result.slaves.empty() || hidden > 0) {
      missing.push_back("reached=" + esc::StateName(static_cast<std::uint8_t>(*required.reached)) +
                        ": the AL states of all slaves are not in the capture");
    }
  }
  if (!required.axis.empty()) AddMissingAxes(required.axis, result, hidden, missing);
  if (required.sync) AddMissingSync(result, hidden, missing);
  if (required.judged) AddNotJudged(required, result, missing);
  return missing;
}

}  // namespace ecaudit::cli
