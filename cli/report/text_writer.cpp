#include "cli/report/text_writer.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "cli/report/coverage_tally.h"
#include "cli/report/digest.h"
#include "cli/report/finding_id.h"
#include "cli/report/finding_order.h"
#include "cli/report/layout.h"
#include "cli/report/mapping_text.h"
#include "cli/report/notation.h"
#include "cli/report/progress_text.h"
#include "cli/report/sentences.h"
#include "cli/report/times.h"
#include "cli/report/topology_text.h"
#include "cli/report/verdict_line.h"
#include "cli/report/wireshark_filter.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

/// A story longer than this shows its beginning and its end.
constexpr std::size_t kStoryHead = 6;
constexpr std::size_t kStoryTail = 10;
/// Entries of the process data of one direction that are named.
constexpr std::size_t kObjectsShown = 12;
/// Findings shown in full; the others get two lines each.
constexpr std::size_t kFindingsInFull = 25;
/// Evidence up to this many columns stays on one line.
constexpr std::size_t kKeptTogether = 50;
/// Reasons shown under "Not evaluated".
constexpr std::size_t kReasonsShown = 15;
/// Ways to know more that are shown.
constexpr std::size_t kAdviceShown = 3;
/// Rules that one of them names.
constexpr std::size_t kRulesNamed = 16;

/// "0x00414b44", or "?" when unknown.
std::string HexOr(const std::optional<std::uint32_t>& value) {
  return value ? Hex(*value, 8) : "?";
}

std::string SecondsText(double seconds) {
  return Fixed(seconds, 6) + " s";
}

std::string StepText(const AlStep& step) {
  if (step.kind == AlStep::Kind::kRequest) {
    const esc::AlWord control{step.to};
    std::string text = esc::StateName(control.state()) + " requested";
    if (step.refused_by_wkc) text += " (not taken)";
    return text;
  }
  if (step.echo) return esc::StateName(esc::AlWord{step.to}.state()) + " (acknowledge echoed)";
  std::string text = esc::StatusText(step.to);
  if (step.status_code && *step.status_code != 0) text += " code " + Hex(*step.status_code);
  return text;
}

/// Between two steps of a story; a line may end after it.
const std::string kArrow = std::string(1, kHardSpace) + "-> ";

std::string Counts(const Summary& s) {
  std::string text = Count(s.errors, "error") + ", " + Count(s.warnings, "warning") + ", " + Count(s.infos, "info");
  if (s.known > 0) text += ", " + Grouped(s.known) + " known from the baseline";
  return text;
}

/// The text of one capture's report.
class CaptureText {
 public:
  CaptureText(const CaptureReport& capture, const TextStyle& style)
      : capture_(capture), result_(capture.result), style_(style), text_(style) {}

  std::string Write() {
    FirstLines();
    if (style_.quiet) return text_.Take();
    if (!WithoutEtherCat(result_)) {
      Findings();
      KnownFindings();
      Slaves();
      Bus();
      NotJudged();
    }
    CaptureFacts();
    return text_.Take();
  }

  std::string WriteVerdictOnly() {
    FirstLines();
    if (style_.quiet) return text_.Take();
    if (!WithoutEtherCat(result_)) {
      Findings();
      KnownFindings();
      NotJudged();
    }
    return text_.Take();
  }

 private:
  void Heading(std::string_view heading) {
    text_.Line();
    text_.Line(text_.Styled(heading, Style::kBold));
  }

  /// The verdict; what was found in how much; what it does not rest on; how much was evaluated.
  void FirstLines() {
    const CaptureDigest digest = DigestOf(capture_);
    const VerdictLine verdict = VerdictLineOf(digest, style_, style_.quiet);
    text_.Line(text_.Styled(verdict.word, verdict.style) + verdict.rest);
    if (style_.quiet || WithoutEtherCat(result_)) return;
    std::string counts = Counts(Summarise(capture_));
    if (!result_.slaves.empty()) counts += "; " + SlavesText(digest.slaves, digest.slaves_there);
    const CaptureSummary& c = result_.capture;
    if (c.duration_ns && c.first.has_time) {
      const bool local = style_.time == TimeMode::kLocal;
      counts += "; " + Fixed(static_cast<double>(*c.duration_ns) / 1e9, 3) + " s from " +
                DateText(c.first.time, local) + " " + ClockText(c.first.time, local, 0) + " " +
                ZoneText(c.first.time, local);
    }
    text_.Paragraph(counts, 0);
    for (const std::string& note : VerdictNotes(digest)) {
      if (verdict.rest.find(note) == std::string::npos) text_.Paragraph(note, 0, 2);
    }
    if (const std::string evaluated = EvaluatedText(); !evaluated.empty()) text_.Paragraph(evaluated, 0, 2);
    WriteProgress(result_, text_);
  }

  /// "evaluated: 204 of 216 checks that concern this bus, ...". A check is a rule for one slave.
  [[nodiscard]] std::string EvaluatedText() const {
    const std::string text = CoverageSentence(result_);
    return text.empty() ? text : "evaluated: " + text;
  }

  // --- slaves ---------------------------------------------------------------------------------------------------

