// What is known of each slave; its content is made when it is opened.
import { closeOf } from "./close.js";
import { append, facts, h, table } from "./dom.js";
import { count, duration, grouped, hex, number, objectName, seconds, slaveLabel, trim, withUnit } from "./format.js";
import { stateStrips } from "./lanes.js";
import { bitStrips, extremes, histogramChart, seriesChart } from "./plots.js";
import { FrameIndex, Track } from "./track.js";
import { alColor, commandSegments, driveColor, driveSegments } from "./states.js";

export function stateChip(text, color) {
  return h("span", { className: "state" }, h("i", { className: `swatch bg-${color}` }), text);
}

export function alChip(slave) {
  const { state, error, status_code: code } = slave.al;
  if (!state) return h("span", { className: "muted" }, "not seen");
  return stateChip(state + (error ? "+ERR" : "") + (error && code ? ` ${hex(code)}` : ""), alColor(state, error));
}

export function driveChip(slave) {
  if (!slave.drive) return null;
  return slave.drive.state ? stateChip(slave.drive.state, driveColor(slave.drive.state)) : h("span", { className: "muted" }, "unknown");
}

export function identityText(slave) {
  const id = slave.identity;
  if (id.vendor_id === null && id.product_code === null) return "not in the capture";
  const part = (value) => (value === null ? "?" : hex(value, 8));
  return `vendor ${part(id.vendor_id)}, product ${part(id.product_code)}, revision ${part(id.revision)}` +
    (id.serial ? `, serial ${id.serial}` : "");
}

const frame = (number) => (number === null || number === undefined ? "" : grouped(number));
const part = (title, ...content) => (content.flat().some(Boolean) ? [h("h3", null, title), ...content] : []);

/// Tables longer than this are folded.
function folded(rows, columns, noun, limit = 30) {
  if (rows.length <= limit) return table(rows, columns);
  return [
    table(rows.slice(0, limit), columns),
    h("details", { className: "more" }, h("summary", null, `The other ${count(rows.length - limit, noun)}`), table(rows.slice(limit), columns)),
  ];
}

const KINDS = { write: "write", eeprom: "EEPROM", request: "state request", download: "SDO write", upload: "SDO read", drive: "control word" };

/// Texts of registers begin with their name, which stands beside them already.
const stepValue = (step) => (step.text?.startsWith(`${step.name}: `) ? step.text.slice(step.name.length + 2) : (step.text ?? ""));

function stepOutcome(step) {
  const differs = step.read_back?.differs;
  return [
    step.outcome === "refused" && h("span", { className: "badge warning" }, step.code ? `refused ${hex(step.code)}` : "refused"),
    step.outcome === "unknown" && h("span", { className: "muted" }, "not known"),
    differs && h("span", { className: "badge warning" }, `read back in frame ${frame(step.read_back.frame)}: ${step.read_back.text}`),
    step.note && h("span", { className: "muted" }, ` ${step.note}`),
  ];
}

/// What the master did from the scan to operation, phase by phase, and each step below it.
export function startUp(startup, title = "Start-up") {
  if (!startup) return [];
  return part(title,
    facts([
      ["Reached", startup.reached],
      ["Attempts", startup.attempts > 1 ? `${startup.attempts}, the last from frame ${frame(startup.again_frame)} on` : null],
    ], "evidence"),
    table(startup.phases, [
      { title: "Phase", value: (p) => p.phase },
      { title: "Frames", value: (p) => (p.frame === null ? "" : p.frame === p.last_frame ? frame(p.frame) : `${frame(p.frame)} to ${frame(p.last_frame)}`) },
      { title: "At", value: (p) => seconds(p.time_s), num: true },
      { title: "Took", value: (p) => duration(p.duration_ms), num: true },
      { title: "Accesses", value: (p) => grouped(p.accesses), num: true },
      { title: "Result", value: (p) => (p.failed ? h("span", { className: "badge error" }, p.result ?? "failed") : (p.result ?? "")), long: true },
    ]),
    startup.steps.length > 0 && h("details", { className: "more" }, h("summary", null, count(startup.steps.length, "step")),
      table(startup.steps, [
        { title: "Frame", value: (s) => frame(s.frame), num: true },
        { title: "At", value: (s) => seconds(s.time_s), num: true },
        { title: "Phase", value: (s) => h("span", { className: "nowrap" }, s.phase) },
        { title: "Kind", value: (s) => h("span", { className: "nowrap" }, KINDS[s.kind] ?? s.kind) },
        { title: "What", value: (s) => [s.kind === "request" ? s.state : s.name, s.count > 1 && h("span", { className: "muted" }, `, ${count(s.count, "time")}`)], long: true },
        { title: "Value", value: stepValue, long: true },
        { title: "Outcome", value: stepOutcome },
      ])),
    startup.steps_left_out > 0 && h("p", { className: "note" }, `${count(startup.steps_left_out, "later step")} left out.`));
}

