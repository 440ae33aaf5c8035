// The time line over all slaves: a lane each, with AL states, drive states, mailbox activity and findings.
import uPlot from "uplot";
import { clock, clockText } from "./axis.js";
import { closeOf, closeRange, spread } from "./close.js";
import { savePng, saveSvg } from "./export.js";
import { copyable, h } from "./dom.js";
import { count, duration, fileName, grouped, hex, shellWord, slaveNumber, trim } from "./format.js";
import { overlay } from "./overlay.js";
import { css, drawCursors, followTime, live, LEFT, mount, selectTime, timeAxis, timeCursor } from "./plots.js";
import { FrameIndex } from "./track.js";
import { AL_STATES, alSegments, DRIVE_STATES, driveSegments } from "./states.js";

const MAX_LANES = 64;
const GLYPHS = { error: "\u25c6", warning: "\u25b2", info: "\u25cf" };

/// Heights of the rows of a lane, in pixels; many slaves get lower ones.
const ROOMY = { marks: 13, bar: 15, thin: 8, gap: 3 };
const DENSE = { marks: 12, bar: 10, thin: 4, gap: 2 };
const MANY = 12;

function buildLanes(capture, page) {
  const end = capture.capture.duration_s ?? 0;
  const timeline = page.timeline;
  const lanes = [];
  const known = new Set(page.order.map(([index]) => index));
  const marksOf = (slave) => capture.findings
    .filter((f, i) => known.has(i) && f.slave === slave && f.time_s !== null)
    .map((f) => ({ time: f.time_s, to: f.last_time_s ?? f.time_s, severity: f.severity, rule: f.rule, id: f.id, title: f.title, count: f.count, frame: f.frame }))
    // Where marks lie upon each other, the worst is on top.
    .sort((a, b) => ["info", "warning", "error"].indexOf(a.severity) - ["info", "warning", "error"].indexOf(b.severity));
  const busMarks = marksOf(null);
  const lost = timeline?.lost ?? null;
  if (busMarks.length || lost) lanes.push({ label: "Bus", marks: busMarks, rows: lost ? [{ kind: "lost", series: lost }] : [] });
  for (const slave of capture.slaves) {
    if (lanes.length > MAX_LANES) break;
    const drawn = timeline?.slaves.find((s) => s.slave === slave.position);
    const rows = [];
    const states = alSegments(slave, end);
    const absent = absences(drawn, end);
    rows.push({ kind: "al", segments: states, absent, requests: slave.al.history.filter((s) => s.kind === "request" && s.time_s !== null) });
    for (const direction of ["outputs", "inputs"]) {
      if (drawn?.[direction]) rows.push({ kind: "exchange", direction, runs: drawn[direction].runs });
    }
    const drive = driveSegments(slave, end);
    if (drive.length) rows.push({ kind: "drive", segments: drive });
    if (drawn?.mailbox) rows.push({ kind: "mailbox", series: drawn.mailbox });
    const lane = {
      label: slave.label,
      more: slave.name || (slave.station_address !== null ? hex(slave.station_address) : ""),
      marks: marksOf(slave.position),
      rows,
      slaves: [slave.position],
      key: lookOf(rows, end),
    };
    // One of those that are alike stands for all, also where others are between them.
    const before = lane.marks.length === 0 ? lanes.find((l) => l.slaves && l.marks.length === 0 && l.key === lane.key) : null;
    if (before) {
      before.slaves.push(slave.position);
      before.label = ranges(before.slaves.map((position) => slaveNumber(capture, position)));
      if (before.more !== lane.more) before.more = "alike";
    } else lanes.push(lane);
  }
  return lanes;
}

/// "0\u20132, 5": positions in order.
export function ranges(numbers) {
  const out = [];
  for (const n of numbers) {
    const last = out[out.length - 1];
    if (last && n === last[1] + 1) last[1] = n;
    else out.push([n, n]);
  }
  return out.map(([a, b]) => (a === b ? `${a}` : `${a}\u2013${b}`)).join(", ");
}

