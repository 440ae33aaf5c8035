#include "cli/report/index_page.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "cli/report/summary_tally.h"
#include "cli/report/times.h"
#include "cli/report/xml.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

// The content security policy of the page names both by their hashes; tests/cli compares them.
constexpr std::string_view kStyle = R"css(
:root{--bg:#f5f6f8;--panel:#fff;--line:#dde1e7;--text:#1b2330;--muted:#5b6675;--link:#1257b0;--error:#b3261e;--error-bg:#fdeceb;--warning:#8a5a00;--warning-bg:#fdf3df;--info:#3a5f8a;--info-bg:#e9f0f8;--good:#14693f;--good-bg:#e4f4eb;color-scheme:light}
@media(prefers-color-scheme:dark){:root{--bg:#14181e;--panel:#1c2129;--line:#323a46;--text:#e5e9ef;--muted:#9aa6b5;--link:#82b4f2;--error:#ff8b82;--error-bg:#3a1f1f;--warning:#f0bd5c;--warning-bg:#38301c;--info:#9dc0e8;--info-bg:#202d3d;--good:#74cf9f;--good-bg:#1b3327;color-scheme:dark}}
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--text);font:14px/1.45 system-ui,sans-serif}
main{max-width:1400px;margin:0 auto;padding:16px}
h1{font-size:20px;margin:4px 0 2px}h2{font-size:16px;margin:0 0 8px}
.panel{background:var(--panel);border:1px solid var(--line);border-radius:8px;padding:14px;margin:12px 0}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%}
th,td{text-align:left;vertical-align:top;padding:5px 10px 5px 0;border-bottom:1px solid var(--line)}
td.number,th.number{text-align:right}
td.what{min-width:16em;overflow-wrap:anywhere}td.path{overflow-wrap:anywhere;min-width:9em}
th button{all:unset;cursor:pointer;font-weight:600}
th button:focus-visible,a:focus-visible,.same:focus-visible{outline:2px solid var(--link);outline-offset:2px}
th[aria-sort=ascending] button::after{content:" \2191"}th[aria-sort=descending] button::after{content:" \2193"}
a{color:var(--link)}
.muted{color:var(--muted)}
summary{cursor:pointer;color:var(--link);padding:6px 0}
.badge{display:inline-block;border-radius:4px;padding:0 7px;font-weight:600;white-space:nowrap}
.error{color:var(--error);background:var(--error-bg)}.warning{color:var(--warning);background:var(--warning-bg)}
.info{color:var(--info);background:var(--info-bg)}.good{color:var(--good);background:var(--good-bg)}
.plain{color:var(--muted);border:1px solid var(--line)}
.tools{display:flex;flex-wrap:wrap;gap:10px;align-items:end;margin-bottom:8px}
label{display:grid;grid-template-columns:minmax(0,auto);gap:2px;color:var(--muted);font-size:12px;min-width:0;max-width:100%}
input,select{font:inherit;color:var(--text);background:var(--panel);border:1px solid var(--line);border-radius:6px;padding:4px 8px;max-width:100%}
.same{font:inherit;color:var(--link);background:none;border:0;padding:0;text-align:left;cursor:pointer;text-decoration:underline}
@media(max-width:640px){main{padding:8px}
.captures thead{display:none}.captures,.captures tbody{display:block}.captures td{min-width:0}.captures tr:not([hidden]){display:grid;grid-template-columns:auto minmax(0,1fr);gap:0 10px;border-bottom:1px solid var(--line);padding:8px 0}
.captures td{border:0;padding:1px 0;text-align:left!important}.captures td.what,.captures td.path{grid-column:1/-1}
.captures td[data-name]::before{content:attr(data-name) " ";color:var(--muted)}}
@media print{.tools{display:none}body{background:#fff}.panel{border:0;padding:0}@page{size:A4;margin:12mm}table{font-size:10px}td.path,td.what{min-width:0}}
)css";
constexpr std::string_view kStyleHash = "'sha256-nbw5MkuZH6bAmX2t2kY/tw26ECJhXFzvSr6jujQssbA='";

constexpr std::string_view kScript = R"js(
"use strict";
const body = document.querySelector(".captures tbody");
const rows = [...body.rows];
const text = document.getElementById("text");
const verdict = document.getElementById("verdict");
const cause = document.getElementById("cause");
const shown = document.getElementById("shown");
function filter() {
  const words = text.value.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (const row of rows) {
    const content = row.textContent.toLowerCase();
    row.hidden = (verdict.value !== "" && row.dataset.verdict !== verdict.value) ||
      (cause.value !== "" && row.dataset.cause !== cause.value) || !words.every((word) => content.includes(word));
    if (!row.hidden) count += 1;
  }
  shown.textContent = count === rows.length ? `${count} captures` : `${count} of ${rows.length} captures`;
}
for (const control of [text, verdict, cause]) control.addEventListener("input", filter);
for (const button of document.querySelectorAll(".same")) {
  button.addEventListener("click", () => {
    cause.value = cause.value === button.dataset.cause ? "" : button.dataset.cause;
    filter();
    shown.scrollIntoView({ block: "nearest" });
  });
}
document.querySelectorAll(".captures th").forEach((head, column) => {
  head.querySelector("button").addEventListener("click", () => {
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const key = (row) => row.cells[column].dataset.key ?? row.cells[column].textContent;
    const number = head.classList.contains("number");
    rows.sort((a, b) => {
      const order = number ? Number(key(a)) - Number(key(b)) : key(a).localeCompare(key(b), "en", { numeric: true });
      return down ? -order : order;
    });
    body.append(...rows);
  });
});
filter();
)js";
constexpr std::string_view kScriptHash = "'sha256-EqbsC8whHyXxz7ajRNhrkCZSPgsjc7HFRroCYhreXi8='";