  void Slaves() {
    if (result_.slaves.empty()) return;
    Heading("Slaves");
    for (std::size_t i = 0; i < result_.slaves.size();) {
      std::size_t end = i + 1;
      while (end < result_.slaves.size() && AlikeAndQuiet(result_.slaves[i], result_.slaves[end])) ++end;
      // Two alike slaves are quickly read; more are one story reported many times.
      if (end - i < 3) end = i + 1;
      Slave(result_.slaves[i]);
      if (end - i > 1) {
        text_.Paragraph(result_.slave_names.Span(result_.slaves[i + 1].position, result_.slaves[end - 1].position) +
                            ": the same device, profile and steps, no findings of their own",
                        2, 5);
      }
      i = end;
    }
  }

  [[nodiscard]] bool HasFinding(SlaveId id) const {
    return std::ranges::any_of(result_.findings, [id](const Finding& f) { return f.slave == id; });
  }

  /// Same device and the same sequence of states, and nothing to report about either.
  [[nodiscard]] bool AlikeAndQuiet(const SlaveSummary& a, const SlaveSummary& b) const {
    const auto same_step = [](const AlStep& x, const AlStep& y) {
      return x.kind == y.kind && x.to == y.to && x.status_code == y.status_code;
    };
    return a.profile == b.profile && a.name == b.name && a.identity.vendor_id == b.identity.vendor_id &&
           a.identity.product_code == b.identity.product_code && a.identity.revision == b.identity.revision &&
           a.al_history_left_out == b.al_history_left_out &&
           std::ranges::equal(a.al_history, b.al_history, same_step) && !HasFinding(a.id) && !HasFinding(b.id);
  }

  void Slave(const SlaveSummary& s) {
    const Identity& id = s.identity;
    std::string head = SlaveLabel(result_, s.id);
    if (s.position_inferred) head += ", position inferred from the station address";
    if (id.vendor_id || id.product_code) {
      head += ": vendor " + HexOr(id.vendor_id) + ", product " + HexOr(id.product_code) + ", revision " +
              HexOr(id.revision);
      if (id.serial && *id.serial != 0) head += ", serial " + std::to_string(*id.serial);
    } else {
      head += ": identity not in the capture";
    }
    text_.Paragraph(head, 2, 5);
    if (!s.profile.empty()) {
      std::string profile = Printable(s.profile);
      if (!s.profile_source.empty()) profile += " (" + OneLine(s.profile_source) + ")";
      text_.Field("profile", profile, 5);
    }
    text_.Field("AL states", Story(s), 5);
    if (s.dc) {
      if (const std::string clocks = DcText(*s.dc); !clocks.empty()) text_.Field("clocks", clocks, 5);
    }
    if (s.drive) text_.Field(AxisLabel(*s.drive), DriveText(*s.drive), 5);
    for (const DriveSummary& axis : s.further_axes) text_.Field(AxisLabel(axis), DriveText(axis), 5);
    ProcessData("outputs", s.rx_pdo, 2, s);
    ProcessData("inputs", s.tx_pdo, 3, s);
    if (s.mailbox.requests > 0 || s.mailbox.responses > 0) text_.Field("mailbox", MailboxLine(s.mailbox), 5);
    if (s.latch) Latch("latch", *s.latch);
    if (s.touch_probe) Latch("probe", *s.touch_probe);
  }

  /// "17 bytes in 1600h, 1601h: 6040h:0 Control word, ...", as far as it is known. What was never used is not
  /// mentioned.
  void ProcessData(std::string_view label, const PdoSummary& pdo, std::uint8_t sync_manager, const SlaveSummary& s) {
    const auto manager = std::ranges::find(s.sync_managers, sync_manager, &SyncManagerSummary::number);
    if (!pdo.bytes) {
      if (manager == s.sync_managers.end() || !manager->enabled || manager->mailbox) return;
      text_.Field(label, Count(manager->length, "byte") + ", contents not known: " + OneLine(pdo.reason), 5);
      return;
    }
    if (*pdo.bytes == 0) return;
    std::string text = Count(*pdo.bytes, "byte") + " in ";
    for (std::size_t i = 0; i < pdo.pdos.size(); ++i) text += (i == 0 ? "" : ", ") + ObjectName(pdo.pdos[i]);
    if (pdo.source == PdoSummary::Source::kDefault) text += " (default by EEPROM or ESI)";
    if (pdo.source == PdoSummary::Source::kEni) text += " (by the ENI file)";
    text += ": ";
    std::size_t shown = 0;
    for (const MappedObject& object : pdo.objects) {
      if (object.index == 0) continue;
      if (shown == kObjectsShown) {
        text += ", [" + std::to_string(pdo.objects.size() - shown) + " more]";
        break;
      }
      std::string name = ObjectName(object.index, object.subindex);
      if (!object.name.empty()) name += " " + OneLine(object.name);
      std::ranges::replace(name, ' ', kHardSpace);
      text += (shown == 0 ? "" : ", ") + name;
      ++shown;
    }
    if (pdo.exchanged > 0) {
      text += "; exchanged in " + Count(pdo.exchanged, "datagram") + ", frames " + std::to_string(pdo.first) + " to " +
              std::to_string(pdo.last);
    }
    text_.Field(label, text, 5);
  }

  [[nodiscard]] static std::string AxisLabel(const DriveSummary& drive) {
    return drive.axis == 0 ? "drive" : "axis " + std::to_string(drive.axis + 1);
  }

