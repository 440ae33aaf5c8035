// How regularly the process data came.
import { spread } from "./close.js";
import { facts, h } from "./dom.js";
import { duration, grouped, trim } from "./format.js";
import { histogramChart, seriesChart } from "./plots.js";

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
    h("div", { className: series ? "pair" : null },
      series && seriesChart(axis, { title: "Time between process data", unit: "\u00b5s", series, close: spread(page.timeline.cycle_close) }),
      histogram));
}
