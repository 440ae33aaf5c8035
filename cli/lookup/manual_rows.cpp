#include "cli/lookup/manual_rows.h"

#include <optional>
#include <string_view>
#include <utility>

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

std::string BitsText(unsigned first, unsigned last) {
  return first == last ? " bit " + std::to_string(first)
                       : " bits " + std::to_string(first) + "-" + std::to_string(last);
}

class Rows {
 public:
  void Add(std::string text, const std::string& note, const std::string& source) {
    if (!text.empty() && !source.empty()) rows_.push_back({std::move(text), note, source});
  }
  template <typename Row>
  void Of(std::string text, const Row& row) {
    Add(std::move(text), row.note, row.source);
  }
  /// @param text  of its value
  /// @param unset  when the manual has no value, and the profile states why
  template <typename T, typename Text>
  void OfFact(const device::Sourced<T>& fact, Text text, std::string_view unset = {}) {
    if (fact.value) {
      Of(text(*fact.value), fact);
    } else if (!fact.note.empty()) {
      Of(std::string(unset), fact);
    }
  }
  [[nodiscard]] std::vector<ManualRow> Take() { return std::move(rows_); }

 private:
  std::vector<ManualRow> rows_;
};

void AddStates(const DeviceDescription& family, Rows& rows) {
  for (const device::SpontaneousAlChange& row : family.al.spontaneous) {
    std::string codes;
    for (const std::uint16_t code : row.codes) codes += (codes.empty() ? "; codes " : ", ") + Hex(code);
    rows.Of(std::string(esc::StateName(row.from)) + " -> " + std::string(esc::StateName(row.to)) +
                " by itself: " + row.cause + codes + std::string(BasisText(row.basis)),
            row);
  }
  if (!family.drive) return;
  for (const device::DriveTransition& row : family.drive->transitions) {
    std::string text = "transition " + std::to_string(row.number) + ": ";
    if (row.from) text += std::string(device::DriveStateName(*row.from)) + " -> ";
    text += device::DriveStateName(row.to);
    if (row.automatic) text += ", automatic";
    if (row.optional) text += ", not in every drive";
    rows.Of(text + std::string(BasisText(row.basis)), row);
  }
}

void AddMailbox(const device::MailboxDescription& mailbox, Rows& rows) {
  for (const device::SyncManagerRule& row : mailbox.sync_managers) {
    std::string text = "sync manager " + std::to_string(row.number) + ": ";
    for (const device::SyncManagerUseWord& word : device::kSyncManagerUses) {
      if (word.value == row.use) text += word.text;
    }
    if (row.use != device::SyncManagerUse::kUnused) {
      text += row.mailbox_mode ? ", one buffer" : ", three buffers";
      text += row.master_writes ? ", the master writes" : ", the master reads";
    }
    if (row.start) text += ", start " + Hex(*row.start);
    for (std::size_t i = 0; i < row.lengths.size(); ++i) {
      text += (i == 0 ? ", length " : " or ") + std::to_string(row.lengths[i]);
    }
    if (row.max_length) text += ", at most " + Count(*row.max_length, "byte");
    rows.Of(std::move(text), row);
  }
  for (const device::MailboxSize& row : mailbox.sizes) {
    std::string text = "mailbox " + row.direction;
    if (row.start) text += " at " + Hex(*row.start);
    rows.Of(text + ": " + Count(row.bytes, "byte"), row);
  }
  for (const device::MailboxProtocol& row : mailbox.protocols) {
    rows.Of("mailbox type " + std::to_string(row.type) + ": " + row.name + (row.reserved ? " (reserved)" : ""), row);
  }
  for (const device::CoeService& row : mailbox.coe_services) {
    std::string text = row.first == row.last ? "CoE service " : "CoE services ";
    text += std::to_string(row.first);
    if (row.first != row.last) text += "-" + std::to_string(row.last);
    text += ": " + row.meaning;
    if (row.reserved && row.meaning != "reserved") text += " (reserved)";
    rows.Of(std::move(text), row);
  }
  for (const device::SdoCommandByte& row : mailbox.sdo_commands) {
    std::string text =
        "SDO command byte " + Hex(row.value, 2) + " of a " + std::string(MessageName(row.request)) + ": " + row.meaning;
    if (row.data_bytes) text += ", " + Count(*row.data_bytes, "byte") + " of data";
    rows.Of(std::move(text), row);
  }
  for (const device::MailboxByte& row : mailbox.layout) {
    rows.Of("mailbox byte " + std::to_string(row.byte) + BitsText(row.first, row.last) + " of a " +
                std::string(MessageName(row.request)) + ": " + row.meaning,
            row);
  }
  for (const device::MailboxExampleByte& row : mailbox.example) {
    rows.Of("mailbox example, byte " + std::to_string(row.byte) + " of the " + std::string(MessageName(row.request)) +
                " = " + Hex(row.value, 2) + ": " + row.meaning,
            row);
  }
  for (const device::MailboxFile& row : mailbox.files) {
    std::string states;
    for (const esc::AlState state : row.states) {
      states += (states.empty() ? "" : ", ") + std::string(esc::StateName(state));
    }
    rows.Of("FoE " + row.name + " (" + row.suffix + "): in " + states, row);
  }
}

