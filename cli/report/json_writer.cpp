#include "cli/report/json_writer.h"

#include <string>
#include <string_view>

#include "analyzers/result/every_slave.h"
#include "cli/report/alike_steps.h"
#include "cli/report/coverage_tally.h"
#include "cli/report/finding_id.h"
#include "cli/report/fingerprint.h"
#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"
#include "cli/report/notation.h"
#include "cli/report/sentences.h"
#include "cli/report/times.h"
#include "cli/report/wireshark_filter.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

/// Empty without a time stamp.
std::string TimeOf(const FrameRef& frame) {
  return frame.has_time ? IsoTime(frame.time) : std::string();
}

JsonScalar DirectionText(DirectionSeen direction) {
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

void PutSummary(JsonObject& out, const Summary& summary) {
  out.Put("errors", summary.errors);
  out.Put("warnings", summary.warnings);
  out.Put("infos", summary.infos);
  out.Put("known", summary.known);
  out.Put("verdict", OnlyIf(summary.judged, summary.Verdict()));
}

void PutTimestamps(JsonObject& out, const TimestampQuality& timestamps) {
  out.Put("backwards", timestamps.backwards);
  out.Put("identical_pairs", timestamps.identical_pairs);
  out.Put("pairs", timestamps.pairs);
  out.Put("missing", timestamps.without);
}

void PutDamage(JsonObject& out, const capture::Damage& damage) {
  out.Text("message", damage.message);
  out.Put("offset", damage.offset);
  out.Frame("after_frame", damage.after_frame);
}

void PutInterface(JsonObject& out, const capture::Interface& interface) {
  out.TextOrNull("name", interface.name);
  out.Put("link_type", interface.link_type);
  out.Put("snap_length", interface.snap_length);
  out.Put("dropped", interface.dropped);
}

void PutComment(JsonObject& out, const capture::Comment& comment) {
  out.Frame("frame", comment.frame);
  out.Text("text", comment.text);
}

/// What became of the outbound frames.
void PutFrames(JsonObject& out, const bus::FrameLedger& frames) {
  out.Put("outbound", frames.outbound);
  out.Put("returned", frames.returned);
  out.Put("lost", frames.lost);
  out.Array("undecided", [&](JsonArray& undecided) {
    for (std::size_t i = 0; i < frames.undecided.size(); ++i) {
      if (frames.undecided[i] == 0) continue;
      undecided.AddObject([&](JsonObject& json) {
        json.Put("reason", Describe(static_cast<bus::Undecided>(i)));
        json.Put("count", frames.undecided[i]);
      });
    }
  });
  out.Put("under_way", frames.in_flight);
}

void PutCapture(JsonObject& out, const CaptureSummary& c) {
  out.Text("path", c.file.path);
  out.Text("format", c.file.format);
  out.Put("packets", c.packets);
  out.Put("ethercat_frames", c.ethercat_frames);
  out.Put("datagrams", c.datagrams);
  out.Put("outbound_frames", c.outbound_frames);
  out.Put("returned_frames", c.returned_frames);
  out.Object("frames", [&](JsonObject& json) { PutFrames(json, c.frames); });
  out.Put("unknown_direction_frames", c.unknown_direction_frames);
  out.Put("foreign_frames", c.foreign_frames);
  out.Put("other_end_frames", c.other_end_frames);
  out.Put("other_packets", c.other_packets);
  out.Put("malformed_frames", c.malformed_frames);
  out.Put("padded_frames", c.padded_frames);
  out.Put("cut_frames", c.cut_frames);
  out.Put("crc_error_frames", c.crc_error_frames);
  out.TextOrNull("first_time", TimeOf(c.first));
  out.TextOrNull("last_time", TimeOf(c.last));
  out.Put("duration_s", c.duration_ns ? JsonScalar(static_cast<double>(*c.duration_ns) / 1e9) : JsonScalar(nullptr));
  out.Put("direction", DirectionText(c.direction));
  out.Put("timestamp_resolution_ns", OnlyIf(c.timestamps.resolution_ns > 0, c.timestamps.resolution_ns));
  out.Object("timestamps", [&](JsonObject& json) { PutTimestamps(json, c.timestamps); });
  out.Put("complete", c.complete);
  out.ObjectOrNull("damage", c.file.damage, PutDamage);
  out.List("interfaces", c.file.interfaces, PutInterface);
  out.List("comments", c.file.comments, PutComment);
}

void PutRange(JsonObject& out, const Selection& s) {
  if (!s.range()) return out.Put("range", nullptr);
  out.Object("range", [&](JsonObject& json) {
    json.Put("from_s", s.from_s);
    json.Put("to_s", s.to_s);
    json.Put("from_frame", s.from_frame);
    json.Put("to_frame", s.to_frame);
    json.TextOrNull("isolated_by", s.isolated_by);
    json.Object("outside", [&](JsonObject& outside) {
      outside.Put("errors", s.outside.errors);
      outside.Put("warnings", s.outside.warnings);
      outside.Put("infos", s.outside.infos);
    });
  });
}

void PutSettings(JsonObject& out, const CaptureReport& capture) {
  out.Put("fail_on", Name(capture.fail_on));
  out.TextOrNull("config", capture.config);
  out.TextOrNull("baseline", capture.baseline);
  out.TextOrNull("expectation", capture.expectation);
  out.Put("judged", !capture.judged ? "nothing" : capture.expectation.empty() ? "all" : "expectation");
  PutRange(out, capture.selection);
  if (capture.result.slave_names.from_one) out.Put("count_from", 1U);
  out.Values("slaves", capture.selection.slaves);
  out.Values("interfaces", capture.selection.interfaces);
  out.Object("rules", [&](JsonObject& json) {
    for (const auto& [id, severity] : capture.rules) json.Put(id, severity);
  });
}

void PutPrediction(JsonObject& out, std::string_view key, const PredictionCount& count) {
  out.Object(key, [&](JsonObject& json) {
    json.Put("made", count.made);
    json.Put("held", count.held);
    json.Values("deviations", count.deviations);
  });
}

void PutRun(JsonObject& out, const RunSummary& run) {
  out.Put("first_frame", run.first.number);
  out.Put("last_frame", run.last.number);
  out.Put("reason", run.why == RunSummary::Why::kCapture ? "capture"
                    : run.why == RunSummary::Why::kClock ? "clock"
                                                         : "initialised");
  out.TextOrNull("highest_state", run.highest == 0 ? std::string() : esc::StateName(run.highest));
  out.Put("slaves_in_op", run.slaves_in_op);
  out.Put("preop_requests", run.preop_requests);
  if (run.cycle_us > 0) out.Put("cycle_us", run.cycle_us);
}

void PutBus(JsonObject& out, const AnalysisResult& result) {
  const BusSummary& b = result.bus;
  out.Put("slave_count", b.slave_count);
  if (b.al) {
    out.Object("al", [&](JsonObject& json) {
      json.Put("status", b.al->status);
      json.Put("status_text", esc::StatesOfAllText(b.al->status));
      json.Put("first_frame", b.al->first.number);
      json.Put("last_frame", b.al->last.number);
      json.Put("reads", b.al->reads);
    });
  }
  out.Object("cycle", [&](JsonObject& json) { PutCycle(json, b.cycle); });
  PutBusDc(out, "dc", result);
  out.Put("lost_frames", b.lost_frames);
  out.Put("duplicated_frames", b.duplicated_frames);
  out.Put("unanswered_at_end", b.unanswered_at_end);
  out.List("events", b.events, PutEventBit);
  out.List("runs", b.runs, PutRun);
  PutTopology(out, "topology", result);
  out.List("cyclic_datagrams", b.cyclic_datagrams, [](JsonObject& json, const CyclicDatagram& datagram) {
    json.Put("command", datagram.command);
    json.Put("logical_address", datagram.logical_address);
    json.Put("length", datagram.length);
    json.Put("count", datagram.count);
  });
  out.Object("predictions", [&](JsonObject& json) {
    PutPrediction(json, "al_answers", b.predictions.al_answers);
    PutPrediction(json, "mailbox_accesses", b.predictions.mailbox_accesses);
    PutPrediction(json, "working_counters", b.predictions.working_counters);
  });
  PutStartup(out, "startup", result, b.startup);
}

/// A value as programs read it.
void PutValue(JsonObject& out, const std::string& name, const Value& value) {
  switch (value.type) {
    case Value::Type::kReal:
      return out.Put(name, value.real());
    case Value::Type::kDuration: {
      if (value.unit == "ns") return out.Put(name, value.number);
      const double divisor = value.unit == "ms" ? 1e6 : 1e3;
      return out.Put(name, static_cast<double>(value.number) / divisor);
    }
    case Value::Type::kFlag:
    case Value::Type::kBoolean:
      return out.Put(name, value.number != 0);
    case Value::Type::kWord:
      return out.Text(name, value.word->code);
    case Value::Type::kText:
    case Value::Type::kBytes:
    case Value::Type::kObject:
    case Value::Type::kAlState:
    case Value::Type::kSlave:
      return out.Text(name, TextOf(value, Form::kNumber));
    case Value::Type::kList:
      return out.Text(name, TextOf(value));
    default:
      return out.Put(name, value.number);
  }
}

void PutArguments(JsonObject& out, const Arguments& arguments) {
  for (const Argument& argument : arguments) {
    out.Object(argument.name, [&](JsonObject& json) {
      json.Put("type", Name(argument.value.type));
      PutValue(json, "value", argument.value);
      json.Text("text", TextOf(argument.value));
    });
  }
}

void PutNote(JsonObject& out, const Note& note) {
  out.Put("kind", note.kind->name);
  out.Object("arguments", [&](JsonObject& json) { PutArguments(json, note.arguments); });
}

void PutMapping(JsonObject& out, const Finding& f) {
  out.List("mapping", f.mapping, [](JsonObject& json, const std::shared_ptr<const MappingTable>& table) {
    json.Put("direction", table->outputs ? "outputs" : "inputs");
    json.Put("sync_manager", table->sync_manager);
    json.Put("sync_manager_bytes", table->manager_bytes);
    json.Put("wanted_bits", table->wanted_bits);
    json.Put("slave_bits", table->slave_bits);
    json.List("entries", table->rows, [](JsonObject& entry, const MappingRow& row) {
      entry.Put("object", ObjectName(row.list, row.subindex));
      entry.TextOrNull("wanted", row.wanted);
      entry.Put("answer", Name(row.answer));
      entry.Text("slave", row.slave);
      entry.Put("wanted_bit", row.wanted_bit);
      entry.Put("slave_bit", row.slave_bit);
      entry.Put("doubtful", row.doubtful);
      entry.Put("shifted", row.shifted);
      entry.Put("frame", FrameOrNull(row.frame));
    });
    json.Put("entries_left_out", table->rows_left_out);
  });
}

/// Which axis, and which slaves.
void PutPlaces(JsonObject& out, const Finding& f) {
  if (f.axis != 0) out.Put("axis", f.axis + 1);
  if (f.affected.number > 0) {
    out.Put("slaves", f.affected.number);
    out.Text("positions", f.affected.positions);
  }
}

void PutArgumentsAsEvidence(JsonObject& out, const Finding& f) {
  for (const Argument& argument : f.arguments) {
    if (argument.value.type != Value::Type::kFlag) PutValue(out, std::string(argument.name), argument.value);
  }
  PutPlaces(out, f);
}

void PutFinding(JsonObject& out, const CaptureReport& capture, std::size_t index) {
  const AnalysisResult& result = capture.result;
  const Finding& f = result.findings[index];
  const SlaveSummary* slave = result.slave(f.slave);
  const bool caused = f.caused_by < result.findings.size();
  out.Put("id", FindingId(result, static_cast<FindingIndex>(index)));
  out.Put("rule", f.rule);
  out.Put("severity", Name(f.severity));
  const Sentences sentences = SentencesOf(f, result);
  out.Put("kind", f.kind->name);
  out.Text("identity", IdentityText(f));
  out.Text("title", sentences.title);
  out.Text("message", MessageOf(f, result));
  out.TextOrNull("next_step", sentences.next);
  out.Put("slave", slave == nullptr ? JsonScalar(nullptr) : slave->position);
  out.Put("station_address", slave == nullptr ? JsonScalar(nullptr) : slave->station_address);
  out.Frame("frame", f.first);
  out.Frame("last_frame", f.last.number == 0 ? f.first : f.last);
  out.Put("count", f.count);
  out.TextOrNull("time", TimeOf(f.first));
  out.Put("time_s", SecondsSince(result.capture.origin, f.first));
  out.Put("last_time_s", SecondsSince(result.capture.origin, f.last.number == 0 ? f.first : f.last));
  out.Values("related_frames", f.related_frames);
  out.TextOrNull("caused_by", caused ? FindingId(result, f.caused_by) : std::string());
  out.TextOrNull("holds", f.holds);
  if (f.aside) out.Put("aside", true);
  out.Put("confidence", f.confidence == Confidence::kObserved ? "observed" : "inferred");
  out.Object("arguments", [&](JsonObject& json) { PutArguments(json, f.arguments); });
  if (!f.notes.empty()) out.List("notes", f.notes, &PutNote);
  if (!f.mapping.empty()) PutMapping(out, f);
  out.Object("evidence", [&](JsonObject& json) { PutArgumentsAsEvidence(json, f); });
  out.Object("reference", [&](JsonObject& json) {
    json.TextOrNull("document", f.reference.document);
    json.TextOrNull("section", f.reference.section);
  });
  out.TextOrNull("wireshark_filter", WiresharkFilter(f));
  out.Put("known", capture.IsKnown(index));
  if (!capture.WhyKnown(index).empty()) out.Text("known_because", capture.WhyKnown(index));
  if (index < capture.decode_lines.size() && capture.decode_lines[index] > 0) {
    out.Put("decode_line", capture.decode_lines[index]);
  }
}

void PutNotEvaluable(JsonObject& out, const AnalysisResult& result, const NotEvaluable& entry) {
  const SlaveSummary* slave = result.slave(entry.slave);
  out.Put("rule", entry.rule);
  out.Put("slave", slave == nullptr ? JsonScalar(nullptr) : slave->position);
  out.Put("scope", slave != nullptr ? "slave" : entry.slave == kEverySlave ? "all-slaves" : "bus");
  out.Text("reason", TextOf(entry));
  out.Put("code", Name(entry.reason.code));
  out.TextOrNull("what", entry.reason.what == nullptr ? std::string_view() : entry.reason.what->code);
  out.Frame("first_frame", entry.first_frame);
  out.Put("occasions", entry.occasions);
}

void PutCount(JsonObject& out, const CoverageCount& count) {
  out.Put("judged", count.judged);
  out.Put("partly", count.partly);
  out.Put("not_judged", count.not_judged);
  out.Put("not_applicable", count.not_applicable);
}

void PutRuleCoverage(JsonObject& out, const AnalysisResult& result, const RuleCoverage& rule) {
  const CoverageCount count = CountOf(rule);
  out.Put("rule", rule.rule);
  PutCount(out, count);
  out.TextOrNull("not_applicable_because", WhyNotApplicable(rule));
  // The rest shows it for each slave already where all are alike.
  const std::uint64_t all = rule.slaves.size();
  const bool alike =
      count.judged == all || count.partly == all || count.not_judged == all || count.not_applicable == all;
  if (alike) return out.Put("slaves", nullptr);
  out.Object("slaves", [&](JsonObject& json) {
    for (const Coverage coverage :
         {Coverage::kJudged, Coverage::kPartly, Coverage::kNotJudged, Coverage::kNotApplicable}) {
      json.Array(Name(coverage), [&](JsonArray& positions) {
        // Slaves that --slave left out have no entry; the others stand in the same order.
        auto slave = result.slaves.begin();
        for (const SlaveCoverage& entry : rule.slaves) {
          while (slave != result.slaves.end() && slave->id != entry.slave) ++slave;
          if (slave == result.slaves.end()) break;
          if (entry.coverage == coverage) positions.Add(slave->position);
        }
      });
    }
  });
}

void PutCoverage(JsonObject& out, const AnalysisResult& result) {
  PutCount(out, CountOf(result.coverage));
  out.List("by_chapter", ByChapter(result.coverage), [](JsonObject& json, const ChapterCoverage& chapter) {
    json.Put("chapter", chapter.chapter);
    PutCount(json, chapter.count);
  });
  out.List("rules", result.coverage,
           [&](JsonObject& json, const RuleCoverage& rule) { PutRuleCoverage(json, result, rule); });
}

/// What was required of the capture; null where nothing was.
void PutRequired(JsonObject& out, const CaptureReport& capture) {
  if (capture.required.empty()) return out.Put("required", nullptr);
  out.Object("required", [&](JsonObject& json) {
    json.Text("asked", capture.required);
    json.Put("met", capture.unmet.empty());
    json.Texts("missing", capture.unmet);
  });
}

void PutCaptureReport(JsonObject& out, const CaptureReport& capture) {
  const AnalysisResult& result = capture.result;
  const AlikeSteps alike(result.slaves);
  out.Object("capture", [&](JsonObject& json) { PutCapture(json, result.capture); });
  out.Object("settings", [&](JsonObject& json) { PutSettings(json, capture); });
  out.Object("bus", [&](JsonObject& json) { PutBus(json, result); });
  PutAlikeSteps(out, "alike_steps", alike);
  out.List("slaves", result.slaves,
           [&](JsonObject& json, const SlaveSummary& slave) { PutSlave(json, result, slave, alike); });
  out.Array("findings", [&](JsonArray& findings) {
    for (std::size_t i = 0; i < result.findings.size(); ++i) {
      findings.AddObject([&](JsonObject& json) { PutFinding(json, capture, i); });
    }
  });
  out.List("not_evaluable", result.not_evaluable,
           [&](JsonObject& json, const NotEvaluable& entry) { PutNotEvaluable(json, result, entry); });
  out.List("limits_reached", result.limits, [](JsonObject& json, const ReachedLimit& reached) {
    json.Text("what", reached.what);
    json.Put("limit", reached.limit);
    json.Put("left_out", reached.left_out);
  });
  out.Object("coverage", [&](JsonObject& json) { PutCoverage(json, result); });
  out.List("capture_next", result.capture_next, [](JsonObject& json, const CaptureAdvice& advice) {
    json.Text("what", advice.text);
    json.Put("judgements", advice.judgements);
  });
  PutRequired(out, capture);
  out.Object("summary", [&](JsonObject& json) {
    PutSummary(json, Summarise(capture));
    json.TextOrNull("limited_because", capture.judged ? WhyLimited(result) : std::string());
    json.Texts("reservations", capture.judged ? TextsOf(Reservations(result)) : std::vector<std::string>());
  });
}

}  // namespace

void PutReport(JsonObject& out, const Report& report) {
  out.Put("schema", "ecaudit.report/1");
  PutTool(out, report.version);
  if (!report.origin.settings.empty()) {
    out.Object("made_from", [&](JsonObject& json) {
      json.Put("settings", report.origin.settings);
      json.Put("bytes", report.origin.bytes);
      json.Put("modified", report.origin.modified);
    });
  }
  out.List("reports", report.captures, PutCaptureReport);
  out.List("unreadable", report.unreadable, [](JsonObject& json, const UnreadableCapture& capture) {
    json.Text("path", capture.path);
    json.Text("message", capture.message);
  });
  out.Object("summary", [&](JsonObject& json) {
    json.Put("captures", report.captures.size());
    PutSummary(json, Summarise(report));
  });
}

std::string WriteJson(const Report& report) {
  return JsonDocumentText([&](JsonObject& out) { PutReport(out, report); });
}

void WriteJson(const Report& report, const TextSink& sink) {
  WriteJsonDocument(sink, [&](JsonObject& out) { PutReport(out, report); });
}

}  // namespace ecaudit::report