/// What a lane looks like, to the width of a few pixels: slaves that a master starts in turn differ by less.
function lookOf(rows, end) {
  const at = (time) => Math.round((time / end) * 100);
  return JSON.stringify(rows.map((row) => [row.kind, row.direction, row.segments?.map((s) => [s.label, at(s.from)]),
    row.runs?.map((r) => [r.kind, at(r.from_s), at(r.to_s)]), row.absent?.map((s) => [at(s.from), at(s.to)])]));
}

/// When the slave took no part in the exchange although others did, by its runs or by a finding: its state then is what
/// it was before. Without an end it is gone to the end of the capture.
function absences(drawn, end) {
  const spans = (drawn?.absent ?? []).filter((span) => span.from_s !== null).map((span) => ({ from: span.from_s, to: span.to_s ?? end }));
  for (const direction of ["outputs", "inputs"]) {
    for (const run of drawn?.[direction]?.runs ?? []) {
      if (run.kind === "missing" && run.count > 1) spans.push({ from: run.from_s, to: run.to_s });
    }
  }
  return spans;
}

/// Gives lanes and rows their place; returns the height of all.
function place(lanes) {
  const size = lanes.length > MANY ? DENSE : ROOMY;
  let y = 4;
  for (const lane of lanes) {
    lane.top = y;
    lane.markY = y + size.marks / 2;
    y += lane.marks.length ? size.marks : size.gap;
    for (const row of lane.rows) {
      row.top = y;
      row.height = row.segments ? size.bar : row.runs ? Math.max(3, size.thin - 2) : size.thin;
      y += row.height + 2;
    }
    if (lane.rows.length === 0) y += 4;
    lane.bottom = y + size.gap;
    y = lane.bottom + 2;
  }
  return y;
}

function drawLanes(u, ctx, lanes, focus) {
  const r = uPlot.pxRatio;
  const { left, top, width } = u.bbox;
  const x = (t) => u.valToPos(t, "x", true);
  const y = (pixel) => top + pixel * r;
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, u.bbox.height);
  ctx.clip();
  ctx.textBaseline = "middle";
  for (const lane of lanes) {
    ctx.fillStyle = css("--grid");
    ctx.fillRect(left, y(lane.bottom), width, Math.max(1, r));
    for (const row of lane.rows) {
      if (row.segments) drawSegments(ctx, row, x, y, r, left, width);
      if (row.absent) for (const span of row.absent) hatch(ctx, x(span.from), x(span.to), y(row.top), row.height * r, css("--panel"), css("--absent"), r);
      if (row.runs) drawRuns(ctx, row, x, y, r);
      if (row.requests) drawRequests(ctx, row, x, y, r);
      if (row.series) drawCounts(ctx, row, u, x, y, r);
    }
  }
  if (focus.time !== null) {
    ctx.fillStyle = css("--text");
    ctx.fillRect(x(focus.time) - r / 2, top, Math.max(1, r), u.bbox.height);
  }
  for (const lane of lanes) drawMarks(ctx, lane, x, y, r, focus);
  ctx.restore();
}

function drawSegments(ctx, row, x, y, r, left, width) {
  const font = Math.round(Math.min(11, row.height - 2) * r);
  ctx.font = `600 ${font}px system-ui, sans-serif`;
  ctx.textAlign = "left";
  for (const segment of row.segments) {
    const from = Math.max(x(segment.from), left);
    const to = Math.min(x(segment.to), left + width);
    if (to < left || from > left + width) continue;
    ctx.fillStyle = css(`--s-${segment.color}`);
    ctx.fillRect(from, y(row.top), Math.max(to - from - (to - from > 3 * r ? r : 0), r), row.height * r);
    const room = to - from - 10 * r;
    if (row.height > 12 && room > 12 * r && ctx.measureText(segment.label).width <= room) {
      ctx.fillStyle = css("--on-state");
      ctx.fillText(segment.label, from + 5 * r, y(row.top + row.height / 2) + r * 0.5);
    }
  }
}