  /// "Operation enabled (status word 0x0237); switched on at frame 778, operation enabled 7.0 ms later; 1 fault"
  [[nodiscard]] static std::string DriveText(const DriveSummary& drive) {
    std::string text = drive.state.empty() ? "state unknown" : drive.state;
    if (drive.status_word) text += " (status word " + Hex(*drive.status_word) + ")";
    if (drive.mode_requested || drive.mode_shown) {
      const bool shown = drive.mode_shown.has_value();
      const std::string& name = shown ? drive.mode_shown_name : drive.mode_requested_name;
      text += ", mode " + std::to_string(shown ? *drive.mode_shown : *drive.mode_requested);
      if (!name.empty()) text += " " + OneLine(name);
      if (!shown) text += " requested";
    }
    if (!drive.enabled.empty()) text += "; " + drive.enabled.front();
    if (drive.enabled.size() > 1) text += ", enabled " + Count(drive.enabled.size(), "time") + " in all";
    if (drive.faults > 0) text += "; " + Count(drive.faults, "fault");
    return text;
  }

  /// ", within 1000 ns from #812 on, 412.3 ms after #45"; empty if no read was above.
  [[nodiscard]] static std::string SettledText(const DcSummary& dc) {
    if (!dc.difference_above.seen()) return {};
    const std::string limit = std::to_string(kClockSettledNs) + " ns";
    if (!dc.settled.seen()) return ", still above " + limit + " in the last read";
    std::string text = ", within " + limit + " from #" + std::to_string(dc.settled.number) + " on";
    if (dc.settled.has_time && dc.difference_above.has_time) {
      text += ", " + Duration(Elapsed(dc.difference_above.time, dc.settled.time)) + " after #" +
              std::to_string(dc.difference_above.number);
    }
    return text;
  }

  /// "3 of 3 clocks within 1000 ns, the last from #812 (0.412300 s) on: slave 2"; empty if none was above.
  [[nodiscard]] std::string ClockFacts() const {
    const BusDcSummary& dc = result_.bus.dc;
    const std::uint64_t all = dc.settled_clocks + dc.unsettled_clocks;
    if (all == 0) return {};
    const std::string limit = std::to_string(kClockSettledNs) + " ns";
    std::string text = Grouped(dc.settled_clocks) + " of " + Count(all, "clock") + " above " + limit + " settled";
    const SlaveSummary* last = result_.slave(dc.settled_last);
    if (last == nullptr) return text;
    text += "; the last is " + result_.slave_names.Of(last->position) + ", within " + limit + " from #" +
            std::to_string(dc.settled.number);
    if (const auto seconds = SecondsSince(result_.capture.origin, dc.settled))
      text += " (" + SecondsText(*seconds) + ")";
    return text + " on";
  }

  /// "delay 300 ns, offset 29229 ns; SYNC0 every 1 ms since #2528, frames 491.0 to 960.7 us after it"
  [[nodiscard]] static std::string DcText(const DcSummary& dc) {
    std::vector<std::string> parts;
    if (dc.reference) parts.emplace_back("reference clock");
    if (dc.delay_ns) parts.push_back("delay " + std::to_string(*dc.delay_ns) + " ns");
    // Alone it shows nothing: it is the difference of two clocks since they were switched on.
    const bool in_use = dc.reference || dc.delay_ns || dc.difference_reads > 0 || dc.activated.seen();
    if (dc.offset_ns && in_use) parts.push_back("offset " + std::to_string(*dc.offset_ns) + " ns");
    if (dc.difference_reads > 0) {
      parts.push_back("difference " + std::to_string(dc.difference_last_ns) + " ns (at most " +
                      std::to_string(dc.difference_max_ns) + ")" + SettledText(dc));
    }
    if (dc.activated.seen() && dc.sync0_cycle_ns) {
      // That is a single pulse, or SYNC1 alone.
      std::string sync = *dc.sync0_cycle_ns == 0 ? "SYNC0 with cycle 0" : "SYNC0 every " + Duration(*dc.sync0_cycle_ns);
      sync += " from #" + std::to_string(dc.activated.number);
      if (dc.activation && (*dc.activation & 1U) == 0) sync += ", off at the end";
      parts.push_back(std::move(sync));
    }
    if (dc.phase) {
      const SyncPhase& p = *dc.phase;
      std::string phase = "in OP frames " + Fixed(p.min_us, 1) + " to " + Fixed(p.max_us, 1) +
                          " us after SYNC0 (mean " + Fixed(p.mean_us, 1) + ", nearest " + Fixed(p.margin_us, 1) +
                          " us in #" + std::to_string(p.margin_frame.number) + ")";
      if (p.empty_intervals + p.double_intervals > 0) {
        phase += ", " + Count(p.empty_intervals, "interval") + " without and " + Grouped(p.double_intervals) +
                 " with two frames";
      }
      parts.push_back(std::move(phase));
    }
    if (dc.pll && dc.pll->reads > 0) {
      parts.push_back("PLL measured " + std::to_string(dc.pll->actual_last) + " at last, " + Grouped(dc.pll->outside) +
                      " of " + Count(dc.pll->reads, "reading") + " outside its window");
    }
    std::string text;
    for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + part;
    return text;
  }

  /// "3 captures of external latch 1 rising (3 valid, 3 read), ...", where the latches were used.
  void Latch(std::string_view label, const LatchSummary& latch) {
    std::string text;
    for (const LatchEdgeSummary& edge : latch.edges) {
      if (edge.armed == 0 && edge.valid == 0) continue;
      text += (text.empty() ? "" : "; ") + OneLine(edge.name) + " armed " + Count(edge.armed, "time") + ", valid " +
              Grouped(edge.valid) + ", read " + Grouped(edge.read);
      if (edge.lost > 0) text += ", lost " + Grouped(edge.lost);
    }
    if (text.empty() && latch.misuses == 0) return;
    if (text.empty()) text = "never armed";
    if (latch.control_by_sdo) text += " (control word by SDO)";
    if (latch.misuses > 0) text += "; " + Count(latch.misuses, "misuse") + ", see the findings";
    text_.Field(label, text, 5);
  }

