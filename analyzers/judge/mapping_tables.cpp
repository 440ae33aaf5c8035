#include "analyzers/judge/mapping_tables.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit {
namespace mapping_tables {
namespace {

using device::PdoDirection;
using Answer = MappingRow::Answer;
using Entry = MappingHistory::Entry;
using List = MappingHistory::List;

std::string PdoText(std::uint32_t pdo) {
  return ObjectName(static_cast<std::uint16_t>(pdo));
}

std::string EntryText(std::uint32_t value) {
  const auto entry = process::MappingEntry::FromValue(value);
  if (entry.index == 0) return "gap, " + std::to_string(entry.bits) + " bit";
  return ObjectName(entry.index, entry.subindex) + ", " + std::to_string(entry.bits) + " bit";
}

std::string PlaceText(std::uint32_t bit) {
  std::string text = "byte " + std::to_string(bit / 8);
  if (bit % 8 != 0) text += ", bit " + std::to_string(bit % 8);
  return text;
}

std::string AbortText(std::uint32_t code) {
  return "aborted (" + Hex(code, 8) + ")";
}

const Entry* Find(const List& list, std::uint8_t subindex) {
  const auto at = list.find(subindex);
  return at == list.end() ? nullptr : &at->second;
}

/// A place in the process data that is known up to some entry.
class Cursor {
 public:
  [[nodiscard]] const std::optional<std::uint32_t>& at() const { return at_; }
  void Advance(std::uint32_t bits) {
    if (at_) *at_ += bits;
  }
  void Lose() { at_.reset(); }

 private:
  std::optional<std::uint32_t> at_ = 0;
};

/// Fills the table of one direction.
class TableMaker {
 public:
  TableMaker(const model::SlaveModel& slave, const MappingHistory::Configuration& configuration, PdoDirection direction,
             const std::optional<MappingHistory::Manager>& manager)
      : configuration_(configuration), layout_(slave.process.Layout(direction)) {
    table_.outputs = direction == PdoDirection::kRx;
    table_.sync_manager = table_.outputs ? 2 : 3;
    if (manager) {
      table_.manager_bytes = manager->bytes;
      table_.manager_frame = manager->since;
    }
  }

  /// @return nothing where all went right
  std::optional<MappingTable> Make() {
    const std::uint16_t assignment = table_.outputs ? process::kRxAssignment : process::kTxAssignment;
    const auto list = configuration_.lists.find(assignment);
    if (list != configuration_.lists.end()) {
      Assigned(assignment, list->second);
    } else {
      table_.of_each_pdo = true;
      for (const auto& [index, entries] : configuration_.lists) {
        const bool own = table_.outputs ? process::IsRxMapping(index) : process::IsTxMapping(index);
        if (!own || !WentWrong(index, entries)) continue;
        wanted_ = slave_cursor_ = {};
        Pdo(index, true, true);
      }
    }
    if (!table_.of_each_pdo) {
      table_.wanted_bits = wanted_.at();
      table_.slave_bits = slave_cursor_.at();
    }
    MarkShifted();
    if (!IsWrong()) return std::nullopt;
    if (table_.rows.size() > MappingTable::kMaxRows) {
      table_.rows_left_out = table_.rows.size() - MappingTable::kMaxRows;
      table_.rows.resize(MappingTable::kMaxRows);
    }
    return std::move(table_);
  }

 private:
  /// Entries that the master wants: the number that it wrote, and beyond it what the slave aborted before.
  static unsigned WantedCount(const List& list) {
    const Entry* count = Find(list, 0);
    unsigned wanted = list.empty() ? 0U : list.rbegin()->first;
    if (count == nullptr) return wanted;
    const std::uint32_t number = count->written ? count->value : count->read.value_or(wanted);
    wanted = std::min<std::uint32_t>(number, 0xFF);
    for (const auto& [subindex, entry] : list) {
      if (entry.aborted()) wanted = std::max<unsigned>(wanted, subindex);
    }
    return wanted;
  }
  /// Entries that the slave takes for valid; nothing: not known.
  static std::optional<unsigned> SlaveCount(const List& list) {
    const Entry* count = Find(list, 0);
    if (count == nullptr) return list.empty() ? 0U : list.rbegin()->first;
    if (count->read) return *count->read;
    if (count->accepted()) return count->value;
    return std::nullopt;
  }

  bool WentWrong(std::uint16_t pdo, const List& list) const {
    return std::ranges::any_of(list, [&](const auto& item) {
      const auto& [subindex, entry] = item;
      return (entry.written && !entry.accepted()) ||
             (subindex > 0 && entry.accepted() && BitsInSlave(pdo, entry.value).doubtful);
    });
  }

