#include "cli/report/sentences.h"

#include <algorithm>
#include <cctype>

#include "cli/report/finding_id.h"
#include "cli/report/notation.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

bool IsTruth(Value::Type type) {
  return type == Value::Type::kFlag || type == Value::Type::kBoolean;
}

/// Fills one template from left to right.
class Filler {
 public:
  Filler(std::string_view text, const Arguments& arguments) : rest_(text), arguments_(arguments) {}

  std::string Fill() {
    std::string out;
    (void)Part(out, false);
    return out;
  }

 private:
  /// Up to the end, or to the bracket that closes this part.
  /// @return whether all arguments that the part needs are there; of a part that only holds other parts, whether one of
  ///   these is there
  bool Part(std::string& out, bool optional) {
    bool complete = true;
    bool has_own = false, has_parts = false, some_part = false;
    while (!rest_.empty()) {
      const char c = rest_.front();
      rest_.remove_prefix(1);
      if (c == '\\' && !rest_.empty()) {
        out += rest_.front();
        rest_.remove_prefix(1);
        continue;
      }
      if (c == ']' && optional) return complete && (has_own || !has_parts || some_part);
      if (c == '[') {
        std::string part = out;
        const bool whole = Part(part, true);
        if (whole) out = std::move(part);
        has_parts = true;
        some_part = some_part || whole;
      } else if (c == '{') {
        has_own = true;
        complete = Placeholder(out, optional) && complete;
      } else if (c == '\n' || c == ' ') {
        if (!out.empty() && out.back() != ' ') out += ' ';
      } else {
        out += c;
      }
    }
    return complete;
  }

  bool Placeholder(std::string& out, bool optional) {
    const std::string_view inside = rest_.substr(0, rest_.find('}'));
    rest_.remove_prefix(std::min(rest_.size(), inside.size() + 1));
    const bool asks = inside.starts_with('?'), asks_not = inside.starts_with('!');
    const std::string_view body = inside.substr(asks || asks_not ? 1 : 0);
    const std::string_view name = body.substr(0, body.find_first_of(":?"));
    const Value* value = arguments_.Find(name);
    const bool there = value != nullptr && (!IsTruth(value->type) || value->number != 0);
    if (asks) return there;
    if (asks_not) return !there;
    if (value == nullptr) {
      if (!optional) out += "?" + std::string(name) + "?";
      return false;
    }
    if (const std::size_t choice = body.find('?'); choice != std::string_view::npos) {
      const std::string_view one = body.substr(choice + 1, body.find('|') - choice - 1);
      out += IsPlural(*value) ? body.substr(body.find('|') + 1) : one;
      return true;
    }
    const Form form = body.ends_with(":number")    ? Form::kNumber
                      : body.ends_with(":meaning") ? Form::kMeaning
                                                   : Form::kWhole;
    Write(out, *value, TextOf(*value, form));
    return true;
  }

  static void Write(std::string& out, const Value& value, std::string text) {
    const bool begins = out.empty() || out.ends_with(". ");
    const bool ours = value.type == Value::Type::kWord || value.type == Value::Type::kFrame ||
                      value.type == Value::Type::kSlave || value.type == Value::Type::kList ||
                      value.type == Value::Type::kAlState;
    if (begins && ours && !text.empty()) {
      text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
    }
    out += text;
  }

  std::string_view rest_;
  const Arguments& arguments_;
};

void Append(std::string& text, const std::string& sentence) {
  if (sentence.empty()) return;
  if (!text.empty() && text.back() != ' ') text += ' ';
  text += sentence;
}

