// Signals that the reader picks, laid over each other below the lanes: what moved when.
import uPlot from "uplot";
import { closeOf } from "./close.js";
import { h } from "./dom.js";
import { saveCsv } from "./export.js";
import { count, fileName, hex, number, objectName, withUnit } from "./format.js";
import { clipped, css, cursorText, drawCursors, extremes, followTime, mount, rangeOf, selectTime, short, timeAxis, timeCursor, valueAxis, valueText } from "./plots.js";
import { matcher } from "./search.js";
import { drawTrack, Track } from "./track.js";

const MOST = 6;
const HEIGHT = 220;
const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3], [], [5, 5]];

/// All signals of a capture that were followed, slave by slave.
function signalsOf(capture, page) {
  return (page.timeline?.slaves ?? []).map((drawn) => {
    const slave = capture.slaves.find((s) => s.position === drawn.slave);
    const name = slave ? `Slave ${slave.label}${slave.name ? `, ${slave.name}` : ""}` : drawn.eni?.name ?? "Slave of the ENI file";
    return { name, short: slave ? slave.label : name, signals: drawn.signals.filter((s) => s.values).map((signal) => ({
      drawn, signal, label: signal.variable ?? signal.name ?? objectName(signal.index, signal.subindex),
      about: `${objectName(signal.index, signal.subindex)}, ${signal.direction}`,
    })) };
  }).filter((slave) => slave.signals.length > 0);
}

