/// `ecaudit explain WHAT`: one rule with cause, remedy and manual section; or the meaning of a number, with its source.
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/options.h"
#include "analyzers/result/rule_info.h"
#include "cli/commands/catalogue_output.h"
#include "cli/commands/command.h"
#include "cli/families.h"
#include "cli/lookup/meaning.h"
#include "cli/lookup/phrase_mentions.h"
#include "cli/lookup/progress_meanings.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "cli/report/sentences.h"
#include "cli/suggest.h"

namespace ecaudit::cli {
namespace {

using report::Style;

/// The rule's Markdown for a terminal: headings without #, paragraphs wrapped, lists and indented examples kept.
void AppendMarkdown(std::string_view markdown, report::TextBuilder& text) {
  std::string paragraph;
  std::size_t hanging = 0;
  const auto flush = [&] {
    if (!paragraph.empty()) text.Paragraph(paragraph, 0, hanging);
    paragraph.clear();
    hanging = 0;
  };
  bool in_code = false;
  while (!markdown.empty()) {
    const std::size_t end = std::min(markdown.find('\n'), markdown.size());
    const std::string_view line = markdown.substr(0, end);
    markdown.remove_prefix(std::min(end + 1, markdown.size()));
    const std::size_t indent = std::min(line.find_first_not_of(' '), line.size());
    if (line.starts_with("```")) {
      flush();
      in_code = !in_code;
    } else if (in_code) {
      text.Line(line, 4);
    } else if (line.starts_with('#')) {
      flush();
      const std::size_t start = std::min(line.find_first_not_of("# "), line.size());
      text.Line(text.Styled(line.substr(start), Style::kBold));
    } else if (indent == line.size()) {
      flush();
      text.Line();
    } else if (indent >= 4 || line.starts_with('|')) {
      flush();
      text.Line(line);
    } else {
      const bool item = line.substr(indent).starts_with("- ") || line.substr(indent).starts_with("* ");
      if (item) {
        flush();
        hanging = indent + 2;
      }
      if (!paragraph.empty()) paragraph += ' ';
      paragraph += line.substr(paragraph.empty() && !item ? indent : paragraph.empty() ? 0 : indent);
    }
  }
  flush();
}

std::string ExplainText(const RuleInfo& rule, bool color) {
  report::TextBuilder text(color);
  text.Line(text.Styled(rule.id, Style::kBold) + " (" +
            text.Styled(Name(rule.severity), report::StyleOf(rule.severity)) + "): " + std::string(rule.title));
  text.Line();
  text.Field("group", rule.group, 0);
  text.Field("needs", rule.needs, 0);
  text.Field("source", rule.source, 0);
  text.Line();
  AppendMarkdown(rule.doc, text);
  text.Line();
  if (!rule.kinds.empty()) text.Line(text.Styled("Findings (kind: title)", Style::kBold));
  for (const FindingKind* kind : rule.kinds) {
    text.Paragraph(std::string(kind->name) + ": " + report::OutlineOf(kind->title), 0, 2);
  }
  if (!rule.kinds.empty()) text.Line();
  text.Paragraph("Switch it off or change its severity: --rule " + std::string(rule.id) +
                     "=off|info|warning|error, or \"rules\" in .ecaudit.json",
                 0);
  return text.Take();
}

/// "[AKD-2011, 4.3.3]" is left to itself; long rows hang below the family's name.
std::string MeaningsText(const std::vector<Meaning>& meanings, bool color) {
  report::TextBuilder text(color);
  for (const Meaning& meaning : meanings) {
    if (&meaning != &meanings.front()) text.Line();
    text.Line(text.Styled(report::OneLine(meaning.name), Style::kBold) + " (" + std::string(meaning.kind) + ")");
    std::size_t label_width = 0;
    for (const auto& [label, about] : meaning.details) label_width = std::max(label_width, label.size() + 2);
    for (const auto& [label, about] : meaning.details) {
      text.Paragraph(report::Padded(label, label_width) + report::OneLine(about), 2, 2 + label_width);
    }
    std::size_t family_width = 0;
    for (const Statement& statement : meaning.statements) {
      family_width = std::max(family_width, report::Columns(statement.family) + 2);
    }
    if (!meaning.details.empty()) text.Line();
    for (const Statement& statement : meaning.statements) {
      const bool same = &statement != meaning.statements.data() && (&statement - 1)->family == statement.family;
      std::string line = report::Padded(same ? "" : report::OneLine(statement.family), family_width);
      line += report::OneLine(statement.text);
      if (!statement.note.empty()) line += "; " + report::OneLine(statement.note);
      if (!statement.source.empty()) line += " [" + report::OneLine(statement.source) + "]";
      text.Paragraph(line, 2, 2 + family_width);
    }
  }
  return text.Take();
}

std::string MeaningsJson(const std::string& what, const std::vector<Meaning>& meanings) {
  return report::JsonDocumentText([&](report::JsonObject& out) {
    out.Put("schema", "ecaudit.explanation/1");
    out.Text("what", what);
    out.List("meanings", meanings, [](report::JsonObject& json, const Meaning& meaning) {
      json.Put("kind", meaning.kind);
      json.Text("name", meaning.name);
      json.List("details", meaning.details, [](report::JsonObject& detail, const auto& row) {
        detail.Put("label", row.first);
        detail.Text("text", row.second);
      });
      json.List("statements", meaning.statements, [](report::JsonObject& row, const Statement& statement) {
        row.Text("family", statement.family);
        row.Text("text", statement.text);
        row.TextOrNull("note", statement.note);
        row.TextOrNull("source", statement.source);
      });
    });
  });
}

class ExplainCommand : public Command {
 public:
  ExplainCommand()
      : Command("explain", "explain WHAT", "Explain a rule (what it checks, what to do), a code or a number") {}

