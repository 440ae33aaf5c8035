// How long until all clocks were locked: the difference to the system time (0x092C) of each slave, in one plot.
import uPlot from "uplot";
import { h, table } from "./dom.js";
import { capitalised, count, duration, grouped, seconds, slaveName } from "./format.js";
import { clipped, css, extremes, followTime, mount, selectTime, timeAxis, timeCursor, valueAxis, valueText } from "./plots.js";
import { drawTrack, Track } from "./track.js";

const LIMIT = 1000; // ns: within it a clock is locked
const MOST = 6; // lines that can be told apart by colour and dashes
const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3], [], [5, 5]];

/// The clocks that were above the limit, the worst first: not locked at the end, then the latest, then the farthest off.
/// Slaves with the same curve share an entry.
export function clocksOf(capture, page) {
  const entries = [];
  for (const slave of capture.slaves) {
    const difference = slave.dc?.difference;
    const drawn = page.timeline?.slaves.find((s) => s.slave === slave.position);
    if (!difference?.above_frame || !drawn?.difference_ns) continue;
    const settled = difference.settled_frame ? drawn.clock_settled_s : null;
    // Reads of two slaves are some microseconds apart in each cycle: times are compared by how long it took.
    const { least, most } = drawn.difference_ns;
    const key = JSON.stringify([difference.settled_after_ms?.toFixed(2), difference.last_ns, least, most]);
    const alike = entries.find((e) => e.key === key);
    if (!alike) entries.push({ key, slaves: [slave], last: slave, difference, series: drawn.difference_ns, locked: Boolean(difference.settled_frame), settled });
    else {
      alike.slaves.push(slave);
      if (settled !== null && settled >= alike.settled) Object.assign(alike, { last: slave, difference, settled });
    }
  }
  return entries.sort((a, b) => a.locked - b.locked || (b.settled ?? 0) - (a.settled ?? 0) || b.difference.max_ns - a.difference.max_ns);
}

function nameOf(capture, { slaves }) {
  if (slaves.length === 1) return capitalised(slaveName(capture, slaves[0].position));
  const more = slaves.length > 8 ? ` and ${grouped(slaves.length - 8)} more` : "";
  return `Slaves ${slaves.slice(0, 8).map((s) => s.label).join(", ")}${more} (alike)`;
}

/// The result in one sentence.
export function clocksSentence(capture, entries) {
  const size = (list) => list.reduce((sum, e) => sum + e.slaves.length, 0);
  const clocks = size(entries);
  const open = size(entries.filter((e) => !e.locked));
  const above = `${count(clocks, "clock")} exceeded 1 \u00b5s`;
  if (open === clocks) return `${above}, ${clocks === 1 ? "and did not lock" : "none locked"} before the capture ends.`;
  const last = entries.find((e) => e.locked);
  const when = `${slaveName(capture, last.last.position)}${last.settled === null ? "" : ` at ${seconds(last.settled)}`}, frame ${last.difference.settled_frame}`;
  if (clocks === 1) return `${above} and locked: ${when}.`;
  return open === 0 ? `${above}, all locked. The last one was ${when}.`
    : `${above}, ${grouped(open)} did not lock before the capture ends. The last that locked was ${when}.`;
}

/// Limit, the moments at which clocks locked, and the last of them as a line. Not clipped: a clock may lock in the last frame.
function drawLocked(u, ctx, axis, shown, last) {
  const r = uPlot.pxRatio;
  const limit = Math.round(u.valToPos(LIMIT, "y", true));
  const seen = (time) => time !== null && time >= axis.min && time <= axis.max;
  const line = (x1, y1, x2, y2, color) => {
    ctx.strokeStyle = color;
    ctx.lineWidth = r;
    ctx.setLineDash([4 * r, 3 * r]);
    ctx.beginPath();
    ctx.moveTo(x1, y1);
    ctx.lineTo(x2, y2);
    ctx.stroke();
    ctx.setLineDash([]);
  };
  const words = (text, x, y, color) => {
    ctx.font = `${Math.round(11 * r)}px system-ui, sans-serif`;
    ctx.strokeStyle = css("--panel");
    ctx.lineWidth = 3 * r;
    ctx.lineJoin = "round";
    ctx.strokeText(text, x, y);
    ctx.fillStyle = color;
    ctx.fillText(text, x, y);
  };
  ctx.save();
  line(u.bbox.left, limit, u.bbox.left + u.bbox.width, limit, css("--error"));
  ctx.textAlign = "left";
  ctx.textBaseline = "bottom";
  words("limit 1 \u00b5s", u.bbox.left + 4 * r, limit - 2 * r, css("--error"));
  if (seen(last)) {
    const at = Math.round(u.valToPos(last, "x", true));
    line(at, u.bbox.top, at, u.bbox.top + u.bbox.height, css("--good"));
    const right = at + 110 * r > u.bbox.left + u.bbox.width;
    ctx.textAlign = right ? "right" : "left";
    ctx.textBaseline = "top";
    words("last one locked", at + (right ? -4 : 4) * r, u.bbox.top + 2 * r, css("--good"));
  }
  shown.forEach((entry, i) => {
    if (!seen(entry.settled)) return;
    ctx.fillStyle = css(`--o${i + 1}`);
    ctx.strokeStyle = css("--panel");
    ctx.lineWidth = 1.5 * r;
    ctx.beginPath();
    ctx.arc(u.valToPos(entry.settled, "x", true), limit, 4.5 * r, 0, 2 * Math.PI);
    ctx.fill();
    ctx.stroke();
  });
  ctx.restore();
}

