// Stands in for the page where npm was missing when the program was built.
#include "cli/report/html_writer.h"

namespace ecaudit::report {

std::string_view MissingHtml() {
  return "this program was built without HTML reports, because npm was missing or could not reach its registry";
}

std::string_view HtmlPage() {
  return {};
}

}  // namespace ecaudit::report
