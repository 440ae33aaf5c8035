#include "decoder/base/packed_json.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "decoder/base/json_tree.h"

// A value is its type, then:  numbers and truth: 8 bytes, little endian;  text: length, bytes;  array: count, elements;
// object: count, and for each member its key (length, bytes) and value. Lengths and counts: 7 bits a byte, lowest
// first.

namespace ecaudit {
namespace {

constexpr std::size_t kMostNested = 64;

class TreeBuilder final : public JsonListener {
 public:
  explicit TreeBuilder(JsonTree& tree) : tree_(tree) {}
  void Null() override { tree_.Null(); }
  void Boolean(bool value) override { tree_.Boolean(value); }
  void Natural(std::uint64_t value) override { tree_.Natural(value); }
  void Integer(std::int64_t value) override { tree_.Integer(value); }
  void Number(double value) override { tree_.Real(value); }
  void Text(std::string_view value) override { tree_.Text(value); }
  void Key(std::string_view key) override { tree_.Key(key); }
  void BeginObject() override { tree_.Begin(JsonType::kObject); }
  void EndObject() override { tree_.End(); }
  void BeginArray() override { tree_.Begin(JsonType::kArray); }
  void EndArray() override { tree_.End(); }

 private:
  JsonTree& tree_;
};

void AppendLength(std::string& out, std::size_t length) {
  for (; length > 0x7F; length >>= 7U) out += static_cast<char>((length & 0x7FU) | 0x80U);
  out += static_cast<char>(length);
}

void AppendText(std::string& out, std::string_view text) {
  AppendLength(out, text.size());
  out += text;
}

void AppendFixed(std::string& out, std::uint64_t value) {
  for (unsigned i = 0; i < 8; ++i) out += static_cast<char>(value >> (8 * i) & 0xFFU);
}

void AppendNode(std::string& out, const JsonNode& node) {
  out += static_cast<char>(node.type);
  switch (node.type) {
    case JsonType::kNull:
      return;
    case JsonType::kBoolean:
      return AppendFixed(out, node.held.boolean ? 1 : 0);
    case JsonType::kNatural:
      return AppendFixed(out, node.held.natural);
    case JsonType::kInteger:
      return AppendFixed(out, std::bit_cast<std::uint64_t>(node.held.integer));
    case JsonType::kReal:
      return AppendFixed(out, std::bit_cast<std::uint64_t>(node.held.real));
    case JsonType::kText:
      return AppendText(out, node.text);
    case JsonType::kArray:
    case JsonType::kObject:
      break;
  }
  AppendLength(out, node.held.children.count);
  for (std::size_t i = 0; i < node.held.children.count; ++i) {
    const JsonNode& child = node.held.children.first[i];
    if (node.type == JsonType::kObject) AppendText(out, child.key);
    AppendNode(out, child);
  }
}

class Unpacker {
 public:
  Unpacker(std::string_view packed, JsonTree& tree) : left_(packed), tree_(tree) {}

  [[nodiscard]] bool Read(JsonNode& node, std::size_t depth) {
    if (left_.empty() || depth == kMostNested) return false;
    node.type = static_cast<JsonType>(left_.front());
    left_.remove_prefix(1);
    std::uint64_t value = 0;
    switch (node.type) {
      case JsonType::kNull:
        return true;
      case JsonType::kBoolean:
        if (!ReadFixed(value)) return false;
        node.held.boolean = value != 0;
        return true;
      case JsonType::kNatural:
        return ReadFixed(node.held.natural);
      case JsonType::kInteger:
        if (!ReadFixed(value)) return false;
        node.held.integer = std::bit_cast<std::int64_t>(value);
        return true;
      case JsonType::kReal:
        if (!ReadFixed(value)) return false;
        node.held.real = std::bit_cast<double>(value);
        return true;
      case JsonType::kText:
        return ReadText(node.text);
      case JsonType::kArray:
      case JsonType::kObject:
        return ReadChildren(node, depth);
    }
    return false;
  }
  [[nodiscard]] bool done() const { return left_.empty(); }

 private:
  bool ReadChildren(JsonNode& node, std::size_t depth) {
    std::size_t count = 0;
    // Each takes a byte at least.
    if (!ReadLength(count) || count > left_.size()) return false;
    node.held.children = {nullptr, count};
    if (count == 0) return true;
    JsonNode* const children = tree_.RoomFor(count);
    node.held.children.first = children;
    for (std::size_t i = 0; i < count; ++i) {
      if (node.type == JsonType::kObject && !ReadText(children[i].key)) return false;
      if (!Read(children[i], depth + 1)) return false;
    }
    return true;
  }
  bool ReadText(std::string_view& text) {
    std::size_t length = 0;
    if (!ReadLength(length) || length > left_.size()) return false;
    text = left_.substr(0, length);
    left_.remove_prefix(length);
    return true;
  }
  bool ReadLength(std::size_t& length) {
    for (unsigned shift = 0; shift < 32 && !left_.empty(); shift += 7) {
      const auto byte = static_cast<std::uint8_t>(left_.front());
      left_.remove_prefix(1);
      length |= std::size_t{byte & 0x7FU} << shift;
      if (byte < 0x80) return true;
    }
    return false;
  }
  bool ReadFixed(std::uint64_t& value) {
    if (left_.size() < 8) return false;
    value = 0;
    for (unsigned i = 0; i < 8; ++i) value |= std::uint64_t{static_cast<std::uint8_t>(left_[i])} << (8 * i);
    left_.remove_prefix(8);
    return true;
  }

  std::string_view left_;
  JsonTree& tree_;
};

}  // namespace

std::string PackJson(std::string_view text, std::span<const std::string_view> only) {
  JsonTree tree;
  TreeBuilder builder(tree);
  if (!StreamJson(text, builder) || tree.repeated()) return {};
  JsonNode root = tree.root();
  std::vector<JsonNode> members;
  if (!only.empty() && root.type == JsonType::kObject) {
    for (const std::string_view key : only) {
      if (const JsonNode* member = root.Member(key)) members.push_back(*member);
    }
    root.held.children = {members.data(), members.size()};
  }
  std::string packed;
  AppendNode(packed, root);
  return packed;
}

std::optional<JsonDocument> UnpackJson(std::string_view packed) {
  auto tree = std::make_shared<JsonTree>();
  JsonNode root;
  Unpacker unpacker(packed, *tree);
  if (!unpacker.Read(root, 0) || !unpacker.done()) return std::nullopt;
  tree->SetRoot(root);
  return JsonDocument(std::move(tree));
}

}  // namespace ecaudit
