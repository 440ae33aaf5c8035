#include "cli/commands/catalogue_output.h"

#include <algorithm>
#include <array>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/options.h"
#include "analyzers/result/rule_info.h"
#include "cli/report/json_text.h"

namespace ecaudit::cli {

void CatalogueOutput::Declare(OptionSet& options) {
  options.Value("--format", "FORMAT", format_, "text (default) or json");
  options.Words({"text", "json"});
  text_.DeclareColor(options);
}

ExitStatus CatalogueOutput::Print(Console& console, const std::function<std::string(bool)>& text,
                                  const std::function<std::string()>& json) const {
  const std::string format = format_.value_or("text");
  if (format != "text" && format != "json") {
    console.Error("unknown format '" + format + "' (text, json)");
    return ExitStatus::kUsage;
  }
  if (const auto error = text_.Check()) {
    console.Error(error->message);
    return ExitStatus::kUsage;
  }
  if (const auto error = console.Write(format == "json" ? json() : text(text_.Colors(console)))) {
    console.Error(error->message);
    return ExitStatus::kUsage;
  }
  return ExitStatus::kClean;
}

std::vector<std::string_view> RuleGroups() {
  // The order of the catalogue's chapters; a group that is new comes after them.
  constexpr std::array<std::string_view, 10> kChapters{
      "Capture",         "Frame and bus", "AL state machine",      "Sync managers and FMMUs",
      "Mailbox and CoE", "PDO mapping",   "Drive profile (DS402)", "Synchronisation",
      "Latch",           "Start-up"};
  std::vector<std::string_view> groups;
  const auto rules_of = [](std::string_view group) {
    return std::ranges::any_of(RuleCatalogue(), [group](const RuleInfo* rule) { return rule->group == group; });
  };
  for (const std::string_view chapter : kChapters) {
    if (rules_of(chapter)) groups.push_back(chapter);
  }
  for (const RuleInfo* rule : RuleCatalogue()) {
    if (std::ranges::find(groups, rule->group) == groups.end()) groups.push_back(rule->group);
  }
  return groups;
}

void PutRule(report::JsonObject& out, const RuleInfo& rule) {
  out.Put("id", rule.id);
  out.Put("group", rule.group);
  out.Put("severity", Name(rule.severity));
  out.Put("title", rule.title);
  out.Put("needs", rule.needs);
  out.Put("source", rule.source);
  out.Put("doc", rule.doc);
}

}  // namespace ecaudit::cli
