// Findings in the order in which they are best read: worst first, each cause before its consequences.
import { copyable, facts, h } from "./dom.js";
import { count, duration, grouped, hex, seconds, slaveLabel, trim } from "./format.js";

const FIRST = 60;
const HEX_NAMES = /address|word|code|index|status|control|value|activation|register|vendor|product|revision|logical|start/i;

/// Evidence is named by the rules; numbers that people write in hexadecimal get both forms.
function evidenceText(name, value) {
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (typeof value !== "number") return value;
  if (!Number.isInteger(value)) return trim(value, 3);
  return value > 9 && HEX_NAMES.test(name) ? `${hex(value)} (${grouped(value)})` : grouped(value);
}

/// The page of the rule, as `ecaudit explain` has it: headings and paragraphs.
function rulePage(rule) {
  if (!rule) return null;
  const parts = [];
  let lines = [];
  const end = () => {
    if (lines.length) parts.push(h("p", null, lines.join(" ")));
    lines = [];
  };
  for (const line of rule.doc.trim().split("\n")) {
    if (line.startsWith("## ")) {
      end();
      parts.push(h("h4", null, line.slice(3)));
    } else if (line.trim() === "") end();
    else lines.push(line.trim());
  }
  end();
  return h("details", { className: "more rule" }, h("summary", null, "About this rule"), h("p", null, `${rule.title}.`), parts,
    h("p", { className: "muted" }, `Source: ${rule.source}`));
}

const clock = (time) => (time ? ` (${time.slice(11, 23)} UTC)` : "");

function findingCard(capture, finding, depth, rules, showInTime) {
  const slave = capture.slaves.find((s) => s.position === finding.slave);
  const where = finding.slave === null ? "Bus" : slave ? slaveLabel(slave) : `Slave ${finding.slave}`;
  const consequences = capture.findings.filter((f) => f.caused_by === finding.id);
  const cause = capture.findings.find((f) => f.id === finding.caused_by);
  const link = (f) => h("a", { href: `#finding-${f.id}` }, `${f.id} ${f.title}`);
  const reference = [finding.reference.document, finding.reference.section].filter(Boolean).join(", ");
  const frames = [...new Set([finding.frame, finding.last_frame, ...finding.related_frames])].filter(Boolean);
  return h("article", { className: `finding ${["", "deep", "deeper"][Math.min(depth, 2)]}`, id: `finding-${finding.id}`, tabindex: "-1",
      "aria-labelledby": `title-${finding.id}` },
    h("h3", { id: `title-${finding.id}` },
      h("span", { className: `badge ${finding.severity}` }, depth > 0 ? `${finding.severity}, consequence` : finding.severity),
      h("span", null, finding.title)),
    h("div", { className: "meta" },
      h("span", null, h("b", null, finding.id)),
      slave ? h("a", { href: `#slave-${slave.position}` }, where) : h("span", null, where),
      finding.frame && h("span", null, `frame ${finding.frame}`, finding.time_s !== null && ` at ${seconds(finding.time_s)}${clock(finding.time)}`),
      finding.count > 1 && h("span", null, `seen ${count(finding.count, "time")}, last in frame ${finding.last_frame}`,
        finding.last_time_s > finding.time_s && `, ${duration((finding.last_time_s - finding.time_s) * 1000)} later`),
      finding.confidence === "inferred" && h("span", { title: "Rests on an assumption, which the text names" }, "inferred"),
      h("span", { className: "mono" }, finding.rule)),
    h("p", { className: "text" }, finding.message),
    Object.keys(finding.evidence).length > 0 &&
      facts(Object.entries(finding.evidence).map(([name, value]) => [name.replaceAll("_", " "), evidenceText(name, value)]), "evidence"),
    (cause || consequences.length > 0) && h("p", { className: "chain" },
      cause && ["Because of ", link(cause), consequences.length > 0 && ". "],
      consequences.length > 0 && ["Leads to ", consequences.map((f, i) => [i > 0 && ", ", link(f)])]),
    frames.length > 0 && h("div", { className: "copy" },
      finding.time_s !== null && showInTime &&
        h("button", { type: "button", onclick: () => showInTime(finding) }, "Show in time line"),
      finding.wireshark_filter && copyable(finding.wireshark_filter, "filter"),
      reference && h("span", { className: "muted" }, `See ${reference}`)),
    rulePage(rules[finding.rule]));
}

