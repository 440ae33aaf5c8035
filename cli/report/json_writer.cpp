#include "cli/report/json_writer.h"

#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include <nlohmann/json.hpp>

#include "analyzers/core/every_slave.h"
#include "cli/report/drive_json.h"
#include "cli/report/json_parts.h"
#include "cli/report/startup_json.h"
#include "cli/report/sync_json.h"
#include "cli/report/times.h"
#include "cli/report/wireshark_filter.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

Json TimeOrNull(const FrameRef& frame) {
  return frame.has_time ? Json(IsoTime(frame.time)) : Json(nullptr);
}

Json DirectionText(DirectionSeen direction) {
  switch (direction) {
    case DirectionSeen::kBoth:
      return "both";
    case DirectionSeen::kOutbound:
      return "outbound";
    case DirectionSeen::kReturned:
      return "returned";
    case DirectionSeen::kNone:
      break;
  }
  return nullptr;
}

Json StateText(std::uint16_t al_word) {
  return esc::StateName(esc::AlWord{al_word}.state());
}

// --- text, as Json::dump() writes it, piece by piece -----------------------------------------------------------------

constexpr std::size_t kIndent = 2;

void NewLine(std::string& out, std::size_t depth) {
  out += '\n';
  out.append(depth * kIndent, ' ');
}

/// @param depth of the line in which it begins
void AppendValue(std::string& out, const Json& value, std::size_t depth) {
  for (const char c : value.dump(kIndent, ' ', false, Json::error_handler_t::replace)) {
    if (c == '\n') {
      NewLine(out, depth);  // in a text it would be \n
    } else {
      out += c;
    }
  }
}

template <typename AppendElement>
void AppendArray(std::string& out, std::size_t size, std::size_t depth, AppendElement append) {
  out += '[';
  for (std::size_t i = 0; i < size; ++i) {
    if (i != 0) out += ',';
    NewLine(out, depth + 1);
    append(i);
  }
  if (size != 0) NewLine(out, depth);
  out += ']';
}

/// @param append writes the value of a member; the object has at least one
template <typename AppendMember>
void AppendObject(std::string& out, const Json& object, std::size_t depth, AppendMember append) {
  out += '{';
  bool first = true;
  for (const auto& [key, value] : object.items()) {
    if (!first) out += ',';
    first = false;
    NewLine(out, depth + 1);
    AppendValue(out, key, depth + 1);
    out += ": ";
    append(key, value);
  }
  NewLine(out, depth);
  out += '}';
}

/// Writes one capture's report; holds what every section needs.
class CaptureWriter {
 public:
  explicit CaptureWriter(const CaptureReport& capture) : capture_(capture), result_(capture.result) {}

  [[nodiscard]] Json Write() const {
    Json json = Outline();
    for (const SlaveSummary& slave : result_.slaves) json["slaves"].push_back(Slave(slave));
    for (std::size_t i = 0; i < result_.findings.size(); ++i) json["findings"].push_back(FindingJson(i));
    return json;
  }

  /// The same as text, `depth` levels deep. Slaves and findings are made one at a time: there may be thousands.
  void Append(std::string& out, std::size_t depth) const {
    AppendObject(out, Outline(), depth, [&](const std::string& key, const Json& value) {
      if (key == "slaves") {
        AppendArray(out, result_.slaves.size(), depth + 1,
                    [&](std::size_t i) { AppendValue(out, Slave(result_.slaves[i]), depth + 2); });
      } else if (key == "findings") {
        AppendArray(out, result_.findings.size(), depth + 1,
                    [&](std::size_t i) { AppendValue(out, FindingJson(i), depth + 2); });
      } else {
        AppendValue(out, value, depth + 1);
      }
    });
  }

  [[nodiscard]] static Json SummaryJson(const Summary& summary) {
    return {{"errors", summary.errors},
            {"warnings", summary.warnings},
            {"infos", summary.infos},
            {"known", summary.known},
            {"verdict", !summary.judged ? Json(nullptr) : Json(summary.fail ? "fail" : "pass")}};
  }

