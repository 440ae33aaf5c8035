#include <nlohmann/json.hpp>

#include "cli/report/json_parts.h"
#include "cli/report/summary_tally.h"
#include "cli/report/summary_writer.h"

namespace ecaudit::report {
namespace {

Json FindingJson(const CaptureDigest& capture, const FindingDigest& f) {
  return {{"rule", f.rule},
          {"severity", Name(f.severity)},
          {"title", f.title},
          {"slave", OrNull(f.slave)},
          {"station_address", OrNull(f.station_address)},
          {"frame", FrameOrNull(f.frame)},
          {"count", f.count},
          {"known", f.known},
          {"fails", Counts(capture, f)}};
}

Json CaptureJson(const CaptureDigest& capture) {
  const std::string headline = Headline(capture);
  const Summary summary = Summarise(capture);
  const bool read = capture.unreadable.empty();
  Json json;
  json["path"] = capture.path;
  json["report"] = TextOrNull(capture.report);
  json["status"] = Name(StatusOf(capture));
  json["headline"] = headline.substr(headline.find(' ') + 1);
  json["error"] = TextOrNull(capture.unreadable);
  json["packets"] = read ? Json(capture.packets) : Json(nullptr);
  json["ethercat_frames"] = read ? Json(capture.ethercat_frames) : Json(nullptr);
  json["slaves"] = read ? Json(capture.slaves) : Json(nullptr);
  json["first_time"] = TextOrNull(capture.first_time);
  json["duration_s"] = OrNull(capture.duration_s);
  json["complete"] = read && capture.complete;
  json["fail_on"] = read ? Json(Name(capture.fail_on)) : Json(nullptr);
  json["errors"] = summary.errors;
  json["warnings"] = summary.warnings;
  json["infos"] = summary.infos;
  json["known"] = summary.known;
  json["findings"] = Json::array();
  for (const FindingDigest& f : capture.findings) json["findings"].push_back(FindingJson(capture, f));
  return json;
}

}  // namespace

std::string WriteSummaryJson(const Digest& digest) {
  const Tally tally = TallyOf(digest);
  Json json;
  json["schema"] = "ecaudit.summary/1";
  json["tool"] = {{"name", "ecaudit"}, {"version", digest.version}};
  json["summary"] = {{"captures", digest.captures.size()},
                     {"passed", tally.passed},
                     {"failed", tally.failed},
                     {"unreadable", tally.unreadable},
                     {"nothing_to_check", tally.nothing_to_check},
                     {"not_reached", digest.not_reached},
                     {"errors", tally.findings.errors},
                     {"warnings", tally.findings.warnings},
                     {"infos", tally.findings.infos},
                     {"known", tally.findings.known},
                     {"verdict", tally.Verdict(digest)}};
  json["rules"] = Json::array();
  for (const RuleTally& rule : tally.rules) {
    json["rules"].push_back({{"rule", rule.rule},
                             {"severity", Name(rule.severity)},
                             {"captures", rule.captures},
                             {"findings", rule.findings}});
  }
  json["captures"] = Json::array();
  for (const CaptureDigest& capture : digest.captures) json["captures"].push_back(CaptureJson(capture));
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace ecaudit::report
