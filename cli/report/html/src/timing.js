// How regularly the process data came.
import { spread } from "./close.js";
import { facts, h } from "./dom.js";
import { duration, grouped, trim } from "./format.js";
import { histogramChart, seriesChart } from "./plots.js";

const REGULAR = 0.01; // of the cycle, as in the text report: below it there is nothing to explain

/// Who makes the cycles irregular, as a bar of shares with its words; null where cycles are regular.
export function originsFigure(cycle) {
  const { origins } = cycle;
  if (!origins) return null;
  const parts = [
    ["Sending (master)", origins.master, "o1"],
    ["Return (line, slaves, network card)", origins.return, "o2"],
    ["Stamps (recorder)", origins.recorder, "o3"],
  ].filter(([, part]) => part);
  if (Math.hypot(...parts.map(([, part]) => part.width_us)) < REGULAR * cycle.median_us) return null;
  const text = (part) => `${trim(part.share, 1)} %, ${trim(part.width_us, 1)} \u00b5s`;
  const bar = h("div", { className: "shares", role: "img", "aria-label": parts.map(([name, part]) => `${name} ${text(part)}`).join("; ") },
    parts.filter(([, part]) => part.share > 0).map(([, part, color]) => {
      const piece = h("i", { className: `share ${color}` });
      piece.style.flexGrow = String(part.share); // by script: the policy of the page forbids style attributes
      return piece;
    }));
  return h("figure", { className: "chart", id: "origins" },
    h("figcaption", null, h("b", null, "Where irregular cycles come from"), h("span", { className: "value" }, "share; width that holds 98 of 100 values")),
    bar,
    h("ul", { className: "legend picked" }, parts.map(([name, part, color]) =>
      h("li", null, h("i", { className: `swatch share ${color}` }), h("span", null, name), h("span", { className: "value" }, text(part))))),
    h("p", { className: "note" }, `Round trip: median ${trim(origins.round_trip_us, 1)} \u00b5s, longest ${trim(origins.longest_round_trip_us, 1)} \u00b5s.` +
      (origins.recorder ? "" : " Sending includes the error of the recorder's stamps: the frames carry no DC time.")));
}

export function timingPanel(capture, page, axis) {
  const cycle = capture.bus.cycle;
  if (!cycle.cycles) return null;
  const us = (value) => (value === null ? null : `${trim(value, 3)} \u00b5s`);
  const series = page.timeline?.cycle_us;
  const histogram = histogramChart({
    title: "Distribution", unit: "\u00b5s", note: `${grouped(cycle.cycles)} cycles, logarithmic`,
    bins: cycle.histogram.map((b) => ({ from: b.from_us, to: b.to_us, count: b.count })),
    middle: { from: cycle.p1_us, to: cycle.p99_us },
  });
  return h("section", { className: "panel", id: "timing", "aria-labelledby": "timing-title" },
    h("h2", { id: "timing-title" }, "Cycle"),
    facts([
      ["Median", duration(cycle.median_us / 1000)], ["Least", us(cycle.min_us)], ["Most", us(cycle.max_us)],
      ["Standard deviation", us(cycle.stddev_us)], ["1 % to 99 %", `${trim(cycle.p1_us, 1)} to ${us(cycle.p99_us)}`],
      ["Uncertainty", us(cycle.uncertainty_us)],
      ["Cycles without process data", cycle.missing_cycles ? grouped(cycle.missing_cycles) : "none"],
      ["Longest", cycle.longest_from_frame ? `frames ${grouped(cycle.longest_from_frame)} to ${grouped(cycle.longest_to_frame)}` : null],
      ["Measured at", cycle.command ? `${cycle.command} 0x${(cycle.logical_address ?? 0).toString(16).padStart(8, "0")}` : null],
    ], "evidence"),
    originsFigure(cycle),
    h("div", { className: series ? "pair" : null },
      series && seriesChart(axis, { title: "Time between process data", unit: "\u00b5s", series, close: spread(page.timeline.cycle_close) }),
      histogram));
}