 private:
  /// All but slaves and findings.
  [[nodiscard]] Json Outline() const {
    Json json;
    json["capture"] = Capture();
    json["settings"] = Settings();
    json["bus"] = Bus();
    json["slaves"] = Json::array();
    json["findings"] = Json::array();
    json["not_evaluable"] = Json::array();
    for (const NotEvaluable& entry : result_.not_evaluable) json["not_evaluable"].push_back(NotEvaluableJson(entry));
    json["summary"] = SummaryJson(Summarise(capture_));
    return json;
  }

  [[nodiscard]] Json Seconds(const FrameRef& frame) const {
    return OrNull(SecondsSince(result_.capture.origin, frame));
  }

  [[nodiscard]] Json Position(SlaveId id) const {
    const SlaveSummary* slave = result_.slave(id);
    return slave == nullptr ? Json(nullptr) : Json(slave->position);
  }

  [[nodiscard]] static Json Frames(const bus::FrameLedger& frames) {
    Json undecided = Json::array();
    for (std::size_t i = 0; i < frames.undecided.size(); ++i) {
      if (frames.undecided[i] == 0) continue;
      undecided.push_back({{"reason", Describe(static_cast<bus::Undecided>(i))}, {"count", frames.undecided[i]}});
    }
    return {{"outbound", frames.outbound},
            {"returned", frames.returned},
            {"lost", frames.lost},
            {"undecided", std::move(undecided)},
            {"under_way", frames.under_way}};
  }

  [[nodiscard]] Json Capture() const {
    const CaptureSummary& c = result_.capture;
    Json json;
    json["path"] = Text(c.file.path);
    json["format"] = Text(c.file.format);
    json["packets"] = c.packets;
    json["ethercat_frames"] = c.ethercat_frames;
    json["datagrams"] = c.datagrams;
    json["outbound_frames"] = c.outbound_frames;
    json["returned_frames"] = c.returned_frames;
    json["frames"] = Frames(c.frames);
    json["unknown_direction_frames"] = c.unknown_direction_frames;
    json["foreign_frames"] = c.foreign_frames;
    json["other_packets"] = c.other_packets;
    json["malformed_frames"] = c.malformed_frames;
    json["padded_frames"] = c.padded_frames;
    json["cut_frames"] = c.cut_frames;
    json["crc_error_frames"] = c.crc_error_frames;
    json["first_time"] = TimeOrNull(c.first);
    json["last_time"] = TimeOrNull(c.last);
    json["duration_s"] = c.duration_ns ? Json(static_cast<double>(*c.duration_ns) / 1e9) : Json(nullptr);
    json["direction"] = DirectionText(c.direction);
    json["timestamp_resolution_ns"] = c.timestamps.resolution_ns > 0 ? Json(c.timestamps.resolution_ns) : Json(nullptr);
    json["timestamps"] = {{"backwards", c.timestamps.backwards},
                          {"identical_pairs", c.timestamps.identical_pairs},
                          {"pairs", c.timestamps.pairs},
                          {"missing", c.timestamps.without}};
    json["complete"] = c.complete;
    json["damage"] = nullptr;
    if (c.file.damage) {
      json["damage"] = {{"message", Text(c.file.damage->message)},
                        {"offset", c.file.damage->offset},
                        {"after_frame", FrameOrNull(c.file.damage->after_frame)}};
    }
    json["interfaces"] = Json::array();
    for (const capture::Interface& i : c.file.interfaces) {
      json["interfaces"].push_back({{"name", TextOrNull(i.name)},
                                    {"link_type", i.link_type},
                                    {"snap_length", i.snap_length},
                                    {"dropped", OrNull(i.dropped)}});
    }
    json["comments"] = Json::array();
    for (const capture::Comment& comment : c.file.comments) {
      json["comments"].push_back({{"frame", FrameOrNull(comment.frame)}, {"text", Text(comment.text)}});
    }
    return json;
  }

  [[nodiscard]] Json Settings() const {
    Json rules = Json::object();
    for (const auto& [id, severity] : capture_.rules) rules[id] = severity;
    return {{"fail_on", Name(capture_.fail_on)},
            {"config", TextOrNull(capture_.config)},
            {"baseline", TextOrNull(capture_.baseline)},
            {"expectation", TextOrNull(capture_.expectation)},
            {"judged", !capture_.judged               ? "nothing"
                       : capture_.expectation.empty() ? "all"
                                                      : "expectation"},
            {"range", Range()},
            {"slaves", capture_.selection.slaves},
            {"rules", std::move(rules)}};
  }

