// Findings in the order in which they are best read: worst first, each cause before its consequences.
import { copyable, facts, h, table } from "./dom.js";
import { capitalised, count, duration, grouped, hex, seconds, slaveLabel, slaveName, slaveNumber, trim } from "./format.js";
import { matcher } from "./search.js";
import { controlMeaning, statusMeaning } from "./states.js";

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

const place = (bit) => (bit === null ? "\u2013" : `byte ${Math.floor(bit / 8)}${bit % 8 ? ` bit ${bit % 8}` : ""}`);
const length = (bits) => (bits % 8 ? count(bits, "bit") : count(bits / 8, "byte"));

/// Wanted, accepted and resulting layout of a PDO mapping side by side.
function mappingDetails(mapping) {
  const lengths = [
    mapping.wanted_bits !== null && `wanted ${length(mapping.wanted_bits)}`,
    mapping.slave_bits !== null && `in the slave ${mapping.entries.some((row) => row.doubtful) ? "maybe " : ""}${length(mapping.slave_bits)}`,
    mapping.sync_manager_bytes !== null && `sync manager ${count(mapping.sync_manager_bytes, "byte")}`,
  ].filter(Boolean).join(", ");
  return h("details", { className: "more mapping" },
    h("summary", null, `Mapping of the ${mapping.direction} (SM${mapping.sync_manager})${lengths && `: ${lengths}`}`),
    table(mapping.entries, [
      { title: "Entry", value: (row) => row.object },
      { title: "Wanted", value: (row) => row.wanted ?? "\u2013" },
      { title: "Slave", value: (row) => row.slave, long: true },
      { title: "Wanted at", value: (row) => place(row.wanted_bit) },
      { title: "Slave at", value: (row) => `${place(row.slave_bit)}${row.shifted ? ", shifted" : row.doubtful && row.slave_bit !== null && row.slave_bit !== row.wanted_bit ? "?" : ""}` },
      { title: "Frame", value: (row) => row.frame ?? "", num: true },
    ]),
    mapping.entries_left_out > 0 && h("p", { className: "muted" }, `${count(mapping.entries_left_out, "more entry", "more entries")}`));
}

const clock = (time) => (time ? ` (${time.slice(11, 23)} UTC)` : "");

/// Command, state, mode, set point and actual value before a fault or a jump, with what the last two did.
function beforeTable(finding) {
  const note = finding.notes?.find((n) => n.kind === "before");
  if (!note) return null;
  const text = (name) => note.arguments[name]?.text;
  const word = (name, meaning) => {
    const words = note.arguments[name] && meaning(note.arguments[name].value);
    return words ? `${text(name)} ${words}` : text(name);
  };
  const named = (words, object) => (object ? `${words} (${object})` : words);
  const rows = [
    ["Control word", word("control", controlMeaning)], ["Status word", word("status", statusMeaning)], ["Mode", text("mode")],
    [named("Set point", text("target_object")), text("target"), text("target_change")],
    [named("Actual value", text("actual_object")), text("actual"), text("actual_change")],
  ].filter(([, value]) => value !== undefined);
  return table(rows, [
    { title: "Before it", value: ([name]) => name },
    { title: `In ${text("at")}`, value: ([, value]) => value },
    { title: text("span") ? `Change in ${text("span")}` : "Change", value: ([, , change]) => change ?? "" },
  ], null, "before");
}