/// What is absent: slanted lines that are told apart from any colour, on paper too.
function hatch(ctx, from, to, top, height, ground, line, r) {
  const width = Math.max(to - from, 1.5 * r);
  ctx.save();
  ctx.beginPath();
  ctx.rect(from, top, width, height);
  ctx.clip();
  ctx.fillStyle = ground;
  ctx.fillRect(from, top, width, height);
  ctx.strokeStyle = line;
  ctx.lineWidth = 1.2 * r;
  const step = 5 * r;
  // From a fixed origin, so that zooming does not make the lines crawl; only what is seen is drawn.
  const first = Math.max(from, 0) - height - (Math.max(from, 0) % step);
  const last = Math.min(from + width, ctx.canvas.width) + height;
  ctx.beginPath();
  for (let at = first; at < last; at += step) {
    ctx.moveTo(at, top + height);
    ctx.lineTo(at + height, top);
  }
  ctx.stroke();
  ctx.restore();
}

function drawRuns(ctx, row, x, y, r) {
  const top = y(row.top);
  const height = row.height * r;
  row.runs.forEach((run, i) => {
    const before = row.runs[i - 1];
    const from = x(run.from_s);
    if (before) hatch(ctx, x(before.to_s), from, top, height, css("--panel"), before.kind === "taken" && run.kind === "taken" ? css("--absent") : css("--grid"), r);
    if (run.kind === "taken") {
      ctx.fillStyle = css("--exchange");
      ctx.fillRect(from, top, Math.max(x(run.to_s) - from, 1.5 * r), height);
    } else {
      hatch(ctx, from, x(run.to_s), top, height, css("--panel"), css(run.kind === "missing" ? "--absent" : "--warning"), r);
    }
  });
}

function drawRequests(ctx, row, x, y, r) {
  ctx.fillStyle = css("--text");
  for (const request of row.requests) ctx.fillRect(x(request.time_s) - r / 2, y(row.top + row.height - 4), Math.max(1, r), 4 * r);
}

function drawCounts(ctx, row, u, x, y, r) {
  const { series } = row;
  ctx.fillStyle = css(row.kind === "lost" ? "--lost" : "--mailbox");
  const at = series.at ?? series.count.map((_, i) => i);
  for (const bucket of at) {
    const from = x(series.start_s + bucket * series.width_s);
    const to = x(series.start_s + (bucket + 1) * series.width_s);
    ctx.fillRect(from, y(row.top), Math.max(to - from, 1.5 * r), row.height * r);
  }
}

function drawMarks(ctx, lane, x, y, r, focus) {
  ctx.textAlign = "center";
  ctx.font = `${Math.round(12 * r)}px system-ui, sans-serif`;
  for (const mark of lane.marks) {
    const to = x(mark.to);
    if (to - x(mark.time) < 3 * r) continue;
    ctx.globalAlpha = focus.id === mark.id ? 0.75 : 0.38;
    ctx.fillStyle = css(`--${mark.severity}`);
    ctx.fillRect(x(mark.time), y(lane.markY) - 1.5 * r, to - x(mark.time), 3 * r);
    ctx.globalAlpha = 1;
  }
  for (const mark of lane.marks) {
    const at = x(mark.time);
    ctx.lineWidth = 2.5 * r;
    ctx.strokeStyle = css(focus.id === mark.id ? "--text" : "--panel");
    ctx.strokeText(GLYPHS[mark.severity], at, y(lane.markY));
    ctx.fillStyle = css(`--${mark.severity}`);
    ctx.fillText(GLYPHS[mark.severity], at, y(lane.markY));
  }
}

const near = (u, mark, left) => Math.abs(u.valToPos(mark.time, "x") - left) <= 7 ||
  (left >= u.valToPos(mark.time, "x") && left <= u.valToPos(mark.to, "x"));

