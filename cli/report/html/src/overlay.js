// Signals that the reader picks, laid over each other below the lanes: what moved when.
import uPlot from "uplot";
import { closeOf } from "./close.js";
import { h } from "./dom.js";
import { count, number, objectName, withUnit } from "./format.js";
import { css, extremes, followTime, mount, points, selectTime, short, timeAxis, timeCursor, valueAxis } from "./plots.js";

const MOST = 6;
const HEIGHT = 220;
const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3], [], [5, 5]];

/// All signals of a capture that were followed, slave by slave.
function signalsOf(capture, page) {
  return (page.timeline?.slaves ?? []).map((drawn) => {
    const slave = capture.slaves.find((s) => s.position === drawn.slave);
    const name = slave ? `Slave ${slave.position}${slave.name ? ` (${slave.name})` : ""}` : drawn.eni?.name ?? "Slave of the ENI file";
    return { name, short: slave ? `${slave.position}` : name, signals: drawn.signals.filter((s) => s.values).map((signal) => ({
      drawn, signal, label: signal.variable ?? signal.name ?? objectName(signal.index, signal.subindex),
      about: `${objectName(signal.index, signal.subindex)}, ${signal.direction}`,
    })) };
  }).filter((slave) => slave.signals.length > 0);
}

/// Lines of the same color: the most and the least of buckets, one line where they are the same.
function lines(pick, i, oneScale) {
  const line = (label) => ({
    label,
    scale: oneScale ? "y" : `y${i}`,
    stroke: () => css(`--o${i + 1}`),
    dash: DASHES[i],
    width: 1.5,
    points: { show: false },
    paths: pick.signal.bits <= 8 ? uPlot.paths.stepped({ align: 1 }) : undefined,
  });
  return pick.data.length > 2 ? [line("most"), line("least")] : [line("value")];
}

/// The part of the time line's panel in which signals are picked, and their plot; null where there are none.
export function overlay(capture, page, axis, marks) {
  const slaves = signalsOf(capture, page);
  if (slaves.length === 0) return null;
  const picked = new Array(MOST).fill(null); // a place keeps its colour
  const box = h("div", { className: "plot", hidden: true });
  const legend = h("ul", { className: "legend picked" });
  const oneScale = h("input", { type: "checkbox", id: "one-scale", onchange: () => draw() });
  const scaleLabel = h("label", { for: "one-scale", hidden: true }, oneScale, " One scale for all");
  const said = h("p", { className: "sr", role: "status" });
  const boxes = [];
  let plot = null;

  function valueAt(u, pick) {
    if (u && u.cursor.left >= 0 && u.cursor.idx !== null && u.cursor.idx !== undefined) {
      const time = u.posToVal(u.cursor.left, "x");
      const i = pick.x.findLastIndex((x) => x <= time);
      const most = i >= 0 ? pick.most[i] : null;
      if (most !== null && most !== undefined) {
        const least = pick.least[i];
        return withUnit(most === least ? number(most) : `${number(least)} to ${number(most)}`, pick.signal.unit) +
          (pick.frames[i] ? `, frame ${pick.frames[i]}` : "");
      }
    }
    return withUnit(pick.low === pick.high ? number(pick.low) : `${number(pick.low)} to ${number(pick.high)}`, pick.signal.unit);
  }

  function say(u) {
    picked.forEach((pick) => { if (pick) pick.value.textContent = valueAt(u, pick); });
  }

  function draw() {
    plot?.destroy();
    plot = null;
    box.replaceChildren();
    const shown = picked.map((pick, i) => [pick, i]).filter(([pick]) => pick);
    legend.replaceChildren(...shown.map(([pick, i]) => h("li", null,
      h("i", { className: `line o${i + 1}` }), h("span", null, `${pick.slave.short}: ${pick.label}`), pick.value)));
    scaleLabel.hidden = shown.length < 2;
    box.hidden = shown.length === 0;
    say(null);
    if (shown.length === 0) return;
    const data = uPlot.join(shown.map(([pick]) => pick.data));
    const scales = { x: { time: false, range: () => [axis.min, axis.max] } };
    const range = (u, low, high) => (low === null || low === undefined ? [0, 1] : low === high ? [low - 1, high + 1] : uPlot.rangeNum(low, high, 0.1, true));
    if (oneScale.checked) scales.y = { range };
    else for (const [, i] of shown) scales[`y${i}`] = { range };
    const values = valueAxis((u, splits) => splits.map((v) => (oneScale.checked || shown.length === 1 ? short(v) : "")));
    plot = mount(box, {
      height: HEIGHT,
      padding: [8, 26, 0, 0],
      cursor: { ...timeCursor, points: { show: false } },
      scales,
      series: [{}, ...shown.flatMap(([pick, i]) => lines(pick, i, oneScale.checked))],
      axes: [timeAxis(), { ...values, scale: oneScale.checked ? "y" : `y${shown[0][1]}` }],
      hooks: {
        drawClear: [(u) => drawMarks(u, marks)],
        setSelect: [selectTime(axis)],
        setCursor: [say],
      },
    }, data, `${shown.map(([pick]) => `${pick.label} of ${pick.slave.name}`).join(", ")} over time, each ${oneScale.checked ? "on the same scale" : "on a scale of its own"}`);
    followTime(plot, axis);
  }

  function toggle(input, slave, entry) {
    const place = picked.findIndex((pick) => pick?.signal === entry.signal);
    if (place >= 0) picked[place] = null;
    else {
      const close = closeOf(entry.drawn, entry.signal);
      const [x, most, least, frames] = points(entry.signal.values, close);
      const [low, high] = extremes(entry.signal.values);
      picked[picked.indexOf(null)] = { ...entry, slave, x, most, least, frames, low, high, value: h("span", { className: "value" }),
        data: entry.signal.values.most ? [x, most, least] : [x, most] };
    }
    const full = !picked.includes(null);
    for (const other of boxes) other.disabled = full && !other.checked;
    said.textContent = full ? `${MOST} signals are shown, the most there is room for` : `${count(picked.filter(Boolean).length, "signal")} shown`;
    draw();
  }

  const fields = slaves.map((slave) => h("fieldset", null, h("legend", null, slave.name), slave.signals.map((entry) => {
    const input = h("input", { type: "checkbox", onchange: () => toggle(input, slave, entry) });
    boxes.push(input);
    return h("label", null, input, h("span", null, ` ${entry.label} `, h("span", { className: "muted" }, entry.about)));
  })));
  return h("div", { className: "overlay", id: "overlay" },
    legend, scaleLabel, box, said,
    h("details", { className: "more screen" }, h("summary", null, `Lay signals over the time line, ${MOST} at most`), fields));
}

/// Where findings are, as lines through the whole height: what the signals did then is to be seen.
function drawMarks(u, marks) {
  const { ctx } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
  ctx.clip();
  for (const mark of marks) {
    ctx.globalAlpha = 0.55;
    ctx.fillStyle = css(`--${mark.severity}`);
    ctx.fillRect(u.valToPos(mark.time, "x", true) - 0.5, u.bbox.top, Math.max(1, uPlot.pxRatio), u.bbox.height);
  }
  ctx.restore();
}
