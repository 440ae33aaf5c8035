#include "tests/support/folders.h"

namespace ecaudit::test {

std::string SourceDir() {
  return ECAUDIT_SOURCE_DIR;
}

std::string SharedDir() {
  return ECAUDIT_SHARED_DIR;
}

}  // namespace ecaudit::test
