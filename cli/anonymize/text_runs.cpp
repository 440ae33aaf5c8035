#include "cli/anonymize/text_runs.h"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace ecaudit::cli::anonymize {
namespace {

bool IsPrintable(std::uint8_t byte) {
  return byte >= 0x20 && byte <= 0x7E;
}

/// Letters of other alphabets have bytes above 0x7F in every encoding that devices use.
bool IsLetter(std::uint8_t byte) {
  return std::isalpha(byte) != 0 || byte >= 0x80;
}

void BlotPart(Bytes bytes) {
  for (std::uint8_t& byte : bytes) {
    if (IsLetter(byte) || std::isdigit(byte) != 0) byte = 'x';
  }
}

void Keep(Bytes bytes, Secrets& secrets) {
  std::string text(bytes.begin(), bytes.end());
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
  const bool has_letters =
      std::ranges::any_of(text, [](unsigned char c) { return (IsLetter(c) || std::isdigit(c) != 0) && c != 'x'; });
  if (text.size() >= kShortestSecret && has_letters) secrets.insert(std::move(text));
}

std::string_view View(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

void BlotText(Bytes bytes, Secrets& secrets) {
  // A text ends at its zero; what follows may be another.
  for (std::size_t at = 0; at < bytes.size();) {
    const auto end = std::find(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end(), std::uint8_t{0});
    const auto length = static_cast<std::size_t>(end - bytes.begin()) - at;
    Keep(bytes.subspan(at, length), secrets);
    BlotPart(bytes.subspan(at, length));
    at += length + 1;
  }
}

void BlotRuns(Bytes bytes, std::size_t shortest, Secrets& secrets) {
  for (std::size_t at = 0; at < bytes.size();) {
    std::size_t end = at;
    std::size_t letters = 0;
    for (; end < bytes.size() && IsPrintable(bytes[end]); ++end) letters += std::isalpha(bytes[end]) != 0 ? 1 : 0;
    if (end - at >= shortest && letters >= 2) {
      Keep(bytes.subspan(at, end - at), secrets);
      BlotPart(bytes.subspan(at, end - at));
    }
    at = end + 1;
  }
}

void BlotSecrets(Bytes bytes, const Secrets& secrets) {
  for (const std::string& secret : secrets) {
    const std::string_view all = View(bytes);
    for (std::size_t at = all.find(secret); at != std::string_view::npos; at = all.find(secret, at + 1)) {
      BlotPart(bytes.subspan(at, secret.size()));
    }
  }
}

void Clear(Bytes bytes) {
  std::ranges::fill(bytes, std::uint8_t{0});
}

void Cross(Bytes bytes) {
  for (std::uint8_t& byte : bytes) {
    if (byte != 0) byte = 'x';
  }
}

bool HoldsSecret(std::span<const std::uint8_t> bytes, const Secrets& secrets) {
  const std::string_view all = View(bytes);
  return std::ranges::any_of(secrets,
                             [&](const std::string& secret) { return all.find(secret) != std::string_view::npos; });
}

}  // namespace ecaudit::cli::anonymize