  [[nodiscard]] Json Range() const {
    const Selection& s = capture_.selection;
    if (!s.range()) return nullptr;
    return {{"from_s", OrNull(s.from_s)},
            {"to_s", OrNull(s.to_s)},
            {"from_frame", OrNull(s.from_frame)},
            {"to_frame", OrNull(s.to_frame)}};
  }

  [[nodiscard]] Json Bus() const {
    const BusSummary& b = result_.bus;
    Json json;
    json["slave_count"] = OrNull(b.slave_count);
    json["cycle"] = CycleJson(b.cycle);
    json["dc"] = BusDcJson(result_);
    json["lost_frames"] = b.lost_frames;
    json["duplicated_frames"] = b.duplicated_frames;
    json["unanswered_at_end"] = b.unanswered_at_end;
    json["events"] = Json::array();
    for (const EventBitSummary& bit : b.events) json["events"].push_back(EventBit(bit));
    json["predictions"] = {{"al_answers", Prediction(b.predictions.al_answers)},
                           {"mailbox_accesses", Prediction(b.predictions.mailbox_accesses)},
                           {"working_counters", Prediction(b.predictions.working_counters)}};
    json["startup"] = StartupJson(result_, b.startup);
    return json;
  }

  [[nodiscard]] static Json EventBit(const EventBitSummary& bit) {
    return {{"bit", bit.bit},
            {"name", bit.name},
            {"raised", bit.raised},
            {"frames", bit.frames},
            {"first_frame", FrameOrNull(bit.first.number)},
            {"last_frame", FrameOrNull(bit.last.number)},
            {"set_at_start", bit.from_start},
            {"set_at_end", bit.at_end}};
  }

  [[nodiscard]] static Json Events(const EventSummary& events) {
    const auto reg = [](const std::optional<EventRegister>& known) -> Json {
      if (!known) return nullptr;
      Json json{{"value", known->value}, {"known_bits", known->known_bits}};
      json["names"] = Json::array();
      for (const std::string& name : known->names) json["names"].push_back(Text(name));
      json["confidence"] = known->inferred ? "inferred" : "observed";
      json["frame"] = FrameOrNull(known->frame);
      return json;
    };
    Json json;
    json["signalled"] = Json::array();
    for (const EventBitSummary& bit : events.signalled) {
      Json& entry = json["signalled"].emplace_back(EventBit(bit));
      entry["confidence"] = bit.inferred ? "inferred" : "observed";
    }
    json["ecat_event_mask"] = reg(events.ecat_mask);
    json["ecat_event_request"] = reg(events.ecat_request);
    json["al_event_mask"] = reg(events.al_mask);
    json["al_event_request"] = reg(events.al_request);
    return json;
  }

  [[nodiscard]] static Json Prediction(const PredictionCount& count) {
    return {{"made", count.made}, {"held", count.held}, {"deviations", count.deviations}};
  }

  [[nodiscard]] Json Slave(const SlaveSummary& s) const {
    Json json;
    json["position"] = s.position;
    json["position_source"] = s.position_inferred ? "inferred" : "observed";
    json["station_address"] = OrNull(s.station_address);
    json["alias"] = OrNull(s.alias);
    json["identity"] = {{"vendor_id", OrNull(s.identity.vendor_id)},
                        {"product_code", OrNull(s.identity.product_code)},
                        {"revision", OrNull(s.identity.revision)},
                        {"serial", OrNull(s.identity.serial)},
                        {"frame", FrameOrNull(s.identity.since)}};
    json["name"] = TextOrNull(s.name);
    json["profile"] = TextOrNull(s.profile);
    json["profile_source"] = TextOrNull(s.profile_source);
    json["al"] = Al(s);
    json["dc"] = s.dc ? DcJson(result_, s) : Json(nullptr);
    json["drive"] = s.drive ? DriveJson(result_, s) : Json(nullptr);
    json["startup"] = StartupJson(result_, s.startup);
    json["sync_managers"] = Json::array();
    for (const SyncManagerSummary& manager : s.sync_managers) json["sync_managers"].push_back(SyncManager(manager));
    json["fmmus"] = Json::array();
    for (const FmmuSummary& fmmu : s.fmmus) json["fmmus"].push_back(Fmmu(fmmu));
    json["pdo"] = Pdo(s.rx_pdo, s.tx_pdo);
    json["mailbox"] = Mailbox(s.mailbox);
    json["events"] = Events(s.events);
    json["latch"] = s.latch ? Latch(*s.latch) : Json(nullptr);
    json["touch_probe"] = s.touch_probe ? Latch(*s.touch_probe) : Json(nullptr);
    return json;
  }