function alStory(slave) {
  const steps = slave.al.history;
  // How long a request took until the state that answers it, and each state until the next.
  const rows = steps.map((step, i) => {
    const next = steps.slice(i + 1).find((s) => s.kind === "state");
    return { step, lasts: next && next.time_s !== null && step.time_s !== null ? (next.time_s - step.time_s) * 1000 : null };
  });
  return part("AL states",
    folded(rows, [
      { title: "Frame", value: ({ step }) => frame(step.frame), num: true },
      { title: "At", value: ({ step }) => seconds(step.time_s), num: true },
      { title: "What", value: ({ step }) => step.kind === "request"
        ? h("span", null, `${step.to} requested`, step.acknowledge && h("span", { className: "muted" }, " with acknowledge"),
          step.refused_by_wkc && h("span", { className: "muted" }, " (no slave took it)"))
        : stateChip(step.to + (step.error ? "+ERR" : ""), alColor(step.to, step.error)) },
      { title: "AL status code", value: ({ step }) => (step.status_code ? hex(step.status_code) : ""), num: true },
      { title: "Until the next state", value: ({ lasts }) => duration(lasts), num: true },
    ], "step"),
    slave.al.history_left_out > 0 && h("p", { className: "note" }, `${count(slave.al.history_left_out, "later step")} left out.`));
}

function drive(slave) {
  if (!slave.drive) return [];
  const d = slave.drive;
  const mode = (value, name) => (value === null ? null : `${value}${name ? ` ${name}` : ""}`);
  return part("Drive",
    facts([
      ["State", d.state],
      ["Status word", d.status_word === null ? null : `${hex(d.status_word)}`],
      ["Control word", d.control_word === null ? null : `${hex(d.control_word)}`],
      ["Mode requested", mode(d.mode.requested, d.mode.requested_name)],
      ["Mode shown", mode(d.mode.shown, d.mode.shown_name)],
      ["Faults", d.faults || null],
      ["Enabled", d.enable_sequence.join("; ")],
    ], "evidence"),
    folded(d.history, [
      { title: "Frame", value: (s) => frame(s.frame), num: true },
      { title: "At", value: (s) => seconds(s.time_s), num: true },
      { title: "What", value: (s) => s.kind === "state" ? stateChip(s.text, driveColor(s.to ?? "")) : s.text, long: true },
      { title: "Reaction", value: (s) => duration(s.reaction_ms), num: true },
    ], "step"),
    d.history_left_out > 0 && h("p", { className: "note" }, `${count(d.history_left_out, "later step")} left out.`));
}

const SOURCES = { observed: "as written or read in the capture", default: "the drive's default by EEPROM or ESI", eni: "by the ENI file", unknown: "not known" };

function mappingTable(title, objects, bytes, source, reason, exchanged) {
  if (objects.length === 0 && !exchanged.datagrams) return null;
  const text = [
    bytes !== null && count(bytes, "byte"),
    source !== "unknown" && SOURCES[source],
    reason,
    exchanged.datagrams > 0 && `exchanged ${count(exchanged.datagrams, "time")}, frames ${frame(exchanged.first_frame)} to ${frame(exchanged.last_frame)}`,
  ].filter(Boolean).join("; ");
  return h("div", null,
    table(objects, [
      { title: "PDO", value: (o) => objectName(o.pdo) },
      { title: "Object", value: (o) => (o.index === 0 ? "gap" : objectName(o.index, o.subindex)) },
      { title: "Name", value: (o) => [o.name ?? "", o.name_source === "inferred" && h("span", { className: "muted" }, " (inferred)")], long: true },
      { title: "Bits", value: (o) => o.bits, num: true },
      { title: "Byte", value: (o) => trim(o.bit_offset / 8, 3), num: true },
    ], `${title}: ${text}`) ?? h("p", { className: "note" }, `${title}: ${text}`));
}

function mapping(slave) {
  const p = slave.pdo;
  const tables = [
    mappingTable("Outputs (master to slave)", p.rx, p.rx_bytes, p.rx_source, p.rx_reason, p.rx_exchanged),
    mappingTable("Inputs (slave to master)", p.tx, p.tx_bytes, p.tx_source, p.tx_reason, p.tx_exchanged),
  ].filter(Boolean);
  return part("Process data", tables.length > 0 && h("div", { className: "two" }, tables));
}

