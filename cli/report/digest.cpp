#include "cli/report/digest.h"

#include <algorithm>

#include "analyzers/result/every_slave.h"
#include "cli/report/finding_order.h"
#include "cli/report/fingerprint.h"
#include "cli/report/layout.h"
#include "cli/report/sentences.h"
#include "cli/report/times.h"
#include "cli/report/wireshark_filter.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

FindingDigest DigestOf(const Finding& finding, const AnalysisResult& result) {
  FindingDigest out;
  out.rule = finding.rule;
  out.severity = finding.severity;
  const Sentences sentences = SentencesOf(finding, result);
  out.kind = finding.kind->name;
  out.identity = IdentityText(finding);
  out.title = PrintableLines(sentences.title);
  out.message = PrintableLines(MessageOf(finding, result));
  out.next = PrintableLines(sentences.next);
  out.place = "bus";
  if (const SlaveSummary* slave = result.slave(finding.slave)) {
    out.slave = slave->position;
    out.station_address = slave->station_address;
    out.product = ProductText(slave->identity.vendor_id, slave->identity.product_code);
    out.place = SlaveLabel(result.slave_names, slave->position, PrintableLines(slave->name), slave->station_address);
  }
  out.frame = finding.first.number;
  out.last_frame = finding.last.number == 0 ? finding.first.number : finding.last.number;
  out.count = finding.count;
  out.time_s = SecondsSince(result.capture.origin, finding.first);
  if (finding.first.has_time) out.time = finding.first.time;
  out.related_frames = finding.related_frames;
  out.holds = finding.holds;
  out.aside = finding.aside;
  if (finding.caused_by < result.findings.size()) out.caused_by = finding.caused_by;
  out.confidence = finding.confidence;
  out.document = PrintableLines(finding.reference.document);
  out.section = PrintableLines(finding.reference.section);
  out.wireshark_filter = WiresharkFilter(finding);
  return out;
}

std::string Joined(const std::vector<std::string>& texts, std::string_view between) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : std::string(between)) + text;
  return joined;
}

/// "SAFEOP refused with AL status code 0x001d (frame 760)"
std::string TitleAndFrame(const FindingDigest& f) {
  std::string text = OneLine(f.title);
  if (f.frame != 0) text += " (frame " + std::to_string(f.frame) + ")";
  return text;
}

/// The rules that could not be evaluated for it report this.
bool MissesPackets(const CaptureDigest& capture) {
  return std::ranges::any_of(capture.not_judged,
                             [](const NotJudged& entry) { return entry.code == Name(ReasonCode::kMissesPackets); });
}

/// ", but the capture misses packets"
std::string ReservationText(const std::vector<Reservation>& reservations) {
  return reservations.empty() ? std::string() : ", but " + Joined(TextsOf(reservations), ", and ");
}

std::string BriefReservationText(const std::vector<Reservation>& reservations) {
  if (reservations.empty()) return {};
  return ", but " + reservations.front().brief + (reservations.size() > 1 ? " and more" : "");
}

}  // namespace

std::vector<Reservation> Reservations(const CaptureDigest& capture) {
  CoverageCount count;
  for (const RuleCoverageDigest& rule : capture.coverage) count.Add(rule.count);
  return Reservations(MissesPackets(capture), !capture.limited.empty(), count);
}

void SortDevices(std::vector<std::string>& devices) {
  std::ranges::sort(devices);
  devices.erase(std::unique(devices.begin(), devices.end()), devices.end());
  if (!devices.empty() && devices.front().empty()) devices.erase(devices.begin());
}

std::string SlavesText(std::uint64_t shown, std::uint64_t there) {
  if (there <= shown) return Count(shown, "slave");
  return Count(there, "slave") + ", " + Grouped(there - shown) + " of them known by broadcasts only";
}