  /// "52 requests, 52 responses (CoE); 40 uploads, 11 downloads, 2 aborted"
  [[nodiscard]] static std::string MailboxLine(const MailboxSummary& m) {
    std::string text = Count(m.requests, "request") + ", " + Count(m.responses, "response");
    std::string protocols;
    for (const MailboxSummary::Messages& p : m.by_protocol) {
      if (p.protocol != "error") protocols += (protocols.empty() ? "" : ", ") + p.protocol;
    }
    if (!protocols.empty()) text += " (" + protocols + ")";
    std::string rest;
    const auto add = [&rest](std::uint64_t n, const std::string& what) {
      if (n > 0) rest += (rest.empty() ? "; " : ", ") + what;
    };
    add(m.sdo_uploads, Count(m.sdo_uploads, "upload"));
    add(m.sdo_downloads, Count(m.sdo_downloads, "download"));
    add(m.aborts, std::to_string(m.aborts) + " aborted");
    add(m.emergencies,
        m.emergencies == 1 ? std::string("1 emergency") : std::to_string(m.emergencies) + " emergencies");
    add(m.error_replies,
        m.error_replies == 1 ? std::string("1 mailbox error") : std::to_string(m.error_replies) + " mailbox errors");
    add(m.unanswered, std::to_string(m.unanswered) + " unanswered");
    return text + rest;
  }

  /// A step of the AL history, or the same request several times.
  struct ShownStep {
    const AlStep* step = nullptr;
    const AlStep* last = nullptr;
    std::size_t times = 1;
  };

  /// "#400 at 0.399 s"; empty if the frame is not known.
  [[nodiscard]] std::string Place(const FrameRef& frame) const {
    if (!frame.seen()) return {};
    const std::string moment = Moment(frame, 3);
    return " #" + std::to_string(frame.number) + (moment.empty() ? "" : " at " + moment);
  }

  /// "PREOP #400 at 0.399 s", "PREOP requested 70 times #5 at 0.002 s to #281 at 0.140 s", not broken over lines.
  [[nodiscard]] std::string StoryStep(const ShownStep& shown) const {
    std::string text = StepText(*shown.step);
    if (shown.times > 1) text += " " + std::to_string(shown.times) + " times";
    text += Place(shown.step->frame);
    if (shown.times > 1 && shown.last->frame.seen()) text += " to" + Place(shown.last->frame);
    std::ranges::replace(text, ' ', kHardSpace);
    return text;
  }

  static bool SameRequest(const AlStep& a, const AlStep& b) {
    return a.kind == AlStep::Kind::kRequest && b.kind == AlStep::Kind::kRequest && a.to == b.to &&
           a.refused_by_wkc == b.refused_by_wkc;
  }

  /// What to show of `history`: a request that is followed by the requested state needs no line.
  [[nodiscard]] static std::vector<ShownStep> NotableSteps(const std::vector<AlStep>& history) {
    std::vector<ShownStep> steps;
    for (std::size_t i = 0; i < history.size();) {
      std::size_t end = i + 1;
      while (end < history.size() && SameRequest(history[i], history[end])) ++end;
      const bool request = history[i].kind == AlStep::Kind::kRequest;
      const bool followed = request && end == i + 1 && end < history.size() &&
                            history[end].kind == AlStep::Kind::kState &&
                            history[end].to == esc::AlWord{history[i].to}.state();
      if (!followed) steps.push_back({&history[i], &history[end - 1], end - i});
      i = end;
    }
    return steps;
  }

  [[nodiscard]] std::string Story(const SlaveSummary& s) const {
    if (s.al_history.empty()) {
      return s.al_status ? esc::StatusText(*s.al_status) + " throughout" : "never read in this capture";
    }
    const std::vector<ShownStep> steps = NotableSteps(s.al_history);
    const std::size_t n = steps.size();
    const bool shortened = n > kStoryHead + kStoryTail + 1;
    std::string text;
    for (std::size_t i = 0; i < n; ++i) {
      if (i > 0) text += kArrow;
      if (shortened && i == kStoryHead) {
        text += "[" + Count(n - kStoryHead - kStoryTail, "more step") + "]" + kArrow;
        i = n - kStoryTail;
      }
      text += StoryStep(steps[i]);
    }
    if (s.al_history_left_out > 0) text += kArrow + "[" + Count(s.al_history_left_out, "later step") + " not kept]";
    return text;
  }

  // --- topology -------------------------------------------------------------------------------------------------

  void Bus() {
    if (!result_.bus.topology.known()) return;
    Heading(result_.slave_names.from_one ? "Topology (numbers from 1 as they are plugged in, by DL status)"
                                         : "Topology (positions as they are plugged in, by DL status)");
    for (const std::string& chain : TopologyChains(result_.bus.topology, result_.slave_names))
      text_.Paragraph(chain, 2, 6);
    for (const std::string& note : TopologyNotes(result_, style_)) text_.Paragraph(note, 2, 6);
  }

  // --- findings -------------------------------------------------------------------------------------------------

