#include "cli/report/esi_text.h"
#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"
#include "cli/report/times.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

std::string StateText(std::uint16_t al_word) {
  return esc::StateName(esc::AlWord{al_word}.state());
}

void PutAlStep(JsonObject& out, const AnalysisResult& result, const AlStep& step) {
  const bool request = step.kind == AlStep::Kind::kRequest;
  out.Put("kind", request ? "request" : "state");
  out.Frame("frame", step.frame);
  out.Put("time_s", SecondsSince(result.capture.origin, step.frame));
  out.TextOrNull("from", step.from == 0 ? "" : StateText(step.from));
  out.Put("to", StateText(step.to));
  out.Put("value", step.to);
  out.Put(request ? "acknowledge" : "error", esc::AlWord{step.to}.bit4() && !step.echo);
  if (!request) out.Put("acknowledge_echoed", step.echo);
  if (request) out.Put("refused_by_wkc", step.refused_by_wkc);
  out.Put("status_code", step.status_code);
}

void PutAl(JsonObject& out, const AnalysisResult& result, const SlaveSummary& s) {
  const bool known = s.al_status.has_value();
  const std::uint16_t status = s.al_status.value_or(0);
  out.TextOrNull("state", known ? StateText(status) : "");
  out.Put("error", OnlyIf(known, esc::AlWord{status}.bit4() && !s.al_echo));
  out.Put("status_code", s.al_status_code);
  out.List("history", s.al_history, [&](JsonObject& json, const AlStep& step) { PutAlStep(json, result, step); });
  out.Put("history_left_out", s.al_history_left_out);
}

void PutIdentity(JsonObject& out, const Identity& identity) {
  out.Put("vendor_id", identity.vendor_id);
  out.Put("product_code", identity.product_code);
  out.Put("revision", identity.revision);
  out.Put("serial", identity.serial);
  out.Frame("frame", identity.since);
}

void PutMailbox(JsonObject& out, const MailboxSummary& m) {
  out.Put("requests", m.requests);
  out.Put("responses", m.responses);
  out.Put("sdo_uploads", m.sdo_uploads);
  out.Put("sdo_downloads", m.sdo_downloads);
  out.Put("aborts", m.aborts);
  out.Put("emergencies", m.emergencies);
  out.Put("error_replies", m.error_replies);
  out.Put("unanswered", m.unanswered);
  out.Object("by_protocol", [&](JsonObject& protocols) {
    for (const MailboxSummary::Messages& messages : m.by_protocol) {
      protocols.Object(messages.protocol, [&](JsonObject& json) {
        json.Put("requests", messages.requests);
        json.Put("responses", messages.responses);
      });
    }
  });
}

void PutEventRegister(JsonObject& out, std::string_view key, const std::optional<EventRegister>& known) {
  if (!known) return out.Put(key, nullptr);
  out.Object(key, [&](JsonObject& json) {
    json.Put("value", known->value);
    json.Put("known_bits", known->known_bits);
    json.Texts("names", known->names);
    json.Put("confidence", known->inferred ? "inferred" : "observed");
    json.Frame("frame", known->frame);
  });
}

void PutEvents(JsonObject& out, const EventSummary& events) {
  out.List("signalled", events.signalled, [](JsonObject& json, const EventBitSummary& bit) {
    PutEventBit(json, bit);
    json.Put("confidence", bit.inferred ? "inferred" : "observed");
  });
  PutEventRegister(out, "ecat_event_mask", events.ecat_mask);
  PutEventRegister(out, "ecat_event_request", events.ecat_request);
  PutEventRegister(out, "al_event_mask", events.al_mask);
  PutEventRegister(out, "al_event_request", events.al_request);
}

}  // namespace

void PutEventBit(JsonObject& out, const EventBitSummary& bit) {
  out.Put("bit", bit.bit);
  out.Put("name", bit.name);
  out.Put("raised", bit.raised);
  out.Put("frames", bit.frames);
  out.Frame("first_frame", bit.first);
  out.Frame("last_frame", bit.last);
  out.Put("set_at_start", bit.from_start);
  out.Put("set_at_end", bit.at_end);
}

void PutSlave(JsonObject& out, const AnalysisResult& result, const SlaveSummary& s, const AlikeSteps& alike) {
  out.Put("position", s.position);
  out.Put("position_source", s.position_inferred ? "inferred" : "observed");
  out.Put("station_address", s.station_address);
  out.Put("alias", s.alias);
  out.Object("identity", [&](JsonObject& json) { PutIdentity(json, s.identity); });
  out.TextOrNull("name", s.name);
  out.TextOrNull("profile", s.profile);
  out.TextOrNull("profile_source", s.profile_source);
  out.Object("al", [&](JsonObject& json) { PutAl(json, result, s); });
  out.ObjectOrNull("dc", s.dc, [&](JsonObject& json, const DcSummary& dc) { PutDc(json, result, dc); });
  out.ObjectOrNull("drive", s.drive, [&](JsonObject& json, const DriveSummary& d) { PutDrive(json, result, d); });
  if (!s.further_axes.empty()) {
    out.List("further_axes", s.further_axes,
             [&](JsonObject& json, const DriveSummary& axis) { PutDrive(json, result, axis); });
  }
  PutLadder(out, "progress", result, s.progress);
  out.List("axes", s.axes, [&](JsonObject& json, const AxisLadder& axis) {
    json.Put("axis", axis.axis + 1);
    PutLadder(json, "progress", result, axis.ladder);
  });
  PutStartup(out, "startup", result, s.startup, &alike);
  PutEsiDemands(out, s);
  out.List("sync_managers", s.sync_managers, PutSyncManager);
  out.List("fmmus", s.fmmus, PutFmmu);
  out.Object("pdo", [&](JsonObject& json) { PutPdos(json, s.rx_pdo, s.tx_pdo); });
  out.Object("mailbox", [&](JsonObject& json) { PutMailbox(json, s.mailbox); });
  out.Object("events", [&](JsonObject& json) { PutEvents(json, s.events); });
  out.ObjectOrNull("latch", s.latch, PutLatch);
  out.ObjectOrNull("touch_probe", s.touch_probe, PutLatch);
}

}  // namespace ecaudit::report