function findingCard(capture, finding, depth, rules, showInTime) {
  const slave = capture.slaves.find((s) => s.position === finding.slave);
  const where = finding.slave === null ? "Bus" : slave ? slaveLabel(slave) : capitalised(slaveName(capture, finding.slave));
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
    beforeTable(finding),
    Object.keys(finding.evidence).length > 0 &&
      facts(Object.entries(finding.evidence).map(([name, value]) => [name.replaceAll("_", " "), evidenceText(name, value)]), "evidence"),
    (finding.mapping ?? []).map(mappingDetails),
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

/// [{key, list: [[index, depth]]}]: a cause with its consequences; alike by rules and severities.
export function treesOf(capture, order) {
  const trees = [];
  for (const [index, depth] of order) {
    if (depth === 0 || trees.length === 0) trees.push({ list: [], key: "" });
    const tree = trees[trees.length - 1];
    const { rule, severity } = capture.findings[index];
    tree.list.push([index, depth]);
    tree.key += `${depth} ${severity} ${rule}\n`;
  }
  return trees;
}

/// Words and a severity; what fits is shown unfolded.
function findingsFilter(cards, folds) {
  const words = h("input", { type: "search", id: "finding-search", autocomplete: "off" });
  const severity = h("select", { id: "finding-severity", "aria-label": "Severity" },
    ["all", "error", "warning", "info"].map((s) => h("option", { value: s === "all" ? "" : s }, s === "all" ? "all severities" : s)));
  const said = h("span", { role: "status", className: "muted", id: "finding-count" });
  const apply = () => {
    const active = words.value.trim() !== "" || severity.value !== "";
    if (active) for (const { fill } of folds) fill();
    const fits = matcher(words.value);
    let shown = 0;
    for (const { card, finding, text } of cards) {
      card.hidden = !fits(text) || (severity.value !== "" && finding.severity !== severity.value);
      shown += card.hidden ? 0 : 1;
    }
    for (const { details } of folds) {
      details.hidden = active && !details.querySelector("article:not([hidden])");
      details.open = active && !details.hidden;
    }
    said.textContent = active ? `${grouped(shown)} of ${count(cards.length, "finding")}` : "";
  };
  words.addEventListener("input", apply);
  severity.addEventListener("input", apply);
  return h("div", { className: "tools screen" }, h("label", { className: "search", for: "finding-search" }, "Search findings ", words), severity, said);
}

export function findingsPanel(capture, page, rules, showInTime) {
  const panel = h("section", { className: "panel", id: "findings", "aria-labelledby": "findings-title" },
    h("h2", { id: "findings-title" }, "Findings"));
  const known = capture.findings.filter((f) => f.known).length;
  if (page.order.length === 0) {
    panel.append(h("p", { className: "muted" }, known > 0 ? `None but ${count(known, "finding")} that the baseline lists.` : "None."));
    return panel;
  }
  const items = treesOf(capture, page.order);
  const groups = new Map(); // trees that are alike, under the first of them
  for (const tree of items) groups.set(tree.key, [...(groups.get(tree.key) ?? []), tree]);
  const cards = [];
  const make = (tree) => tree.list.map(([index, depth]) => {
    const finding = capture.findings[index];
    const card = findingCard(capture, finding, depth, rules, showInTime);
    const slave = capture.slaves.find((s) => s.position === finding.slave);
    cards.push({ card, finding, text: `${finding.id} ${finding.severity} ${finding.rule} ${finding.title} ${finding.message} ${slave ? slaveLabel(slave) : "bus"}`.toLowerCase() });
    return card;
  });
  const folds = [...groups.values()].map((alike) => {
    const [first, ...rest] = alike;
    panel.append(...make(first));
    if (rest.length === 0) return null;
    const slaves = [...new Set(rest.map((tree) => capture.findings[tree.list[0][0]].slave))].sort((a, b) => a - b)
      .map((position) => capture.slaves.find((s) => s.position === position)?.label ?? "bus");
    const frames = rest.map((tree) => capture.findings[tree.list[0][0]].frame).filter(Boolean);
    const details = h("details", { className: "more alike" }, h("summary", null,
      `${grouped(rest.length)} more like this: ${slaves.length === 1 ? `slave ${slaves[0]}` : `slaves ${slaves.slice(0, 20).join(", ")}${slaves.length > 20 ? " \u2026" : ""}`}` +
        (frames.length ? `, frames ${frames.slice(0, 8).map(grouped).join("; ")}${frames.length > 8 ? " \u2026" : ""}` : "")));
    const fill = () => {
      if (details.dataset.made) return;
      details.dataset.made = "yes";
      for (const tree of rest) details.append(...make(tree));
    };
    details.addEventListener("toggle", fill);
    panel.append(details);
    return { details, fill };
  }).filter(Boolean);
  panel.addEventListener("all", () => folds.forEach(({ fill }) => fill()));
  if (page.order.length > 3) panel.querySelector("h2").after(findingsFilter(cards, folds));
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
    `A check is one rule for one slave. Of ${count(applicable(coverage), "check")} that apply to this bus, the capture shows enough for ${grouped(coverage.judged)}` +
      `${coverage.partly > 0 ? `, for ${grouped(coverage.partly)} only during a part of it` : ""}; for ${grouped(coverage.not_judged)} it does not, so nothing is known there, good or bad. `,
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
    group.slaves.add(entry.slave !== null ? slaveNumber(capture, entry.slave) : (entry.scope === "all-slaves" ? "all" : "bus"));
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