  void Findings() {
    const std::vector<OrderedFinding> order = OrderForReading(capture_);
    if (order.empty()) return;
    Heading("Findings");
    for (std::size_t i = 0; i < order.size(); ++i) {
      const OrderedFinding& entry = order[i];
      const std::size_t indent = 2 + 4 * static_cast<std::size_t>(std::min(entry.depth, 4));
      if (i > 0 && i < kFindingsInFull) text_.Line();
      if (i == kFindingsInFull) {
        text_.Line();
        text_.Line(
            text_.Styled(Count(order.size() - i, "further finding") + " in short (--format json has all of each):",
                         Style::kFaint),
            2);
      }
      FindingHead(entry.index, entry.depth, indent);
      if (i < kFindingsInFull) FindingBody(result_.findings[entry.index], indent + 4);
    }
  }

  /// "f1 error al-refused  slave 0 (AKD, 0x1001)  frame 760 at 1.950000 s" and the title below. The id is the one that
  /// `slice --finding` takes.
  void FindingHead(std::size_t index, int depth, std::size_t indent) {
    const Finding& f = result_.findings[index];
    const std::string id =
        FindingId(result_, static_cast<FindingIndex>(index)) + " " + (depth > 0 ? "consequence: " : "");
    const std::string head = id + text_.Styled(Name(f.severity), StyleOf(f.severity)) + " " +
                             text_.Styled(std::string(f.rule), Style::kBold);
    const std::string label = SlaveLabel(result_, f.slave) + "  ";
    const std::string place = Place(f);
    const std::size_t columns = indent + id.size() + Name(f.severity).size() + 1 + f.rule.size() + 2;
    if (columns + Columns(label) + Columns(place) <= text_.width()) {
      text_.Line(head + "  " + label + place, indent);
    } else if (columns + Columns(label) <= text_.width() + 2) {
      text_.Line(head + "  " + label.substr(0, label.size() - 2), indent);
      text_.Paragraph(place, indent + 4);
    } else {
      text_.Line(head, indent);
      text_.Paragraph(label + place, indent + 4);
    }
    text_.Paragraph(OneLine(TitleOf(f)), indent + 4);
  }

  /// Frames stand in "see also", and flags only choose words.
  [[nodiscard]] static bool IsShownAsEvidence(const Value& value) {
    return value.type != Value::Type::kFlag && value.type != Value::Type::kFrame;
  }

  [[nodiscard]] std::string Place(const Finding& f) const {
    if (!f.first.seen()) return "no single frame";
    std::string text = "frame " + std::to_string(f.first.number);
    if (const std::string moment = Moment(f.first, 6); !moment.empty()) text += " at " + moment;
    if (f.count > 1) {
      // What was seen so often may have happened once: polls that find it unchanged count, too.
      text += ", seen " + Count(f.count, "time");
      if (f.last.number > f.first.number) text += ", last in frame " + std::to_string(f.last.number);
    }
    return text;
  }

  [[nodiscard]] std::string Moment(const FrameRef& frame, std::size_t digits) const {
    return MomentText(style_.time, result_.capture.origin, frame, digits);
  }

  void FindingBody(const Finding& f, std::size_t indent) {
    const Sentences sentences = SentencesOf(f, result_);
    if (sentences.message != sentences.title) text_.Paragraph(OneLine(sentences.message), indent);
    text_.Field("do", OneLine(sentences.next), indent);
    std::string evidence;
    const auto add = [&](std::string_view name, const std::string& value) {
      if (!evidence.empty()) evidence += ", ";
      std::string item = OneLine(name) + " = " + value;
      if (Columns(item) <= kKeptTogether) std::ranges::replace(item, ' ', kHardSpace);
      evidence += item;
    };
    for (const Argument& argument : f.arguments) {
      const Value& value = argument.value;
      if (!IsShownAsEvidence(value)) continue;
      // The sentences have the text of a word.
      add(argument.name, value.word != nullptr ? std::string(value.word->code) : OneLine(TextOf(value)));
    }
    text_.Field("evidence", evidence, indent);
    for (const auto& table : f.mapping) {
      for (const std::string& line : MappingLines(*table)) text_.Line(line, indent);
    }
    std::string related;
    for (const FrameNo frame : f.related_frames) related += (related.empty() ? "" : ", ") + std::to_string(frame);
    const std::string_view noun = f.related_frames.size() == 1 ? "frame " : "frames ";
    text_.Field("see also", related.empty() ? related : std::string(noun) + related, indent);
    if (f.confidence == Confidence::kInferred) {
      text_.Field("certainty", "inferred: rests on an assumption, not only on observed bytes", indent);
    }
    text_.Field("source", ReferenceText(f.reference.document, f.reference.section), indent);
    text_.Field("Wireshark", WiresharkFilter(f), indent);
    text_.Field("more", "ecaudit explain " + std::string(f.rule), indent);
  }

  void KnownFindings() {
    if (Summarise(capture_).known == 0) return;
    Heading("Known from the baseline (not counted)");
    for (std::size_t i = 0; i < result_.findings.size(); ++i) {
      if (!capture_.IsKnown(i)) continue;
      const Finding& f = result_.findings[i];
      text_.Paragraph(FindingId(result_, static_cast<FindingIndex>(i)) + " " + std::string(Name(f.severity)) + " " +
                          std::string(f.rule) + ", " + SlaveLabel(result_, f.slave) + ", " + Place(f) + ": " +
                          OneLine(TitleOf(f)) +
                          (capture_.WhyKnown(i).empty() ? "" : " (" + OneLine(capture_.WhyKnown(i)) + ")"),
                      2, 6);
    }
  }

  // --- what could not be evaluated -----------------------------------------------------------------------------------

