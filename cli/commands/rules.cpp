/// `ecaudit rules`: the catalogue.
#include <string>
#include <string_view>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/options.h"
#include "analyzers/result/rule_info.h"
#include "cli/commands/catalogue_output.h"
#include "cli/commands/command.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"

namespace ecaudit::cli {
namespace {

using report::Style;

std::string RulesText(bool color) {
  std::size_t width = 0;
  for (const RuleInfo* rule : RuleCatalogue()) width = std::max(width, rule->id.size());

  report::TextBuilder text(color);
  for (const std::string_view group : RuleGroups()) {
    if (group != RuleGroups().front()) text.Line();
    text.Line(text.Styled(group, Style::kBold));
    for (const RuleInfo* rule : RuleCatalogue()) {
      if (rule->group != group) continue;
      std::string line(rule->id);
      line.append(width - rule->id.size() + 2, ' ');
      const std::string_view severity = Name(rule->severity);
      line += text.Styled(severity, report::StyleOf(rule->severity));
      line.append(std::string_view("warning").size() - severity.size() + 2, ' ');
      line += rule->title;
      text.Line(line, 2);
    }
  }
  text.Line();
  text.Line("ecaudit explain RULE shows what a rule checks, why, and what to do.");
  return text.Take();
}

std::string RulesJson() {
  return report::JsonDocumentText([](report::JsonObject& out) {
    out.Put("schema", "ecaudit.rules/1");
    out.List("rules", RuleCatalogue(), [](report::JsonObject& json, const RuleInfo* rule) { PutRule(json, *rule); });
  });
}

class RulesCommand : public Command {
 public:
  RulesCommand() : Command("rules", "rules", "List the rules that captures are checked against") {}
  void Declare(OptionSet& options) override { output_.Declare(options); }
  [[nodiscard]] ExitStatus Run(Console& console) override { return output_.Print(console, RulesText, RulesJson); }

 private:
  CatalogueOutput output_;
};

}  // namespace

std::unique_ptr<Command> MakeRulesCommand() {
  return std::make_unique<RulesCommand>();
}

}  // namespace ecaudit::cli
