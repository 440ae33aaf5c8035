#include "decoder/base/json_tree.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace ecaudit {
namespace {

constexpr std::size_t kBlockBytes = std::size_t{32} << 10U;

static_assert(std::is_trivially_destructible_v<JsonNode>);  // blocks go without asking what lies in them

bool KeyLess(const JsonNode& a, const JsonNode& b) {
  return a.key < b.key;
}

bool KeyEqual(const JsonNode& a, const JsonNode& b) {
  return a.key == b.key;
}

bool AnyEqual(const JsonNode* first, const JsonNode* last) {
  for (const JsonNode* a = first; a < last; ++a) {
    for (const JsonNode* b = a + 1; b < last; ++b) {
      if (KeyEqual(*a, *b)) return true;
    }
  }
  return false;
}

}  // namespace

const JsonNode* JsonNode::Member(std::string_view name) const {
  if (type != JsonType::kObject) return nullptr;
  const JsonNode* const last = held.children.first + held.children.count;
  if (held.children.count <= kMostUnsorted) {
    for (const JsonNode* member = held.children.first; member != last; ++member) {
      if (member->key == name) return member;
    }
    return nullptr;
  }
  const JsonNode* found =
      std::lower_bound(held.children.first, last, name,
                       [](const JsonNode& member, std::string_view wanted) { return member.key < wanted; });
  return found != last && found->key == name ? found : nullptr;
}

void JsonTree::Add(JsonNode node) {
  if (open_.empty()) {
    root_ = node;
    return;
  }
  node.key = key_;
  waiting_.push_back(node);
}

void JsonTree::Begin(JsonType type) {
  JsonNode node;
  node.type = type;
  node.key = key_;
  node.held.children = {};
  open_.push_back({node, waiting_.size()});
}

void JsonTree::End() {
  Open open = open_.back();
  open_.pop_back();
  if (open.node.type == JsonType::kObject) SortMembers(open.first);
  const std::size_t count = waiting_.size() - open.first;
  if (count > 0) {
    auto* const kept = static_cast<JsonNode*>(Take(count * sizeof(JsonNode)));
    std::uninitialized_copy_n(waiting_.begin() + static_cast<std::ptrdiff_t>(open.first), count, kept);
    open.node.held.children = {kept, count};
  }
  waiting_.resize(open.first);
  key_ = open.node.key;
  Add(open.node);
}

void JsonTree::SortMembers(std::size_t first) {
  const auto begin = waiting_.begin() + static_cast<std::ptrdiff_t>(first);
  const std::size_t count = waiting_.size() - first;
  const JsonNode* const members = waiting_.data() + first;
  if (count <= JsonNode::kMostUnsorted && !AnyEqual(members, members + count)) return;
  std::stable_sort(begin, waiting_.end(), KeyLess);
  const auto twice = std::adjacent_find(begin, waiting_.end(), KeyEqual);
  if (twice == waiting_.end()) return;
  if (!repeated_) repeated_ = twice->key;
  // From the back: the last of equal ones is the first that stays.
  const auto kept = std::unique(waiting_.rbegin(), std::reverse_iterator(begin), KeyEqual);
  waiting_.erase(begin, kept.base());
}

std::string_view JsonTree::Keep(std::string_view text) {
  if (text.empty()) return {};
  char* const kept = static_cast<char*>(Take(text.size()));
  std::memcpy(kept, text.data(), text.size());
  return {kept, text.size()};
}

void* JsonTree::Take(std::size_t bytes) {
  constexpr std::size_t kAlign = alignof(JsonNode);
  bytes = (bytes + kAlign - 1) / kAlign * kAlign;
  if (bytes > left_) {
    const std::size_t room = std::max(kBlockBytes, bytes);
    blocks_.push_back(std::make_unique_for_overwrite<std::byte[]>(room));
    if (room > kBlockBytes) return blocks_.back().get();  // what is left of the last block still serves
    at_ = blocks_.back().get();
    left_ = room;
  }
  void* const taken = at_;
  at_ += bytes;
  left_ -= bytes;
  return taken;
}

}  // namespace ecaudit