/// What the slave did with its process data at `time`, in words.
function exchangeAt(row, time) {
  const what = { taken: "exchanged", missing: "not exchanged: the slave does not count", unclear: "working counter short, by whom is not clear" };
  const name = row.direction === "outputs" ? "Outputs" : "Inputs";
  const run = row.runs.find((r) => time >= r.from_s && time <= r.to_s);
  if (run) return `${name}: ${what[run.kind]}, frames ${run.frame} to ${run.last_frame}`;
  const i = row.runs.findIndex((r) => r.from_s > time);
  if (i <= 0) return null;
  return `${name}: pause of ${duration((row.runs[i].from_s - row.runs[i - 1].to_s) * 1000)}, frames ${row.runs[i - 1].last_frame} to ${row.runs[i].frame}`;
}

/// What lies under the pointer, in words.
function textAt(u, lanes, left, top, frames) {
  const lane = lanes.find((l) => top >= l.top && top < l.bottom + 2);
  if (!lane) return "";
  const now = u.posToVal(left, "x");
  const lines = [`${trim(now, 6)} s${clock.start === null ? "" : `, ${clockText(now)} UTC`}${frames?.text(now) ? `, ${frames.text(now)}` : ""}`];
  const marks = lane.marks.filter((mark) => near(u, mark, left)).reverse();
  for (const mark of marks.slice(0, 4)) {
    lines.push(`${GLYPHS[mark.severity]} ${mark.id}: ${mark.title} (frame ${mark.frame}${mark.count > 1 ? `, seen ${count(mark.count, "time")}` : ""}${mark.to > mark.time ? ` over ${duration((mark.to - mark.time) * 1000)}` : ""})`);
  }
  if (marks.length > 4) lines.push(`and ${marks.length - 4} more`);
  const time = u.posToVal(left, "x");
  for (const row of lane.rows) {
    if (row.runs) {
      const text = exchangeAt(row, time);
      if (text) lines.push(text);
    }
    if (row.absent?.some((span) => time >= span.from && time <= span.to)) lines.push("absent: takes no part in the exchange");
    if (!row.segments) continue;
    const segment = row.segments.find((s) => time >= s.from && time < s.to);
    if (segment) lines.push(`${{ al: "AL state: ", drive: "Drive: " }[row.kind] ?? ""}${segment.label}, from frame ${segment.frame}, ${duration((segment.to - segment.from) * 1000)}`);
  }
  return lines.join("\n");
}

function legend(lanes) {
  const rows = lanes.flatMap((lane) => lane.rows);
  const used = (kind) => new Set(rows.filter((r) => r.kind === kind).flatMap((r) => r.segments.map((s) => s.color)));
  const entries = (states, colors, title) => colors.size === 0 ? [] :
    [h("span", null, h("b", null, title)),
      states.filter(([, color]) => colors.has(color)).map(([name, color]) =>
        h("span", null, h("i", { className: `swatch bg-${color}` }), name))];
  const marks = new Set(lanes.flatMap((l) => l.marks.map((m) => m.severity)));
  return h("div", { className: "legend" },
    entries(AL_STATES, used("al"), "AL state"),
    entries(DRIVE_STATES, used("drive"), "Drive"),
    rows.some((r) => r.kind === "mailbox") && h("span", null, h("i", { className: "swatch bg-mailbox" }), "mailbox"),
    rows.some((r) => r.kind === "exchange") && h("span", null, h("i", { className: "swatch bg-exchange" }), "process data (outputs, inputs)"),
    rows.some((r) => r.absent?.length || r.runs?.length > 1) && h("span", null, h("i", { className: "swatch bg-absent" }), "pause, or absent"),
    rows.some((r) => r.kind === "lost") && h("span", null, h("i", { className: "swatch bg-lost" }), "lost frames"),
    ["error", "warning", "info"].filter((s) => marks.has(s)).map((s) =>
      h("span", null, h("span", { className: `glyph ${s}` }, GLYPHS[s]), s)));
}

