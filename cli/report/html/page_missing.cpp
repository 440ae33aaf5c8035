// Stands in for the page where npm was missing when the program was built.
#include "cli/report/html_writer.h"

namespace ecaudit::report {

std::string_view MissingHtml() {
  return "this program was built without HTML reports: npm was missing, could not reach its registry, or ECAUDIT_HTML "
         "was off";
}

std::string_view HtmlPage() {
  return {};
}

}  // namespace ecaudit::report