void AddMappingLimits(const device::FlexibleMapping& flexible, Rows& rows) {
  rows.OfFact(flexible.max_pdos,
              [](std::uint32_t n) { return "free mapping: at most " + Count(n, "PDO") + " in a direction"; });
  rows.OfFact(flexible.max_bytes_per_pdo,
              [](std::uint32_t n) { return "free mapping: at most " + Count(n, "byte") + " in a PDO"; });
  rows.OfFact(flexible.max_entries_per_pdo,
              [](std::uint32_t n) { return "free mapping: at most " + Count(n, "entry", "entries") + " in a PDO"; });
  rows.OfFact(flexible.clear_unused, [](bool clear) {
    return std::string(clear ? "free mapping: unused PDOs must be cleared"
                             : "free mapping: unused PDOs may keep contents");
  });
  rows.OfFact(flexible.even_length, [](bool even) {
    return std::string(even ? "free mapping: each PDO must have an even length"
                            : "free mapping: PDOs may have an odd length");
  });
  for (const auto* limits : {&flexible.max_rx_bytes, &flexible.max_tx_bytes}) {
    for (const device::ByteLimit& row : *limits) {
      std::string text = "free mapping: at most " + Count(row.bytes, "byte") +
                         (limits == &flexible.max_rx_bytes ? " of Rx PDOs" : " of Tx PDOs");
      if (!row.condition.empty()) text += ", " + row.condition;
      rows.Of(text + std::string(BasisText(row.basis)), row);
    }
  }
  for (const device::Padding& row : flexible.paddings) {
    std::string text = "free mapping: padding " + ObjectName(row.index, row.first_subindex);
    if (row.last_subindex != row.first_subindex) text += "-" + std::to_string(row.last_subindex);
    text += row.bits == 0 ? ", any size" : ", " + Count(row.bits, "bit");
    rows.Of(text + " (" + std::string(Name(row.direction)) + ")", row);
  }
}

void AddPdoRows(const device::PdoDescription& pdo, Rows& rows) {
  rows.Add(
      "PDO assignment: " + ObjectName(pdo.rx_assign) + " for Rx PDOs, " + ObjectName(pdo.tx_assign) + " for Tx PDOs",
      pdo.note, pdo.source);
  for (const device::SelectablePdo& row : pdo.selectable) {
    rows.Of(std::string(Name(row.direction)) + " PDO " + ObjectName(row.index) +
                (row.example_only ? " appears in an example only" : " may be assigned"),
            row);
  }
  for (const device::MappingRule& row : pdo.rules) {
    rows.Of("PDO rule, " + row.rule + (row.value.empty() ? "" : ": " + row.value), row);
  }
  if (pdo.flexible) AddMappingLimits(*pdo.flexible, rows);
}

void AddSync(const device::SyncDescription& sync, Rows& rows) {
  const auto ns = [](TimeNs value) { return std::to_string(value) + " ns"; };
  rows.OfFact(sync.cycle_base, [&](TimeNs value) { return "cycle time: a multiple of " + ns(value); });
  rows.OfFact(sync.cycle_min, [&](TimeNs value) { return "cycle time: at least " + ns(value); });
  rows.OfFact(sync.cycle_by_60c2, [](bool by_object) {
    return std::string(by_object ? "cycle time: set by 60C2h" : "cycle time: set by the SYNC0 cycle register");
  });
  rows.OfFact(sync.pll_range_ppm,
              [](std::uint32_t ppm) { return "PLL: follows up to " + std::to_string(ppm) + " ppm"; });
  rows.OfFact(sync.pll_step, [&](TimeNs value) { return "PLL: corrects " + ns(value) + " in each period"; });
  rows.OfFact(
      sync.lost_after_jitter,
      [](std::uint32_t n) {
        return "synchronisation is lost after " + Count(n, "consecutive cycle") + " outside the permitted jitter";
      },
      "synchronisation is lost: no number of cycles outside the jitter in the manual");
  rows.OfFact(
      sync.lost_after_missing,
      [](std::uint32_t n) { return "synchronisation is lost after more than " + Count(n, "missing frame"); },
      "synchronisation is lost: no number of missing frames in the manual");
  for (const device::JitterLimit& row : sync.jitter) {
    std::string text = "permitted jitter: " + ns(row.jitter);
    if (row.cycle_min) text += ", cycles from " + ns(*row.cycle_min);
    if (row.cycle_max) text += ", cycles up to " + ns(*row.cycle_max);
    rows.Of(text + (row.undocumented ? " (no figure in the manual)" : ""), row);
  }
  if (!sync.source_with_dc.empty()) {
    rows.Add("synchronisation source with distributed clocks: " + sync.source_with_dc, sync.note, sync.source);
  }
  if (!sync.source_without_dc.empty()) {
    rows.Add("synchronisation source without distributed clocks: " + sync.source_without_dc, sync.note, sync.source);
  }
}

}  // namespace

std::vector<ManualRow> ManualRows(const DeviceDescription& family) {
  Rows rows;
  AddStates(family, rows);
  AddMailbox(family.mailbox, rows);
  AddPdoRows(family.pdo, rows);
  AddSync(family.sync, rows);
  return rows.Take();
}

}  // namespace ecaudit::cli::lookup