std::string_view Badge(Status status) {
  switch (status) {
    case Status::kFail:
    case Status::kUnmet:
    case Status::kUnreadable:
      return "error";
    case Status::kLimited:
      return "warning";
    case Status::kPass:
      return "good";
    case Status::kNothingToCheck:
      break;
  }
  return "plain";
}

std::string_view Badge(Severity severity) {
  return severity == Severity::kError ? "error" : severity == Severity::kWarning ? "warning" : "info";
}

/// "<td class=...>text</td>"
std::string Cell(std::string_view attributes, const std::string& html) {
  return "<td" + (attributes.empty() ? std::string() : " " + std::string(attributes)) + ">" + html + "</td>";
}

std::string BadgeHtml(std::string_view kind, std::string_view text) {
  return "<span class=\"badge " + std::string(kind) + "\">" + XmlText(text) + "</span>";
}

class IndexPage {
 public:
  IndexPage(const Digest& digest, const TextStyle& style)
      : digest_(digest), style_(style), tally_(TallyOf(digest)), cause_of_(digest.captures.size(), 0) {
    for (std::size_t group = 0; group < tally_.causes.size(); ++group) {
      for (const std::size_t capture : tally_.causes[group].captures) cause_of_[capture] = group + 1;
    }
  }

  std::string Write() {
    const std::string policy = "default-src 'none'; script-src " + std::string(kScriptHash) + "; style-src " +
                               std::string(kStyleHash) + "; img-src data:; base-uri 'none'; form-action 'none'";
    out_ =
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"" +
        policy +
        "\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta name=\"color-scheme\" content=\"light dark\">\n<meta name=\"referrer\" content=\"no-referrer\">\n"
        "<title>" +
        XmlText(Count(digest_.captures.size(), "capture")) +
        " - ecaudit</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>" + std::string(kStyle) +
        "</style>\n</head>\n<body>\n<main>\n";
    Head();
    Causes();
    Captures();
    out_ += "<p class=\"muted\">ecaudit " + XmlText(digest_.version) +
            ". This page is complete in itself and loads nothing.</p>\n</main>\n<script>" + std::string(kScript) +
            "</script>\n</body>\n</html>\n";
    return std::move(out_);
  }

