// uPlot with our colours, our zoom and our keys.
import uPlot from "uplot";
import { clock, clockText, zoomKey } from "./axis.js";
import { h } from "./dom.js";
import { equalBins, grouped, hex, number, trim, withUnit } from "./format.js";
import { css } from "./theme.js";
import { bitName, bitsOf, drawBit, drawTrack, Track } from "./track.js";

const FONT = "12px system-ui, sans-serif";
const cursors = uPlot.sync("time");
export const live = new Set(); // all plots of the page: they are drawn anew when the theme changes

export { css };

function timeTicks(u, splits, index, space, step) {
  if (clock.on) return splits.map((t) => clockText(t, Math.min(9, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)))));
  const ms = Math.max(...splits.map(Math.abs)) < 1;
  const width = ms ? step * 1000 : step;
  const decimals = width >= 1 ? 0 : Math.min(9, Math.max(0, -Math.floor(Math.log10(width) + 1e-9)));
  return splits.map((t) => `${((ms ? 1000 : 1) * t).toFixed(decimals)} ${ms ? "ms" : "s"}`);
}

export function timeAxis(show = true) {
  return {
    show,
    font: FONT,
    stroke: () => css("--muted"),
    grid: { stroke: () => css("--grid"), width: 1 },
    ticks: { stroke: () => css("--grid"), width: 1, size: 5 },
    values: timeTicks,
    space: () => (clock.on ? 130 : 90),
    size: 30,
    gap: 4,
  };
}

export const LEFT = 88; // all plots over time begin there, so that their cursors stand in line

export function valueAxis(values, size = LEFT) {
  return {
    font: FONT,
    stroke: () => css("--muted"),
    grid: { stroke: () => css("--grid"), width: 1 },
    ticks: { show: false },
    values,
    size,
    gap: 6,
    space: 32,
  };
}

/// Makes the plot, keeps it as wide as its container, and drawn in the colours of the theme.
export function mount(container, options, data, label) {
  const width = () => Math.max(200, Math.floor(container.clientWidth));
  const plot = new uPlot({ width: width(), legend: { show: false }, ...options }, data, container);
  plot.over.setAttribute("tabindex", "0");
  plot.over.setAttribute("role", "img");
  plot.over.setAttribute("aria-label", label);
  new ResizeObserver(() => {
    if (container.clientWidth > 0 && width() !== plot.width) plot.setSize({ width: width(), height: plot.height });
  }).observe(container);
  live.add(plot);
  return plot;
}

/// Follows `axis`: selecting, keys and wheel with Ctrl or Shift zoom all plots.
export function followTime(plot, axis) {
  // Not as a batch, which draws at once: a selection reaches all plots, and each reads it by the scale it had.
  const ends = [axis.onChange((min, max) => {
    plot.setScale("x", { min, max });
    for (const key of Object.keys(plot.scales)) if (key !== "x" && plot.scales[key].follows) plot.setScale(key, { min: 0, max: 1 });
  }), axis.onCursor(() => plot.redraw(false, false))];
  (plot.hooks.destroy ??= []).push(() => {
    for (const end of ends) end();
    live.delete(plot);
  });
  (plot.hooks.draw ??= []).push((u) => drawCursors(u, u.ctx, axis));
  plot.over.addEventListener("keydown", (event) => {
    const key = event.key.toLowerCase();
    if ((key === "a" || key === "b") && !event.ctrlKey && !event.metaKey && !event.altKey) {
      axis.setCursor(key, plot.cursor.left >= 0 ? plot.posToVal(plot.cursor.left, "x") : (axis.min + axis.max) / 2);
    } else zoomKey(axis, event);
  });
  plot.over.addEventListener("click", (event) => {
    if (axis.armed) axis.setCursor(axis.armed, plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
  });
  plot.over.addEventListener("dblclick", () => axis.reset());
  plot.over.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.shiftKey) return;
    event.preventDefault();
    const delta = event.deltaY || event.deltaX;
    axis.zoom(delta > 0 ? 1.25 : 0.8, plot.posToVal(plot.cursor.left, "x"));
  }, { passive: false });
}