  [[nodiscard]] static Json Millis(const FrameRef& from, const FrameRef& to) {
    if (!from.seen() || !to.seen() || !from.has_time || !to.has_time) return nullptr;
    return static_cast<double>(to.time - from.time) / 1e6;
  }

  [[nodiscard]] static Json LatchCapture(const LatchCaptureSummary& c) {
    return {{"edge", Text(c.edge)},
            {"armed_frame", FrameOrNull(c.armed.number)},
            {"valid_frame", FrameOrNull(c.valid.number)},
            {"selected_frame", FrameOrNull(c.selected.number)},
            {"acknowledged_frame", FrameOrNull(c.acknowledged.number)},
            {"read_frame", FrameOrNull(c.read.number)},
            {"disarmed_frame", FrameOrNull(c.disarmed.number)},
            {"rearmed_frame", FrameOrNull(c.rearmed.number)},
            {"read_by", TextOrNull(c.read_by)},
            {"position", OrNull(c.position)},
            {"arm_to_valid_ms", Millis(c.armed, c.valid)},
            {"valid_to_read_ms", Millis(c.valid, c.read)},
            {"read_to_rearm_ms", Millis(c.read, c.rearmed)}};
  }

  [[nodiscard]] static Json Latch(const LatchSummary& latch) {
    const auto source = [](const auto& word, bool by_sdo) {
      return word ? Json(by_sdo ? "sdo" : "process data") : Json(nullptr);
    };
    Json json;
    json["control"] = OrNull(latch.control);
    json["control_source"] = source(latch.control, latch.control_by_sdo);
    json["status"] = OrNull(latch.status);
    json["status_source"] = source(latch.status, latch.status_by_sdo);
    json["digital_inputs"] = Json::array();
    for (const LatchInputSummary& input : latch.inputs) {
      json["digital_inputs"].push_back({{"input", input.number}, {"state", input.state}, {"changes", input.changes}});
    }
    json["edges"] = Json::array();
    for (const LatchEdgeSummary& edge : latch.edges) {
      json["edges"].push_back({{"edge", Text(edge.name)},
                               {"armed", edge.armed},
                               {"valid", edge.valid},
                               {"read", edge.read},
                               {"lost", edge.lost}});
    }
    json["captures"] = Json::array();
    for (const LatchCaptureSummary& capture : latch.captures) json["captures"].push_back(LatchCapture(capture));
    json["captures_left_out"] = latch.captures_left_out;
    json["misuses"] = latch.misuses;
    return json;
  }

  [[nodiscard]] static Json SyncManager(const SyncManagerSummary& manager) {
    return {{"number", manager.number},
            {"start", manager.start},
            {"length", manager.length},
            {"control", manager.control},
            {"mode", manager.mailbox ? "mailbox" : "buffered"},
            {"direction", manager.ecat_writes ? "outputs" : "inputs"},
            {"enabled", manager.enabled},
            {"confidence", manager.inferred ? "inferred" : "observed"},
            {"frame", FrameOrNull(manager.since)}};
  }

  [[nodiscard]] static Json Fmmu(const FmmuSummary& fmmu) {
    return {{"number", fmmu.number},
            {"logical_start", fmmu.logical_start},
            {"length", fmmu.length},
            {"logical_start_bit", fmmu.logical_start_bit},
            {"logical_stop_bit", fmmu.logical_stop_bit},
            {"physical_start", fmmu.physical_start},
            {"physical_start_bit", fmmu.physical_start_bit},
            {"read", fmmu.reads},
            {"write", fmmu.writes},
            {"active", fmmu.active},
            {"confidence", fmmu.inferred ? "inferred" : "observed"},
            {"frame", FrameOrNull(fmmu.since)}};
  }

