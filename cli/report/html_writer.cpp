#include "cli/report/html_writer.h"

#include <set>
#include <string_view>

#include "cli/report/digest.h"
#include "cli/report/finding_order.h"
#include "cli/report/json_text.h"
#include "cli/report/json_writer.h"
#include "cli/report/packed.h"
#include "cli/report/text_writer.h"
#include "cli/report/timeline_json.h"
#include "cli/report/xml.h"
#include "decoder/base/system/names.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

/// What the page needs besides the JSON report.
void PutPage(JsonObject& out, const CaptureReport& capture) {
  const HeadlineParts headline = HeadlinePartsOf(DigestOf(capture));
  out.Put("verdict", headline.verdict);
  out.Put("sentence", headline.sentence);
  out.Array("order", [&](JsonArray& order) {
    for (const OrderedFinding& finding : OrderForReading(capture)) {
      order.AddArray([&](JsonArray& pair) {
        pair.Add(finding.index);
        pair.Add(finding.depth);
      });
    }
  });
  if (capture.timeline == nullptr) return out.Put("timeline", nullptr);
  out.Object("timeline", [&](JsonObject& json) { PutTimeline(json, capture.result, *capture.timeline); });
}

/// What `ecaudit explain` shows of the rules that found something: readers who get the page by mail have no program.
void PutRulePages(JsonObject& out, const Report& report) {
  std::set<std::string_view> fired;
  for (const CaptureReport& capture : report.captures) {
    for (const Finding& finding : capture.result.findings) fired.insert(finding.rule);
  }
  out.Object("rules", [&](JsonObject& rules) {
    for (const RuleInfo* rule : report.rules) {
      if (!fired.contains(rule->id)) continue;
      rules.Object(rule->id, [&](JsonObject& json) {
        json.Put("title", rule->title);
        json.Put("source", rule->source);
        json.Put("doc", rule->doc);
      });
    }
  });
}

/// Larger data are packed: the report of forty slaves has nearly the same forty times.
constexpr std::size_t kPlainBytes = 256 * 1024;

/// The data, or {"packed": "..."} with them.
std::string MadeSmall(std::string data) {
  if (data.size() <= kPlainBytes) return data;
  const std::string packed = Packed(data);
  if (packed.empty()) return data;
  JsonText text(JsonText::Layout::kLine);
  text.Object([&](JsonObject& json) { json.Put("packed", packed); });
  return text.Take();
}

/// JSON in which nothing looks like a tag, so that no text of the capture can end the element it stands in.
std::string WithoutTags(std::string_view json) {
  std::string out;
  out.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
  return out;
}

std::string Title(const Report& report) {
  if (report.captures.size() != 1) return Count(report.captures.size(), "capture") + " - ecaudit";
  const std::string path = Printable(report.captures.front().result.capture.file.path);
  return std::string(system::NameOf(path)) + " - ecaudit";
}

}  // namespace

std::string WriteHtml(const Report& report) {
  JsonText data(JsonText::Layout::kLine);
  data.Object([&](JsonObject& out) {
    out.Object("report", [&](JsonObject& json) { PutReport(json, report); });
    out.List("pages", report.captures, PutPage);
    PutRulePages(out, report);
  });
  std::string summary;
  for (const CaptureReport& capture : report.captures) summary += Headline(capture) + "\n";

  std::string out;
  std::string_view page = HtmlPage();
  const auto fill = [&](std::string_view mark, std::string_view text) {
    const std::size_t at = page.find(mark);
    if (at == std::string_view::npos) return;
    out += page.substr(0, at);
    out += text;
    page.remove_prefix(at + mark.size());
  };
  // In the order in which they stand in the page.
  fill(kTitleMark, XmlText(Title(report)));
  fill(kSummaryMark, XmlText(summary));
  fill(kDataMark, WithoutTags(MadeSmall(data.Take())));
  out += page;
  return out;
}

}  // namespace ecaudit::report
