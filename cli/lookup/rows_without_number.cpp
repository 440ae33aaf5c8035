#include "cli/lookup/rows_without_number.h"

#include <string_view>
#include <utility>

#include "analyzers/objects/object_words.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::cli::lookup {
namespace {

using device::Basis;
using device::DeviceDescription;

std::string_view Name(device::PdoDirection direction) {
  return direction == device::PdoDirection::kRx ? "Rx" : "Tx";
}

std::string_view MessageName(bool request) {
  return request ? "request" : "response";
}

/// Nothing for what the manual prints.
std::string_view BasisText(Basis basis) {
  switch (basis) {
    case Basis::kPrinted:
      return "";
    case Basis::kStandard:
      return " (by the standard)";
    case Basis::kInferred:
      return " (inferred)";
  }
  return "";
}

class Rows {
 public:
  void Add(std::string title, std::string words, const std::string& note, const std::string& source) {
    if (!words.empty() && !source.empty()) rows_.push_back({std::move(title), std::move(words), note, source});
  }
  template <typename Row>
  void Of(std::string title, std::string words, const Row& row) {
    Add(std::move(title), std::move(words), row.note, row.source);
  }
  /// @param words  of its value
  /// @param unset  when the manual has no value, and the profile states why
  template <typename T, typename Words>
  void OfFact(std::string_view title, const device::Sourced<T>& fact, Words words, std::string_view unset = {}) {
    if (fact.value) {
      Of(std::string(title), words(*fact.value), fact);
    } else if (!fact.note.empty()) {
      Of(std::string(title), std::string(unset), fact);
    }
  }
  [[nodiscard]] std::vector<RowWithoutNumber> Take() { return std::move(rows_); }

