// The first screen: verdict, the sentence that matters, and the bus.
import { copyable, facts, h, table } from "./dom.js";
import { count, duration, fileName, grouped, hex, shellWord } from "./format.js";
import { ranges } from "./lanes.js";
import { alChip, driveChip, identityText, worst } from "./slaves.js";

const STAMPS = { FAIL: "fail", UNMET: "fail", PASS: "pass" };
/// More than this, and those that are alike share a row.
const MANY_SLAVES = 6;

/// Slaves with the same device, states and no findings: [[slave, ...]], in the order of the first of each.
export function alikeSlaves(slaves, quiet) {
  const groups = new Map();
  for (const slave of slaves) {
    const { vendor_id, product_code, revision } = slave.identity;
    const key = slaves.length > MANY_SLAVES && quiet(slave)
      ? JSON.stringify([slave.name, vendor_id, product_code, revision, slave.profile, slave.al.state, slave.al.error, slave.al.status_code, slave.drive?.state])
      : `one ${slave.position}`;
    groups.set(key, [...(groups.get(key) ?? []), slave]);
  }
  return [...groups.values()];
}

function cycleText(cycle) {
  if (!cycle.cycles) return null;
  const sources = { dc: "DC time", esl: "the probe's time", capture: "capture time" };
  return [`${duration(cycle.median_us / 1000)} `, h("small", null, `median, by ${sources[cycle.time_source] ?? cycle.time_source}`)];
}

function directionText(direction) {
  return { both: "both directions", outbound: "outbound only", returned: "returned only" }[direction] ?? direction;
}

export function summaryPanel(capture, page) {
  const c = capture.capture;
  const s = capture.summary;
  const badge = (n, noun, kind) => n > 0 && h("span", { className: `badge ${kind}` }, count(n, noun));
  return h("section", { className: "panel", id: "summary", "aria-label": "Verdict" },
    h("div", { className: "verdict" },
      h("span", { className: `stamp ${STAMPS[page.verdict] ?? "none"}` }, page.verdict.replaceAll("-", " ")),
      h("h1", null, page.sentence.charAt(0).toUpperCase() + page.sentence.slice(1)),
      h("p", { className: "file" }, fileName(c.path), " ",
        badge(s.errors, "error", "error"), badge(s.warnings, "warning", "warning"), badge(s.infos, "info", "info"),
        badge(s.known, "known finding", "plain"))),
    facts([
      ["Captured", c.first_time ? `${c.first_time.slice(0, 10)} ${c.first_time.slice(11, 19)} UTC` : null],
      ["Duration", c.duration_s !== null ? duration(c.duration_s * 1000) : null],
      ["EtherCAT frames", [grouped(c.ethercat_frames), " ", h("small", null, c.packets === c.ethercat_frames ? directionText(c.direction) : `of ${count(c.packets, "packet")}, ${directionText(c.direction)}`)]],
      ["Slaves", capture.slaves.length ? String(capture.slaves.length) : null],
      ["Cycle", cycleText(capture.bus.cycle)],
      ["Lost frames", capture.bus.lost_frames ? grouped(capture.bus.lost_frames) : "none"],
      ["Damaged", c.damage ? c.damage.message : null],
    ], "facts"));
}

export function busPanel(capture) {
  if (capture.slaves.length === 0) return null;
  const drives = capture.slaves.some((s) => s.drive);
  const findingsOf = (slave) => capture.findings.filter((f) => f.slave === slave.position && !f.known);
  const columns = [
    { title: "Slave", value: ([s, ...others]) => (others.length === 0 ? h("a", { href: `#slave-${s.position}` }, s.label)
      : [h("a", { href: `#slave-${s.position}` }, ranges([s, ...others].map((o) => Number(o.label)))),
        h("span", { className: "muted small" }, ` ${others.length + 1} alike`)]) },
    { title: "Address", value: (all) => {
      const known = all.map((s) => s.station_address).filter((a) => a !== null);
      return known.length < 2 ? known.map((a) => hex(a)).join() : `${hex(Math.min(...known))} to ${hex(Math.max(...known))}`;
    } },
    { title: "Device", value: ([s]) => [s.name ?? "", s.name && h("br"), h("span", { className: "muted small" }, identityText(s))], long: true },
    { title: "Family", value: ([s]) => h("span", { className: "nowrap" }, s.profile ?? "") },
    { title: "AL state at the end", value: ([s]) => alChip(s) },
    ...(drives ? [{ title: "Drive at the end", value: ([s]) => driveChip(s) ?? "" }] : []),
    { title: "Findings", value: ([s]) => {
      const found = findingsOf(s);
      return found.length === 0 ? h("span", { className: "muted" }, "none")
        : h("span", { className: `badge ${worst(found)}` }, grouped(found.length));
    } },
  ];
  const quiet = (s) => findingsOf(s).length === 0;
  return h("section", { className: "panel", id: "bus", "aria-labelledby": "bus-title" },
    h("h2", { id: "bus-title" }, "Bus"),
    table(alikeSlaves(capture.slaves, quiet), columns, null, "wide"));
}

