#include "cli/report/fingerprint.h"

#include <algorithm>
#include <array>

#include "cli/report/layout.h"
#include "cli/report/sentences.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::report {

Fingerprint FingerprintOf(const FindingDigest& finding) {
  return {finding.rule, finding.slave, finding.identity.empty() ? WithoutCounts(finding.title) : finding.identity};
}

std::string IdentityText(const Finding& finding) {
  return finding.kind == nullptr ? WithoutCounts(PrintableLines(TitleOf(finding)))
                                 : PrintableLines(IdentityOf(finding));
}

std::string WithoutCounts(std::string_view title) {
  constexpr std::string_view kDigits = "0123456789";
  constexpr std::string_view kInNumbers = "0123456789.,";
  std::string out;
  while (!title.empty()) {
    const std::size_t spaces = std::min(title.find_first_not_of(' '), title.size());
    out += title.substr(0, spaces);
    title.remove_prefix(spaces);
    const std::string_view word = title.substr(0, std::min(title.find(' '), title.size()));
    title.remove_prefix(word.size());
    const bool number = !word.empty() && kDigits.find(word.front()) != std::string_view::npos &&
                        word.find_first_not_of(kInNumbers) == std::string_view::npos;
    // Names that are numbers: another one is another thing.
    constexpr std::array<std::string_view, 4> kNamed{"port ", "state ", "Mode of operation ", "Mode "};
    const bool name =
        std::any_of(kNamed.begin(), kNamed.end(), [&out](std::string_view what) { return out.ends_with(what); });
    if (!number || name) {
      out += word;
      continue;
    }
    out += '#';
    // Punctuation after the number belongs to the sentence.
    out += word.substr(word.find_last_of(kDigits) + 1);
  }
  return out;
}

std::uint64_t StableHash(std::string_view bytes) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (const char c : bytes) {
    hash = WrappingProduct(hash ^ static_cast<unsigned char>(c), std::uint64_t{0x100000001B3});
  }
  return hash;
}

}  // namespace ecaudit::report
