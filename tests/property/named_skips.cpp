#include "tests/support/named_skips.h"

namespace ecaudit::test {
namespace {

[[maybe_unused]] const bool kNamed = ExpectNamedSkips("laws");

}  // namespace
}  // namespace ecaudit::test
