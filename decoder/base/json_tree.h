/// The values of a JSON document, kept together: as many as a document has, in a few blocks of memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ecaudit {

enum class JsonType : std::uint8_t { kNull, kBoolean, kNatural, kInteger, kReal, kText, kArray, kObject };

/// One value. Texts and elements lie in the tree it belongs to.
struct JsonNode {
  /// Objects up to this size keep their members as they were written, larger ones by key.
  static constexpr std::size_t kMostUnsorted = 24;

  struct Children {
    const JsonNode* first;
    std::size_t count;
  };
  union Held {
    bool boolean;
    std::uint64_t natural;
    std::int64_t integer;  ///< below 0
    double real;
    Children children;
  };

  std::string_view key;  ///< of a member
  std::string_view text;
  Held held{.natural = 0};
  JsonType type = JsonType::kNull;

  [[nodiscard]] bool holds_children() const { return type == JsonType::kArray || type == JsonType::kObject; }
  /// Null when this is no object, or lacks it.
  [[nodiscard]] const JsonNode* Member(std::string_view name) const;
};

/// Takes a document part by part, in the order in which it is written, and owns what became of it.
class JsonTree {
 public:
  [[nodiscard]] const JsonNode& root() const { return root_; }
  /// A key that appears twice in one object, whose last value stays.
  [[nodiscard]] const std::optional<std::string>& repeated() const { return repeated_; }
  /// Arrays and objects that have begun and not ended.
  [[nodiscard]] std::size_t depth() const { return open_.size(); }

  void Null() { Add({}); }
  void Boolean(bool value) { Add({{}, {}, {.boolean = value}, JsonType::kBoolean}); }
  void Natural(std::uint64_t value) { Add({{}, {}, {.natural = value}, JsonType::kNatural}); }
  void Integer(std::int64_t value) { Add({{}, {}, {.integer = value}, JsonType::kInteger}); }
  void Real(double value) { Add({{}, {}, {.real = value}, JsonType::kReal}); }
  void Text(std::string_view value) { Add({{}, Keep(value), {.natural = 0}, JsonType::kText}); }
  void Key(std::string_view key) { key_ = Keep(key); }
  void Begin(JsonType type);
  void End();

 private:
  struct Open {
    JsonNode node;
    std::size_t first = 0;  ///< of its children in `waiting_`
  };

  void Add(JsonNode node);
  [[nodiscard]] std::string_view Keep(std::string_view text);
  [[nodiscard]] void* Take(std::size_t bytes);
  /// Orders and thins out the members after `first`.
  void SortMembers(std::size_t first);

  JsonNode root_;
  std::vector<Open> open_;
  std::vector<JsonNode> waiting_;  ///< children of what is open
  std::string_view key_;           ///< of the next value
  std::optional<std::string> repeated_;

  std::vector<std::unique_ptr<std::byte[]>> blocks_;
  std::byte* at_ = nullptr;
  std::size_t left_ = 0;
};

}  // namespace ecaudit