function varies(series) {
  const [low, high] = extremes(series);
  return low !== high;
}

/// Words of bits are read in hexadecimal, everything else is a number.
const isWord = (signal) => signal.word;

function signals(slave, drawn, axis, frames) {
  if (!drawn || drawn.signals.length === 0) return [];
  const name = (s) => s.variable ?? s.name ?? objectName(s.index, s.subindex);
  const commands = slave.drive ? commandSegments(slave, axis.full.max) : [];
  const states = driveSegments(slave, axis.full.max);
  const asStates = states.length > 0 && slave.drive.source === "process data";
  const words = drawn.signals.filter((s) => s.values && (s.index === 0x6041 || s.index === 0x6040));
  const shown = drawn.signals.filter((s) => s.values && !(asStates && (s.index === 0x6041 || (s.index === 0x6040 && commands.length > 0))));
  const constant = (s) => {
    const [low, high] = extremes(s.values);
    return low === high ? low : null;
  };
  const still = shown.filter((s) => constant(s) !== null);
  return part("Signals",
    asStates && h("figure", { className: "chart" },
      h("figcaption", null, h("span", null, h("b", null, "Control and status word"), h("span", { className: "muted" }, " 6040h, 6041h, as command and state"))),
      stateStrips(axis, [commands.length > 0 && { label: "command", segments: commands }, { label: "state", segments: states }].filter(Boolean),
        "Commands and states of the drive over time; the table above lists them.")),
    asStates && words.filter((s) => constant(s) === null).map((s) => {
      const bits = bitStrips(axis, new Track(s.values, closeOf(drawn, s)), s.index, s.bits);
      return bits && h("div", null, h("p", { className: "under" }, `${name(s)} (${objectName(s.index, s.subindex)})`), bits);
    }),
    shown.filter((s) => constant(s) === null).map((s) => seriesChart(axis, {
      frames, index: s.index, bits: s.bits,
      title: name(s),
      note: `${objectName(s.index, s.subindex)}${s.variable && s.name ? ` ${s.name}` : ""}, ${s.direction}${s.name_inferred ? ", name inferred" : ""}`,
      unit: s.unit,
      series: s.values,
      close: closeOf(drawn, s),
      word: isWord(s),
      stepped: isWord(s) || s.bits <= 8,
    })),
    still.length > 0 && [h("p", { className: "note" }, "The same value throughout:"),
      facts(still.map((s) => [`${name(s)} (${objectName(s.index, s.subindex)})`,
        withUnit(isWord(s) ? hex(constant(s)) : number(constant(s)), s.unit)]), "evidence")]);
}

function sdos(drawn) {
  if (!drawn || drawn.sdos.length === 0) return [];
  return part("SDO transfers",
    folded(drawn.sdos, [
      { title: "Frame", value: (s) => frame(s.request_frame ?? s.response_frame), num: true },
      { title: "At", value: (s) => seconds(s.time_s), num: true },
      { title: "Kind", value: (s) => (s.service === "download" ? "write" : "read") },
      { title: "Object", value: (s) => (s.index === null ? "not known" : objectName(s.index, s.complete_access ? null : s.subindex) + (s.complete_access ? " all" : "")) },
      { title: "Name", value: (s) => s.name ?? "", long: true },
      { title: "Value", value: (s) => s.outcome === "aborted"
        ? [h("span", { className: "badge warning" }, `abort ${hex(s.abort_code, 8)}`), ` ${s.abort_text ?? ""}`]
        : s.outcome === "completed" ? (s.value ?? "") : [h("span", { className: "badge warning" }, s.outcome), ` ${s.value ?? ""}`], long: true },
      { title: "Took", value: (s) => duration(s.duration_ms), num: true },
    ], "transfer"),
    drawn.sdos_left_out > 0 && h("p", { className: "note" }, `${count(drawn.sdos_left_out, "later transfer")} left out.`));
}