  [[nodiscard]] static std::string_view SourceText(PdoSummary::Source source) {
    switch (source) {
      case PdoSummary::Source::kObserved:
        return "observed";
      case PdoSummary::Source::kDefault:
        return "default";
      case PdoSummary::Source::kEni:
        return "eni";
      case PdoSummary::Source::kUnknown:
        break;
    }
    return "unknown";
  }

  [[nodiscard]] static Json Objects(const PdoSummary& pdo) {
    Json json = Json::array();
    for (const MappedObject& object : pdo.objects) {
      Json& entry = json.emplace_back();
      entry["pdo"] = object.pdo;
      entry["index"] = object.index;
      entry["subindex"] = object.subindex;
      entry["bits"] = object.bits;
      entry["name"] = TextOrNull(object.name);
      entry["name_source"] = object.name.empty() ? Json(nullptr) : object.name_inferred ? "inferred" : "known";
      entry["variable"] = TextOrNull(object.variable);
      entry["bit_offset"] = object.bit_offset;
      entry["sync_manager"] = object.sync_manager;
    }
    return json;
  }

  [[nodiscard]] static Json Exchanged(const PdoSummary& pdo) {
    return {
        {"datagrams", pdo.exchanged}, {"first_frame", FrameOrNull(pdo.first)}, {"last_frame", FrameOrNull(pdo.last)}};
  }

  [[nodiscard]] static Json Pdo(const PdoSummary& rx, const PdoSummary& tx) {
    // One word for both directions: the weaker one, which is what a reader must not overrate.
    const auto weight = [](PdoSummary::Source source) {
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
    };
    Json json;
    json["rx"] = Objects(rx);
    json["tx"] = Objects(tx);
    json["rx_bytes"] = OrNull(rx.bytes);
    json["tx_bytes"] = OrNull(tx.bytes);
    json["source"] = SourceText(weight(rx.source) <= weight(tx.source) ? rx.source : tx.source);
    json["rx_source"] = SourceText(rx.source);
    json["tx_source"] = SourceText(tx.source);
    json["rx_reason"] = TextOrNull(rx.reason);
    json["tx_reason"] = TextOrNull(tx.reason);
    json["rx_pdos"] = rx.pdos;
    json["tx_pdos"] = tx.pdos;
    json["rx_frame"] = FrameOrNull(rx.since);
    json["tx_frame"] = FrameOrNull(tx.since);
    json["rx_exchanged"] = Exchanged(rx);
    json["tx_exchanged"] = Exchanged(tx);
    return json;
  }

  [[nodiscard]] static Json Mailbox(const MailboxSummary& m) {
    Json json{{"requests", m.requests},           {"responses", m.responses},  {"sdo_uploads", m.sdo_uploads},
              {"sdo_downloads", m.sdo_downloads}, {"aborts", m.aborts},        {"emergencies", m.emergencies},
              {"error_replies", m.error_replies}, {"unanswered", m.unanswered}};
    json["by_protocol"] = Json::object();
    for (const MailboxSummary::Messages& p : m.by_protocol) {
      json["by_protocol"][p.protocol] = {{"requests", p.requests}, {"responses", p.responses}};
    }
    return json;
  }

  [[nodiscard]] Json Al(const SlaveSummary& s) const {
    Json json;
    json["state"] = s.al_status ? StateText(*s.al_status) : Json(nullptr);
    json["error"] = s.al_status ? Json(esc::AlWord{*s.al_status}.bit4()) : Json(nullptr);
    json["status_code"] = OrNull(s.al_status_code);
    json["history"] = Json::array();
    for (const AlStep& step : s.al_history) json["history"].push_back(Step(step));
    json["history_left_out"] = s.al_history_left_out;
    return json;
  }

  [[nodiscard]] Json Step(const AlStep& step) const {
    const bool request = step.kind == AlStep::Kind::kRequest;
    Json json;
    json["kind"] = request ? "request" : "state";
    json["frame"] = FrameOrNull(step.frame.number);
    json["time_s"] = Seconds(step.frame);
    json["from"] = step.from == 0 ? Json(nullptr) : StateText(step.from);
    json["to"] = StateText(step.to);
    json["value"] = step.to;
    json[request ? "acknowledge" : "error"] = esc::AlWord{step.to}.bit4();
    if (request) json["refused_by_wkc"] = step.refused_by_wkc;
    json["status_code"] = OrNull(step.status_code);
    return json;
  }

