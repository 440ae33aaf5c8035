#include "decoder/base/json_places.h"

#include <algorithm>

namespace ecaudit {
namespace {

constexpr int kMaxDepth = 64;

}  // namespace

JsonPlaces::JsonPlaces(std::string_view text) : text_(text) {
  Value("", 0, 0);
}

const JsonPlace* JsonPlaces::Find(std::string_view path) const {
  const auto it = places_.find(path);
  return it == places_.end() ? nullptr : &it->second;
}

void JsonPlaces::Space() {
  while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
}

bool JsonPlaces::Take(char c) {
  Space();
  if (at_ >= text_.size() || text_[at_] != c) return false;
  ++at_;
  return true;
}

/// Keys of profiles hold no escapes; one that does is named as it is written.
std::string JsonPlaces::Text() {
  const std::size_t begin = ++at_;
  while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
  at_ = std::min(at_, text_.size());
  std::string out(text_.substr(begin, at_ - begin));
  if (at_ < text_.size()) ++at_;
  return out;
}

void JsonPlaces::Value(const std::string& path, std::size_t outer, int depth) {
  Space();
  if (at_ >= text_.size() || depth > kMaxDepth) {
    at_ = text_.size();
    return;
  }
  JsonPlace place{outer, at_, at_};
  if (path.empty() || path.back() == ']') place.outer = at_;
  if (text_[at_] == '{') {
    Object(path, depth);
  } else if (text_[at_] == '[') {
    Array(path, depth);
  } else if (text_[at_] == '"') {
    static_cast<void>(Text());
  } else {
    while (at_ < text_.size() && std::string_view(",]} \t\r\n").find(text_[at_]) == std::string_view::npos) ++at_;
  }
  place.end = at_;
  const auto [known, added] = places_.try_emplace(path, place);
  if (!added) {
    repeated_.emplace_back(path, place);
    known->second = place;
  }
}

void JsonPlaces::Object(const std::string& path, int depth) {
  ++at_;
  while (!Take('}')) {
    Space();
    if (at_ >= text_.size() || text_[at_] != '"') {
      at_ = text_.size();
      return;
    }
    const std::size_t outer = at_;
    const std::string key = Text();
    if (!Take(':')) {
      at_ = text_.size();
      return;
    }
    Value(path.empty() ? key : path + "." + key, outer, depth + 1);
    static_cast<void>(Take(','));
  }
}

void JsonPlaces::Array(const std::string& path, int depth) {
  ++at_;
  for (std::size_t index = 0; !Take(']'); ++index) {
    if (at_ >= text_.size()) return;
    const std::size_t before = at_;
    Value(path + "[" + std::to_string(index) + "]", at_, depth + 1);
    static_cast<void>(Take(','));
    if (at_ == before) {  // no value: not JSON
      at_ = text_.size();
      return;
    }
  }
}

std::size_t LineOf(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, std::min(offset, text.size()));
  return 1 + static_cast<std::size_t>(std::ranges::count(before, '\n'));
}

}  // namespace ecaudit
