/// The CANopen objects of a simulated slave. The process data are objects too: mapped outputs are stored here and
/// mapped inputs are fetched from here.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <type_traits>
#include <utility>

#include "samples/builder/wire_bytes.h"

namespace ecaudit::samples {

inline constexpr std::uint16_t kRxAssignment = 0x1C12;
inline constexpr std::uint16_t kTxAssignment = 0x1C13;

struct ObjectEntry {
  std::uint16_t type = 0;  ///< CANopen data type: 5 UNSIGNED8, 6 UNSIGNED16, 7 UNSIGNED32, 4 INTEGER32, 9 string ...
  Bytes value{};
  bool readable = true;
  bool writable = false;
  bool any_size = false;  ///< strings: downloads may be shorter or longer
  std::string name{};
};

class ObjectDictionary {
 public:
  using Key = std::pair<std::uint16_t, std::uint8_t>;

  ObjectEntry& Add(std::uint16_t index, std::uint8_t subindex, ObjectEntry entry) {
    return entries_[{index, subindex}] = std::move(entry);
  }
  template <typename T>
  ObjectEntry& AddNumber(std::uint16_t index, std::uint8_t subindex, T value, bool writable, const std::string& name) {
    constexpr std::uint16_t kTypes[] = {0, 5, 6, 0, 7};
    constexpr std::uint16_t kSigned[] = {0, 2, 3, 0, 4};
    const std::uint16_t type = std::is_signed_v<T> ? kSigned[sizeof(T)] : kTypes[sizeof(T)];
    return Add(index, subindex, {.type = type, .value = LeBytes(value), .writable = writable, .name = name});
  }
  ObjectEntry& AddText(std::uint16_t index, const std::string& text, const std::string& name) {
    return Add(index, 0, {.type = 9, .value = Bytes(text.begin(), text.end()), .any_size = true, .name = name});
  }

  [[nodiscard]] ObjectEntry* Find(std::uint16_t index, std::uint8_t subindex) {
    const auto found = entries_.find({index, subindex});
    return found == entries_.end() ? nullptr : &found->second;
  }
  [[nodiscard]] const ObjectEntry* Find(std::uint16_t index, std::uint8_t subindex) const {
    const auto found = entries_.find({index, subindex});
    return found == entries_.end() ? nullptr : &found->second;
  }
  [[nodiscard]] bool Has(std::uint16_t index) const {
    const auto found = entries_.lower_bound({index, 0});
    return found != entries_.end() && found->first.first == index;
  }
  /// 0 for an object that does not exist.
  template <typename T>
  [[nodiscard]] T Number(std::uint16_t index, std::uint8_t subindex) const {
    const ObjectEntry* entry = Find(index, subindex);
    return entry == nullptr ? T{0} : LoadLe<T>(entry->value, 0);
  }
  /// Does nothing for an object that does not exist; keeps its size.
  template <typename T>
  void Set(std::uint16_t index, std::uint8_t subindex, T value) {
    if (ObjectEntry* entry = Find(index, subindex)) StoreLe(entry->value, 0, value);
  }
  [[nodiscard]] const std::map<Key, ObjectEntry>& entries() const { return entries_; }

 private:
  std::map<Key, ObjectEntry> entries_;
};

}  // namespace ecaudit::samples