 private:
  void Head() {
    const std::string_view verdict = tally_.Verdict(digest_);
    const std::string_view kind = verdict == "pass" ? "good" : verdict == "limited" ? "warning" : "error";
    std::string word(verdict);
    std::ranges::transform(word, word.begin(),
                           [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
    std::string text = Grouped(tally_.failed) + " failed";
    const auto add = [&text](std::uint64_t count, const char* what) {
      if (count > 0) text += ", " + Grouped(count) + " " + what;
    };
    add(tally_.unmet, "without what is required");
    add(tally_.unreadable, "not read");
    add(tally_.limited, "limited");
    add(tally_.nothing_to_check, "without EtherCAT");
    add(tally_.passed, "passed");
    add(digest_.not_reached, "not reached");
    out_ += "<h1>" + BadgeHtml(kind, word) + " " + XmlText(Count(digest_.captures.size(), "capture")) + "</h1>\n<p>" +
            XmlText(text) + "; " +
            XmlText(Count(tally_.findings.errors, "error") + ", " + Count(tally_.findings.warnings, "warning") + ", " +
                    Count(tally_.findings.infos, "info")) +
            "</p>\n";
  }

  /// "2026-03-02 02:13:07"
  [[nodiscard]] std::string When(const std::string& iso) const {
    const std::optional<TimeNs> time = ParseIsoTime(iso, false);
    if (!time) return {};
    const bool local = style_.time == TimeMode::kLocal;
    return DateText(*time, local) + " " + ClockText(*time, local, 0);
  }

  /// Those of several captures; those of one after a fold, unless they are few and alone.
  void Causes() {
    constexpr std::size_t kFew = 8;
    if (tally_.causes.empty()) return;
    const auto shared = [](const CauseGroup& group) { return group.captures.size() > 1; };
    const auto several = static_cast<std::size_t>(std::ranges::count_if(tally_.causes, shared));
    const std::size_t single = tally_.causes.size() - several;
    out_ += "<section class=\"panel\" aria-labelledby=\"causes-title\">\n<h2 id=\"causes-title\">First causes</h2>\n";
    if (several > 0) CauseTable([&](const CauseGroup& group) { return shared(group); });
    if (single > 0) {
      out_ += std::string("<details") + (several == 0 && single <= kFew ? " open" : "") + "><summary>" +
              XmlText(Count(single, several > 0 ? "other cause" : "cause") + ", each of one capture") + "</summary>\n";
      CauseTable([&](const CauseGroup& group) { return !shared(group); });
      out_ += "</details>\n";
    }
    out_ += "</section>\n";
  }

  template <typename Belongs>
  void CauseTable(Belongs&& belongs) {
    out_ +=
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"First causes\"><table>\n<thead><tr>"
        "<th scope=\"col\" class=\"number\">Captures</th><th scope=\"col\">Rule</th><th scope=\"col\">What</th>"
        "<th scope=\"col\">First seen</th><th scope=\"col\">Last seen</th><th scope=\"col\">Slaves "
        "of</th></tr></thead>\n"
        "<tbody>\n";
    for (std::size_t i = 0; i < tally_.causes.size(); ++i) {
      const CauseGroup& group = tally_.causes[i];
      if (!belongs(group)) continue;
      std::string products;
      for (const std::string& product : group.products) products += (products.empty() ? "" : "; ") + product;
      out_ += "<tr>" + Cell("class=\"number\"", Grouped(group.captures.size())) +
              Cell("", BadgeHtml(Badge(group.severity), Name(group.severity)) + " " + XmlText(group.rule)) +
              Cell("class=\"what\"", "<button type=\"button\" class=\"same\" data-cause=\"" + std::to_string(i + 1) +
                                         "\">" + XmlText(group.title) + "</button>") +
              Cell("", XmlText(When(group.first_time))) + Cell("", XmlText(When(group.last_time))) +
              Cell("", XmlText(products)) + "</tr>\n";
    }
    out_ += "</tbody></table></div>\n";
  }

  void Filters() {
    out_ +=
        "<div class=\"tools\"><label>Text <input id=\"text\" type=\"search\" autocomplete=\"off\"></label>"
        "<label>Verdict <select id=\"verdict\"><option value=\"\">all</option>";
    std::vector<std::string_view> verdicts;
    for (const CaptureDigest& capture : digest_.captures) {
      const std::string_view name = Name(StatusOf(capture));
      if (std::ranges::find(verdicts, name) == verdicts.end()) verdicts.push_back(name);
    }
    for (const std::string_view name : verdicts) out_ += "<option>" + XmlText(name) + "</option>";
    out_ += "</select></label><label>First cause <select id=\"cause\"><option value=\"\">all</option>";
    for (std::size_t i = 0; i < tally_.causes.size(); ++i) {
      const CauseGroup& group = tally_.causes[i];
      out_ += "<option value=\"" + std::to_string(i + 1) + "\">" +
              XmlText(group.rule + ": " + Shortened(group.title, 60) + " (" + Grouped(group.captures.size()) + ")") +
              "</option>";
    }
    out_ += "</select></label><span id=\"shown\" role=\"status\" class=\"muted\"></span></div>\n";
  }

  void Captures() {
    out_ += "<section class=\"panel\" aria-labelledby=\"captures-title\">\n<h2 id=\"captures-title\">Captures</h2>\n";
    Filters();
    out_ +=
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-labelledby=\"captures-title\">"
        "<table class=\"captures\">\n<thead><tr>";
    const auto head = [this](const char* title, bool number) {
      out_ += std::string("<th scope=\"col\"") + (number ? " class=\"number\"" : "") + "><button type=\"button\">" +
              title + "</button></th>";
    };
    head("Verdict", false);
    head("Capture", false);
    head("Begins", false);
    head("Seconds", true);
    head("Slaves", true);
    head("Errors", true);
    head("Warnings", true);
    head("What", false);
    out_ += "</tr></thead>\n<tbody>\n";
    // Captures of the same urgency stay in their order.
    std::vector<std::size_t> order(digest_.captures.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::stable_sort(order, [this](std::size_t a, std::size_t b) {
      return UrgencyOf(digest_.captures[a]) < UrgencyOf(digest_.captures[b]);
    });
    for (const std::size_t i : order) Row(digest_.captures[i], cause_of_[i]);
    out_ += "</tbody></table></div>\n</section>\n";
  }

  void Row(const CaptureDigest& capture, std::size_t cause) {
    const Status status = StatusOf(capture);
    const HeadlineParts headline = HeadlinePartsOf(capture);
    const Summary summary = Summarise(capture);
    const std::string path = XmlText(capture.path);
    out_ += "<tr data-verdict=\"" + std::string(Name(status)) + "\" data-cause=\"" +
            (cause > 0 ? std::to_string(cause) : std::string()) + "\">";
    out_ += Cell("data-key=\"" + std::to_string(static_cast<unsigned>(UrgencyOf(capture))) + "\"",
                 BadgeHtml(Badge(status), headline.verdict));
    out_ += Cell("class=\"path\"",
                 capture.page.empty() ? path : "<a href=\"" + XmlText(UriOf(capture.page)) + "\">" + path + "</a>");
    out_ += Cell("data-key=\"" + XmlText(capture.first_time) + "\"", XmlText(When(capture.first_time)));
    const auto number = [this](const char* name, const std::string& text) {
      out_ += Cell(
          "class=\"number\" data-name=\"" + std::string(name) + "\" data-key=\"" + (text.empty() ? "-1" : text) + "\"",
          text);
    };
    number("Seconds", capture.duration_s ? Fixed(*capture.duration_s, 3) : "");
    const bool read = capture.unreadable.empty();
    number("Slaves", read ? std::to_string(capture.slaves) : "");
    number("Errors", read ? std::to_string(summary.errors) : "");
    number("Warnings", read ? std::to_string(summary.warnings) : "");
    out_ += Cell("class=\"what\"", XmlText(headline.sentence)) + "</tr>\n";
  }

  /// A file beside this page, as a reference.
  static std::string UriOf(std::string_view name) {
    constexpr std::string_view kKept = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
    std::string uri;
    for (const char c : name) {
      if (kKept.find(c) != std::string_view::npos) {
        uri += c;
      } else {
        uri += "%" + Hex(static_cast<unsigned char>(c), 2).substr(2);
      }
    }
    return uri;
  }

  const Digest& digest_;
  const TextStyle& style_;
  Tally tally_;
  std::vector<std::size_t> cause_of_;  ///< of each capture: its group, counted from 1; 0: none
  std::string out_;
};

}  // namespace

std::string WriteIndexPage(const Digest& digest, const TextStyle& style) {
  return IndexPage(digest, style).Write();
}

}  // namespace ecaudit::report
