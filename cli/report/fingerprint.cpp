#include "cli/report/fingerprint.h"

#include "cli/report/layout.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::report {

Fingerprint FingerprintOf(const FindingDigest& finding) {
  return {finding.rule, finding.slave, finding.identity};
}

std::string IdentityText(const Finding& finding) {
  return PrintableLines(IdentityOf(finding));
}

std::uint64_t StableHash(std::string_view bytes) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (const char c : bytes) {
    hash = WrappingProduct(hash ^ static_cast<unsigned char>(c), std::uint64_t{0x100000001B3});
  }
  return hash;
}

}  // namespace ecaudit::report
