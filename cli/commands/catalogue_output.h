/// What `rules`, `explain` and `profiles` share: --format text|json on standard output.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/result/rule_info.h"
#include "cli/console.h"
#include "cli/exit_status.h"
#include "cli/options.h"
#include "cli/text_options.h"

namespace ecaudit::report {
class JsonObject;
}

namespace ecaudit::cli {

class CatalogueOutput {
 public:
  void Declare(OptionSet& options);
  /// Prints what the function of the chosen format returns; `text` gets the choice of colours.
  [[nodiscard]] ExitStatus Print(Console& console, const std::function<std::string(bool color)>& text,
                                 const std::function<std::string()>& json) const;

 private:
  std::optional<std::string> format_;
  TextOptions text_;
};

/// The headings of the catalogue, in the order in which rules of an AL state machine are read: as the first rule of
/// each appears in the catalogue's own order.
[[nodiscard]] std::vector<std::string_view> RuleGroups();

/// All that is known of a rule.
void PutRule(report::JsonObject& out, const RuleInfo& rule);

}  // namespace ecaudit::cli