/// The part of the time line's panel in which signals are picked, and their plot; null where there are none.
/// @param pictures  gets the plot while there is one
export function overlay(capture, page, axis, marks, frames, pictures) {
  const slaves = signalsOf(capture, page);
  if (slaves.length === 0) return null;
  const picked = new Array(MOST).fill(null); // a place keeps its colour
  let shownAxis = null; // the pick whose values the axis shows
  const box = h("div", { className: "plot", hidden: true });
  const legend = h("ul", { className: "legend picked" });
  const point = h("p", { className: "note", id: "one-point", hidden: true });
  const oneScale = h("input", { type: "checkbox", id: "one-scale", onchange: () => draw() });
  const scaleLabel = h("label", { for: "one-scale", hidden: true }, oneScale, " One scale for all");
  const table = h("button", { type: "button", id: "save-csv", hidden: true, onclick: () => saveTable() }, "Save as CSV");
  const said = h("p", { className: "sr", role: "status" });
  const boxes = [];
  let plot = null;
  const pixels = () => plot?.over.clientWidth || 900;
  const full = (pick) => (v) => withUnit(pick.signal.word && v >= 0 ? hex(v) : number(v), pick.signal.unit);

  function sayOne(u, pick) {
    const time = u && u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null;
    const now = valueText(pick.track, axis, pixels(), time, full(pick));
    const row = now ? pick.track.valueAt(time, axis.max - axis.min, pixels()) : null;
    const where = row ? (row.frame ? `frame ${row.frame}` : frames.text(time)) : "";
    const between = cursorText(pick.track, axis, pixels(), full(pick));
    const whole = pick.low === pick.high ? full(pick)(pick.low) : `${full(pick)(pick.low)} to ${full(pick)(pick.high)}`;
    pick.value.textContent = (now ? `${now}${where ? `, ${where}` : ""}` : whole) + (between ? `; ${between}` : "");
  }

  function say(u) {
    for (const pick of picked) if (pick) sayOne(u, pick);
    const widest = picked.filter(Boolean)[0];
    point.hidden = !widest;
    if (widest) point.textContent = `${widest.label}: ${widest.track.pointText(axis.min, axis.max, pixels())}.`;
  }

  function paint(u, ctx) {
    clipped(u, ctx, () => {
      drawMarks(u, ctx, marks);
      picked.forEach((pick, i) => {
        const scale = oneScale.checked ? "y" : `y${i}`;
        if (!pick || !u.scales[scale]) return; // a plot that is about to be replaced
        drawTrack(ctx, pick.track.view(axis.min, axis.max, pixels()).rows, (t) => u.valToPos(t, "x", true), (v) => u.valToPos(v, scale, true),
          { color: css(`--o${i + 1}`), dash: DASHES[i], width: 1.5, stepped: pick.signal.bits <= 8 || pick.signal.word });
      });
    });
  }

  function draw() {
    plot?.destroy();
    plot = null;
    pictures.overlay = null;
    box.replaceChildren();
    const shown = picked.map((pick, i) => [pick, i]).filter(([pick]) => pick);
    if (!picked.includes(shownAxis)) shownAxis = null;
    const main = shown.find(([pick]) => pick === shownAxis) ?? shown[0];
    legend.replaceChildren(...shown.map(([pick, i]) => h("li", null,
      h("i", { className: `line o${i + 1}` }),
      shown.length > 1 && !oneScale.checked
        ? h("button", { type: "button", className: "axis", "aria-pressed": String(main[0] === pick), title: "Show the values of this signal at the axis",
          onclick: () => { shownAxis = pick; draw(); } }, `${pick.slave.short}: ${pick.label}`)
        : h("span", null, `${pick.slave.short}: ${pick.label}`),
      pick.value)));
    scaleLabel.hidden = shown.length < 2;
    box.hidden = table.hidden = shown.length === 0;
    say(null);
    if (shown.length === 0) return;
    const scales = { x: { time: false, range: () => [axis.min, axis.max] } };
    const extent = (pick) => pick.track.extent(axis.min, axis.max, pixels());
    if (oneScale.checked) {
      scales.y = { follows: true, range: () => {
        const all = shown.map(([pick]) => extent(pick)).filter(Boolean);
        return rangeOf(all.length ? [Math.min(...all.map((e) => e[0])), Math.max(...all.map((e) => e[1]))] : null);
      } };
    } else for (const [pick, i] of shown) scales[`y${i}`] = { follows: true, range: () => rangeOf(extent(pick)) };
    plot = mount(box, {
      height: HEIGHT,
      padding: [8, 26, 0, 0],
      cursor: { ...timeCursor, points: { show: false } },
      scales,
      series: [{}, ...shown.map(([, i]) => ({ scale: oneScale.checked ? "y" : `y${i}`, paths: () => null, points: { show: false } }))],
      axes: [timeAxis(), { ...valueAxis((u, splits) => splits.map(short)), scale: oneScale.checked ? "y" : `y${main[1]}`,
        stroke: () => css(oneScale.checked || shown.length === 1 ? "--muted" : `--o${main[1] + 1}`) }],
      hooks: {
        draw: [(u) => paint(u, u.ctx)],
        setSelect: [selectTime(axis)],
        setCursor: [say],
      },
    }, [[axis.full.min, axis.full.max], ...shown.map(([pick]) => [pick.low, pick.high])],
    `${shown.map(([pick]) => `${pick.label} of ${pick.slave.name}`).join(", ")} over time, each ${oneScale.checked ? "on the same scale" : "on a scale of its own"}`);
    followTime(plot, axis);
    const made = plot;
    pictures.overlay = { plot: made, draw: (ctx) => { paint(made, ctx); drawCursors(made, ctx, axis); },
      lines: shown.map(([pick]) => `${pick.slave.short}: ${pick.label} ${pick.signal.unit ? `(${pick.signal.unit})` : ""}`.trim()) };
  }
  axis.onChange(() => say(null));
  axis.onCursor(() => say(null));

  /// What the view shows: one row a point and signal.
  function saveTable() {
    const rows = [["from_s", "to_s", "first_frame", "slave", "signal", "object", "unit", "smallest", "largest"]];
    for (const pick of picked) {
      if (!pick) continue;
      for (const row of pick.track.view(axis.min, axis.max, pixels()).rows) {
        if (row.to < axis.min || row.from > axis.max) continue;
        rows.push([row.from.toFixed(9), row.to.toFixed(9), row.frame ?? frames.at(row.from)?.[0] ?? "", pick.slave.short, pick.label,
          objectName(pick.signal.index, pick.signal.subindex), pick.signal.unit ?? "", row.least, row.most]);
      }
    }
    saveCsv(rows, `${fileName(capture.capture.path)}.signals.csv`);
  }

  function toggle(input, slave, entry) {
    const place = picked.findIndex((pick) => pick?.signal === entry.signal);
    if (place >= 0) picked[place] = null;
    else {
      const [low, high] = extremes(entry.signal.values);
      picked[picked.indexOf(null)] = { ...entry, slave, low, high, value: h("span", { className: "value" }),
        track: new Track(entry.signal.values, closeOf(entry.drawn, entry.signal)) };
    }
    const isFull = !picked.includes(null);
    for (const other of boxes) other.disabled = isFull && !other.checked;
    said.textContent = isFull ? `${MOST} signals are shown, the most there is room for` : `${count(picked.filter(Boolean).length, "signal")} shown`;
    draw();
  }

  const entries = [];
  const fields = slaves.map((slave) => {
    const labels = slave.signals.map((entry) => {
      const input = h("input", { type: "checkbox", onchange: () => toggle(input, slave, entry) });
      boxes.push(input);
      const element = h("label", null, input, h("span", null, ` ${entry.label} `, h("span", { className: "muted" }, entry.about)));
      entries.push({ element, text: `${slave.name} ${entry.label} ${entry.signal.name ?? ""} ${entry.about}`.toLowerCase() });
      return element;
    });
    return h("fieldset", null, h("legend", null, slave.name), labels);
  });
  const search = h("input", { type: "search", id: "signal-search", autocomplete: "off", oninput: () => {
    const fits = matcher(search.value);
    for (const { element, text } of entries) element.hidden = !fits(text);
    for (const field of fields) field.hidden = !field.querySelector("label:not([hidden])");
  } });
  return h("div", { className: "overlay", id: "overlay" },
    legend, h("div", { className: "tools" }, scaleLabel, table), box, point, said,
    h("details", { className: "more screen" }, h("summary", null, `Lay signals over the time line, ${MOST} at most`),
      entries.length > 8 && h("label", { className: "search", for: "signal-search" }, "Search signals ", search), fields));
}

/// Where findings are, as lines through the whole height: what the signals did then is to be seen.
function drawMarks(u, ctx, marks) {
  ctx.save();
  for (const mark of marks) {
    ctx.globalAlpha = 0.55;
    ctx.fillStyle = css(`--${mark.severity}`);
    ctx.fillRect(u.valToPos(mark.time, "x", true) - 0.5, u.bbox.top, Math.max(1, uPlot.pxRatio), u.bbox.height);
  }
  ctx.restore();
}
