// uPlot with our colours, our zoom and our keys.
import uPlot from "uplot";
import { clock, clockText, zoomKey } from "./axis.js";
import { merged } from "./close.js";
import { h } from "./dom.js";
import { equalBins, grouped, hex, number, trim, withUnit } from "./format.js";

const FONT = "12px system-ui, sans-serif";
const cursors = uPlot.sync("time");
export const live = new Set(); // all plots of the page: they are drawn anew when the theme changes

export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

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
  axis.onChange((min, max) => plot.setScale("x", { min, max }));
  plot.over.addEventListener("keydown", (event) => zoomKey(axis, event));
  plot.over.addEventListener("dblclick", () => axis.reset());
  plot.over.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.shiftKey) return;
    event.preventDefault();
    const delta = event.deltaY || event.deltaX;
    axis.zoom(delta > 0 ? 1.25 : 0.8, plot.posToVal(plot.cursor.left, "x"));
  }, { passive: false });
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

/// A series of the report, with what was kept around findings -> [x, most, least, frames], with a null where nothing was
/// measured for long.
export function points(series, close) {
  const at = series.at ?? series.least.map((_, i) => i);
  const steps = at.slice(1).map((a, i) => a - at[i]).sort((a, b) => a - b);
  const usual = steps.length ? steps[Math.floor(steps.length / 2)] : 1;
  const pause = Math.max(4, usual * 8);
  const x = [];
  const most = [];
  const least = [];
  at.forEach((bucket, i) => {
    if (i > 0 && bucket - at[i - 1] > pause) {
      x.push(series.start_s + (bucket - 0.5) * series.width_s);
      most.push(null);
      least.push(null);
    }
    x.push(series.start_s + (bucket + 0.5) * series.width_s);
    least.push(series.least[i]);
    most.push((series.most ?? series.least)[i]);
  });
  return merged([x, most, least], close);
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

/// chart: {title, unit, series, close, word (shown in hexadecimal), stepped, note}
export function seriesChart(axis, chart) {
  const { series, unit } = chart;
  const text = chart.word ? (v) => hex(v) : (v) => number(v);
  const full = (v) => withUnit(text(v), unit);
  const [low, high] = extremes(series);
  const whole = low === high ? full(low) : `${text(low)} to ${full(high)}`;
  const value = h("span", { className: "value" }, whole);
  const box = h("div", { className: "plot" });
  const figure = h("figure", { className: "chart" },
    h("figcaption", null, h("span", null, h("b", null, chart.title), chart.note && h("span", { className: "muted" }, ` ${chart.note}`)), value), box);
  const data = points(series, chart.close);
  const frames = data.pop();
  // Least and most coincide where buckets hold one value; the second line is left out then.
  if (!series.most) data.pop();
  const line = (name) => ({
    label: name,
    stroke: () => css("--plot"),
    width: 1.25,
    // Single values are seen as such where there is room for them.
    points: { show: (u, i, from, to) => data[0].length < 3 || (to - from < 90 && frames[from] !== null), size: 4 },
    paths: chart.stepped ? uPlot.paths.stepped({ align: 1 }) : undefined,
  });
  queueMicrotask(() => requestAnimationFrame(() => {
    const plot = mount(box, {
      height: 132,
      padding: [8, 26, 0, 0],
      cursor: { ...timeCursor, points: { size: 6 } },
      scales: {
        x: { time: false, range: () => [axis.min, axis.max] },
        y: { range: (u, min, max) => (min === max ? [min - 1, max + 1] : uPlot.rangeNum(min, max, 0.1, true)) },
      },
      series: series.most ? [{}, line("most"), line("least")] : [{}, line("value")],
      bands: series.most ? [{ series: [1, 2], fill: () => `color-mix(in srgb, ${css("--plot")} 28%, transparent)` }] : [],
      axes: [timeAxis(), {
        ...valueAxis((u, splits) => splits.map((v) => (!chart.word ? short(v) : Number.isInteger(v) && v >= 0 ? hex(v) : ""))),
        ...(chart.word && { incrs: Array.from({ length: 17 }, (_, i) => 4 ** i) }),
      }],
      hooks: {
        setSelect: [selectTime(axis)],
        setCursor: [(u) => {
          const i = u.cursor.idx;
          const top = i === null || i === undefined ? null : u.data[1][i];
          if (top === null || top === undefined) {
            value.textContent = whole;
            return;
          }
          const bottom = series.most ? u.data[2][i] : top;
          value.textContent = `${trim(u.data[0][i], 6)} s${frames[i] ? `, frame ${frames[i]}` : ""}: ` +
            (bottom === top ? full(top) : `${text(bottom)} to ${full(top)}`);
        }],
      },
    }, data, `${chart.title} over time: ${whole}`);
    followTime(plot, axis);
  }));
  return figure;
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