 private:
  std::vector<RowWithoutNumber> rows_;
};

void AddStates(const DeviceDescription& family, Rows& rows) {
  for (const device::SpontaneousAlChange& row : family.al.spontaneous) {
    std::string codes;
    for (const std::uint16_t code : row.codes) codes += (codes.empty() ? "; codes " : ", ") + Hex(code);
    rows.Of(std::string(esc::StateName(row.from)) + " -> " + std::string(esc::StateName(row.to)),
            "by itself: " + row.cause + codes + std::string(BasisText(row.basis)), row);
  }
  if (!family.drive) return;
  for (const device::DriveTransition& row : family.drive->transitions) {
    std::string words;
    if (row.from) words += std::string(device::DriveStateName(*row.from)) + " -> ";
    words += device::DriveStateName(row.to);
    if (row.automatic) words += ", automatic";
    if (row.optional) words += ", not in every drive";
    rows.Of("transition " + std::to_string(row.number), words + std::string(BasisText(row.basis)), row);
  }
}

std::string SyncManagerText(const device::SyncManagerRule& row) {
  std::string words;
  for (const device::SyncManagerUseWord& word : device::kSyncManagerUses) {
    if (word.value == row.use) words += word.text;
  }
  if (row.use != device::SyncManagerUse::kUnused) {
    words += row.mailbox_mode ? ", one buffer" : ", three buffers";
    words += row.master_writes ? ", the master writes" : ", the master reads";
  }
  if (row.start) words += ", start " + Hex(*row.start);
  for (std::size_t i = 0; i < row.lengths.size(); ++i) {
    words += (i == 0 ? ", length " : " or ") + std::to_string(row.lengths[i]);
  }
  if (row.max_length) words += ", at most " + Count(*row.max_length, "byte");
  return words;
}

void AddMailbox(const device::MailboxDescription& mailbox, Rows& rows) {
  for (const device::SyncManagerRule& row : mailbox.sync_managers) {
    rows.Of("sync manager " + std::to_string(row.number), SyncManagerText(row), row);
  }
  for (const device::MailboxSize& row : mailbox.sizes) {
    rows.Of("mailbox size",
            row.direction + (row.start ? " at " + Hex(*row.start) : "") + " " + Count(row.bytes, "byte"), row);
  }
  for (const device::MailboxProtocol& row : mailbox.protocols) {
    rows.Of("mailbox type", std::to_string(row.type) + " " + row.name + (row.reserved ? " (reserved)" : ""), row);
  }
  for (const device::CoeService& row : mailbox.coe_services) {
    std::string words = std::to_string(row.first);
    if (row.first != row.last) words += "-" + std::to_string(row.last);
    words += " " + row.meaning;
    if (row.reserved && row.meaning != "reserved") words += " (reserved)";
    rows.Of("CoE service", std::move(words), row);
  }
  for (const device::SdoCommandByte& row : mailbox.sdo_commands) {
    std::string words = Hex(row.value, 2) + " of a " + std::string(MessageName(row.request)) + ", " + row.meaning;
    if (row.data_bytes) words += ", " + Count(*row.data_bytes, "byte") + " of data";
    rows.Of("SDO command", std::move(words), row);
  }
  for (const device::MailboxByte& row : mailbox.layout) {
    rows.Of("mailbox byte",
            std::to_string(row.byte) + " " + events::BitsName(row.first, row.last) + " of a " +
                std::string(MessageName(row.request)) + ", " + row.meaning,
            row);
  }
  for (const device::MailboxExampleByte& row : mailbox.example) {
    rows.Of("mailbox example",
            "byte " + std::to_string(row.byte) + " of the " + std::string(MessageName(row.request)) + " = " +
                Hex(row.value, 2) + ", " + row.meaning,
            row);
  }
  for (const device::MailboxFile& row : mailbox.files) {
    std::string states;
    for (const esc::AlState state : row.states) {
      states += (states.empty() ? "" : ", ") + std::string(esc::StateName(state));
    }
    rows.Of("FoE " + row.name, row.suffix + " in " + states, row);
  }
}

void AddMappingLimits(const device::FlexibleMapping& flexible, Rows& rows) {
  constexpr std::string_view kTitle = "free mapping";
  rows.OfFact(kTitle, flexible.max_pdos,
              [](std::uint32_t n) { return "at most " + Count(n, "PDO") + " in a direction"; });
  rows.OfFact(kTitle, flexible.max_bytes_per_pdo,
              [](std::uint32_t n) { return "at most " + Count(n, "byte") + " in a PDO"; });
  rows.OfFact(kTitle, flexible.max_entries_per_pdo,
              [](std::uint32_t n) { return "at most " + Count(n, "entry", "entries") + " in a PDO"; });
  rows.OfFact(kTitle, flexible.clear_unused, [](bool clear) {
    return std::string(clear ? "unused PDOs must be cleared" : "unused PDOs may keep contents");
  });
  rows.OfFact(kTitle, flexible.even_length, [](bool even) {
    return std::string(even ? "each PDO must have an even length" : "PDOs may have an odd length");
  });
  for (const auto* limits : {&flexible.max_rx_bytes, &flexible.max_tx_bytes}) {
    for (const device::ByteLimit& row : *limits) {
      std::string words =
          "at most " + Count(row.bytes, "byte") + (limits == &flexible.max_rx_bytes ? " of Rx PDOs" : " of Tx PDOs");
      if (!row.condition.empty()) words += ", " + row.condition;
      rows.Of(std::string(kTitle), words + std::string(BasisText(row.basis)), row);
    }
  }
  for (const device::Padding& row : flexible.paddings) {
    std::string words = "padding " + ObjectName(row.index, row.first_subindex);
    if (row.last_subindex != row.first_subindex) words += "-" + std::to_string(row.last_subindex);
    words += row.bits == 0 ? ", any size" : ", " + Count(row.bits, "bit");
    rows.Of(std::string(kTitle), words + " (" + std::string(Name(row.direction)) + ")", row);
  }
}

void AddPdoRows(const device::PdoDescription& pdo, Rows& rows) {
  rows.Add("PDO assignment", ObjectName(pdo.rx_assign) + " for Rx PDOs, " + ObjectName(pdo.tx_assign) + " for Tx PDOs",
           pdo.note, pdo.source);
  for (const device::SelectablePdo& row : pdo.selectable) {
    rows.Of("PDO assignment",
            std::string(Name(row.direction)) + " PDO " + ObjectName(row.index) +
                (row.example_only ? " appears in an example only" : " may be assigned"),
            row);
  }
  for (const device::MappingRule& row : pdo.rules)
    rows.Of(row.rule, row.value.empty() ? "a rule of PDOs" : row.value, row);
  if (pdo.flexible) AddMappingLimits(*pdo.flexible, rows);
}

void AddSync(const device::SyncDescription& sync, Rows& rows) {
  constexpr std::string_view kCycle = "cycle time";
  constexpr std::string_view kLost = "loss of synchronisation";
  const auto ns = [](TimeNs value) { return std::to_string(value) + " ns"; };
  rows.OfFact(kCycle, sync.cycle_base, [&](TimeNs value) { return "a multiple of " + ns(value); });
  rows.OfFact(kCycle, sync.cycle_min, [&](TimeNs value) { return "at least " + ns(value); });
  rows.OfFact(kCycle, sync.cycle_by_60c2, [](bool by_object) {
    return std::string(by_object ? "set by 60C2h" : "set by the SYNC0 cycle register");
  });
  rows.OfFact("PLL", sync.pll_range_ppm,
              [](std::uint32_t ppm) { return "follows up to " + std::to_string(ppm) + " ppm"; });
  rows.OfFact("PLL", sync.pll_step, [&](TimeNs value) { return "corrects " + ns(value) + " in each period"; });
  rows.OfFact(
      kLost, sync.lost_after_jitter,
      [](std::uint32_t n) { return "after " + Count(n, "consecutive cycle") + " outside the permitted jitter"; },
      "no number of cycles outside the jitter in the manual");
  rows.OfFact(
      kLost, sync.lost_after_missing, [](std::uint32_t n) { return "after more than " + Count(n, "missing frame"); },
      "no number of missing frames in the manual");
  for (const device::JitterLimit& row : sync.jitter) {
    std::string words = ns(row.jitter);
    if (row.cycle_min) words += ", cycles from " + ns(*row.cycle_min);
    if (row.cycle_max) words += ", cycles up to " + ns(*row.cycle_max);
    rows.Of("permitted jitter", words + (row.undocumented ? " (no figure in the manual)" : ""), row);
  }
  if (!sync.source_with_dc.empty()) {
    rows.Add("synchronisation source", sync.source_with_dc + " with distributed clocks", sync.note, sync.source);
  }
  if (!sync.source_without_dc.empty()) {
    rows.Add("synchronisation source", sync.source_without_dc + " without distributed clocks", sync.note, sync.source);
  }
}

}  // namespace

std::vector<RowWithoutNumber> RowsWithoutNumber(const DeviceDescription& family) {
  Rows rows;
  AddStates(family, rows);
  AddMailbox(family.mailbox, rows);
  AddPdoRows(family.pdo, rows);
  AddSync(family.sync, rows);
  return rows.Take();
}

}  // namespace ecaudit::cli::lookup
