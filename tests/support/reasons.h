/// Reasons for tests that need any, or many different ones.
#pragma once

#include <deque>
#include <map>
#include <string>

#include "analyzers/result/reason.h"

namespace ecaudit::test {

/// "`what` is not in the capture".
inline Reason Because(const std::string& what) {
  static std::deque<std::string> texts;  // both live as long as the tests
  static std::map<std::string, Word> words;
  const auto [at, is_new] = words.try_emplace(what);
  if (is_new) {
    texts.push_back(what);
    at->second = Word{texts.back(), texts.back()};
  }
  return Reason::Of(ReasonCode::kNotInCapture, at->second);
}

}  // namespace ecaudit::test