/// The two cursors, as lines with their names.
export function drawCursors(u, ctx, axis) {
  const r = uPlot.pxRatio;
  for (const which of ["a", "b"]) {
    const time = axis.cursors[which];
    if (time === null || time < axis.min || time > axis.max) continue;
    const at = Math.round(u.valToPos(time, "x", true));
    ctx.save();
    ctx.fillStyle = css("--link");
    ctx.fillRect(at, u.bbox.top, Math.max(1, Math.round(1.5 * r)), u.bbox.height);
    ctx.font = `700 ${Math.round(11 * r)}px system-ui, sans-serif`;
    ctx.textBaseline = "top";
    ctx.textAlign = which === "a" ? "right" : "left";
    ctx.fillText(which.toUpperCase(), at + (which === "a" ? -3 : 4) * r, u.bbox.top + 2 * r);
    ctx.restore();
  }
}

export const timeCursor = {
  sync: { key: cursors.key, setSeries: false, scales: ["x", null] },
  drag: { x: true, y: false, setScale: false },
  y: false,
};

export function selectTime(axis) {
  return (u) => {
    if (u.select.width < 2) return;
    axis.set(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  };
}

export function extremes(series) {
  const most = series.most ?? series.least;
  let low = Infinity;
  let high = -Infinity;
  for (let i = 0; i < series.least.length; ++i) {
    low = Math.min(low, series.least[i]);
    high = Math.max(high, most[i]);
  }
  return [low, high];
}

/// Least and most of what a view shows, with some room.
export function rangeOf(extent) {
  const [low, high] = extent ?? [0, 1];
  return low === high ? [low - 1, high + 1] : uPlot.rangeNum(low, high, 0.1, true);
}

/// What the signal was at `time`, in words; "" where it is not known.
export function valueText(track, axis, pixels, time, text) {
  const row = time === null ? null : track.valueAt(time, axis.max - axis.min, pixels);
  if (!row) return "";
  return row.least === row.most ? text(row.least) : `${text(row.least)} to ${text(row.most)}`;
}

/// "A 3 mm, B 8 mm, B \u2212 A = 5 mm"; "" without cursors.
export function cursorText(track, axis, pixels, text) {
  const { a, b } = axis.cursors;
  const at = (time) => (time === null ? null : track.valueAt(time, axis.max - axis.min, pixels));
  const [first, second] = [at(a), at(b)];
  const parts = [];
  if (first) parts.push(`A ${valueText(track, axis, pixels, a, text)}`);
  if (second) parts.push(`B ${valueText(track, axis, pixels, b, text)}`);
  if (first && second) {
    const [low, high] = [second.least - first.most, second.most - first.least];
    parts.push(`B \u2212 A = ${low === high ? text(low) : `${text(low)} to ${text(high)}`}`);
  }
  return parts.join(", ");
}

/// chart: {title, unit, series, close, word (shown in hexadecimal), stepped, note, frames (FrameIndex), index, bits}
export function seriesChart(axis, chart) {
  const { series, unit, frames } = chart;
  const text = chart.word ? (v) => (v < 0 ? number(v) : hex(v)) : (v) => number(v);
  const full = (v) => withUnit(text(v), unit);
  const [low, high] = extremes(series);
  const whole = low === high ? full(low) : `${text(low)} to ${full(high)}`;
  const value = h("span", { className: "value" }, whole);
  const between = h("span", { className: "value measured" });
  const point = h("span", { className: "muted point" });
  const box = h("div", { className: "plot" });
  const track = new Track(series, chart.close);
  const bits = chart.word && chart.bits ? bitStrips(axis, track, chart.index, chart.bits) : null;
  const figure = h("figure", { className: "chart" },
    h("figcaption", null, h("span", null, h("b", null, chart.title), chart.note && h("span", { className: "muted" }, ` ${chart.note}`)), value), box,
    h("p", { className: "under" }, point, between), bits);
  let plot = null;
  const pixels = () => plot?.over.clientWidth || 900;
  const say = () => {
    point.textContent = track.pointText(axis.min, axis.max, pixels());
    between.textContent = cursorText(track, axis, pixels(), full);
  };
  queueMicrotask(() => requestAnimationFrame(() => {
    plot = mount(box, {
      height: 132,
      padding: [8, 26, 0, 0],
      cursor: { ...timeCursor, points: { show: false } },
      scales: {
        x: { time: false, range: () => [axis.min, axis.max] },
        y: { follows: true, range: () => rangeOf(track.extent(axis.min, axis.max, pixels())) },
      },
      series: [{}, { paths: () => null, points: { show: false } }],
      axes: [timeAxis(), {
        ...valueAxis((u, splits) => splits.map((v) => (!chart.word ? short(v) : Number.isInteger(v) && v >= 0 ? hex(v) : ""))),
        ...(chart.word && { incrs: Array.from({ length: 17 }, (_, i) => 4 ** i) }),
      }],
      hooks: {
        draw: [(u) => clipped(u, u.ctx, () => drawTrack(u.ctx, track.view(axis.min, axis.max, pixels()).rows,
          (t) => u.valToPos(t, "x", true), (v) => u.valToPos(v, "y", true), { color: css("--plot"), stepped: chart.stepped }))],
        setSelect: [selectTime(axis)],
        setCursor: [(u) => {
          const time = u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null;
          const row = time === null ? null : track.valueAt(time, axis.max - axis.min, pixels());
          if (!row) {
            value.textContent = whole;
            return;
          }
          const where = row.frame ? `frame ${row.frame}` : frames?.text(time);
          value.textContent = `${trim(time, 6)} s${where ? `, ${where}` : ""}: ` +
            (row.least === row.most ? full(row.least) : `${text(row.least)} to ${full(row.most)}`);
        }],
      },
    }, [[axis.full.min, axis.full.max], [low, high]], `${chart.title} over time: ${whole}`);
    followTime(plot, axis);
    axis.onChange(say);
    axis.onCursor(say);
    say();
  }));
  return figure;
}

export function clipped(u, ctx, draw) {
  ctx.save();
  ctx.beginPath();
  ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
  ctx.clip();
  draw();
  ctx.restore();
}

/// A lane for each bit that changes, on the axis of the other plots; null where none does.
export function bitStrips(axis, track, index, bits) {
  const { moving, set } = bitsOf(track, bits);
  if (moving.length === 0) return null;
  const row = 17;
  const box = h("div", { className: "plot" });
  const list = (all) => all.map((b) => bitName(index, b)).join(", ");
  const still = h("p", { className: "note" },
    `Bits: ${list(moving)}. A filled lane is 1, a line is 0, a pale lane changes within one point.${set.length ? ` Always 1: bit ${list(set)}.` : ""} All other bits are always 0.`);
  const details = h("details", { className: "more" }, h("summary", null, `Bits (${moving.length} of ${bits} change)`));
  details.classList.add("bits");
  let made = false;
  details.addEventListener("toggle", () => {
    if (!details.open || made) return;
    made = true;
    details.append(box, still);
    const height = moving.length * row;
    const plot = mount(box, {
      height: height + 38,
      padding: [4, 26, 0, 0],
      cursor: { ...timeCursor, points: { show: false } },
      scales: { x: { time: false, range: () => [axis.min, axis.max] }, y: { range: [0, height] } },
      series: [{}, { paths: () => null, points: { show: false } }],
      axes: [timeAxis(), { size: LEFT, grid: { show: false }, ticks: { show: false }, values: (u, splits) => splits.map(() => "") }],
      hooks: {
        draw: [(u) => {
          const { ctx } = u;
          const r = uPlot.pxRatio;
          const { rows } = track.view(axis.min, axis.max, u.over.clientWidth || 900);
          clipped(u, ctx, () => moving.forEach((bit, i) =>
            drawBit(ctx, rows, bit, (t) => u.valToPos(t, "x", true), u.bbox.top + (i * row + 4) * r, (row - 6) * r, css("--plot"))));
          moving.forEach((bit, i) => label(ctx, bitName(index, bit), u.bbox.top + (i * row + row / 2 + 1) * r, u.bbox.left - 6 * r));
        }],
        setSelect: [selectTime(axis)],
      },
    }, [[axis.full.min, axis.full.max], [null, null]], `Bits over time: ${list(moving)}`);
    followTime(plot, axis);
  });
  return details;
}

/// A text at the left edge, shortened to `room`.
function label(ctx, text, y, room) {
  const r = uPlot.pxRatio;
  ctx.save();
  ctx.font = `${Math.round(11 * r)}px system-ui, sans-serif`;
  ctx.fillStyle = css("--text");
  ctx.textBaseline = "middle";
  ctx.textAlign = "left";
  let shown = text;
  while (shown.length > 1 && ctx.measureText(shown).width > room) shown = `${shown.replace(/\u2026$/, "").slice(0, -1)}\u2026`;
  ctx.fillText(shown, 2 * r, y);
  ctx.restore();
}

/// At most eight characters for an axis.
export function short(value) {
  const size = Math.abs(value);
  if (size >= 1e9) return `${trim(value / 1e9, 2)} G`;
  if (size >= 1e7) return `${trim(value / 1e6, 2)} M`;
  return grouped(Number(value.toPrecision(6)));
}

/// Equal bins over what was measured; counts on a logarithmic axis, so that the single late frame is seen.
export function histogramChart({ title, unit, bins, note, middle }) {
  if (bins.length === 0) return null;
  const { low, high, width, counts, beyond } = equalBins(bins, 60, middle);
  const total = counts.reduce((a, b) => a + b, 0);
  const x = counts.map((_, i) => low + (i + 0.5) * width);
  const y = counts.map((c) => (c === 0 ? null : c));
  const whole = [note, beyond > 0 && `${grouped(beyond)} far outside not drawn`].filter(Boolean).join("; ");
  const value = h("span", { className: "value" }, whole);
  const box = h("div", { className: "plot" });
  const figure = h("figure", { className: "chart" }, h("figcaption", null, h("b", null, title), value), box);
  const decades = [];
  for (let d = 1; d <= 1e12; d *= 10) decades.push(d);
  queueMicrotask(() => requestAnimationFrame(() => {
    mount(box, {
      height: 164,
      padding: [8, 34, 0, 0],
      cursor: { y: false, drag: { x: false, y: false }, points: { show: false } },
      scales: {
        x: { time: false, range: [low - width * 0.5, high + width * 0.5] },
        y: { distr: 3, range: (u, min, max) => [0.5, Math.max(10, (max ?? 1) * 1.6)] },
      },
      series: [{}, {
        stroke: () => css("--plot"),
        fill: () => `color-mix(in srgb, ${css("--plot")} 45%, transparent)`,
        width: 1,
        paths: uPlot.paths.bars({ size: [0.92, Infinity, 2] }),
        fillTo: 0.5,
        points: { show: false },
      }],
      axes: [
        { ...timeAxis(), space: 64, values: (u, splits) => splits.map((v) => `${trim(v, 3)} ${unit}`) },
        { ...valueAxis((u, splits) => splits.map((v) => (v >= 1 ? grouped(v) : ""))),
          splits: (u, i, min, max) => decades.filter((d) => d >= min && d <= max), filter: null },
      ],
      hooks: {
        setCursor: [(u) => {
          const i = u.cursor.idx;
          if (i === null || i === undefined) {
            value.textContent = whole;
            return;
          }
          value.textContent = `${trim(low + i * width, 3)} to ${trim(low + (i + 1) * width, 3)} ${unit}: ${grouped(counts[i])}`;
        }],
      },
    }, [x, y], `${title}: ${grouped(total)} values from ${trim(low, 3)} to ${trim(high, 3)} ${unit}`);
  }));
  return figure;
}
