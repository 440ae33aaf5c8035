// A signal at every zoom: single values where they were kept, buckets elsewhere, and coarser levels of those (a pyramid),
// so that a view draws about one bucket a pixel.
import uPlot from "uplot";
import { stretches } from "./close.js";
import { duration } from "./format.js";

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/// Neighbours in pairs: rows of twice the width.
function coarser(rows) {
  const out = [];
  for (const row of rows) {
    const at = Math.floor(row.at / 2);
    const last = out[out.length - 1];
    if (last?.at === at) {
      last.least = Math.min(last.least, row.least);
      last.most = Math.max(last.most, row.most);
      last.any = (last.any | row.any) >>> 0;
      last.all = (last.all & row.all) >>> 0;
    } else out.push({ ...row, at });
  }
  return out;
}

export class Track {
  /// series: {start_s, width_s, at, least, most, any, all}; close: as closeOf() gives it, or null
  constructor(series, close = null) {
    this.start = series.start_s;
    this.width = series.width_s;
    this.close = close;
    const bits = (value) => (value >= 0 && value < 2 ** 32 ? value >>> 0 : 0);
    this.buckets = [series.least.map((least, i) => ({
      at: series.at ? series.at[i] : i, least, most: series.most ? series.most[i] : least,
      any: series.any ? series.any[i] : bits(least), all: series.all ? series.all[i] : bits(least),
    }))];
    this.rows = [];
  }

  /// The level in which a bucket of a view of `seconds` is about as wide as one of its `pixels`.
  levelFor(seconds, pixels) {
    let level = 0;
    while (level < 20 && seconds / (this.width * 2 ** level) > Math.max(pixels, 50)) level += 1;
    return level;
  }

  /// Rows in order: {from, to, least, most, any, all, frame, single, pause}. `single`: one value of one frame; `pause`:
  /// nothing was measured for long before it.
  at(level) {
    if (this.rows[level]) return this.rows[level];
    while (this.buckets.length <= level) this.buckets.push(coarser(this.buckets[this.buckets.length - 1]));
    const width = this.width * 2 ** level;
    const buckets = this.buckets[level];
    const steps = buckets.slice(1).map((b, i) => b.at - buckets[i].at).sort((a, b) => a - b);
    const usual = steps.length ? steps[Math.floor(steps.length / 2)] : 1;
    const pause = Math.max(4, usual * 8);
    const all = buckets.map((b, i) => ({ ...b, from: this.start + b.at * width, to: this.start + (b.at + 1) * width, frame: null,
      single: usual > 1 && b.least === b.most, pause: i > 0 && b.at - buckets[i - 1].at > pause }));
    this.rows[level] = this.close ? this.#withSingles(all) : all;
    return this.rows[level];
  }

  /// A bucket gives way where single values are: what is left of it begins and ends beside them.
  #withSingles(rows) {
    const { time_s: times, values, frames } = this.close;
    const spans = stretches(times).map(([first, last]) => ({ first, last, from: times[first], to: times[last],
      step: last > first ? (times[last] - times[first]) / (last - first) : 0 }));
    const out = [];
    const push = (span) => {
      for (let i = span.first; i <= span.last; ++i) {
        const bits = values[i] >= 0 ? values[i] >>> 0 : 0;
        out.push({ from: times[i], to: times[i], least: values[i], most: values[i], any: bits, all: bits, frame: frames[i], single: true, pause: false });
      }
    };
    let next = 0;
    for (let row of rows) {
      let whole = true;
      while (next < spans.length && spans[next].from < row.to) {
        const span = spans[next];
        const before = span.from - row.from;
        if (whole && before > 1.5 * span.step) out.push({ ...row, to: span.from });
        if (span.from >= row.from || whole) {
          if (span.made !== true) push(span);
          span.made = true;
        }
        if (span.to >= row.to) {
          whole = null;
          break;
        }
        row = { ...row, from: span.to, pause: false };
        whole = row.to - span.to > 1.5 * span.step;
        next += 1;
      }
      if (whole) out.push(row);
    }
    for (; next < spans.length; ++next) if (!spans[next].made) push(spans[next]);
    return out;
  }

  /// Of the view [min, max]: rows, with one to the left and one to the right of it, so that lines go on.
  view(min, max, pixels) {
    const level = this.levelFor(max - min, pixels);
    const rows = this.at(level);
    let from = 0;
    for (let high = rows.length; from < high;) {
      const middle = (from + high) >> 1;
      if (rows[middle].to < min) from = middle + 1;
      else high = middle;
    }
    let to = from;
    while (to < rows.length && rows[to].from <= max) to += 1;
    return { rows: rows.slice(Math.max(0, from - 1), to + 1), width: this.width * 2 ** level };
  }

  /// What the signal was at `time`; null in a pause and before the first value.
  valueAt(time, seconds, pixels) {
    const rows = this.at(this.levelFor(seconds, pixels));
    let low = 0;
    for (let high = rows.length; low < high;) {
      const middle = (low + high) >> 1;
      if (rows[middle].from <= time) low = middle + 1;
      else high = middle;
    }
    const row = rows[low - 1];
    if (!row || (rows[low]?.pause && time > row.to)) return null;
    return row;
  }

  extent(min, max, pixels) {
    let [low, high] = [Infinity, -Infinity];
    const { rows } = this.view(min, max, pixels);
    const inside = rows.filter((row) => row.to >= min && row.from <= max);
    for (const row of inside.length ? inside : rows) {
      low = Math.min(low, row.least);
      high = Math.max(high, row.most);
    }
    return low <= high ? [low, high] : null;
  }

  /// "one point = 20 ms, band = smallest to largest value", or that nothing is left out.
  pointText(min, max, pixels) {
    const { rows, width } = this.view(min, max, pixels);
    if (rows.every((row) => row.single)) return "every value of the capture";
    return `one point = ${duration(width * 1000)}, band = smallest to largest value` +
      (rows.some((row) => row.single && row.frame) ? "; every value around findings" : "");
  }
}

