#include "tests/unit/analyzers/expected_findings.h"

#include <algorithm>
#include <charconv>
#include <sstream>

#include "cli/report/notation.h"
#include "cli/report/sentences.h"

namespace ecaudit::test {
namespace {

/// Words of a line; "..." keeps its blanks and loses its quotes, also behind key=.
std::vector<std::string> Words(const std::string& line) {
  std::vector<std::string> words;
  std::string word;
  bool quoted = false;
  bool open = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
      open = true;
    } else if (c == '#' && !quoted) {
      break;
    } else if (c == ' ' && !quoted) {
      if (open) words.push_back(word);
      word.clear();
      open = false;
    } else {
      word += c;
      open = true;
    }
  }
  if (open) words.push_back(word);
  return words;
}

std::optional<std::uint64_t> NumberIn(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || problem != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<FrameNo> FrameIn(std::string_view text, const Trace& trace) {
  if (const auto number = NumberIn(text)) return number;
  constexpr std::string_view kReturned = ".returned";
  const bool returned = text.ends_with(kReturned);
  if (returned) text.remove_suffix(kReturned.size());
  const FrameNo frame = returned ? trace.Returned(text) : trace.Sent(text);
  if (frame == 0) return std::nullopt;
  return frame;
}

std::vector<std::string> Split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) parts.push_back(part);
  return parts;
}

bool SlaveIn(const std::string& text, std::optional<SlavePos>& slave) {
  if (text == "-") return true;
  const auto number = NumberIn(text);
  if (number) slave = static_cast<SlavePos>(*number);
  return number.has_value();
}

/// One key=value of a finding; false when it cannot be read.
bool Take(const std::string& key, const std::string& value, const Trace& trace, ExpectedFinding& finding) {
  if (key == "slave") return SlaveIn(value, finding.slave);
  if (key == "frame" || key == "last") {
    const auto frame = FrameIn(value, trace);
    if (!frame) return false;
    if (key == "frame") {
      finding.frame = *frame;
    } else {
      finding.last = frame;
    }
    return true;
  }
  if (key == "count") {
    const auto number = NumberIn(value);
    finding.count = number.value_or(0);
    return number.has_value();
  }
  if (key == "related") {
    for (const std::string& one : Split(value, ',')) {
      const auto frame = FrameIn(one, trace);
      if (!frame) return false;
      finding.related.push_back(*frame);
    }
    return true;
  }
  if (key == "axis") {
    const auto number = NumberIn(value);
    if (number) finding.axis = static_cast<unsigned>(*number);
    return number.has_value();
  }
  if (key == "caused_by") {
    finding.caused_by = value;
  } else if (key.starts_with("cause.")) {
    finding.cause_arguments.emplace_back(key.substr(std::string_view("cause.").size()), value);
  } else if (key == "confidence") {
    finding.confidence = value;
  } else if (key == "kind") {
    finding.kind = value;
  } else if (key == "note") {
    finding.notes.push_back(value);
  } else if (key == "without") {
    finding.without.push_back(value);
  } else {
    finding.arguments.emplace_back(key, value);
  }
  return true;
}

bool IsWritten(const Value* value, const std::string& text) {
  return value != nullptr && (KeyOf(*value) == text || report::TextOf(*value, report::Form::kNumber) == text ||
                              report::TextOf(*value) == text);
}

bool HasArgument(const Finding& finding, const std::string& name, const std::string& text) {
  if (IsWritten(finding.arguments.Find(name), text)) return true;
  return std::any_of(finding.notes.begin(), finding.notes.end(), [&](const Note& note) {
    const std::string prefix = std::string(note.kind->name) + ".";
    return name.starts_with(prefix) && IsWritten(note.arguments.Find(name.substr(prefix.size())), text);
  });
}

bool HasNote(const Finding& finding, const std::string& name) {
  return std::any_of(finding.notes.begin(), finding.notes.end(),
                     [&](const Note& note) { return note.kind->name == name; });
}

/// A value for the text form.
std::string Quoted(const Value& value) {
  const std::string text = value.type == Value::Type::kWord   ? KeyOf(value)
                           : value.type == Value::Type::kList ? report::TextOf(value)
                                                              : report::TextOf(value, report::Form::kNumber);
  return text.find_first_of(" #") == std::string::npos ? text : '"' + text + '"';
}

std::string SlaveText(SlaveId id, const AnalysisResult& result) {
  const SlaveSummary* slave = result.slave(id);
  return slave == nullptr ? "-" : std::to_string(slave->position);
}

}  // namespace