  [[nodiscard]] static Json EvidenceValue(const Evidence& evidence) {
    return std::visit(
        [](const auto& value) {
          if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::string>) {
            return Text(value);
          } else {
            return Json(value);
          }
        },
        evidence.value);
  }

  [[nodiscard]] static std::string FindingId(std::size_t index) { return "f" + std::to_string(index + 1); }

  [[nodiscard]] Json FindingJson(std::size_t index) const {
    const Finding& f = result_.findings[index];
    const SlaveSummary* slave = result_.slave(f.slave);
    Json json;
    json["id"] = FindingId(index);
    json["rule"] = f.rule;
    json["severity"] = Name(f.severity);
    json["title"] = Text(f.title);
    json["message"] = Text(f.message);
    json["slave"] = Position(f.slave);
    json["station_address"] = slave == nullptr ? Json(nullptr) : OrNull(slave->station_address);
    json["frame"] = FrameOrNull(f.first.number);
    json["last_frame"] = FrameOrNull(f.last.number == 0 ? f.first.number : f.last.number);
    json["count"] = f.count;
    json["time"] = TimeOrNull(f.first);
    json["time_s"] = Seconds(f.first);
    json["related_frames"] = f.related_frames;
    json["caused_by"] = f.caused_by < result_.findings.size() ? Json(FindingId(f.caused_by)) : Json(nullptr);
    json["confidence"] = f.confidence == Confidence::kObserved ? "observed" : "inferred";
    json["evidence"] = Json::object();
    for (const Evidence& evidence : f.evidence) json["evidence"][Printable(evidence.name)] = EvidenceValue(evidence);
    json["reference"] = {{"document", TextOrNull(f.reference.document)}, {"section", TextOrNull(f.reference.section)}};
    json["wireshark_filter"] = TextOrNull(WiresharkFilter(f));
    json["known"] = capture_.IsKnown(index);
    return json;
  }

  [[nodiscard]] Json NotEvaluableJson(const NotEvaluable& entry) const {
    return {{"rule", entry.rule},
            {"slave", Position(entry.slave)},
            {"scope", result_.slave(entry.slave) != nullptr ? "slave"
                      : entry.slave == kEverySlave          ? "all-slaves"
                                                            : "bus"},
            {"reason", Text(entry.reason)},
            {"first_frame", FrameOrNull(entry.first_frame)},
            {"occasions", entry.occasions}};
  }

  const CaptureReport& capture_;
  const AnalysisResult& result_;
};

}  // namespace

namespace {

/// All but the reports of the captures.
Json OutlineOf(const Report& report) {
  Json json;
  json["schema"] = "ecaudit.report/1";
  json["tool"] = {{"name", "ecaudit"}, {"version", report.version}};
  if (!report.origin.settings.empty()) {
    json["made_from"] = {
        {"settings", report.origin.settings}, {"bytes", report.origin.bytes}, {"modified", report.origin.modified}};
  }
  json["reports"] = Json::array();
  json["unreadable"] = Json::array();
  for (const UnreadableCapture& capture : report.unreadable) {
    json["unreadable"].push_back({{"path", Text(capture.path)}, {"message", Text(capture.message)}});
  }
  json["summary"] = {{"captures", report.captures.size()}};
  json["summary"].update(CaptureWriter::SummaryJson(Summarise(report)));
  return json;
}

}  // namespace

Json ReportJson(const Report& report) {
  Json json = OutlineOf(report);
  for (const CaptureReport& capture : report.captures) json["reports"].push_back(CaptureWriter(capture).Write());
  return json;
}

std::string WriteJson(const Report& report) {
  std::string out;
  AppendObject(out, OutlineOf(report), 0, [&](const std::string& key, const Json& value) {
    if (key != "reports") return AppendValue(out, value, 1);
    AppendArray(out, report.captures.size(), 1,
                [&](std::size_t i) { CaptureWriter(report.captures[i]).Append(out, 2); });
  });
  out += '\n';
  return out;
}

}  // namespace ecaudit::report