function clocksPlot(capture, axis, shown, last, values) {
  const box = h("div", { className: "plot" });
  const tracks = shown.map((entry) => new Track(entry.series));
  const ends = shown.map((entry) => extremes(entry.series));
  // Decades: 0 has no place on a logarithmic axis, 1 ns is its lowest line.
  const low = 10 ** Math.floor(Math.log10(Math.max(1, Math.min(...ends.map((e) => e[0]), LIMIT / 2))));
  const high = 10 ** Math.ceil(Math.log10(Math.max(...ends.map((e) => e[1]), 2 * LIMIT)));
  const decades = [];
  for (let d = low; d <= high; d *= 10) decades.push(d);
  const tick = (v) => (v >= 1e9 ? `${grouped(v / 1e9)} s` : v >= 1e6 ? `${grouped(v / 1e6)} ms` : v >= 1e3 ? `${grouped(v / 1e3)} \u00b5s` : `${v} ns`);
  queueMicrotask(() => requestAnimationFrame(() => {
    const plot = mount(box, {
      height: 240,
      padding: [8, 26, 0, 0],
      cursor: { ...timeCursor, points: { show: false } },
      scales: {
        x: { time: false, range: () => [axis.min, axis.max] },
        y: { distr: 3, range: () => [low, high] },
      },
      series: [{}, { paths: () => null, points: { show: false } }],
      axes: [timeAxis(), { ...valueAxis((u, splits) => splits.map(tick)), space: 16, splits: () => decades, filter: null }],
      hooks: {
        draw: [(u) => {
          clipped(u, u.ctx, () => tracks.forEach((track, i) => drawTrack(u.ctx, track.view(axis.min, axis.max, u.over.clientWidth || 900).rows,
            (t) => u.valToPos(t, "x", true), (v) => u.valToPos(Math.max(v, low), "y", true), { color: css(`--o${i + 1}`), dash: DASHES[i], width: 1.5 })));
          drawLocked(u, u.ctx, axis, shown, last);
        }],
        setSelect: [selectTime(axis)],
        setCursor: [(u) => {
          const time = u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null;
          tracks.forEach((track, i) => {
            const now = valueText(track, axis, u.over.clientWidth || 900, time, (v) => `${grouped(v)} ns`);
            values[i].textContent = now || stateText(shown[i]);
          });
        }],
      },
    }, [[axis.full.min, axis.full.max], [low, high]], `Difference to the system time of ${shown.map((e) => nameOf(capture, e)).join(", ")}`);
    followTime(plot, axis);
  }));
  return box;
}

function stateText(entry) {
  if (!entry.locked) return `not locked, last ${grouped(entry.difference.last_ns)} ns`;
  const after = entry.difference.settled_after_ms;
  return after === null ? "locked" : `locked after ${duration(after)}`;
}

/// Null where no clock was ever above the limit.
export function clocksPanel(capture, page, axis) {
  const entries = clocksOf(capture, page);
  if (entries.length === 0) return null;
  const shown = entries.slice(0, MOST);
  const left = entries.slice(MOST).reduce((sum, e) => sum + e.slaves.length, 0);
  const moments = entries.map((e) => e.settled).filter((t) => t !== null);
  const values = shown.map((entry) => h("span", { className: "value" }, stateText(entry)));
  const rows = table(entries.slice(0, 64), [
    { title: "Slave", value: (e) => nameOf(capture, e), long: true },
    { title: "Largest", value: (e) => `${grouped(e.difference.max_ns)} ns`, num: true },
    { title: "Last", value: (e) => `${grouped(e.difference.last_ns)} ns`, num: true },
    { title: "Locked at", value: (e) => (e.settled === null ? "\u2013" : seconds(e.settled)), num: true },
    { title: "Frame", value: (e) => e.difference.settled_frame ?? "\u2013", num: true },
    { title: "It took", value: (e) => (e.locked ? duration(e.difference.settled_after_ms) || "\u2013" : "not locked"), num: true },
  ], null, "wide");
  return h("section", { className: "panel", id: "clocks", "aria-labelledby": "clocks-title" },
    h("h2", { id: "clocks-title" }, "Clocks"),
    h("p", null, clocksSentence(capture, entries)),
    h("figure", { className: "chart" },
      h("figcaption", null, h("b", null, "Difference to the system time (0x092C)"), h("span", { className: "value" }, "magnitude, logarithmic; a dot: the clock locked")),
      clocksPlot(capture, axis, shown, moments.length ? Math.max(...moments) : null, values),
      h("ul", { className: "legend picked" }, shown.map((entry, i) =>
        h("li", null, h("i", { className: `line o${i + 1}` }), h("span", null, nameOf(capture, entry)), values[i])))),
    left > 0 && h("p", { className: "note" }, `The worst ${grouped(MOST)} are drawn; ${count(left, "more clock")} in the table.`),
    entries.length > MOST ? h("details", { className: "more" }, h("summary", null, `Table of ${count(entries.length, "curve")}`), rows) : rows,
    entries.length > 64 && h("p", { className: "note" }, "The table holds the worst 64. JSON holds all (slaves[].dc.difference)."));
}