/// Draws the rows of a view: a band where a point stands for several values, a line through single ones.
export function drawTrack(ctx, rows, x, y, { color, dash = [], width = 1.25, stepped = false }) {
  const r = uPlot.pxRatio;
  ctx.save();
  ctx.fillStyle = color;
  ctx.strokeStyle = color;
  ctx.lineWidth = width * r;
  ctx.lineJoin = "round";
  for (const row of rows) {
    if (row.least === row.most) continue;
    const left = Math.round(x(row.from));
    const top = y(row.most);
    const height = y(row.least) - top;
    // A flat band is read as a line.
    ctx.globalAlpha = height < 3 * r ? 1 : 0.42;
    ctx.fillRect(left, top, Math.max(Math.round(x(row.to)) - left, 1), Math.max(height, width * r));
  }
  ctx.globalAlpha = 1;
  ctx.setLineDash(dash.map((d) => d * r));
  ctx.beginPath();
  let pen = null; // {x, least, most}
  const points = [];
  for (const row of rows) {
    if (row.pause) pen = null;
    const band = row.least !== row.most;
    // A line meets a band at its edge, at the value of the band that is the nearest.
    const entry = band || !row.single ? row.from : row.from + (row.to - row.from) / 2;
    const middle = row.single ? (row.from + row.to) / 2 : entry;
    const at = x(middle);
    const value = pen ? clamp((pen.least + pen.most) / 2, row.least, row.most) : row.least;
    if (pen) {
      const left = clamp(value, pen.least, pen.most);
      if (!(pen.band && band && left === value)) {
        ctx.moveTo(pen.x, y(left));
        if (stepped) ctx.lineTo(at, y(left));
        ctx.lineTo(at, y(value));
      }
    }
    if (!band && !row.single) {
      ctx.moveTo(at, y(row.least));
      ctx.lineTo(Math.max(x(row.to), at + r), y(row.least));
    }
    if (row.single) points.push([at, y(row.least)]);
    pen = { x: row.single ? at : x(row.to), least: row.least, most: row.most, band };
  }
  ctx.stroke();
  ctx.setLineDash([]);
  // Single values are seen as such where there is room for them.
  if (points.length < 90) for (const [px, py] of points) ctx.fillRect(px - 2 * r, py - 2 * r, 4 * r, 4 * r);
  ctx.restore();
}

/// The bits of a word over time: high where set, a line where clear, half where both occur within a point.
export function drawBit(ctx, rows, bit, x, top, height, color) {
  const r = uPlot.pxRatio;
  const mask = (1 << bit) >>> 0;
  const of = (row) => ((row.all & mask) !== 0 ? 1 : (row.any & mask) === 0 ? 0 : 0.5);
  ctx.save();
  ctx.fillStyle = color;
  for (let i = 0; i < rows.length; ++i) {
    const row = rows[i];
    const next = rows[i + 1];
    const left = Math.round(x(row.from));
    const right = next && !next.pause ? x(next.from) : x(row.to);
    const wide = Math.max(Math.round(right) - left, 1);
    const value = of(row);
    if (value === 0) ctx.fillRect(left, top + height - r, wide, r);
    else {
      ctx.globalAlpha = value === 1 ? 1 : 0.4;
      ctx.fillRect(left, top, wide, height);
      ctx.globalAlpha = 1;
    }
  }
  ctx.restore();
}

const KNOWN_BITS = {
  0x6040: ["switch on", "enable voltage", "quick stop (0 = stop)", "enable operation", null, null, null, "fault reset", "halt"],
  0x6041: ["ready to switch on", "switched on", "operation enabled", "fault", "voltage enabled", "quick stop (0 = active)",
    "switch on disabled", "warning", null, "remote", "target reached", "internal limit"],
  0x60fd: ["negative limit switch", "positive limit switch", "home switch"],
};
export const bitName = (index, bit) => `${bit}${KNOWN_BITS[index]?.[bit] ? ` ${KNOWN_BITS[index][bit]}` : ""}`;

/// {moving: bits that change, set: always 1}
export function bitsOf(track, bits) {
  let [any, all] = [0, 0xffffffff];
  for (const row of track.at(12)) {
    any = (any | row.any) >>> 0;
    all = (all & row.all) >>> 0;
  }
  const list = Array.from({ length: bits }, (_, i) => i);
  const has = (word, bit) => (word & ((1 << bit) >>> 0)) !== 0;
  return { moving: list.filter((b) => has(any, b) && !has(all, b)), set: list.filter((b) => has(all, b)) };
}

/// Which frames belong to a time: the first frame of each bucket.
export class FrameIndex {
  constructor(series) {
    this.series = series;
  }
  /// "frame 12", "frames 12 to 20", or ""
  text(time) {
    const [first, last] = this.at(time) ?? [];
    return first === undefined ? "" : first === last ? `frame ${first}` : `frames ${first} to ${last}`;
  }
  /// [first, last], or null outside of what was captured
  at(time) {
    const { series } = this;
    if (!series?.least.length || time < series.start_s) return null;
    const bucket = (time - series.start_s) / series.width_s + 1e-6;
    let low = 0;
    for (let high = series.least.length; low < high;) {
      const middle = (low + high) >> 1;
      if ((series.at ? series.at[middle] : middle) <= bucket) low = middle + 1;
      else high = middle;
    }
    if (low === 0) return null;
    const first = series.least[low - 1];
    const next = series.least[low];
    // Beyond the bucket only its frames come before the next one.
    return [first, next === undefined ? first : Math.max(first, next - 1)];
  }
}