  MappingRow& Row(std::uint16_t list, std::uint8_t subindex, const Entry* entry) {
    MappingRow& row = table_.rows.emplace_back();
    row.list = list;
    row.subindex = subindex;
    if (entry == nullptr || !entry->written) {
      row.answer = Answer::kOnlyRead;
    } else {
      row.frame = entry->frame;
      row.answer = entry->aborted() ? Answer::kAborted : entry->accepted() ? Answer::kAccepted : Answer::kOther;
      row.slave = entry->aborted() ? AbortText(entry->abort_code) : "accepted";
    }
    return row;
  }

  /// Subindex 0, where the slave did not take it as it was written, or another number of entries is shown.
  void Count(std::uint16_t index, const List& list) {
    const Entry* count = Find(list, 0);
    if (count == nullptr || !count->written || count->accepted()) return;
    MappingRow& row = Row(index, 0, count);
    row.wanted = ecaudit::Count(count->value, "entry");
    if (count->read) row.slave = (count->aborted() ? row.slave + ", " : "") + "has " + std::to_string(*count->read);
  }

  void Assigned(std::uint16_t assignment, const List& list) {
    const unsigned wanted = WantedCount(list);
    const std::optional<unsigned> in_slave = SlaveCount(list);
    if (!in_slave) slave_cursor_.Lose();
    for (unsigned subindex = 1; subindex <= wanted; ++subindex) {
      const Entry* entry = Find(list, static_cast<std::uint8_t>(subindex));
      if (entry == nullptr) {
        wanted_.Lose();
        slave_cursor_.Lose();
        continue;
      }
      MappingRow& row = Row(assignment, static_cast<std::uint8_t>(subindex), entry);
      const bool valid = !in_slave || subindex <= *in_slave;
      if (entry->written) {
        row.wanted = PdoText(entry->value);
      } else {
        row.slave = "has " + PdoText(entry->read.value_or(0));
      }
      if (entry->written && entry->read && !entry->accepted()) row.slave = Joined(row, "has " + PdoText(*entry->read));
      if (entry->accepted() && !valid) row.slave = kNotCounted;
      if (entry->aborted() && !entry->read && valid) row.doubtful = maybe_older_ = true;
      // The slave has another PDO there.
      const bool other = entry->written && entry->read && *entry->read != entry->value;
      if (other && valid) slave_cursor_.Lose();
      const std::uint32_t pdo = entry->written ? entry->value : entry->read.value_or(0);
      Pdo(static_cast<std::uint16_t>(pdo), true, valid && !other && !entry->aborted());
    }
    Count(assignment, list);
  }

  static std::string Joined(const MappingRow& row, const std::string& text) {
    return row.answer == Answer::kAborted ? row.slave + ", " + text : text;
  }

  /// @param wanted, in_slave  whether the PDO is assigned
  void Pdo(std::uint16_t pdo, bool wanted, bool in_slave) {
    const auto list = configuration_.lists.find(pdo);
    if (list == configuration_.lists.end()) return Described(pdo, wanted, in_slave);
    const unsigned count = WantedCount(list->second);
    const std::optional<unsigned> valid = SlaveCount(list->second);
    if (!valid && in_slave) slave_cursor_.Lose();
    for (unsigned subindex = 1; subindex <= count; ++subindex) {
      const Entry* entry = Find(list->second, static_cast<std::uint8_t>(subindex));
      if (entry == nullptr) {
        if (wanted) wanted_.Lose();
        if (in_slave) slave_cursor_.Lose();
        continue;
      }
      One(pdo, static_cast<std::uint8_t>(subindex), *entry, wanted, in_slave, !valid || subindex <= *valid);
    }
    Count(pdo, list->second);
  }

  /// A PDO that the master neither wrote nor read: what the description of the slave has.
  void Described(std::uint16_t pdo, bool wanted, bool in_slave) {
    std::uint32_t bits = 0;
    bool known = false;
    for (const model::Signal& signal : layout_.signals) {
      if (signal.pdo != pdo) continue;
      known = true;
      bits += signal.bits;
    }
    if (!known) {
      if (wanted) wanted_.Lose();
      if (in_slave) slave_cursor_.Lose();
      return;
    }
    MappingRow& row = Row(pdo, 0, nullptr);
    row.slave = std::to_string(bits) + " bit by its description";
    Place(row, bits, wanted, bits, in_slave);
  }

