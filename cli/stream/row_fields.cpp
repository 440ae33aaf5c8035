#include "cli/stream/row_fields.h"

namespace ecaudit::cli {

void RowFields::Clear() {
  fields_.clear();
  texts_.clear();
  open_ = false;
}

void RowFields::Close() {
  if (open_) fields_.back().length = texts_.size() - fields_.back().begin;
  open_ = false;
}

RowField& RowFields::Add(std::string_view key, RowField::Kind kind) {
  Close();
  RowField& field = fields_.emplace_back();
  field.key = key;
  field.kind = kind;
  return field;
}

void RowFields::AddText(std::string_view key, RowField::Kind kind, std::string_view text) {
  RowField& field = Add(key, kind);
  field.begin = texts_.size();
  field.length = text.size();
  texts_ += text;
}

void RowFields::Bytes(std::string_view key, ByteSpan bytes) {
  RowField& field = Add(key, RowField::Kind::kBytes);
  field.begin = texts_.size();
  field.length = bytes.size();
  texts_.append(bytes.begin(), bytes.end());
}

std::string& RowFields::Json(std::string_view key) {
  Add(key, RowField::Kind::kJson).begin = texts_.size();
  open_ = true;
  return texts_;
}

const RowField* RowFields::Find(std::string_view key) const {
  for (const RowField& field : fields_) {
    if (field.key == key) return &field;
  }
  return nullptr;
}

ByteSpan RowFields::BytesOf(const RowField& field) const {
  const std::string_view text = TextOf(field);
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::size_t RowFields::size() const {
  constexpr std::size_t kKeyAndNumber = 16;
  return texts_.size() + fields_.size() * kKeyAndNumber;
}

}  // namespace ecaudit::cli
