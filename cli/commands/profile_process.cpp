#include "cli/commands/profile_process.h"

#include <string>
#include <string_view>

#include "cli/commands/profile_rows.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::cli {
namespace {

using profile_page::Heading;
using profile_page::Row;
using report::OneLine;
using report::TextBuilder;

/// A row for a sourced number, nothing when the profile does not have it.
template <typename T, typename Format>
void SourcedRow(std::string_view name, const device::Sourced<T>& fact, Format format, TextBuilder& text) {
  if (fact.value) Row(name, format(*fact.value), fact.note, fact.source, text);
}

std::string_view Name(device::PdoDirection direction) {
  return direction == device::PdoDirection::kRx ? "Rx" : "Tx";
}

void AppendMailbox(const device::MailboxDescription& mailbox, TextBuilder& text) {
  if (mailbox.sync_managers.empty() && mailbox.protocols.empty()) return;
  Heading("Mailbox and sync managers", "", text);
  for (const device::SyncManagerRule& rule : mailbox.sync_managers) {
    std::string about(Name(rule.use));
    if (rule.start) about += ", start " + Hex(*rule.start);
    for (std::size_t i = 0; i < rule.lengths.size(); ++i) {
      about += (i == 0 ? ", length " : " or ") + std::to_string(rule.lengths[i]);
    }
    if (rule.max_length) about += ", at most " + Count(*rule.max_length, "byte");
    Row("SM" + std::to_string(rule.number), about, rule.note, rule.source, text);
  }
  std::string supported;
  std::string reserved;
  for (const device::MailboxProtocol& protocol : mailbox.protocols) {
    std::string& list = protocol.reserved ? reserved : supported;
    list += (list.empty() ? "" : ", ") + OneLine(protocol.name);
  }
  if (!supported.empty()) Row("protocols", supported, "", "", text);
  if (!reserved.empty()) Row("reserved", reserved, "", "", text);
}

void AppendPdos(const device::PdoDescription& pdo, TextBuilder& text) {
  if (pdo.selectable.empty() && pdo.fixed.empty() && pdo.rules.empty()) return;
  Heading("Process data", pdo.selectable_complete ? "the manual lists all PDOs" : "the manual does not list all PDOs",
          text);
  for (const device::PdoContent& content : pdo.fixed) {
    std::string about;
    for (const device::PdoEntry& entry : content.entries) {
      const std::string object = entry.index == 0 ? "padding" : ObjectName(entry.index, entry.subindex);
      about +=
          (about.empty() ? "" : ", ") + object + " " + OneLine(entry.name) + " (" + std::to_string(entry.bits) + ")";
    }
    if (!content.known) about = "content not documented";
    Row(ObjectName(content.index) + " " + std::string(Name(content.direction)), about, content.note, content.source,
        text);
  }
  std::string free_pdos;
  for (const device::SelectablePdo& choice : pdo.selectable) {
    if (pdo.FindFixed(choice.index) != nullptr) continue;
    free_pdos += (free_pdos.empty() ? "" : ", ") + ObjectName(choice.index) + " " + std::string(Name(choice.direction));
    if (choice.example_only) free_pdos += " (in an example only)";
  }
  if (!free_pdos.empty()) Row("selectable", free_pdos, "", "", text);
  for (const device::MappingRule& rule : pdo.rules) {
    Row("rule", OneLine(rule.rule) + (rule.value.empty() ? "" : ": " + OneLine(rule.value)), rule.note, rule.source,
        text);
  }
}

void AppendDrive(const device::DriveProfile& drive, TextBuilder& text) {
  Heading("Drive profile", drive.modes_complete ? "the manual lists all modes of operation" : "", text);
  for (const device::OperationMode& mode : drive.modes) {
    Row("mode " + std::to_string(mode.value), OneLine(mode.name), mode.note, mode.source, text);
  }
  for (const device::FaultObject& object : drive.fault_objects) {
    std::string where = ObjectName(object.index, object.subindex);
    if (object.last_subindex != object.subindex) where += " to " + std::to_string(object.last_subindex);
    std::string about = where + ", " + std::string(device::FaultValueName(object.kind));
    if (!object.prefix.empty()) about += " (" + OneLine(object.prefix) + "...)";
    if (object.basis == device::Basis::kInferred) about += ", inferred";
    Row("reason of a fault", about, object.note, object.source, text);
  }
  std::string states;
  for (const esc::AlState state : drive.control_word_in) {
    states += (states.empty() ? "" : ", ") + std::string(esc::StateName(state));
  }
  if (!states.empty()) Row("control word acts in", states, "", "", text);
  Row("state machine",
      Count(drive.states.size(), "state") + ", " + Count(drive.transitions.size(), "transition") + ", " +
          Count(drive.commands.size(), "command"),
      drive.note, drive.source, text);
}

void AppendSync(const device::SyncDescription& sync, TextBuilder& text) {
  const auto time = [](TimeNs ns) { return Duration(ns); };
  const auto number = [](std::uint32_t n) { return std::to_string(n); };
  if (!sync.cycle_base.value && !sync.cycle_min.value && sync.jitter.empty()) return;
  Heading("Synchronisation", "", text);
  SourcedRow("cycle a multiple of", sync.cycle_base, time, text);
  SourcedRow("shortest cycle", sync.cycle_min, time, text);
  SourcedRow(
      "cycle deviation", sync.pll_range_ppm,
      [](std::uint32_t ppm) { return "at most " + std::to_string(ppm) + " ppm"; }, text);
  for (const device::JitterLimit& limit : sync.jitter) {
    std::string about = Duration(limit.jitter);
    if (limit.cycle_min) about += " for cycles from " + Duration(*limit.cycle_min);
    if (limit.cycle_max) about += (limit.cycle_min ? " to " : " for cycles up to ") + Duration(*limit.cycle_max);
    if (limit.undocumented) about += " (not in the manual)";
    Row("permitted jitter", about, limit.note, limit.source, text);
  }
  SourcedRow("lost after jitter events", sync.lost_after_jitter, number, text);
  SourcedRow("lost after missing frames", sync.lost_after_missing, number, text);
  for (const device::DriveParameter* parameter : sync.DriveParameters()) {
    std::string about = parameter->keyword;
    if (parameter->object) about += " (" + ObjectName(parameter->object->index, parameter->object->subindex) + ")";
    Row("parameter", about, parameter->note, parameter->source, text);
  }
}

void AppendLatch(std::string_view title, const device::LatchDescription& latch, TextBuilder& text) {
  Heading(title,
          "control word " + ObjectName(latch.control_object) + ", status word " + ObjectName(latch.status_object),
          text);
  for (const device::LatchEdge& edge : latch.edges) {
    std::string about = "enable " + Hex(edge.enable) + ", valid " + Hex(edge.valid);
    if (edge.selector != 0) about += ", selector " + std::to_string(edge.selector);
    for (const device::ObjectAddress& position : edge.positions) {
      about += ", " + ObjectName(position.index, position.subindex);
    }
    Row(OneLine(edge.name), about, edge.note, edge.source, text);
  }
  std::string others;
  for (const device::ObjectAddress& position : latch.other_positions) {
    others += (others.empty() ? "" : ", ") + ObjectName(position.index, position.subindex);
  }
  if (!others.empty()) Row("positions of no known edge", others, "", "", text);
}

void AppendObjects(const device::DeviceDescription& profile, TextBuilder& text) {
  if (!profile.dictionary && !profile.emergency && profile.limits.empty()) return;
  Heading("Objects, emergencies, limits", "", text);
  if (profile.dictionary) {
    Row("object dictionary",
        Count(profile.dictionary->objects.size(), "row") +
            (profile.dictionary->complete ? ", the manual lists all" : ", others are possible"),
        profile.dictionary->note, profile.dictionary->source, text);
  }
  if (profile.emergency) {
    Row("emergency codes", Count(profile.emergency->codes.size(), "code"), profile.emergency->note,
        profile.emergency->source, text);
  }
  for (const device::Limit& limit : profile.limits) {
    std::string about = OneLine(limit.value);
    if (!limit.unit.empty()) about += " " + OneLine(limit.unit);
    if (!limit.meaning.empty()) about += ": " + OneLine(limit.meaning);
    Row(OneLine(limit.name), about, limit.note, limit.source, text);
  }
}

}  // namespace

void AppendProcessSections(const device::DeviceDescription& profile, TextBuilder& text) {
  AppendMailbox(profile.mailbox, text);
  AppendPdos(profile.pdo, text);
  if (profile.drive) AppendDrive(*profile.drive, text);
  AppendSync(profile.sync, text);
  if (profile.latch) AppendLatch("Latch", *profile.latch, text);
  if (profile.touch_probe) AppendLatch("Touch probe", *profile.touch_probe, text);
  AppendObjects(profile, text);
}

}  // namespace ecaudit::cli
