#include "cli/report/json_text.h"
#include "cli/report/summary_tally.h"
#include "cli/report/summary_writer.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::report {
namespace {

void PutFindingDigest(JsonObject& out, const CaptureDigest& capture, const FindingDigest& f) {
  out.Put("rule", f.rule);
  out.Put("severity", Name(f.severity));
  out.Put("title", f.title);
  out.Put("slave", f.slave);
  out.Put("station_address", f.station_address);
  out.Frame("frame", f.frame);
  out.Put("count", f.count);
  out.Put("known", f.known);
  out.Put("fails", Counts(capture, f));
}

void PutCaptureDigest(JsonObject& out, const CaptureDigest& capture) {
  const std::string headline = Headline(capture);
  const Summary summary = Summarise(capture);
  const bool read = capture.unreadable.empty();
  out.Put("path", capture.path);
  out.TextOrNull("report", capture.report);
  out.TextOrNull("page", capture.page);
  out.Put("status", Name(StatusOf(capture)));
  out.Put("headline", headline.substr(WrappingSum(headline.find(' '), std::size_t{1})));
  out.TextOrNull("error", capture.unreadable);
  out.Values("reservations", read && capture.judged ? TextsOf(Reservations(capture)) : std::vector<std::string>());
  out.Put("packets", OnlyIf(read, capture.packets));
  out.Put("ethercat_frames", OnlyIf(read, capture.ethercat_frames));
  out.Put("slaves", OnlyIf(read, capture.slaves));
  out.TextOrNull("first_time", capture.first_time);
  out.Put("duration_s", capture.duration_s);
  out.Put("complete", read && capture.complete);
  out.Put("fail_on", OnlyIf(read, Name(capture.fail_on)));
  out.TextOrNull("config", capture.config);
  out.Put("errors", summary.errors);
  out.Put("warnings", summary.warnings);
  out.Put("infos", summary.infos);
  out.Put("known", summary.known);
  out.List("findings", capture.findings,
           [&](JsonObject& json, const FindingDigest& f) { PutFindingDigest(json, capture, f); });
}

void PutTally(JsonObject& out, const Digest& digest, const Tally& tally) {
  out.Put("captures", digest.captures.size());
  out.Put("passed", tally.passed);
  out.Put("failed", tally.failed);
  out.Put("unmet", tally.unmet);
  out.Put("limited", tally.limited);
  out.Put("unreadable", tally.unreadable);
  out.Put("nothing_to_check", tally.nothing_to_check);
  out.Put("not_reached", digest.not_reached);
  out.Put("errors", tally.findings.errors);
  out.Put("warnings", tally.findings.warnings);
  out.Put("infos", tally.findings.infos);
  out.Put("known", tally.findings.known);
  out.Put("verdict", tally.Verdict(digest));
}

void PutRuleTally(JsonObject& out, const RuleTally& rule) {
  out.Put("rule", rule.rule);
  out.Put("severity", Name(rule.severity));
  out.Put("captures", rule.captures);
  out.Put("findings", rule.findings);
}

void PutCause(JsonObject& out, const Digest& digest, const CauseGroup& group) {
  out.Put("rule", group.rule);
  out.Put("severity", Name(group.severity));
  out.Put("title", group.title);
  out.Put("captures", group.captures.size());
  out.TextOrNull("first_time", group.first_time);
  out.TextOrNull("last_time", group.last_time);
  out.Array("products", [&](JsonArray& products) {
    for (const std::string& product : group.products) products.Add(product);
  });
  out.Array("paths", [&](JsonArray& paths) {
    for (const std::size_t capture : group.captures) paths.Add(digest.captures[capture].path);
  });
}

}  // namespace

std::string WriteSummaryJson(const Digest& digest) {
  const Tally tally = TallyOf(digest);
  return JsonDocumentText([&](JsonObject& out) {
    out.Put("schema", "ecaudit.summary/1");
    PutTool(out, digest.version);
    out.Object("summary", [&](JsonObject& json) { PutTally(json, digest, tally); });
    out.List("causes", tally.causes, [&](JsonObject& json, const CauseGroup& group) { PutCause(json, digest, group); });
    out.List("rules", tally.rules, PutRuleTally);
    out.List("captures", digest.captures, PutCaptureDigest);
  });
}

}  // namespace ecaudit::report
