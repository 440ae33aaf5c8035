/// The events "pdo-mapping": what the process data of a slave hold, whenever that becomes known or changes.
#include "cli/stream/event_writer.h"
#include "cli/stream/json_line.h"
#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::cli {
namespace {

/// Never 0. Two mappings with the same digest are taken for the same one.
std::uint64_t DigestOf(const model::ProcessLayout& layout) {
  std::uint64_t digest = 14695981039346656037U;  // FNV-1a
  const auto add = [&digest](std::uint64_t value) {
    digest = WrappingProduct(digest ^ value, std::uint64_t{1099511628211U});
  };
  add(static_cast<std::uint64_t>(layout.source));
  for (const std::uint16_t pdo : layout.pdos) add(pdo);
  for (const model::Signal& signal : layout.signals) {
    add(std::uint64_t{signal.pdo} << 48U | std::uint64_t{signal.index} << 32U | std::uint64_t{signal.subindex} << 16U |
        signal.bits);
  }
  return digest == 0 ? 1 : digest;
}

void AddEntries(RowFields& fields, const model::ProcessLayout& layout) {
  std::string& out = fields.Json("entries");
  out += '[';
  bool first = true;
  for (const model::Signal& signal : layout.signals) {
    if (!first) out += ',';
    first = false;
    JsonLine entry(out);
    entry.Number("pdo", signal.pdo);
    entry.Number("index", signal.index);
    entry.Number("subindex", signal.subindex);
    entry.Number("bits", signal.bits);
    entry.Number("bit_offset", signal.bit_offset);
    entry.Number("sync_manager", signal.sync_manager);
    if (signal.name.empty()) {
      entry.Null("name");
    } else {
      entry.Text("name", signal.name);
    }
    entry.Close();
  }
  out += ']';
}

std::string EntryText(const model::Signal& signal) {
  if (signal.gap()) return "gap of " + Count(signal.bits, "bit");
  std::string text = ObjectName(signal.index, signal.subindex) + " " + std::to_string(signal.bits) + " bit";
  if (!signal.name.empty()) text += " " + Printable(signal.name);
  if (signal.name_inferred) text += " (inferred)";
  return text;
}

}  // namespace

void EventWriter::WriteMappings(SlaveId slave, const FrameRef& frame) {
  if (!output_->Wants(EventType::kPdoMapping)) return;
  WriteMapping(slave, frame, device::PdoDirection::kRx);
  WriteMapping(slave, frame, device::PdoDirection::kTx);
}

void EventWriter::WriteMapping(SlaveId slave, const FrameRef& frame, device::PdoDirection direction) {
  const bool rx = direction == device::PdoDirection::kRx;
  const model::ProcessLayout& layout = model_->slave(slave).process.Layout(direction);
  if (!layout.known()) return;
  // That a slave has no process data in a direction is news only where the capture shows it.
  if (layout.pdos.empty() && layout.source != model::LayoutSource::kObserved) return;
  std::uint64_t& shown = NotesOf(slave).mapping[rx ? 0 : 1];
  const std::uint64_t digest = DigestOf(layout);
  if (shown == digest) return;
  shown = digest;
  if (!output_->Wants(EventType::kPdoMapping, frame, slave)) return;

  EventRow row(*output_, EventType::kPdoMapping, frame, slave);
  row.fields.Text("direction", rx ? "rx" : "tx");
  std::string& pdos = row.fields.Json("pdos");
  pdos += '[';
  for (std::size_t i = 0; i < layout.pdos.size(); ++i) {
    if (i != 0) pdos += ',';
    AppendNumber(pdos, layout.pdos[i]);
  }
  pdos += ']';
  AddEntries(row.fields, layout);
  row.fields.Number("bytes", layout.bytes());
  row.fields.Text("source", model::Name(layout.source));
  row.fields.Text("certainty", layout.assumed ? "inferred" : "observed");

  row.text = rx ? "outputs: " : "inputs: ";
  if (layout.pdos.empty()) {
    row.text += "no PDO assigned";
  } else {
    row.text += Count(layout.bytes(), "byte") + " in";
    for (std::size_t i = 0; i < layout.pdos.size(); ++i) {
      row.text += (i == 0 ? " " : ", ") + ObjectName(layout.pdos[i]);
    }
    row.text += ":";
    for (std::size_t i = 0; i < layout.signals.size(); ++i) {
      row.text += (i == 0 ? " " : ", ") + EntryText(layout.signals[i]);
    }
  }
  if (layout.source == model::LayoutSource::kDefault) row.Note("default by EEPROM or ESI");
  if (layout.source == model::LayoutSource::kEni) row.Note("by the ENI file");
}

}  // namespace ecaudit::cli