  /// How much was evaluated, by chapter.
  void CoverageLines() {
    const std::string text = CoverageText(result_.coverage);
    if (text.empty()) return;
    Heading("Evaluated checks (a rule for one slave)");
    text_.Paragraph(text, 2);
  }

  /// What would open most of what could not be evaluated.
  void CaptureNext() {
    if (result_.capture_next.empty()) return;
    Heading("What to capture next (checks that it may add)");
    for (std::size_t i = 0; i < std::min(result_.capture_next.size(), kAdviceShown); ++i) {
      const CaptureAdvice& advice = result_.capture_next[i];
      text_.Paragraph(OneLine(advice.text) + " (" + Grouped(advice.judgements) + ")", 2, 6);
    }
  }

  void NotJudged() {
    NotJudgedLines();
    CaptureNext();
  }

  void NotJudgedLines() {
    CoverageLines();
    if (result_.not_evaluable.empty()) return;
    Heading("Not evaluated");
    // One line for each reason: the rules it silences, and for whom.
    struct Group {
      std::vector<std::string_view> rules;
      std::set<unsigned> positions;  // empty: the whole bus
    };
    std::vector<std::pair<std::string, Group>> groups;
    std::map<std::string, std::size_t, std::less<>> index;
    for (const NotEvaluable& entry : result_.not_evaluable) {
      const auto [at, is_new] = index.try_emplace(TextOf(entry), groups.size());
      if (is_new) groups.emplace_back(TextOf(entry), Group{});
      Group& group = groups[at->second].second;
      if (std::ranges::find(group.rules, entry.rule) == group.rules.end()) {
        group.rules.push_back(entry.rule);
      }
      if (const SlaveSummary* slave = result_.slave(entry.slave)) {
        group.positions.insert(slave->position);
      }
    }
    std::ranges::stable_sort(
        groups, [](const auto& a, const auto& b) { return a.second.rules.size() > b.second.rules.size(); });
    for (std::size_t i = 0; i < groups.size(); ++i) {
      if (i == kReasonsShown) {
        text_.Line("and " + Count(groups.size() - i, "more reason") + " (--format json lists all)", 2);
        break;
      }
      const auto& [reason, group] = groups[i];
      std::string line = OneLine(reason);
      const std::size_t slaves = group.positions.size();
      if (slaves > 0 && slaves < result_.slaves.size()) {
        line += " (" + result_.slave_names.Of(group.positions) + ")";
      }
      line += ": ";
      for (std::size_t r = 0; r < group.rules.size(); ++r) {
        if (r == kRulesNamed && group.rules.size() > kRulesNamed + 1) {
          line += " and " + std::to_string(group.rules.size() - r) + " more";
          break;
        }
        line += (r > 0 ? ", " : "") + std::string(group.rules[r]);
      }
      text_.Paragraph(line, 2, 6);
    }
  }

  // --- capture facts ----------------------------------------------------------------------------------------------

  /// What the models predicted, so that a reader knows how far they fit these slaves.
  [[nodiscard]] std::string Predictions() const {
    const PredictionSummary& p = result_.bus.predictions;
    std::uint64_t made = 0;
    std::uint64_t held = 0;
    std::string kinds;
    std::string deviations;
    const auto add = [&](const PredictionCount& count, std::string_view noun) {
      if (count.made == 0) return;
      made += count.made;
      held += count.held;
      kinds += (kinds.empty() ? "" : ", ") + Count(count.made, noun);
      if (count.deviations.empty()) return;
      deviations += (deviations.empty() ? "" : ", ") + std::string("frame ") +
                    std::to_string(count.deviations.front()) + " (" + std::string(noun) + ")";
    };
    add(p.al_answers, "state answer");
    add(p.mailbox_accesses, "mailbox transfer");
    add(p.working_counters, "working counter");
    if (made == 0) return "";
    std::string text = "models of the slaves: " + PartWas(held, made, "prediction") + " right (" + kinds + ")";
    if (!deviations.empty()) text += "; first wrong in " + deviations;
    return text;
  }

  void CaptureFacts() {
    const CaptureSummary& c = result_.capture;
    Heading("Capture");
    text_.Paragraph(OneLine(c.file.path), 2, 4);
    std::string frames = Count(c.packets, "packet") + " (" + Printable(c.file.format) + "), " +
                         Count(c.ethercat_frames, "EtherCAT frame") + " (" + Grouped(c.outbound_frames) +
                         " outbound, " + Grouped(c.returned_frames) + " returned";
    if (c.unknown_direction_frames > 0) frames += ", " + Grouped(c.unknown_direction_frames) + " of unknown direction";
    frames += ") with " + Count(c.datagrams, "datagram");
    text_.Paragraph(frames, 2);
    if (c.frames.outbound > 0) text_.Paragraph(Ledger(), 2);
    text_.Paragraph(TimeFacts(), 2);
    if (!WithoutEtherCat(result_)) text_.Paragraph(BusFacts(), 2);
    if (const std::string clocks = ClockFacts(); !clocks.empty()) text_.Paragraph(clocks, 2);
    if (const std::string origins = OriginFacts(); !origins.empty()) text_.Paragraph(origins, 2);
    if (const std::string runs = RunFacts(); !runs.empty()) text_.Paragraph(runs, 2);
    if (const std::string events = SignalledFacts(); !events.empty()) text_.Paragraph(events, 2);
    if (const std::string predictions = Predictions(); !predictions.empty()) text_.Paragraph(predictions, 2);
    if (const std::string left_out = LeftOut(); !left_out.empty()) text_.Paragraph(left_out, 2);
    for (const ReachedLimit& reached : result_.limits) {
      text_.Paragraph("limit reached: " + Grouped(reached.limit) + " " + OneLine(reached.what) + "; " +
                          Grouped(reached.left_out) + " more are left out or counted on others",
                      2);
    }
    if (c.file.damage) text_.Paragraph("damaged: " + OneLine(c.file.damage->message), 2);
    if (const std::string limits = LimitsText(capture_.selection); !limits.empty()) {
      text_.Paragraph("limited by " + OneLine(limits), 2);
    }
    if (!c.complete) text_.Paragraph("the report covers only the part of the capture that was read", 2);
    if (!capture_.config.empty()) text_.Paragraph("settings from " + OneLine(capture_.config), 2);
  }