CaptureDigest DigestOf(const CaptureReport& capture) {
  const AnalysisResult& result = capture.result;
  CaptureDigest out;
  out.path = PrintableLines(result.capture.file.path);
  out.packets = result.capture.packets;
  out.ethercat_frames = result.capture.ethercat_frames;
  out.without_ethercat = WithoutEtherCat(result);
  out.slaves = result.slaves.size();
  out.slave_names = result.slave_names;
  // Slaves that --slave left out are known well.
  if (capture.selection.slaves.empty()) out.slaves_there = result.bus.slave_count.value_or(0);
  if (result.capture.first.has_time) out.first_time = IsoTime(result.capture.first.time);
  if (result.capture.duration_ns) out.duration_s = static_cast<double>(*result.capture.duration_ns) / 1e9;
  out.complete = result.capture.complete;
  out.judged = capture.judged;
  if (capture.judged) out.limited = PrintableLines(WhyLimited(result));
  out.required = capture.required;
  for (const std::string& missing : capture.unmet) out.unmet.push_back(PrintableLines(missing));
  out.selection = capture.selection;
  out.fail_on = capture.fail_on;
  out.config = PrintableLines(capture.config);
  out.baseline = PrintableLines(capture.baseline);
  out.rules = capture.rules;
  for (const SlaveSummary& slave : result.slaves) {
    out.devices.push_back(ProductText(slave.identity.vendor_id, slave.identity.product_code));
  }
  SortDevices(out.devices);
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    out.findings.push_back(DigestOf(result.findings[i], result));
    out.findings.back().known = capture.IsKnown(i);
    out.findings.back().known_because = PrintableLines(capture.WhyKnown(i));
    if (i < capture.decode_lines.size()) out.findings.back().line = capture.decode_lines[i];
  }
  for (const NotEvaluable& entry : result.not_evaluable) {
    const SlaveSummary* slave = result.slave(entry.slave);
    out.not_judged.push_back({std::string(entry.rule), slave == nullptr ? std::nullopt : std::optional(slave->position),
                              PrintableLines(TextOf(entry)), entry.slave == kEverySlave,
                              std::string(Name(entry.reason.code))});
  }
  for (const RuleCoverage& rule : result.coverage) {
    out.coverage.push_back({std::string(rule.rule), CountOf(rule), std::string(WhyNotApplicable(rule))});
  }
  return out;
}

Digest DigestOf(const Report& report) {
  Digest out;
  out.version = report.version;
  out.rules = report.rules;
  for (const CaptureReport& capture : report.captures) out.captures.push_back(DigestOf(capture));
  for (const UnreadableCapture& capture : report.unreadable) {
    out.captures.emplace_back();
    out.captures.back().path = PrintableLines(capture.path);
    out.captures.back().unreadable = PrintableLines(capture.message);
  }
  return out;
}

bool Counts(const CaptureDigest& capture, const FindingDigest& finding) {
  return !finding.known && Fails(finding.severity, !finding.holds.empty(), capture.fail_on);
}

std::string PlaceOf(const NotJudged& entry, const SlaveNames& names) {
  if (entry.slave) return names.Of(*entry.slave);
  return entry.every_slave ? "all slaves" : "bus";
}

Summary Summarise(const CaptureDigest& capture) {
  Summary summary;
  summary.judged = capture.judged;
  summary.limited = !capture.limited.empty();
  summary.unmet = !capture.unmet.empty();
  for (const FindingDigest& finding : capture.findings) {
    summary.Add(finding.severity, finding.known, !finding.holds.empty(), capture.fail_on);
  }
  return summary;
}

Summary Summarise(const Digest& digest) {
  Summary sum;
  for (const CaptureDigest& capture : digest.captures) sum.Add(Summarise(capture));
  return sum;
}

std::string SlaveLabel(const SlaveNames& names, SlavePos position, std::string_view name,
                       const std::optional<StationAddress>& station_address) {
  std::string inside = OneLine(name);
  if (station_address) inside += (inside.empty() ? "" : ", ") + Hex(*station_address);
  return names.Of(position, inside);
}

std::optional<MainFinding> MainFindingOf(const CaptureDigest& capture) {
  const std::vector<OrderedFinding> order = OrderForReading(capture);
  if (order.empty()) return std::nullopt;
  // Of the trees with the worst severity the first that holds something the master wanted, else the first. An error
  // aside stands before warnings that hold nothing, no other.
  std::optional<MainFinding> best;
  std::pair<Severity, bool> best_rank;
  for (std::size_t i = 0; i < order.size();) {
    MainFinding tree{order[i].index, order[i].index};
    bool holds = false, aside = true;
    do {
      const FindingDigest& f = capture.findings[order[i].index];
      if (f.severity > capture.findings[tree.worst].severity) tree.worst = order[i].index;
      holds = holds || !f.holds.empty();
      aside = aside && f.aside;
      ++i;
    } while (i < order.size() && order[i].depth > 0);
    const Severity worst = capture.findings[tree.worst].severity;
    const std::pair rank{aside ? std::min(worst, Severity::kWarning) : worst, holds};
    if (best && rank <= best_rank) continue;
    best = tree;
    best_rank = rank;
  }
  return best;
}

