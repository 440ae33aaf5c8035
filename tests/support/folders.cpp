#include "tests/support/folders.h"

#include <cstdlib>

namespace ecaudit::test {

std::string SourceDir() {
  return ECAUDIT_SOURCE_DIR;
}

std::string SharedDir() {
  const char* other = std::getenv("ECAUDIT_SHARED_DIR");
  return other != nullptr ? other : ECAUDIT_SHARED_DIR;
}

}  // namespace ecaudit::test
