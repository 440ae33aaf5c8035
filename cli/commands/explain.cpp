/// `ecaudit explain RULE`: one rule with cause, remedy and manual section.
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/options.h"
#include "analyzers/result/rule_info.h"
#include "cli/commands/catalogue_output.h"
#include "cli/commands/command.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
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
  text.Paragraph("Switch it off or change its severity: --rule " + std::string(rule.id) +
                     "=off|info|warning|error, or \"rules\" in .ecaudit.json",
                 0);
  return text.Take();
}

class ExplainCommand : public Command {
 public:
  [[nodiscard]] std::string_view name() const override { return "explain"; }
  [[nodiscard]] std::string_view usage() const override { return "explain RULE"; }
  [[nodiscard]] std::string_view summary() const override { return "Say what a rule checks, why, and what to do"; }

  void Declare(OptionSet& options) override {
    options.Argument("RULE", rule_, "id of a rule, as reports and 'ecaudit rules' print it", true);
    output_.Declare(options);
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    const std::string id = rule_.value_or("");
    const RuleInfo* rule = FindRule(id);
    if (rule == nullptr) {
      std::vector<std::string_view> ids;
      for (const RuleInfo* known : RuleCatalogue()) ids.push_back(known->id);
      console.Error("unknown rule '" + id + "'" + Suggestion(id, ids, "ecaudit rules"));
      return ExitStatus::kUsage;
    }
    return output_.Print(
        console, [rule](bool color) { return ExplainText(*rule, color); },
        [rule] { return report::JsonDocumentText([rule](report::JsonObject& out) { PutRule(out, *rule); }); });
  }

 private:
  std::optional<std::string> rule_;
  CatalogueOutput output_;
};

}  // namespace

std::unique_ptr<Command> MakeExplainCommand() {
  return std::make_unique<ExplainCommand>();
}

}  // namespace ecaudit::cli
