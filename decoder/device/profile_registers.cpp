/// Reads the sections "registers", "register_bits" and "event_bits" of a profile.
#include <algorithm>
#include <charconv>
#include <iterator>
#include <utility>

#include "decoder/base/sort_by_key.h"
#include "decoder/base/text.h"
#include "decoder/device/profile_sections.h"

namespace ecaudit::device {

void Read(const Cursor& cursor, Access& out) {
  static constexpr Word<Access> kWords[] = {{"unknown", Access::kUnknown},
                                            {"-", Access::kNone},
                                            {"r", Access::kRead},
                                            {"w", Access::kWrite},
                                            {"rw", Access::kReadWrite}};
  ReadWord(cursor, kWords, out);
}

void ReadBits(const Cursor& cursor, std::uint8_t& first, std::uint8_t& last) {
  std::string text;
  Read(cursor, text);
  if (cursor.failed()) return;
  const auto number = [](std::string_view digits) {
    unsigned value = 99;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return error == std::errc{} && end == digits.data() + digits.size() && !digits.empty() ? value : 99U;
  };
  const std::string_view all = text;
  const std::size_t dash = all.find('-');
  const unsigned low = number(all.substr(0, dash));
  const unsigned high = dash == std::string_view::npos ? low : number(all.substr(dash + 1));
  if (low > high || high > 31) {
    return cursor.Fail("\"" + Printable(text) + "\" names no bits (expected \"3\" or \"0-3\")");
  }
  first = static_cast<std::uint8_t>(low);
  last = static_cast<std::uint8_t>(high);
}

namespace {

/// A row that means several equal ones: "{n}" in its name is their number.
struct RegisterRow {
  struct Repeat {
    std::uint16_t count = 1;
    std::uint16_t stride = 0;
  };
  RegisterRight first;
  Repeat repeat;
};

}  // namespace

static void Read(const Cursor& cursor, RegisterRow::Repeat& out) {
  ObjectReader object(cursor);
  object.Require("count", out.count);
  object.Require("stride", out.stride);
  object.Finish();
}

static void Read(const Cursor& cursor, RegisterRow& row) {
  RegisterRight& out = row.first;
  ObjectReader object(cursor);
  object.Require("address", out.address);
  object.Require("length", out.length);
  object.Allow("repeat", row.repeat);
  object.Allow("buffer", out.buffer);
  object.Require("name", out.name);
  object.Allow("ecat", out.ecat);
  object.Allow("drive", out.drive);
  object.Allow("printed_ecat", out.printed_ecat);
  object.Allow("printed_length", out.printed_length);
  FinishRow(object, cursor, out.note, out.source);
  if (cursor.failed()) return;
  const std::uint64_t last = out.address + (std::max<std::uint64_t>(row.repeat.count, 1) - 1) * row.repeat.stride;
  if (out.length == 0 || row.repeat.count == 0 || last + out.length > 0x10000) {
    cursor.Fail("a register is at least one byte long and ends inside 0x0000 to 0xFFFF");
  }
}

namespace {

bool Overlap(const RegisterRight& a, const RegisterRight& b) {
  return a.address < b.address + b.length && b.address < a.address + a.length;
}

std::vector<RegisterRight> Expand(const std::vector<RegisterRow>& rows) {
  std::vector<RegisterRight> out;
  for (const RegisterRow& row : rows) {
    for (std::uint16_t n = 0; n < row.repeat.count; ++n) {
      RegisterRight& made = out.emplace_back(row.first);
      made.address = static_cast<EscAddress>(made.address + n * row.repeat.stride);
      if (const auto at = made.name.find("{n}"); at != std::string::npos) made.name.replace(at, 3, std::to_string(n));
    }
  }
  return out;
}

}  // namespace

void ReadRegisters(const Cursor& cursor, std::vector<RegisterRight>& inherited) {
  std::vector<RegisterRow> rows;
  Read(cursor, rows);
  if (cursor.failed()) return;
  std::vector<RegisterRight> own = Expand(rows);
  const auto address = [](const RegisterRight& row) { return row.address; };
  SortByKey(own, address);
  const auto clash = std::ranges::adjacent_find(own, Overlap);
  if (clash != own.end()) {
    return cursor.Fail("registers " + Hex(clash->address) + " and " + Hex(std::next(clash)->address) + " overlap");
  }
  std::erase_if(inherited, [&](const RegisterRight& old) {
    return std::ranges::any_of(own, [&](const RegisterRight& r) { return Overlap(old, r); });
  });
  for (RegisterRight& row : own) inherited.push_back(std::move(row));
  SortByKey(inherited, address);
}

void Read(const Cursor& cursor, RegisterBits& out) {
  ObjectReader object(cursor);
  object.Require("address", out.address);
  object.AllowWith("bits", [&](const Cursor& bits) { ReadBits(bits, out.first, out.last); });
  object.Allow("value", out.value);
  object.AllowWith("edge", [&](const Cursor& at) {
    static constexpr Word<bool> kEdges[] = {{"rising", true}, {"falling", false}};
    bool rising = false;
    ReadWord(at, kEdges, rising);
    out.rising = rising;
  });
  object.Require("name", out.name);
  object.Allow("meaning", out.meaning);
  object.Allow("ecat", out.ecat);
  object.Allow("drive", out.drive);
  object.Allow("printed_address", out.printed_address);
  FinishRow(object, cursor, out.note, out.source);
}

}  // namespace ecaudit::device