std::string ProductText(std::optional<std::uint32_t> vendor, std::optional<std::uint32_t> product) {
  return vendor && product ? "vendor " + Hex(*vendor, 8) + ", product " + Hex(*product, 8) : std::string();
}

HeadlineParts HeadlinePartsOf(const CaptureDigest& capture) {
  if (!capture.unreadable.empty()) return {"ERROR", OneLine(capture.unreadable)};
  const Summary summary = Summarise(capture);
  const bool window = capture.selection.range() && capture.selection.isolated_by.empty();
  const std::string outside = summary.fail ? std::string() : OutsideText(capture.selection);
  // With a window the counts stand nearer to the verdict.
  const std::string selected = outside.empty() ? LimitsText(capture.selection) : Text(capture.selection);
  std::string limits = selected.empty() ? "" : " (limited by " + OneLine(selected) + ")";
  if (!capture.unmet.empty()) limits = "; required and missing: " + OneLine(Joined(capture.unmet, "; ")) + limits;
  if (capture.without_ethercat) {
    const std::string packets = capture.packets == 0 ? std::string("the capture holds no packet")
                                                     : "no EtherCAT frame among " + Count(capture.packets, "packet");
    return {summary.fail ? "FAIL" : summary.unmet ? "UNMET" : "NOTHING-TO-CHECK", packets + limits};
  }
  if (!capture.judged) return {"NOT-JUDGED", "the start-up is shown; ecaudit check evaluates the capture" + limits};
  const std::vector<Reservation> reservations = summary.fail ? std::vector<Reservation>() : Reservations(capture);
  std::string reservation = ReservationText(reservations);
  std::string brief = BriefReservationText(reservations);
  const std::string verdict = summary.fail ? "FAIL" : summary.unmet ? "UNMET" : summary.limited ? "LIMITED" : "PASS";
  if (summary.limited && !summary.fail && capture.slaves > 0) limits = "; not evaluated: " + capture.limited + limits;
  const std::optional<MainFinding> main = MainFindingOf(capture);
  if (!outside.empty()) {
    // A range that passes is not a capture that does.
    const std::string note = std::string(main ? " (outside the range: " : " (outside it: ") + outside + ")";
    reservation = note + reservation;
    brief = note + brief;
  }
  if (!main) {
    const std::string none = std::string("no ") + (summary.known > 0 ? "new " : "") + "findings in " +
                             (window ? std::string("the range") : Count(capture.ethercat_frames, "EtherCAT frame"));
    const std::string slaves = capture.slaves == 0 ? "; no slave is known"
                               : window            ? ""
                                                   : " of " + SlavesText(capture.slaves, capture.slaves_there);
    const std::string reach = capture.complete ? "" : ", as far as the capture was read";
    return {verdict, none + slaves + reach + reservation + limits, reservation, brief};
  }
  const FindingDigest& root = capture.findings[main->root];
  const FindingDigest& worst = capture.findings[main->worst];
  std::string line;
  if (!summary.fail) line += std::string(Name(worst.severity)) + ": ";
  line += root.place + ": " + TitleAndFrame(root);
  if (&worst != &root) line += "; consequence: " + TitleAndFrame(worst);
  if (summary.limited && !summary.fail && capture.slaves == 0) line += "; " + capture.limited;
  return {verdict, line + reservation + limits, reservation, brief};
}

std::string WithName(const CaptureDigest& capture, const std::string& sentence) {
  const std::string path = OneLine(capture.path);
  // Why a capture cannot be read begins with its name.
  return !capture.unreadable.empty() && sentence.starts_with(path) ? sentence : path + ": " + sentence;
}

std::string Headline(const CaptureDigest& capture) {
  const HeadlineParts parts = HeadlinePartsOf(capture);
  return parts.verdict + " " + WithName(capture, parts.sentence);
}

}  // namespace ecaudit::report
