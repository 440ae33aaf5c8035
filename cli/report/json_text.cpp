#include "cli/report/json_text.h"

#include <charconv>

#include "cli/report/layout.h"
#include "decoder/base/json.h"

namespace ecaudit::report {
namespace {

constexpr std::size_t kIndent = 2;

template <typename T>
void AppendNumber(std::string& out, T value) {
  char digits[24];
  const char* const end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  out.append(digits, static_cast<std::size_t>(end - digits));  // by length: two iterators make it replace()
}

}  // namespace

/// Writes the document that it receives.
class JsonCopy : public JsonListener {
 public:
  explicit JsonCopy(JsonText& text) : text_(text) {}

  void Null() override { Value(nullptr); }
  void Boolean(bool value) override { Value(value); }
  void Natural(std::uint64_t value) override { Value(value); }
  void Integer(std::int64_t value) override { Value(value); }
  void Number(double value) override { Value(value); }
  void Text(std::string_view value) override { Value(value); }
  void Key(std::string_view key) override {
    text_.Key(key);
    after_key_ = true;
  }
  void BeginObject() override { Open('{'); }
  void EndObject() override { text_.Close('}'); }
  void BeginArray() override { Open('['); }
  void EndArray() override { text_.Close(']'); }

 private:
  /// A value after its key stands in the place that the key has taken.
  void Place() {
    if (!after_key_) text_.Element();
    after_key_ = false;
  }
  void Value(JsonScalar value) {
    Place();
    text_.Value(value);
  }
  void Open(char bracket) {
    Place();
    text_.Open(bracket);
  }

  JsonText& text_;
  bool after_key_ = false;
};

void JsonScalar::AppendTo(std::string& out) const {
  switch (kind_) {
    case Kind::kNull:
      out += "null";
      break;
    case Kind::kBoolean:
      out += natural_ != 0 ? "true" : "false";
      break;
    case Kind::kNatural:
      AppendNumber(out, natural_);
      break;
    case Kind::kInteger:
      AppendNumber(out, integer_);
      break;
    case Kind::kNumber:
      AppendJson(out, number_);
      break;
    case Kind::kText:
      AppendJson(out, text_);
      break;
  }
}

void JsonText::NewLine() {
  if (!indents()) return;
  out_ += '\n';
  out_.append(depth_ * kIndent, ' ');
}

void JsonText::Element() {
  if (sink_ && out_.size() >= kPieceBytes) {
    sink_(out_);
    given_ += out_.size();
    out_.clear();
  }
  if (!empty_) out_ += ',';
  empty_ = false;
  NewLine();
}

void JsonText::Key(std::string_view key) {
  Element();
  AppendJson(out_, key);
  out_ += indents() ? ": " : ":";
}

void JsonText::Open(char bracket) {
  out_ += bracket;
  ++depth_;
  empty_ = true;
}

void JsonText::Close(char bracket) {
  --depth_;
  if (!empty_) NewLine();
  out_ += bracket;
  empty_ = false;
}

void JsonArray::Add(JsonScalar value) {
  text_.Element();
  text_.Value(value);
}

void JsonArray::AddDocument(std::string_view json) {
  JsonCopy copy(text_);
  StreamJson(json, copy);
}

void JsonObject::Put(std::string_view key, JsonScalar value) {
  text_.Key(key);
  text_.Value(value);
}

void JsonObject::Text(std::string_view key, std::string_view text) {
  Put(key, PrintableLines(text));
}

void JsonObject::TextOrNull(std::string_view key, std::string_view text) {
  if (text.empty()) return Put(key, nullptr);
  Text(key, text);
}

void JsonObject::Texts(std::string_view key, std::span<const std::string> texts) {
  Array(key, [&](JsonArray& array) {
    for (const std::string& text : texts) array.Add(PrintableLines(text));
  });
}

void PutTool(JsonObject& out, std::string_view version) {
  out.Object("tool", [&](JsonObject& json) {
    json.Put("name", "ecaudit");
    json.Put("version", version);
  });
}

}  // namespace ecaudit::report
