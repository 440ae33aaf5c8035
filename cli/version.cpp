#include "cli/version.h"

#include <ecaudit_build_info.h>

#include "cli/report/sarif_writer.h"
#include "decoder/capture/libraries.h"

namespace ecaudit::cli {

// Set by the build from project(ecaudit VERSION ...).
std::string_view Version() {
  return ECAUDIT_VERSION;
}

std::string VersionPage() {
  return "ecaudit " + std::string(Version()) + "\n" + "commit     " ECAUDIT_COMMIT "\n" +
         "compiler   " ECAUDIT_COMPILER "\n" + "libraries  " ECAUDIT_LIBRARIES "\n" + "runs with  " +
         capture::LibraryVersions() + ", Qt " + report::QtVersion() + "\n";
}

}  // namespace ecaudit::cli
