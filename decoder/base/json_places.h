/// Where the values of a JSON document stand in its text, for messages with line numbers and for cutting parts out.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace ecaudit {

/// Places of one value, as offsets into the text.
struct JsonPlace {
  std::size_t outer = 0;  ///< of the key of a member, else as `begin`
  std::size_t begin = 0;
  std::size_t end = 0;  ///< after the value
};

/// Values are named by the way to them: "al.transitions[3].from"; "" is the document.
class JsonPlaces {
 public:
  /// @param text  a JSON document; of other text as much as is one
  explicit JsonPlaces(std::string_view text);

  /// Null when there is no such value.
  [[nodiscard]] const JsonPlace* Find(std::string_view path) const;
  /// Members whose key the object has already had; Find() gives the last.
  [[nodiscard]] const std::vector<std::pair<std::string, JsonPlace>>& repeated() const { return repeated_; }

 private:
  void Value(const std::string& path, std::size_t outer, int depth);
  void Object(const std::string& path, int depth);
  void Array(const std::string& path, int depth);
  [[nodiscard]] std::string Text();
  void Space();
  [[nodiscard]] bool Take(char c);

  std::string_view text_;
  std::size_t at_ = 0;
  std::map<std::string, JsonPlace, std::less<>> places_;
  std::vector<std::pair<std::string, JsonPlace>> repeated_;
};

/// The line of an offset, from 1.
[[nodiscard]] std::size_t LineOf(std::string_view text, std::size_t offset);

}  // namespace ecaudit
