#include "cli/report/diff_writer.h"

#include <algorithm>
#include <vector>

#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

constexpr std::size_t kNoteIndent = 2;
constexpr std::size_t kSideIndent = 4;
constexpr std::size_t kSideHanging = 7;
constexpr std::size_t kLongestSide = 400;
/// Differences reported in full; the JSON has all.
constexpr std::size_t kDifferencesShown = 60;

std::string FrameText(FrameNo frame) {
  return frame == 0 ? "" : " (#" + std::to_string(frame) + ")";
}

class DiffText {
 public:
  DiffText(const DiffReport& report, const TextStyle& style) : report_(report), text_(style) {}

  std::string Write() {
    const std::vector<diff::Difference>& all = report_.diff.differences;
    const bool different = report_.diff.different();
    text_.Line(text_.Styled(different ? "DIFFERENT" : "SAME", different ? Style::kError : Style::kGood) + "  A " +
               Path(report_.a));
    text_.Line(std::string(different ? 9 : 4, ' ') + "  B " + Path(report_.b));
    if (!different) {
      text_.Paragraph("No difference in " + Count(report_.diff.steps_compared, "step") + " of " +
                          Count(Compared(), "slave") +
                          "; times, offsets, station addresses and the like are not compared.",
                      0);
    }
    Section("Slaves", [](const diff::Difference& d) { return d.counts && d.area == diff::Area::kBus; });
    // Then the outcome: what it is all about.
    if (HasOutcome() &&
        std::ranges::any_of(all, [](const diff::Difference& d) { return d.counts && d.area == diff::Area::kBus; })) {
      text_.Line();
    }
    for (const diff::Difference& d : all) {
      if (d.area == diff::Area::kOutcome) Outcome(d);
    }
    const auto is_setting = [](const diff::Difference& d) {
      return d.counts && !d.consequence && d.area != diff::Area::kOutcome && d.area != diff::Area::kFinding &&
             d.area != diff::Area::kBus;
    };
    const auto is_finding = [](const diff::Difference& d) { return d.area == diff::Area::kFinding; };
    const auto is_consequence = [](const diff::Difference& d) { return d.consequence; };
    const auto is_no_difference = [](const diff::Difference& d) {
      return !d.counts && d.area != diff::Area::kFinding && !d.consequence;
    };
    const bool leads = std::ranges::any_of(all, [&](const diff::Difference& d) { return d.relevant && is_setting(d); });
    const bool explained =
        std::ranges::any_of(all, [&](const diff::Difference& d) { return d.relevant && is_finding(d); });
    if (leads || explained) {
      Section(OneLine(report_.diff.failed) + ": what it is about, the likeliest reason first",
              [&](const diff::Difference& d) { return d.relevant && (is_setting(d) || is_finding(d)); });
    }
    const auto is_other_finding = [&](const diff::Difference& d) { return is_finding(d) && !d.relevant; };
    constexpr std::string_view kFindings = "Findings in one of them only";
    const bool findings_first = report_.diff.findings_lead;
    if (findings_first) Section(kFindings, is_other_finding);
    const bool fold = leads && !report_.all;
    if (!fold) {
      Section(leads || explained || findings_first ? "What else is done differently"
              : different && HasOutcome()          ? "What is done differently, the most important first"
                                                   : "Differences",
              [&](const diff::Difference& d) { return !d.relevant && is_setting(d); });
    }
    if (!findings_first) Section(kFindings, is_other_finding);
    if (!fold) {
      Section("What follows from it: steps the other start-up did not come to", is_consequence);
      Section("Does not count: times, devices, layout", is_no_difference);
    } else {
      const auto left = std::ranges::count_if(all, [&](const diff::Difference& d) {
        return (is_setting(d) && !d.relevant) || is_consequence(d) || is_no_difference(d);
      });
      if (left > 0) {
        text_.Line();
        text_.Line(Count(static_cast<std::uint64_t>(left), "further difference") + " not shown; --all shows them");
      }
    }
    if (!report_.diff.notes.empty()) {
      text_.Line();
      text_.Line(text_.Styled("Not compared", Style::kBold));
      for (const std::string& note : report_.diff.notes) text_.Paragraph(OneLine(note), kNoteIndent, kSideIndent);
    }
    return text_.Take();
  }

 private:
  static std::string Path(const AnalysisResult& result) { return OneLine(result.capture.file.path); }