/// As it was typed: "--slave 0 --to #100".
function limits(settings) {
  const range = settings.range ?? {};
  const given = (option, value) => (value === null || value === undefined ? [] : [`${option} ${value}`]);
  const frame = (number) => (number === null || number === undefined ? null : `#${number}`);
  // How slaves are counted limits nothing, but the numbers after --slave need it.
  const counted = settings.slaves?.length ? given("--count-from", settings.count_from) : [];
  return [...counted, ...(settings.slaves ?? []).map((s) => `--slave ${s}`), ...given("--from", range.from_s),
    ...given("--from", frame(range.from_frame)), ...given("--to", range.to_s), ...given("--to", frame(range.to_frame))].join(" ");
}

/// The command that copies the frames of the first finding. Findings are numbered anew without the range, and a capture
/// of several files or of standard input has no name to give, so then there is none.
function sliceHint(capture) {
  const file = capture.capture.path;
  const finding = capture.findings.find((f) => f.frame !== null);
  if (!finding || capture.settings.range || file === "-" || file.includes(", ")) return null;
  const typed = capture.settings.slaves ?? [];
  const counted = capture.settings.count_from && typed.length ? ` --count-from ${capture.settings.count_from}` : "";
  const slaves = counted + typed.map((s) => ` --slave ${s}`).join("");
  const rules = Object.entries(capture.settings.rules ?? {}).map(([id, severity]) => ` --rule ${id}=${severity}`).join("");
  return h("p", { className: "note" }, "This copies the frames of a finding: ",
    copyable(`ecaudit slice ${shellWord(file)}${slaves}${rules} --finding ${finding.id} -o ${finding.id}.pcapng`, "command"));
}

export function capturePanel(capture, report) {
  const c = capture.capture;
  const p = capture.bus.predictions;
  const prediction = (one) => (one.made === 0 ? null : `${grouped(one.held)} of ${grouped(one.made)} right`);
  return h("section", { className: "panel", id: "capture", "aria-labelledby": "capture-title" },
    h("h2", { id: "capture-title" }, "Capture"),
    facts([
      ["File", c.path], ["Format", c.format],
      ["Interfaces", c.interfaces.map((i) => (i.name ?? "without name") + (i.dropped ? ` (${count(i.dropped, "packet")} dropped)` : "")).join(", ")],
      ["Packets", grouped(c.packets)], ["Datagrams", grouped(c.datagrams)],
      ["Outbound, returned", `${grouped(c.outbound_frames)}, ${grouped(c.returned_frames)}`],
      ["Other packets", c.other_packets ? grouped(c.other_packets) : null],
      ["Malformed", c.malformed_frames || null], ["Cut", c.cut_frames || null],
      ["Time stamps", c.timestamp_resolution_ns ? `in steps of ${duration(c.timestamp_resolution_ns / 1e6)}` : "none"],
      ["Limited by", limits(capture.settings)],
      ["Slaves counted from", capture.settings.count_from ? `${capture.settings.count_from} (position 0 is slave ${capture.settings.count_from})` : null],
      ["Settings", capture.settings.config], ["Baseline", capture.settings.baseline],
    ], "evidence"),
    h("h3", null, "How well the models foretold it"),
    facts([
      ["Answers to state requests", prediction(p.al_answers)],
      ["Mailbox accesses", prediction(p.mailbox_accesses)],
      ["Working counters", prediction(p.working_counters)],
    ], "evidence"),
    c.comments.length > 0 && h("details", { className: "more" }, h("summary", null, count(c.comments.length, "comment")),
      table(c.comments, [
        { title: "Frame", value: (x) => x.frame ?? "file", num: true },
        { title: "Comment", value: (x) => x.text, long: true },
      ])),
    h("p", { className: "note" }, `Made by ecaudit ${report.tool.version}. 'ecaudit explain RULE' tells what a rule checks.`),
    sliceHint(capture));
}