  void One(std::uint16_t pdo, std::uint8_t subindex, const Entry& entry, bool wanted, bool in_slave, bool valid) {
    MappingRow& row = Row(pdo, subindex, &entry);
    if (entry.written) row.wanted = EntryText(entry.value);
    const std::uint32_t value = entry.written ? entry.value : entry.read.value_or(0);
    const std::uint32_t wanted_bits = value & 0xFFU;
    Bits bits{wanted_bits, false};
    if (entry.read && *entry.read != value) {
      bits.number = *entry.read & 0xFFU;
      row.slave = Joined(row, "has " + EntryText(*entry.read));
    } else if (entry.aborted()) {
      // Whether the slave still has an older entry there is not known.
      const bool older = in_slave && valid;
      in_slave = false;
      row.doubtful = older;
      maybe_older_ = maybe_older_ || older;
    } else if (!valid) {
      row.slave = kNotCounted;
    } else if (in_slave || table_.of_each_pdo) {
      bits = BitsInSlave(pdo, value);
      if (bits.doubtful) {
        row.slave = std::string(entry.written ? "accepted" : "has it") + ", but its type has " +
                    std::to_string(bits.number) + " bit";
      }
    }
    if (row.slave.empty()) row.slave = "has " + EntryText(value);
    Place(row, wanted_bits, wanted, bits.number, in_slave && valid);
    by_type_ = by_type_ || (bits.doubtful && in_slave && valid);
  }

  void Place(MappingRow& row, std::uint32_t wanted_bits, bool wanted, std::uint32_t slave_bits, bool in_slave) {
    if (wanted) {
      row.wanted_bit = wanted_.at();
      wanted_.Advance(wanted_bits);
    }
    if (in_slave) {
      row.slave_bit = slave_cursor_.at();
      row.doubtful = by_type_ || maybe_older_;
      slave_cursor_.Advance(slave_bits);
    }
  }

  struct Bits {
    std::uint32_t number = 0;
    bool doubtful = false;  ///< the type of the object has other than those that the slave accepted
  };
  [[nodiscard]] Bits BitsInSlave(std::uint16_t pdo, std::uint32_t value) const {
    const auto entry = process::MappingEntry::FromValue(value);
    Bits bits{entry.bits, false};
    if (entry.index == 0) return bits;
    for (const model::Signal& signal : layout_.signals) {
      if (signal.pdo != pdo || signal.index != entry.index || signal.subindex != entry.subindex) continue;
      const std::uint16_t of_type = device::BitsOf(device::DataTypeFromCode(static_cast<std::uint16_t>(signal.type)));
      if (of_type == 0 || of_type == entry.bits || (of_type == 1 && entry.bits == 8)) break;
      bits.number = of_type;
      bits.doubtful = true;
      return bits;
    }
    return bits;
  }

  /// The master keeps to what it wanted: its sync manager is as long as that, or as long as both are.
  void MarkShifted() {
    const auto bytes = [](std::uint32_t bits) { return (bits + 7) / 8; };
    const bool by_wish =
        table_.manager_bytes && table_.wanted_bits && *table_.manager_bytes == bytes(*table_.wanted_bits);
    if (!by_wish) return;
    table_.as_wanted = true;
    for (MappingRow& row : table_.rows) {
      row.shifted = row.wanted_bit && row.slave_bit && *row.wanted_bit != *row.slave_bit && !row.doubtful;
    }
  }

  [[nodiscard]] bool IsWrong() const {
    return std::ranges::any_of(table_.rows, [](const MappingRow& row) {
      return row.answer == Answer::kAborted || row.answer == Answer::kOther || row.shifted || row.doubtful ||
             row.slave == kNotCounted;
    });
  }

  static constexpr std::string_view kNotCounted = "accepted, but not counted by subindex 0";

  const MappingHistory::Configuration& configuration_;
  const model::ProcessLayout& layout_;
  MappingTable table_;
  Cursor wanted_;
  Cursor slave_cursor_;
  bool by_type_ = false;      ///< an entry before this one has another length than its type
  bool maybe_older_ = false;  ///< the slave aborted one before it, and may keep an older one there
};

/// Rules whose findings are about a mapping wherever they name one of its objects.
constexpr std::array<std::string_view, 11> kMappingRules{
    "sdo-abort",       "sdo-wrong-size",      "pdo-assign-order", "pdo-assign-state",
    "pdo-unsupported", "pdo-mapping-rule",    "pdo-not-mappable", "pdo-object-mapped-twice",
    "pdo-object-type", "pdo-length-mismatch", "sm-process-config"};
/// Invalid sync manager, outputs or inputs. Source: ETG.1000.6, AL status codes.
constexpr std::size_t kMostTables = 64;
constexpr std::array<std::int64_t, 5> kCodes{0x0017, 0x001D, 0x001E, 0x0024, 0x0025};

/// Which directions a finding is about.
struct Directions {
  bool outputs = false, inputs = false;