function clocks(slave, drawn, axis) {
  if (!slave.dc) return [];
  const dc = slave.dc;
  const phase = dc.phase;
  const us = (value) => `${trim(value, 3)} \u00b5s`;
  return part("Distributed clocks",
    facts([
      ["Role", dc.reference ? "reference clock" : null],
      ["Propagation delay", dc.delay_ns === null ? null : `${grouped(dc.delay_ns)} ns`],
      ["Offset", dc.offset_ns === null ? null : `${grouped(dc.offset_ns)} ns`],
      ["SYNC0 cycle", dc.activated?.sync0_cycle_ns ? duration(dc.activated.sync0_cycle_ns / 1e6) : null],
      ["Switched on", dc.activated ? `frame ${frame(dc.activated.frame)}` : null],
      ["Difference", dc.difference ? `last ${dc.difference.last_ns} ns, at most ${dc.difference.max_ns} ns (frame ${frame(dc.difference.max_frame)})` : null],
      ["Frames behind SYNC0", phase ? `${us(phase.min_us)} to ${us(phase.max_us)}, mean ${us(phase.mean_us)}` : null],
      ["Nearest to a pulse", phase ? `${us(phase.margin_us)} in frame ${frame(phase.margin_frame)}` : null],
      ["Intervals without a frame", phase && phase.empty_intervals ? grouped(phase.empty_intervals) : null],
      ["Intervals with two", phase && phase.double_intervals ? grouped(phase.double_intervals) : null],
    ], "evidence"),
    (drawn?.phase_us || phase) && h("div", { className: drawn?.phase_us && phase ? "pair" : null },
      drawn?.phase_us && seriesChart(axis, { title: "End of process data behind SYNC0", unit: "\u00b5s", series: drawn.phase_us }),
      phase && histogramChart({
        title: "Distribution", unit: "\u00b5s",
        bins: trimBins(phase.histogram.counts.map((n, i) => ({ from: i * phase.histogram.bin_us, to: (i + 1) * phase.histogram.bin_us, count: n }))),
        note: dc.activated?.sync0_cycle_ns ? `within a cycle of ${duration(dc.activated.sync0_cycle_ns / 1e6)}` : "",
      })),
    drawn?.difference_ns && varies(drawn.difference_ns) && seriesChart(axis, { title: "Difference to the system time (0x092C)", unit: "ns", series: drawn.difference_ns }),
    dc.configuration.length > 0 && h("details", { className: "more" }, h("summary", null, `${count(dc.configuration.length, "write")} that set it up`),
      table(dc.configuration, [
        { title: "Frame", value: (s) => frame(s.frame), num: true },
        { title: "At", value: (s) => seconds(s.time_s), num: true },
        { title: "Register", value: (s) => `${hex(s.address)} ${s.register ?? ""}`, long: true },
        { title: "Value", value: (s) => s.text, long: true },
        { title: "Outcome", value: (s) => (s.refused ? "not taken" : s.broadcast ? "broadcast" : "") },
      ])));
}

function trimBins(bins) {
  const first = bins.findIndex((b) => b.count > 0);
  if (first < 0) return [];
  const last = bins.length - 1 - [...bins].reverse().findIndex((b) => b.count > 0);
  return bins.slice(Math.max(0, first - 1), last + 2);
}

/** An edge that was armed and never became valid captured nothing. */
function captureTitle(captures) {
  const captured = captures.filter((c) => c.valid_frame !== null).length;
  const without = captures.length - captured;
  return count(captured, "captured position") + (without > 0 ? `, ${without} armed without a capture` : "");
}

function latches(slave) {
  const latch = slave.latch;
  if (!latch) return [];
  return part("Latches",
    facts([
      ["Control word", latch.control === null ? null : `${hex(latch.control)} by ${latch.control_source}`],
      ["Status word", latch.status === null ? null : `${hex(latch.status)} by ${latch.status_source}`],
      ["Digital inputs", latch.digital_inputs.map((i) => `${i.input}: ${i.state ? "on" : "off"}, ${count(i.changes, "change")}`).join("; ")],
    ], "evidence"),
    table(latch.edges.filter((e) => e.armed || e.valid || e.read), [
      { title: "Edge", value: (e) => e.edge, long: true },
      { title: "Armed", value: (e) => e.armed, num: true },
      { title: "Valid", value: (e) => e.valid, num: true },
      { title: "Read", value: (e) => e.read, num: true },
      { title: "Lost", value: (e) => e.lost, num: true },
    ]),
    latch.captures.length > 0 && h("details", { className: "more" }, h("summary", null, captureTitle(latch.captures)),
      table(latch.captures, [
        { title: "Edge", value: (c) => c.edge, long: true },
        { title: "Armed", value: (c) => frame(c.armed_frame), num: true },
        { title: "Valid", value: (c) => frame(c.valid_frame), num: true },
        { title: "Read", value: (c) => frame(c.read_frame), num: true },
        { title: "Position", value: (c) => (c.position === null ? "" : grouped(c.position)), num: true },
        { title: "Arm to valid", value: (c) => duration(c.arm_to_valid_ms), num: true },
        { title: "Valid to read", value: (c) => duration(c.valid_to_read_ms), num: true },
      ])));
}