/// The panel, and what shows a finding in it.
/// Rows of states below each other, on the axis of the other plots: [{label, segments}].
export function stateStrips(axis, rows, label) {
  const lanes = rows.map((row) => ({ label: "", more: row.label, marks: [], rows: [{ kind: "states", segments: row.segments }] }));
  const height = place(lanes);
  const box = h("div", { className: "plot" });
  const tip = h("div", { className: "tip", hidden: true });
  queueMicrotask(() => requestAnimationFrame(() => {
    const plot = mount(box, {
      height: height + 34,
      padding: [4, 26, 0, 0],
      cursor: { ...timeCursor, points: { show: false } },
      scales: { x: { time: false, range: () => [axis.min, axis.max] }, y: { range: [0, height], dir: -1 } },
      series: [{}, { paths: () => null, points: { show: false } }],
      axes: [timeAxis(), { size: LEFT, grid: { show: false }, ticks: { show: false }, values: (u, splits) => splits.map(() => "") }],
      hooks: {
        draw: [(u) => {
          drawLanes(u, u.ctx, lanes, { time: null, id: null });
          drawLabels(u, u.ctx, lanes);
        }],
        setSelect: [selectTime(axis)],
      },
    }, [[axis.full.min, axis.full.max], [null, null]], label);
    followTime(plot, axis);
    plot.over.append(tip);
    hover(plot, lanes, tip, null);
  }));
  return box;
}

function hover(plot, lanes, tip, frames) {
  plot.over.addEventListener("mousemove", (event) => {
    const area = plot.over.getBoundingClientRect();
    const left = event.clientX - area.left;
    const top = event.clientY - area.top;
    const text = textAt(plot, lanes, left, top, frames);
    tip.hidden = text === "";
    tip.textContent = text;
    tip.style.left = `${Math.max(0, Math.min(left + 14, area.width - tip.offsetWidth - 4))}px`;
    tip.style.top = `${top + 16}px`;
  });
  plot.over.addEventListener("mouseleave", () => { tip.hidden = true; });
}

/// The buttons that place the cursors, and what lies between them.
function cursorParts(axis, frames) {
  const button = (which) => h("button", { type: "button", id: `cursor-${which}`, "aria-pressed": "false",
    title: "Then click into a plot", onclick: () => axis.arm(which) }, `Cursor ${which.toUpperCase()}`);
  const buttons = [button("a"), button("b")];
  const text = h("span");
  const clear = h("button", { type: "button", onclick: () => {
    axis.cursors.b = null;
    axis.setCursor("a", null);
  } }, "Remove cursors");
  const readout = h("p", { className: "cursors", id: "cursors", hidden: true }, text, clear);
  const say = () => {
    const { a, b } = axis.cursors;
    buttons.forEach((one, i) => one.setAttribute("aria-pressed", String(axis.armed === "ab"[i])));
    const one = (name, time) => (time === null ? null
      : `${name} ${trim(time, 9)} s${clock.start === null ? "" : ` (${clockText(time)} UTC)`}${frames.text(time) ? `, ${frames.text(time)}` : ""}`);
    const parts = [one("A", a), one("B", b)];
    if (a !== null && b !== null) {
      const [first, second] = [frames.at(a)?.[0], frames.at(b)?.[0]];
      parts.push(`B \u2212 A = ${duration((b - a) * 1000)}` + (a !== b ? ` (${trim(1 / Math.abs(b - a), 3)} Hz)` : "") +
        (first !== undefined && second !== undefined ? `, ${grouped(second - first)} frames` : ""));
    }
    text.textContent = parts.filter(Boolean).join("; ");
    readout.hidden = text.textContent === "";
  };
  axis.onCursor(say);
  return { buttons, readout };
}

/// The command that writes every value of what is shown.
function samplesCommand(capture, axis, frames) {
  const file = capture.capture.path;
  if (!capture.slaves.length || file === "-" || file.includes(", ")) return { line: null };
  const line = h("p", { className: "note", id: "all-samples" });
  const command = () => {
    const half = Math.max((axis.max - axis.min) / 2, 1e-6);
    const middle = (axis.min + axis.max) / 2;
    const whole = axis.min === axis.full.min && axis.max === axis.full.max;
    const frame = whole ? null : frames.at(middle)?.[0];
    const around = whole ? "" : ` --around ${frame ? `'#${frame}'` : trim(middle, 6)} --window ${trim(half, half < 0.001 ? 9 : 6)}`;
    return `ecaudit signals ${shellWord(file)}${around} -o signals.csv`;
  };
  const say = () => line.replaceChildren("All values of this view: ", ...copyable(command(), "command"));
  let waiting = 0;
  axis.onChange(() => {
    clearTimeout(waiting);
    waiting = setTimeout(say, 60);
  });
  say();
  return { line };
}