  [[nodiscard]] std::string Ledger() const {
    const bus::FrameLedger& frames = result_.capture.frames;
    std::string text = Grouped(frames.outbound) + " outbound = " + Grouped(frames.returned) + " returned + " +
                       Grouped(frames.lost) + " lost + " + Grouped(frames.undecided_total()) + " undecided";
    std::string reasons;
    for (std::size_t i = 0; i < frames.undecided.size(); ++i) {
      if (frames.undecided[i] == 0) continue;
      if (!reasons.empty()) reasons += ", ";
      reasons += Grouped(frames.undecided[i]) + ": " + std::string(Describe(static_cast<bus::Undecided>(i)));
    }
    if (!reasons.empty()) text += " (" + reasons + ")";
    return text + " + " + Grouped(frames.in_flight) + " in flight at the end";
  }

  [[nodiscard]] std::string TimeFacts() const {
    const CaptureSummary& c = result_.capture;
    if (!c.first.has_time) return "no time stamps";
    const bool local = style_.time == TimeMode::kLocal;
    std::string text = "from " + (local ? IsoLocalTime(c.first.time) : IsoTime(c.first.time));
    if (c.duration_ns) text += ", " + SecondsText(static_cast<double>(*c.duration_ns) / 1e9);
    if (c.timestamps.resolution_ns > 0) text += ", time stamps in steps of " + Duration(c.timestamps.resolution_ns);
    if (c.timestamps.backwards > 0) text += ", " + Grouped(c.timestamps.backwards) + " backwards";
    if (c.timestamps.without > 0) text += ", " + Count(c.timestamps.without, "packet") + " without";
    return text;
  }

  [[nodiscard]] std::string BusFacts() const {
    const BusSummary& b = result_.bus;
    std::string text;
    switch (result_.capture.direction) {
      case DirectionSeen::kBoth:
        text = "both directions";
        break;
      case DirectionSeen::kOutbound:
        text = result_.capture.frames.undecided[static_cast<std::size_t>(bus::Undecided::kNoAnswers)] > 0
                   ? "outbound frames only: no slave answers"
                   : "outbound frames only: answers of the slaves are not in the capture";
        break;
      case DirectionSeen::kReturned:
        text = "returned frames only";
        break;
      case DirectionSeen::kNone:
        text = "direction unknown";
        break;
    }
    if (b.slave_count) text += ", " + Count(*b.slave_count, "slave");
    if (b.al) {
      text += " (last broadcast read of AL Status: " + esc::StatesOfAllText(b.al->status) + ", #" +
              std::to_string(b.al->last.number) + ")";
    }
    if (result_.capture.direction == DirectionSeen::kBoth) text += ", " + Count(b.lost_frames, "frame") + " lost";
    if (b.duplicated_frames > 0) text += ", " + Grouped(b.duplicated_frames) + " duplicated";
    if (b.cycle.cycles > 0) {
      text += ", " + Count(b.cycle.cycles, "cycle") + " of " + Fixed(b.cycle.mean_us, 1) + " us (" +
              Fixed(b.cycle.min_us, 1) + " to " + Fixed(b.cycle.max_us, 1) + ", deviation " +
              Fixed(b.cycle.stddev_us, 1) + ", median " + Fixed(b.cycle.median_us, 1);
      if (b.cycle.missing > 0) text += ", " + Count(b.cycle.missing, "cycle") + " missing";
      text += "; by " + Printable(b.cycle.time_source) + " time)";
    }
    return text;
  }

  /// "irregular cycles; 98 of 100 values lie within: sending 1569.7 us; return 4.2 us (...); stamps of the recorder
  /// 0.0 us"; empty where cycles are regular.
  [[nodiscard]] std::string OriginFacts() const {
    constexpr double kRegular = 0.01;
    const CycleSummary& cycle = result_.bus.cycle;
    if (!cycle.origins || cycle.origins->width_us() < kRegular * cycle.median_us) return {};
    const DelayOrigins& origins = *cycle.origins;
    const auto us = [](double value) { return Fixed(value, 1) + " us"; };
    std::string text = "irregular cycles; 98 of 100 values lie within: sending " + us(origins.master_us);
    if (!origins.recorder_us) text += " (by stamps, with the error of the recorder: no DC time in the frames)";
    text += "; return " + us(origins.return_us) + " (line, slaves, network card: round trip " +
            us(origins.round_trip_us) + ", longest " + us(origins.longest_round_trip_us) + ")";
    if (origins.recorder_us) text += "; stamps of the recorder " + us(*origins.recorder_us);
    return text;
  }