  void Declare(OptionSet& options) override {
    options.Argument("WHAT", what_, "id of a rule, or a number as below", true);
    options.Words(RuleIds());
    options.Value("--profile", "PROFILE", profile_, "show only the standard and this family");
    options.Words(device::BuiltinProfileNames());
    options.Values("--profiles", "PATH", paths_, "more drive families: a JSON file or a folder of them (repeatable)");
    output_.Declare(options);
    options.Footer(
        "WHAT is one of these; neither a capture nor a network is needed:\n"
        "  al-refused             a rule, as reports and 'ecaudit rules' print it\n"
        "  0x001d                 AL status code, register, object or emergency: all that has this number\n"
        "  0x06090011             SDO abort code\n"
        "  F125, n503, F28        fault or warning that a drive shows\n"
        "  NAME                   name of the manuals: capitals or digits, as they print it\n"
        "  \"CoE service\"          phrase of the manuals, two words or more\n"
        "  6040h, 1018h:1         object, by family; 6040h, 6041h and 6060h with bits and values\n"
        "  6041h=0x1237           value of an object: state and bits\n"
        "  6041, 1C12:1, 27       the same without a mark; 27 is a code in decimal and in hexadecimal\n"
        "  0x0130, 0x0810         register with its bits\n"
        "  FPRD                   datagram command\n"
        "  SAFEOP, SAFEOP+ERR     AL state\n"
        "  enabled, sync          rung of the ladder under Progress: what it needs and what may hold it\n"
        "  \"axis does not move\"   the rungs in order; also \"does not reach OP\", \"drops out of OP\"");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    const std::string what = what_.value_or("");
    if (const RuleInfo* rule = FindRule(what)) {
      return output_.Print(
          console, [rule](bool color) { return ExplainText(*rule, color); },
          [rule] { return report::JsonDocumentText([rule](report::JsonObject& out) { PutRule(out, *rule); }); });
    }
    const Result<device::ProfileRegistry> known = LoadFamilies(paths_);
    if (!known) return Fail(console, known.error());
    const Result<Families> families = AskedFamilies(*known);
    if (!families) return Fail(console, families.error());
    std::vector<Meaning> meanings = LookUp(what, *families);
    // Parameters are also mentioned in rows of other names: bits of objects, files.
    if (meanings.empty() || what.find('.') != std::string::npos) lookup::AddMentions(what, *families, *known, meanings);
    if (meanings.empty()) return Unknown(console, what);
    return output_.Print(
        console, [&meanings](bool color) { return MeaningsText(meanings, color); },
        [&] { return MeaningsJson(what, meanings); });
  }

 private:
  [[nodiscard]] Result<Families> AskedFamilies(const device::ProfileRegistry& registry) const {
    Families families;
    if (profile_ && registry.Find(*profile_) == nullptr) return UnknownProfile(registry, *profile_);
    for (const std::string& name : registry.Names()) {
      if (profile_ && name != *profile_ && name != "generic") continue;
      families.push_back(registry.Find(name));
    }
    return families;
  }

  [[nodiscard]] static ExitStatus Unknown(Console& console, const std::string& what) {
    if (IsNumberLike(what)) {
      return Fail(console, Error{"nothing is known of '" + what + "' (see 'ecaudit explain --help')"});
    }
    std::vector<std::string_view> ids;
    for (const RuleInfo* known : RuleCatalogue()) ids.push_back(known->id);
    for (const std::string_view topic : lookup::ProgressTopics()) ids.push_back(topic);
    return Fail(console, Error{"unknown rule '" + what + "'" + Suggestion(what, ids, "ecaudit rules")});
  }

  std::optional<std::string> what_;
  std::optional<std::string> profile_;
  std::vector<std::string> paths_;
  CatalogueOutput output_;
};

}  // namespace

std::unique_ptr<Command> MakeExplainCommand() {
  return std::make_unique<ExplainCommand>();
}

}  // namespace ecaudit::cli