  void Add(PdoDirection direction) { (direction == PdoDirection::kRx ? outputs : inputs) = true; }
};

Directions DirectionsOf(const Finding& finding) {
  Directions directions;
  if (finding.rule == "al-refused") {
    const Value* code = finding.arguments.Find("al_status_code");
    const bool about = code != nullptr && std::ranges::find(kCodes, code->number) != kCodes.end();
    return about ? Directions{true, true} : directions;
  }
  if (std::ranges::find(kMappingRules, finding.rule) == kMappingRules.end()) return directions;
  for (const Argument& argument : finding.arguments) {
    const Value& value = argument.value;
    if (value.type == Value::Type::kObject) {
      const auto index = static_cast<std::uint16_t>(value.number >> 9U);
      if (process::IsTxMapping(index) || index == process::kTxAssignment) directions.Add(PdoDirection::kTx);
      if (process::IsRxMapping(index) || index == process::kRxAssignment) directions.Add(PdoDirection::kRx);
    } else if (argument.name == "direction" && value.word != nullptr) {
      if (value.word->code == "outputs" || value.word->code == "Rx") directions.Add(PdoDirection::kRx);
      if (value.word->code == "inputs" || value.word->code == "Tx") directions.Add(PdoDirection::kTx);
    } else if (argument.name == "sync_manager") {
      if (value.number == 2) directions.Add(PdoDirection::kRx);
      if (value.number == 3) directions.Add(PdoDirection::kTx);
    } else if (argument.name == "by_sdo" && finding.rule == "pdo-object-type") {
      directions.Add(PdoDirection::kTx);
    }
  }
  return directions;
}

/// The first entry that is elsewhere, and the one that moves it. A type that may move it is in the words of the rules.
void AddShift(Finding& finding, const MappingTable& table) {
  const bool aborted = std::ranges::any_of(
      table.rows, [](const MappingRow& row) { return row.answer == Answer::kAborted && row.doubtful; });
  const auto first = std::ranges::find_if(table.rows, [&](const MappingRow& row) {
    const bool maybe = table.as_wanted && aborted && row.doubtful && row.wanted_bit && row.slave_bit;
    return row.shifted || (maybe && *row.wanted_bit != *row.slave_bit);
  });
  if (first == table.rows.end()) return;
  const auto wrong = std::find_if(std::make_reverse_iterator(first), table.rows.rend(), [](const MappingRow& row) {
    return row.answer != Answer::kAccepted && row.answer != Answer::kOnlyRead;
  });
  Arguments arguments{{"shifted", arg::Text(first->wanted.empty() ? PdoText(first->list) : first->wanted)},
                      {"slave_place", arg::Text(PlaceText(*first->slave_bit))},
                      {"wanted_place", arg::Text(PlaceText(*first->wanted_bit))},
                      {"outputs", arg::Flag(table.outputs)}};
  if (wrong != table.rows.rend()) arguments.Set("entry", arg::Object(wrong->list, wrong->subindex));
  finding.Add(first->shifted ? kMappingShifted : kMappingMayBeShifted, std::move(arguments));
}

void AddAll(const RuleContext& context, const MappingHistory& history, FindingStore& store) {
  using Key = std::tuple<SlaveId, FrameNo, PdoDirection>;
  std::set<Key> made;
  const auto add = [&](Finding& finding) {
    const Directions directions = DirectionsOf(finding);
    if (!directions.outputs && !directions.inputs) return;
    const MappingHistory::Configuration* const configuration = history.Of(finding.slave, finding.first.number);
    if (configuration == nullptr) return;
    for (const PdoDirection direction : {PdoDirection::kRx, PdoDirection::kTx}) {
      if (direction == PdoDirection::kRx ? !directions.outputs : !directions.inputs) continue;
      const Key key{finding.slave, configuration->first, direction};
      if (made.size() >= kMostTables || made.contains(key)) continue;
      std::optional<MappingTable> table = TableMaker(context.slave(finding.slave), *configuration, direction,
                                                     history.ManagerOf(finding.slave, *configuration, direction))
                                              .Make();
      if (!table) continue;
      made.insert(key);
      AddShift(finding, *table);
      finding.mapping.push_back(std::make_shared<const MappingTable>(*std::move(table)));
    }
  };
  for (const bool causes : {true, false}) {
    for (Finding& finding : store.findings()) {
      if (finding.slave != kNoSlave && (finding.caused_by == kNoFinding) == causes) add(finding);
    }
  }
}

}  // namespace
}  // namespace mapping_tables

void AddMappingTables(const RuleContext& context, const MappingHistory& history, FindingStore& store) {
  mapping_tables::AddAll(context, history, store);
}

}  // namespace ecaudit