Result<Expectations> ParseExpectations(std::string_view text, const Trace& trace) {
  Expectations expectations;
  std::istringstream lines{std::string(text)};
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::vector<std::string> words = Words(line);
    if (words.empty()) continue;
    const auto failed = [&](const std::string& why) { return Error{"line " + std::to_string(number) + ": " + why}; };
    if (words.size() < 3) return failed("too few words");
    if (words[0] == "not-evaluable") {
      ExpectedNotEvaluable entry;
      entry.rule = words[1];
      if (words.size() < 4 || words.size() > 5 || !words[2].starts_with("slave=") ||
          !SlaveIn(words[2].substr(6), entry.slave)) {
        return failed("expected: not-evaluable RULE slave=N CODE [WHAT]");
      }
      entry.code = words[3];
      if (words.size() == 5) entry.what = words[4];
      expectations.not_evaluable.push_back(std::move(entry));
      continue;
    }
    if (words[0] != "error" && words[0] != "warning" && words[0] != "info") {
      return failed("\"" + words[0] + "\" is neither a severity nor not-evaluable");
    }
    ExpectedFinding finding;
    finding.severity = words[0];
    finding.rule = words[1];
    finding.line = line;
    for (std::size_t i = 2; i < words.size(); ++i) {
      const std::size_t equals = words[i].find('=');
      if (equals == std::string::npos ||
          !Take(words[i].substr(0, equals), words[i].substr(equals + 1), trace, finding)) {
        return failed("\"" + words[i] + "\" is not understood");
      }
    }
    if (finding.frame == 0) return failed("frame= is missing");
    if (finding.kind.empty()) return failed("kind= is missing");
    expectations.findings.push_back(std::move(finding));
  }
  return expectations;
}

std::string TextOf(const Finding& finding, const AnalysisResult& result) {
  std::string text = std::string(Name(finding.severity)) + " " + std::string(finding.rule) +
                     " slave=" + SlaveText(finding.slave, result) + " frame=" + std::to_string(finding.first.number) +
                     " last=" + std::to_string(finding.last.number) + " count=" + std::to_string(finding.count);
  if (finding.caused_by != kNoFinding) {
    text += " caused_by=" + std::string(result.findings[finding.caused_by].rule);
  }
  if (finding.confidence == Confidence::kInferred) text += " confidence=inferred";
  text += " related=";
  for (const FrameNo frame : finding.related_frames) text += std::to_string(frame) + ",";
  return text + " " + KindTextOf(finding) + "\n      " + report::TitleOf(finding) + "\n      " +
         report::MessageOf(finding, result);
}

std::string KindTextOf(const Finding& finding) {
  std::string text = "kind=" + std::string(finding.kind->name);
  if (finding.axis != 0) text += " axis=" + std::to_string(finding.axis + 1);
  std::istringstream names{std::string(finding.kind->identity)};
  for (std::string name; names >> name;) {
    if (const Value* value = finding.arguments.Find(name)) text += " " + name + "=" + Quoted(*value);
  }
  for (const Note& note : finding.notes) text += " note=" + std::string(note.kind->name);
  return text;
}

std::string LineOf(const NotEvaluable& entry, const AnalysisResult& result) {
  std::string text = "not-evaluable " + std::string(entry.rule) + " slave=" + SlaveText(entry.slave, result) + " ";
  text += Name(entry.reason.code);
  return entry.reason.what == nullptr ? text : text + " " + std::string(entry.reason.what->code);
}

bool Matches(const ExpectedNotEvaluable& expected, const NotEvaluable& entry, const AnalysisResult& result) {
  const SlaveSummary* slave = result.slave(entry.slave);
  const bool same_slave = expected.slave ? slave != nullptr && slave->position == *expected.slave : slave == nullptr;
  if (entry.rule != expected.rule || !same_slave) return false;
  const std::string_view what = entry.reason.what == nullptr ? std::string_view() : entry.reason.what->code;
  return Name(entry.reason.code) == expected.code && what == expected.what;
}

bool Matches(const ExpectedFinding& expected, const Finding& finding, const AnalysisResult& result) {
  const SlaveSummary* slave = result.slave(finding.slave);
  const bool same_slave =
      expected.slave ? slave != nullptr && slave->position == *expected.slave : finding.slave == kNoSlave;
  const std::string cause = finding.caused_by == kNoFinding ? "" : std::string(result.findings[finding.caused_by].rule);
  const bool inferred = finding.confidence == Confidence::kInferred;
  const bool same_cause =
      cause == expected.caused_by &&
      std::all_of(expected.cause_arguments.begin(), expected.cause_arguments.end(), [&](const auto& argument) {
        return !cause.empty() && HasArgument(result.findings[finding.caused_by], argument.first, argument.second);
      });
  const bool same_kind =
      finding.kind->name == expected.kind && (!expected.axis || *expected.axis == finding.axis + 1U) &&
      std::all_of(expected.notes.begin(), expected.notes.end(),
                  [&](const std::string& note) { return HasNote(finding, note); }) &&
      std::none_of(expected.without.begin(), expected.without.end(),
                   [&](const std::string& name) { return HasNote(finding, name) || finding.arguments.Has(name); }) &&
      std::all_of(expected.arguments.begin(), expected.arguments.end(),
                  [&](const auto& argument) { return HasArgument(finding, argument.first, argument.second); });
  return same_kind && finding.rule == expected.rule && Name(finding.severity) == expected.severity && same_slave &&
         finding.first.number == expected.frame && (!expected.last || finding.last.number == *expected.last) &&
         finding.count == expected.count && same_cause && inferred == (expected.confidence == "inferred") &&
         std::all_of(expected.related.begin(), expected.related.end(), [&](FrameNo frame) {
           return std::find(finding.related_frames.begin(), finding.related_frames.end(), frame) !=
                  finding.related_frames.end();
         });
}

}  // namespace ecaudit::test