export function findingsPanel(capture, page, rules, showInTime) {
  const panel = h("section", { className: "panel", id: "findings", "aria-labelledby": "findings-title" },
    h("h2", { id: "findings-title" }, "Findings"));
  const known = capture.findings.filter((f) => f.known).length;
  if (page.order.length === 0) {
    panel.append(h("p", { className: "muted" }, known > 0 ? `None but ${count(known, "finding")} that the baseline lists.` : "None."));
    return panel;
  }
  const add = (from, to) => {
    for (const [index, depth] of page.order.slice(from, to)) {
      panel.append(findingCard(capture, capture.findings[index], depth, rules, showInTime));
    }
  };
  add(0, FIRST);
  if (page.order.length > FIRST) {
    panel.append(h("p", null, h("button", { type: "button", id: "all-findings", onclick: (event) => {
      event.target.parentElement.remove();
      add(FIRST, page.order.length);
    } }, `Show the other ${grouped(page.order.length - FIRST)}`)));
  }
  if (known > 0) panel.append(h("p", { className: "note" }, `${count(known, "finding")} more are known from the baseline.`));
  return panel;
}

/// How much was evaluated, by chapter: "AL state machine 8/10".
function coverageLine(coverage) {
  const applicable = (c) => c.judged + c.partly + c.not_judged;
  const chapters = coverage.by_chapter.filter((c) => applicable(c) > 0);
  const without = coverage.by_chapter.filter((c) => applicable(c) === 0).map((c) => c.chapter);
  const part = coverage.partly > 0 ? `, ${grouped(coverage.partly)} in part` : "";
  return h("p", { id: "coverage" },
    `Evaluated, each rule once for a slave: ${grouped(coverage.judged)} of ${grouped(applicable(coverage))}${part}: `,
    chapters.map((c, i) => [i > 0 && ", ",
      h("span", { className: "nowrap" }, `${c.chapter} ${grouped(c.judged)}/${grouped(applicable(c))}`)]),
    without.length > 0 && `; not applicable: ${without.join(", ")}`);
}

/// Rules that could not be evaluated, with the slaves they concern.
export function notJudgedPanel(capture) {
  const groups = new Map();
  for (const entry of capture.not_evaluable) {
    const key = `${entry.reason}\u0000${entry.rule}`;
    const group = groups.get(key) ?? { reason: entry.reason, rule: entry.rule, slaves: new Set(), frame: entry.first_frame };
    group.slaves.add(entry.slave ?? (entry.scope === "all-slaves" ? "all" : "bus"));
    groups.set(key, group);
  }
  const byReason = new Map();
  for (const group of groups.values()) {
    const slaves = [...group.slaves].join(", ");
    const key = `${group.reason}\u0000${slaves}`;
    const row = byReason.get(key) ?? { reason: group.reason, slaves, rules: [], frame: group.frame };
    row.rules.push(group.rule);
    byReason.set(key, row);
  }
  const rows = [...byReason.values()];
  return h("section", { className: "panel", id: "not-judged", "aria-labelledby": "not-judged-title" },
    h("h2", { id: "not-judged-title" }, "Not evaluated"),
    capture.coverage.by_chapter.length > 0 && coverageLine(capture.coverage),
    capture.capture_next.length > 0 && h("p", { className: "note", id: "capture-next" }, "To know more, capture next: ",
      capture.capture_next.slice(0, 3).map((a, i) => [i > 0 && "; ", `${a.what} (${count(a.judgements, "rule")})`])),
    rows.length === 0
      ? h("p", { className: "muted" }, "Nothing: every rule had what it needs.")
      : [h("p", { className: "note" }, "The capture does not show enough for these. That is no fault of the machine."),
        h("div", { className: "scroll" }, h("table", { className: "wide" },
          h("thead", null, h("tr", null, ["Why", "Slave", "Rules", "First frame"].map((t) => h("th", { scope: "col" }, t)))),
          h("tbody", null, rows.map((row) => h("tr", null,
            h("td", { className: "long" }, row.reason),
            h("td", null, row.slaves.length > 40 ? `${row.slaves.slice(0, 38)} \u2026` : row.slaves),
            h("td", { className: "mono" }, row.rules.join(", ")),
            h("td", null, row.frame ?? ""))))))]);
}