  [[nodiscard]] std::size_t Compared() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        report_.diff.pairs, [](const diff::SlavePair& pair) { return pair.a != nullptr && pair.b != nullptr; }));
  }

  [[nodiscard]] bool HasOutcome() const {
    return std::ranges::any_of(report_.diff.differences,
                               [](const diff::Difference& d) { return d.area == diff::Area::kOutcome; });
  }

  [[nodiscard]] std::string Label(const diff::SlavePair& pair) const {
    if (pair.a == nullptr) return SlaveLabel(report_.b, pair.b->id) + " of B";
    if (pair.b == nullptr) return SlaveLabel(report_.a, pair.a->id) + " of A";
    std::string label = SlaveLabel(report_.a, pair.a->id);
    if (pair.a->position != pair.b->position) {
      label += " of A, " + report_.b.slave_names.Of(pair.b->position) + " of B";
    } else if (pair.a->station_address != pair.b->station_address && pair.b->station_address) {
      label += " (" + Hex(*pair.b->station_address) + " in B)";
    }
    return label;
  }

  [[nodiscard]] std::string Labels(const diff::Difference& d) const {
    if (d.pairs.empty()) return d.area == diff::Area::kBus || d.area == diff::Area::kTiming ? "bus" : "all slaves";
    std::string label = Label(report_.diff.pairs[d.pairs.front()]);
    if (d.pairs.size() > 1) label += " and " + Grouped(d.pairs.size() - 1) + " more";
    return label;
  }

  void Sides(const diff::Difference& d) {
    text_.Paragraph("A  " + Shortened(OneLine(d.in_a), kLongestSide) + FrameText(d.frame_a), kSideIndent, kSideHanging);
    text_.Paragraph("B  " + Shortened(OneLine(d.in_b), kLongestSide) + FrameText(d.frame_b), kSideIndent, kSideHanging);
  }

  void Outcome(const diff::Difference& d) {
    text_.Line(text_.Styled(Labels(d), Style::kBold));
    Sides(d);
  }

  template <typename Belongs>
  void Section(std::string_view heading, Belongs&& belongs) {
    std::size_t shown = 0;
    std::size_t left_out = 0;
    for (const diff::Difference& d : report_.diff.differences) {
      if (!belongs(d)) continue;
      if (shown == 0) {
        text_.Line();
        text_.Line(text_.Styled(heading, Style::kBold));
      }
      if (shown++ >= kDifferencesShown) {
        ++left_out;
        continue;
      }
      text_.Paragraph(Labels(d) + ": " + Shortened(OneLine(d.what), kLongestSide), kNoteIndent, kSideIndent);
      Sides(d);
    }
    if (left_out > 0)
      text_.Line(Count(left_out, "further difference") + " not shown; --format json has all", kNoteIndent);
  }

  const DiffReport& report_;
  TextBuilder text_;
};

void PutDiffCapture(JsonObject& out, const AnalysisResult& result) {
  out.Put("path", Printable(result.capture.file.path));
  out.Put("packets", result.capture.packets);
  out.Put("slaves", result.slaves.size());
}

void PutSide(JsonObject& out, std::string_view key, const SlaveSummary* slave) {
  if (slave == nullptr) return out.Put(key, nullptr);
  out.Object(key, [&](JsonObject& json) {
    json.Put("position", slave->position);
    json.Put("station_address", slave->station_address);
    json.TextOrNull("name", Printable(slave->name));
  });
}

void PutPair(JsonObject& out, const diff::SlavePair& pair) {
  PutSide(out, "a", pair.a);
  PutSide(out, "b", pair.b);
}

void PutDifference(JsonObject& out, const diff::Difference& d) {
  out.Put("area", Name(d.area));
  out.Values("slaves", d.pairs);
  out.Put("what", Printable(d.what));
  out.Put("a", Printable(d.in_a));
  out.Put("b", Printable(d.in_b));
  out.Frame("frame_a", d.frame_a);
  out.Frame("frame_b", d.frame_b);
  out.Put("relevant", d.relevant);
  out.Put("consequence", d.consequence);
  out.Put("counts", d.counts);
}

}  // namespace

std::string WriteDiffText(const DiffReport& report, const TextStyle& style) {
  return DiffText(report, style).Write();
}

std::string WriteDiffJson(const DiffReport& report) {
  return JsonDocumentText([&](JsonObject& out) {
    out.Put("schema", "ecaudit.diff/1");
    PutTool(out, report.version);
    out.Object("a", [&](JsonObject& json) { PutDiffCapture(json, report.a); });
    out.Object("b", [&](JsonObject& json) { PutDiffCapture(json, report.b); });
    out.Put("different", report.diff.different());
    out.Put("steps_compared", report.diff.steps_compared);
    out.TextOrNull("failed", Printable(report.diff.failed));
    out.List("slaves", report.diff.pairs, PutPair);
    out.List("differences", report.diff.differences, PutDifference);
    out.Array("notes", [&](JsonArray& notes) {
      for (const std::string& note : report.diff.notes) notes.Add(Printable(note));
    });
  });
}

}  // namespace ecaudit::report