export function lanesPanel(capture, page, axis) {
  const lanes = buildLanes(capture, page);
  if (lanes.length === 0 || !(capture.capture.duration_s > 0)) return null;
  const height = place(lanes);
  const drawn = lanes.reduce((sum, lane) => sum + (lane.slaves?.length ?? 0), 0);
  const focus = { time: null, id: null };
  const box = h("div", { className: "plot" });
  const tip = h("div", { className: "tip", hidden: true });
  const frames = new FrameIndex(page.timeline?.frames);
  const pictures = { lanes: null, overlay: null };
  const cursors = cursorParts(axis, frames);
  const samples = samplesCommand(capture, axis, frames);
  const picture = (as, ending) => {
    const shown = [pictures.lanes, pictures.overlay].filter(Boolean);
    if (shown.length === 0) return;
    as(shown, [`${fileName(capture.capture.path)}, ${trim(axis.min, 6)} to ${trim(axis.max, 6)} s`],
      [...(pictures.overlay?.lines ?? []), cursors.readout.textContent].filter(Boolean), `${fileName(capture.capture.path)}.${ending}`);
  };
  const button = (text, label, action) => h("button", { type: "button", className: "icon", title: label, "aria-label": label, onclick: action }, text);
  const panel = h("section", { className: "panel", id: "time", "aria-labelledby": "time-title" },
    h("div", { className: "tools" },
      h("h2", { id: "time-title" }, "Time line"),
      h("span", { className: "space" }),
      button("\u2212", "Zoom out", () => axis.zoom(2)),
      button("+", "Zoom in", () => axis.zoom(0.5)),
      button("\u2190", "Earlier", () => axis.pan(-0.25)),
      button("\u2192", "Later", () => axis.pan(0.25)),
      h("button", { type: "button", onclick: () => axis.reset() }, "Whole capture"),
      cursors.buttons,
      h("button", { type: "button", id: "save-png", onclick: () => picture(savePng, "png") }, "PNG"),
      h("button", { type: "button", id: "save-svg", onclick: () => picture(saveSvg, "svg") }, "SVG"),
      clock.start !== null && h("button", { type: "button", id: "clock", "aria-pressed": String(clock.on), onclick: (event) => {
        clock.on = !clock.on;
        event.target.setAttribute("aria-pressed", String(clock.on));
        for (const shown of live) shown.redraw(false, true);
      } }, "Clock times (UTC)")),
    box,
    cursors.readout,
    legend(lanes),
    overlay(capture, page, axis, lanes.flatMap((lane) => lane.marks), frames, pictures),
    samples.line,
    h("p", { className: "note screen" }, "Drag to zoom, double-click for the whole capture. When a plot has the focus: arrows, + and \u2212 move and zoom; A and B set the cursors at the pointer. Times count from the first packet. Around findings every cycle is shown."),
    lanes.some((lane) => lane.slaves?.length > 1) && h("p", { className: "note" }, "Slaves that are alike and have no finding share a lane: " +
      `${lanes.filter((lane) => lane.slaves?.length > 1).map((lane) => lane.label).join("; ")}.`),
    drawn < capture.slaves.length && h("p", { className: "note" }, `The first ${drawn} of ${capture.slaves.length} slaves.`),
    capture.slaves.some((s) => s.al.history_left_out || s.drive?.history_left_out) &&
      h("p", { className: "note" }, "States that changed too often to list are left out; their bars end there."));

  const tell = () => Object.assign(panel.dataset, { from: axis.min, to: axis.max });
  axis.onChange(tell);
  tell();
  let plot;
  queueMicrotask(() => requestAnimationFrame(() => {
    plot = mount(box, {
      height: height + 34,
      padding: [4, 26, 0, 0],
      cursor: { ...timeCursor, points: { show: false } },
      scales: { x: { time: false, range: () => [axis.min, axis.max] }, y: { range: [0, height], dir: -1 } },
      series: [{}, { paths: () => null, points: { show: false } }],
      axes: [timeAxis(), {
        size: LEFT,
        grid: { show: false },
        ticks: { show: false },
        splits: () => lanes.map((l) => (l.top + l.bottom) / 2),
        values: () => lanes.map(() => ""),
      }],
      hooks: {
        draw: [(u) => {
          drawLanes(u, u.ctx, lanes, focus);
          drawLabels(u, u.ctx, lanes);
        }],
        setSelect: [selectTime(axis)],
      },
    }, [[axis.full.min, axis.full.max], [null, null]],
    `Time line of ${count(capture.slaves.length, "slave")} over ${duration(capture.capture.duration_s * 1000)}. The tables of each slave hold the same states.`);
    followTime(plot, axis);
    plot.over.append(tip);
    hover(plot, lanes, tip, frames);
    pictures.lanes = { plot, draw: (ctx) => {
      drawLanes(plot, ctx, lanes, focus);
      drawLabels(plot, ctx, lanes);
      drawCursors(plot, ctx, axis);
    } };
    let pressed = 0;
    // A click that places a cursor opens no finding.
    let placing = false;
    plot.over.addEventListener("mousedown", (event) => {
      pressed = event.clientX;
      placing = axis.armed !== null;
    });
    plot.over.addEventListener("click", (event) => {
      if (Math.abs(event.clientX - pressed) > 3 || placing) return;
      const area = plot.over.getBoundingClientRect();
      const lane = lanes.find((l) => event.clientY - area.top >= l.top && event.clientY - area.top < l.bottom);
      const marks = lane?.marks.filter((mark) => near(plot, mark, event.clientX - area.left)) ?? [];
      if (marks.length) location.hash = `#finding-${marks[marks.length - 1].id}`;
    });
  }));

  return {
    panel,
    show(finding) {
      focus.time = finding.time_s;
      focus.id = finding.id;
      panel.dataset.focus = finding.id;
      const drawnOf = page.timeline?.slaves.find((s) => s.slave === finding.slave);
      const kept = [...(drawnOf?.signals ?? []).map((s) => closeOf(drawnOf, s)), spread(page.timeline?.cycle_close)];
      const range = kept.map((close) => closeRange(close, finding.time_s)).find(Boolean);
      if (range) axis.set(...range);
      else if (finding.time_s < axis.min || finding.time_s > axis.max || axis.max - axis.min === axis.full.max - axis.full.min) axis.center(finding.time_s);
      plot?.redraw(false, false);
      panel.scrollIntoView({ block: "center" });
      plot?.over.focus({ preventScroll: true });
    },
  };
}

function drawLabels(u, ctx, lanes) {
  const r = uPlot.pxRatio;
  const room = u.bbox.left - 12 * r;
  ctx.save();
  ctx.textBaseline = "middle";
  ctx.textAlign = "left";
  for (const lane of lanes) {
    const middle = u.bbox.top + ((lane.rows.length ? lane.rows[0].top + lane.rows[0].height / 2 : (lane.top + lane.bottom) / 2)) * r;
    ctx.font = `600 ${Math.round(12 * r)}px system-ui, sans-serif`;
    ctx.fillStyle = css("--text");
    ctx.fillText(lane.label.length > 12 ? `${lane.label.slice(0, 11)}\u2026` : lane.label, 2 * r, middle);
    if (!lane.more) continue;
    const start = 2 * r + ctx.measureText(lane.label).width + 6 * r;
    if (start > room - 12 * r) continue;
    ctx.font = `${Math.round(12 * r)}px system-ui, sans-serif`;
    ctx.fillStyle = css("--muted");
    let text = lane.more;
    while (text.length > 1 && start + ctx.measureText(text).width > room) text = `${text.replace(/\u2026$/, "").slice(0, -1)}\u2026`;
    ctx.fillText(text, start, middle);
  }
  ctx.restore();
}