  /// "2 runs: #1 to #1348 to OP (2 slaves, every 1000.0 us); #1349 to #2691 ..."; empty where there is one.
  [[nodiscard]] std::string RunFacts() const {
    constexpr std::size_t kShown = 6;
    const std::vector<RunSummary>& runs = result_.bus.runs;
    if (runs.size() < 2) return {};
    std::string text = Count(runs.size(), "run") + ": ";
    for (std::size_t i = 0; i < runs.size() && i < kShown; ++i) {
      const RunSummary& run = runs[i];
      if (i > 0) text += "; ";
      text += "#" + std::to_string(run.first.number) + " to #" + std::to_string(run.last.number);
      if (run.why == RunSummary::Why::kClock) text += ", another recording";
      text += run.highest == 0 ? ", no state read" : ", up to " + esc::StateName(run.highest);
      if (run.slaves_in_op > 0) text += " (" + Count(run.slaves_in_op, "slave") + ")";
      if (run.cycle_us > 0) text += ", every " + Fixed(run.cycle_us, 1) + " us";
    }
    if (runs.size() > kShown) text += "; and " + std::to_string(runs.size() - kShown) + " more";
    return text + "; each is evaluated by itself";
  }

  /// "slaves signalled: DL status in 47 frames, #2 to #94 (slave 0)"
  [[nodiscard]] std::string SignalledFacts() const {
    std::string text;
    for (const EventBitSummary& bit : result_.bus.events) {
      text += (text.empty() ? "slaves signalled: " : "; ") + Printable(bit.name) + " in " + Count(bit.frames, "frame") +
              ", #" + std::to_string(bit.first.number) + " to #" + std::to_string(bit.last.number);
      if (bit.raised > 1) text += ", raised " + Count(bit.raised, "time");
      std::set<unsigned> slaves;
      std::uint64_t raised = 0;
      bool inferred = false;  // by the last read that answered the event: others may have been answered before
      for (const SlaveSummary& slave : result_.slaves) {
        for (const EventBitSummary& of : slave.events.signalled) {
          if (of.bit != bit.bit) continue;
          slaves.insert(slave.position);
          raised += of.raised;
          inferred = inferred || of.inferred;
        }
      }
      if (!slaves.empty()) {
        text += inferred || raised < bit.raised ? " (at least " : " (";
        text += result_.slave_names.Of(slaves) + ")";
      }
    }
    return text;
  }

  [[nodiscard]] std::string LeftOut() const {
    const CaptureSummary& c = result_.capture;
    std::string text;
    const auto add = [&text](std::uint64_t n, std::string_view what) {
      if (n == 0) return;
      if (!text.empty()) text += ", ";
      text += Grouped(n) + " " + std::string(what);
    };
    add(c.other_packets, "not EtherCAT commands");
    add(c.foreign_frames, "EtherCAT of other senders");
    add(c.other_end_frames, "at the other end of a redundant line");
    add(c.malformed_frames, "malformed");
    add(c.cut_frames, "cut by the snap length");
    add(c.crc_error_frames, "with CRC errors");
    return text.empty() ? text : "packets ignored: " + text;
  }

  const CaptureReport& capture_;
  const AnalysisResult& result_;
  const TextStyle& style_;
  TextBuilder text_;
};

}  // namespace

std::string SlaveLabel(const AnalysisResult& result, SlaveId id) {
  const SlaveSummary* slave = result.slave(id);
  return slave == nullptr ? "bus"
                          : SlaveLabel(result.slave_names, slave->position, slave->name, slave->station_address);
}

std::string Headline(const CaptureReport& capture) {
  return Headline(DigestOf(capture));
}

std::string WriteVerdict(const CaptureReport& capture, const TextStyle& style) {
  return CaptureText(capture, style).WriteVerdictOnly();
}

std::string UnreadableText(const Report& report, const TextStyle& style) {
  TextBuilder text(style);
  for (const UnreadableCapture& capture : report.unreadable) {
    text.Line(text.Styled("ERROR", Style::kError) + " " + OneLine(capture.path) + ": " + OneLine(capture.message));
  }
  return text.Take();
}

std::string WriteText(const Report& report, const TextStyle& style) {
  std::string out;
  for (const CaptureReport& capture : report.captures) {
    if (!out.empty() && !style.quiet) out += "\n";
    out += CaptureText(capture, style).Write();
  }
  if (!report.unreadable.empty()) {
    if (!out.empty() && !style.quiet) out += "\n";
    out += UnreadableText(report, style);
  }
  if (report.captures.size() > 1) {
    const Summary sum = Summarise(report);
    std::uint64_t failed = 0;
    for (const CaptureReport& capture : report.captures) failed += Summarise(capture).fail ? 1U : 0U;
    TextBuilder text(style);
    if (!style.quiet) text.Line();
    const std::string_view verdict = Gates(sum) ? "fail" : sum.Verdict();
    const Style shown = verdict == "fail" ? Style::kError : verdict == "pass" ? Style::kGood : Style::kWarning;
    const std::string_view word = verdict == "fail"         ? "FAIL"
                                  : verdict == "pass"       ? "PASS"
                                  : verdict == "incomplete" ? "INCOMPLETE"
                                                            : "LIMITED";
    std::string line = " " + Count(report.captures.size(), "capture") + ", " + Grouped(failed) + " failed";
    if (!report.unreadable.empty()) line += ", " + Grouped(report.unreadable.size()) + " could not be read";
    text.Line(text.Styled(word, shown) + line + ": " + Counts(sum));
    out += text.Take();
  }
  return out;
}

}  // namespace ecaudit::report
