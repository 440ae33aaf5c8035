// How far each slave and axis got: the ladder as a picture, a row of rungs for each, from the lowest on. Alike slaves share
// a row. A rung that fails leads to its finding, one that is reached to its moment in the time line.
import { h } from "./dom.js";
import { hex, seconds } from "./format.js";

const MANY_ROWS = 24;
const GLYPHS = { reached: "\u2713", lost: "\u2717", "not-reached": "\u2717", "not-asked": "\u2013", unknown: "?" };
const WORDS = { reached: "reached", lost: "lost", "not-reached": "wanted and not reached", "not-asked": "not asked for", unknown: "not known" };
const NAMES = {
  answers: "answers", known: "identity", preop: "PREOP", mailbox: "mailbox", configured: "configured", safeop: "SAFEOP",
  exchange: "process data", op: "OP", sync: "in sync", "no-fault": "no fault", voltage: "voltage", enabled: "enabled",
  mode: "mode", commanded: "commanded", follows: "follows",
};

const fails = (rung) => rung.status === "lost" || rung.status === "not-reached";

/// The ladders of one slave: its own, and one for each axis.
function laddersOf(slave) {
  const many = slave.axes.length > 1 || slave.axes.some((axis) => axis.axis > 1);
  return [{ name: null, rungs: slave.progress },
    ...slave.axes.map((axis) => ({ name: many ? `axis ${axis.axis}` : "drive", rungs: axis.progress }))];
}

/// What two slaves have alike when a reader learns nothing from a second row: all but frames and times.
function keyOf(slave, findings) {
  return JSON.stringify(laddersOf(slave).map(({ name, rungs }) => [name, rungs.map((r) =>
    [r.rung, r.status, r.why, r.until_frame !== null, findings.get(r.finding)?.rule])]));
}

function chip(rung, count, findings, showInTime) {
  const finding = findings.get(rung.finding);
  const since = rung.frame !== null && `from frame ${rung.frame}${rung.time_s !== null ? ` (${seconds(rung.time_s)})` : ""}`;
  const until = rung.until_frame !== null && `until frame ${rung.until_frame}${rung.until_s !== null ? ` (${seconds(rung.until_s)})` : ""}`;
  const words = [`${NAMES[rung.rung] ?? rung.rung}: ${WORDS[rung.status]}`, count === 1 && since, count === 1 && until, rung.text,
    finding && `${finding.id} ${finding.title}`].filter(Boolean).join(", ");
  const content = [h("span", { className: "glyph", "aria-hidden": "true" }, GLYPHS[rung.status]), h("span", null, NAMES[rung.rung] ?? rung.rung)];
  const attributes = { className: `rung ${rung.status}`, title: words, "aria-label": words };
  if (finding) return h("a", { ...attributes, href: `#finding-${finding.id}` }, content);
  const time = fails(rung) ? (rung.until_s ?? rung.time_s) : rung.time_s;
  if (time !== null && showInTime) {
    return h("button", { ...attributes, type: "button", onclick: () => showInTime({ id: null, slave: null, time_s: time }) }, content);
  }
  return h("span", { ...attributes, role: "img" }, content);
}

/// The first rung that was wanted and is not there, in words.
function heldText(rungs, findings) {
  const failed = rungs.find(fails);
  if (!failed) return null;
  const finding = findings.get(failed.finding);
  return h("p", { className: "held" }, `${NAMES[failed.rung] ?? failed.rung} ${WORDS[failed.status]}`, failed.text && `: ${failed.text}`,
    finding && [" (", h("a", { href: `#finding-${finding.id}` }, `${finding.id} ${finding.title}`), ")"]);
}

function row({ slaves }, findings, showInTime) {
  const [slave] = slaves;
  const last = slaves[slaves.length - 1];
  const label = slaves.length === 1
    ? [h("a", { href: `#slave-${slave.position}` }, `Slave ${slave.label}`), " ",
      h("span", { className: "muted" }, [slave.place, slave.name || (slave.station_address !== null ? hex(slave.station_address) : "")].filter(Boolean).join(", "))]
    : [h("a", { href: `#slave-${slave.position}` }, `Slaves ${slave.label}\u2013${last.label}`), " ", h("span", { className: "muted" }, "alike")];
  return h("div", { className: "ladder", "data-slaves": slaves.map((s) => s.position).join(" ") },
    h("div", { className: "who" }, label),
    laddersOf(slave).map(({ name, rungs }) => h("div", { className: "rungs", role: "group", "aria-label": name ?? "slave" },
      name && h("span", { className: "muted small" }, name),
      rungs.map((rung) => chip(rung, slaves.length, findings, showInTime)),
      heldText(rungs, findings))));
}

/// Neighbours that are alike.
export function groupsOf(slaves, findings) {
  const groups = [];
  for (const slave of slaves) {
    const key = keyOf(slave, findings);
    const before = groups[groups.length - 1];
    if (before?.key === key) before.slaves.push(slave);
    else groups.push({ key, slaves: [slave] });
  }
  return groups;
}

export function progressPanel(capture, showInTime) {
  const slaves = capture.slaves.filter((s) => s.progress?.length > 0);
  if (slaves.length === 0) return null;
  const findings = new Map(capture.findings.map((f) => [f.id, f]));
  const groups = groupsOf(slaves, findings);
  const failing = (group) => laddersOf(group.slaves[0]).some(({ rungs }) => rungs.some(fails));
  const shown = groups.length <= MANY_ROWS ? groups : groups.filter((group, i) => i < MANY_ROWS || failing(group));
  const rest = groups.filter((group) => !shown.includes(group));
  return h("section", { className: "panel", id: "progress", "aria-labelledby": "progress-title" },
    h("h2", { id: "progress-title" }, "Progress"),
    h("p", { className: "note" }, "What each slave and axis reached, from the first step on. \u2717 was wanted and is not there; \u2013 was not asked for, which is healthy."),
    shown.map((group) => row(group, findings, showInTime)),
    rest.length > 0 && h("details", { className: "more" }, h("summary", null, `${rest.length} more rows, none fails`),
      rest.map((group) => row(group, findings, showInTime))));
}