function mailbox(slave) {
  const m = slave.mailbox;
  if (!m.requests && !m.responses) return [];
  const used = Object.entries(m.by_protocol).map(([name, n]) => `${name} ${n.requests}/${n.responses}`).join(", ");
  return part("Mailbox", facts([
    ["Requests", grouped(m.requests)], ["Responses", grouped(m.responses)], ["Protocols (out/in)", used],
    ["SDO read", m.sdo_uploads || null], ["SDO written", m.sdo_downloads || null], ["Aborted", m.aborts || null],
    ["Emergencies", m.emergencies || null], ["Error replies", m.error_replies || null], ["Unanswered", m.unanswered || null],
  ], "evidence"));
}

function memory(slave) {
  if (slave.sync_managers.length + slave.fmmus.length === 0) return [];
  return part("Sync managers and FMMUs",
    table(slave.sync_managers, [
      { title: "SM", value: (m) => m.number },
      { title: "Start", value: (m) => hex(m.start) },
      { title: "Length", value: (m) => m.length, num: true },
      { title: "Mode", value: (m) => `${m.mode}, ${m.direction}` },
      { title: "Enabled", value: (m) => (m.enabled ? "yes" : "no") },
      { title: "Frame", value: (m) => frame(m.frame), num: true },
    ]),
    table(slave.fmmus, [
      { title: "FMMU", value: (f) => f.number },
      { title: "Logical", value: (f) => `${hex(f.logical_start, 8)}:${f.logical_start_bit}` },
      { title: "Length", value: (f) => f.length, num: true },
      { title: "Physical", value: (f) => `${hex(f.physical_start)}:${f.physical_start_bit}` },
      { title: "Does", value: (f) => [f.read && "read", f.write && "write"].filter(Boolean).join(", ") },
      { title: "Active", value: (f) => (f.active ? "yes" : "no") },
      { title: "Frame", value: (f) => frame(f.frame), num: true },
    ]));
}

export function slavePanel(capture, page, slave, axis) {
  const drawn = page.timeline?.slaves.find((s) => s.slave === slave.position);
  const findings = capture.findings.filter((f) => f.slave === slave.position && !f.known);
  const details = h("details", { className: "panel slave", id: `slave-${slave.position}` },
    h("summary", null,
      h("h3", null, slaveLabel(slave)),
      alChip(slave), driveChip(slave),
      findings.length > 0 && h("span", { className: `badge ${worst(findings)}` }, count(findings.length, "finding"))));
  let made = false;
  details.addEventListener("toggle", () => {
    if (!details.open || made) return;
    made = true;
    append(details, [
      facts([
        ["Position", slave.position_source === "inferred" ? `${slave.position}, inferred from the station address` : String(slave.position)],
        ["Alias", slave.alias ? hex(slave.alias) : null],
        ["Identity", identityText(slave)],
        ["Family", slave.profile ? `${slave.profile} (${slave.profile_source ?? ""})` : null],
      ], "evidence"),
      findings.length > 0 && h("p", { className: "chain" }, "Findings: ", findings.slice(0, 12).map((f, i) => [i > 0 && ", ", h("a", { href: `#finding-${f.id}` }, `${f.id} ${f.title}`)]),
        findings.length > 12 && ` and ${findings.length - 12} more`),
      startUp(slave.startup), alStory(slave), drive(slave), signals(slave, drawn, axis, new FrameIndex(page.timeline?.frames)), mapping(slave), latches(slave),
      clocks(slave, drawn, axis), sdos(drawn), mailbox(slave), memory(slave),
    ]);
  });
  return details;
}

/// A slave that no frame addresses: the ENI file tells where its process data lie.
export function unmetPanel(drawn, number, axis, frames) {
  const { position, station_address: address, name } = drawn.eni;
  const label = [name, position !== null && `position ${position}`, address !== null && hex(address)].filter(Boolean).join(", ");
  return h("details", { className: "panel slave", id: `eni-slave-${number}`, open: true },
    h("summary", null, h("h3", null, label || "Slave of the ENI file"), h("span", { className: "muted" }, "not addressed in the capture, known from the ENI file")),
    signals({ drive: null }, drawn, axis, frames));
}

export function worst(findings) {
  return ["error", "warning", "info"].find((s) => findings.some((f) => f.severity === s));
}