std::string WithoutEnd(std::string text) {
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

/// "Axis 2: "
std::string AxisText(const Finding& finding) {
  return finding.axis == 0 ? std::string() : "Axis " + std::to_string(finding.axis + 1) + ": ";
}

std::string AffectedText(const AffectedSlaves& affected) {
  std::string text = std::to_string(affected.number) + " slaves are affected: ";
  for (std::size_t i = 0; i < affected.named.size(); ++i) text += (i > 0 ? ", " : "") + affected.named[i];
  if (affected.number > affected.named.size()) {
    text += " and " + std::to_string(affected.number - affected.named.size()) + " more";
  }
  return text + ". For " + affected.first + ":";
}

/// With what every finding has.
Arguments ArgumentsOf(const Finding& finding, const Arguments& own) {
  Arguments all = own;
  if (!all.Has("frame")) all.Set("frame", arg::Frame(finding.first.number));
  if (!all.Has("last_frame")) all.Set("last_frame", arg::Frame(finding.last.number));
  if (!all.Has("count")) all.Set("count", arg::Count(finding.count, "time"));
  return all;
}

/// What to do about a consequence is one sentence for all rules, made here: only a report knows the id of the cause.
/// Its rule stands beside the id, since not all formats show ids.
std::string NextOf(const Finding& finding, const AnalysisResult& result, const Arguments& arguments) {
  std::string own = Fill(finding.kind->next, arguments);
  if (own.empty() || finding.caused_by >= result.findings.size()) return own;
  std::string next = "Correct " + FindingId(result, finding.caused_by) + " (" +
                     std::string(result.findings[finding.caused_by].rule) + ") first.";
  if (finding.kind->next_stays) Append(next, own);
  return next;
}

std::string_view TemplateOf(ReasonCode code) {
  static constexpr Named<ReasonCode> kNames[] = {
      {ReasonCode::kNotInCapture, "{what} {what?is|are} not in the capture"},
      {ReasonCode::kNotRead, "the master did not read {what}"},
      {ReasonCode::kCaptureGap, "{what} may have changed in a capture gap"},
      {ReasonCode::kMissesPackets, "the capture misses packets[: {what} may be among them]"},
      {ReasonCode::kNoReturnedFrames, "the capture has no returned frames"},
      {ReasonCode::kNoOutboundFrames, "the capture has no outbound frames"},
      {ReasonCode::kNoEtherCat, "the capture has no EtherCAT frames"},
      {ReasonCode::kNoSlave, "no slave is known"},
      {ReasonCode::kSnapLength, "packets are cut by the snap length"},
      {ReasonCode::kFamilyUnknown, "the identity of the slave is not in the capture"},
      {ReasonCode::kNotInProfile, "the profile does not give {what}"},
      {ReasonCode::kStampsTooCoarse, "the time stamps are too coarse[ for {what}]"},
      {ReasonCode::kNoStamps, "packets have no time stamps"},
      {ReasonCode::kWithinUncertainty, "{what} {what?lies|lie} within the uncertainty of the clock"},
      {ReasonCode::kTooFew, "the capture has too few {what}"},
      {ReasonCode::kTooIrregular, "{what} {what?is|are} too irregular"},
      {ReasonCode::kCaptureEnds, "the capture ends during {what}"},
      {ReasonCode::kNeverReturned, "{what} never returned"},
      {ReasonCode::kAmbiguous, "{what} {what?has|have} more than one explanation"},
      {ReasonCode::kNotFollowed, "{what} {what?is|are} reported, but not evaluated"},
      {ReasonCode::kListFull, "more {what} than the report keeps"},
  };
  return NameIn(kNames, code);
}

}  // namespace

std::string Fill(std::string_view text, const Arguments& arguments) {
  return WithoutEnd(Filler(text, arguments).Fill());
}

std::string OutlineOf(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\\' && i + 1 < text.size()) {
      out += text[++i];
    } else if (c == '{') {
      const std::string_view inside = text.substr(i + 1, text.find('}', i) - i - 1);
      i += inside.size() + 1;
      if (inside.starts_with('?') || inside.starts_with('!')) continue;
      const std::size_t choice = inside.find('|');
      if (choice != std::string_view::npos) {
        out += inside.substr(choice + 1);
      } else {
        out += "<" + std::string(inside.substr(0, inside.find(':'))) + ">";
      }
    } else if (c == '\n' || c == ' ') {
      if (!out.empty() && out.back() != ' ') out += ' ';
    } else {
      out += c;
    }
  }
  return out;
}

std::string TitleOf(const Finding& finding) {
  std::string title = AxisText(finding) + Fill(finding.kind->title, ArgumentsOf(finding, finding.arguments));
  if (finding.affected.number > 0) title += " (" + std::to_string(finding.affected.number) + " slaves)";
  return title;
}

Sentences SentencesOf(const Finding& finding, const AnalysisResult& result) {
  Sentences out;
  out.title = TitleOf(finding);
  if (finding.affected.number > 0) out.message = AffectedText(finding.affected);
  const Arguments all = ArgumentsOf(finding, finding.arguments);
  Append(out.message, AxisText(finding) + Fill(finding.kind->message, all));
  out.next = NextOf(finding, result, all);
  for (const Note& note : finding.notes)
    Append(out.message, Fill(note.kind->text, ArgumentsOf(finding, note.arguments)));
  return out;
}

std::string MessageOf(const Finding& finding, const AnalysisResult& result) {
  Sentences sentences = SentencesOf(finding, result);
  Append(sentences.message, sentences.next);
  return sentences.message;
}

std::string TextOf(const Reason& reason) {
  Arguments arguments;
  if (reason.what != nullptr) arguments.Set("what", arg::Of(*reason.what));
  std::string text = Fill(TemplateOf(reason.code), arguments);
  // It follows a colon, so it begins with a small letter.
  if (reason.what != nullptr && text.size() >= reason.what->text.size() && !reason.what->text.empty()) {
    std::string begin = text.substr(0, reason.what->text.size());
    begin.front() = reason.what->text.front();
    if (begin == reason.what->text) text.front() = begin.front();
  }
  return text;
}

std::string TextOf(const NotEvaluable& entry) {
  std::string text = TextOf(entry.reason);
  if (entry.slaves > 0) text += " (" + std::to_string(entry.slaves) + " slaves)";
  return text;
}

}  // namespace ecaudit::report
