#include "cli/version.h"

namespace ecaudit::cli {

// Set by the build from project(ecaudit VERSION ...).
std::string_view Version() {
  return ECAUDIT_VERSION;
}

}  // namespace ecaudit::cli
