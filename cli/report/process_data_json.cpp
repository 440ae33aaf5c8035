#include <string_view>

#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"
#include "decoder/base/names.h"

namespace ecaudit::report {
namespace {

std::string_view SourceText(PdoSummary::Source source) {
  static constexpr Named<PdoSummary::Source> kNames[] = {
      {PdoSummary::Source::kObserved, "observed"},
      {PdoSummary::Source::kDefault, "default"},
      {PdoSummary::Source::kEni, "eni"},
      {PdoSummary::Source::kUnknown, "unknown"},
  };
  return NameIn(kNames, source);
}

int Weight(PdoSummary::Source source) {
  switch (source) {
    case PdoSummary::Source::kUnknown:
      return 0;
    case PdoSummary::Source::kDefault:
      return 1;
    case PdoSummary::Source::kEni:
      return 2;
    case PdoSummary::Source::kObserved:
      return 3;
  }
  return 0;
}

void PutObject(JsonObject& out, const MappedObject& object) {
  out.Put("pdo", object.pdo);
  out.Put("index", object.index);
  out.Put("subindex", object.subindex);
  out.Put("bits", object.bits);
  out.TextOrNull("name", object.name);
  out.Put("name_source", OnlyIf(!object.name.empty(), object.name_inferred ? "inferred" : "known"));
  out.TextOrNull("variable", object.variable);
  out.Put("bit_offset", object.bit_offset);
  out.Put("sync_manager", object.sync_manager);
}

void PutExchanged(JsonObject& out, std::string_view key, const PdoSummary& pdo) {
  out.Object(key, [&](JsonObject& json) {
    json.Put("datagrams", pdo.exchanged);
    json.Frame("first_frame", pdo.first);
    json.Frame("last_frame", pdo.last);
  });
}

}  // namespace

void PutSyncManager(JsonObject& out, const SyncManagerSummary& manager) {
  out.Put("number", manager.number);
  out.Put("start", manager.start);
  out.Put("length", manager.length);
  out.Put("control", manager.control);
  out.Put("mode", manager.mailbox ? "mailbox" : "buffered");
  out.Put("direction", manager.ecat_writes ? "outputs" : "inputs");
  out.Put("enabled", manager.enabled);
  out.Put("confidence", manager.inferred ? "inferred" : "observed");
  out.Frame("frame", manager.since);
}

void PutFmmu(JsonObject& out, const FmmuSummary& fmmu) {
  out.Put("number", fmmu.number);
  out.Put("logical_start", fmmu.logical_start);
  out.Put("length", fmmu.length);
  out.Put("logical_start_bit", fmmu.logical_start_bit);
  out.Put("logical_stop_bit", fmmu.logical_stop_bit);
  out.Put("physical_start", fmmu.physical_start);
  out.Put("physical_start_bit", fmmu.physical_start_bit);
  out.Put("read", fmmu.reads);
  out.Put("write", fmmu.writes);
  out.Put("active", fmmu.active);
  out.Put("confidence", fmmu.inferred ? "inferred" : "observed");
  out.Frame("frame", fmmu.since);
}

void PutPdos(JsonObject& out, const PdoSummary& rx, const PdoSummary& tx) {
  out.List("rx", rx.objects, PutObject);
  out.List("tx", tx.objects, PutObject);
  out.Put("rx_bytes", rx.bytes);
  out.Put("tx_bytes", tx.bytes);
  // One word for both directions: the weaker one, which is what a reader must not overrate.
  out.Put("source", SourceText(Weight(rx.source) <= Weight(tx.source) ? rx.source : tx.source));
  out.Put("rx_source", SourceText(rx.source));
  out.Put("tx_source", SourceText(tx.source));
  out.TextOrNull("rx_reason", rx.reason);
  out.TextOrNull("tx_reason", tx.reason);
  out.Values("rx_pdos", rx.pdos);
  out.Values("tx_pdos", tx.pdos);
  out.Frame("rx_frame", rx.since);
  out.Frame("tx_frame", tx.since);
  PutExchanged(out, "rx_exchanged", rx);
  PutExchanged(out, "tx_exchanged", tx);
}

}  // namespace ecaudit::report
