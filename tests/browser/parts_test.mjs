// Parts of the page of HTML reports that need no browser.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import path from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const part = (name) => import(pathToFileURL(path.join(process.env.ECAUDIT_SOURCE_DIR, "cli", "report", "html", "src", name)));
/// track.js draws on canvases of uPlot, of which it needs one number here.
const withPlots = async (name) => {
  const { mkdtempSync, readFileSync, writeFileSync, rmSync } = await import("node:fs");
  const { tmpdir } = await import("node:os");
  const folder = mkdtempSync(path.join(tmpdir(), "ecaudit-parts-"));
  const source = path.join(process.env.ECAUDIT_SOURCE_DIR, "cli", "report", "html", "src");
  for (const file of [name, "close.js", "format.js"]) {
    const text = readFileSync(path.join(source, file), "utf8").replace('import uPlot from "uplot";', "const uPlot = { pxRatio: 1 };")
      .replaceAll(/from "\.\/(\w+)\.js"/g, 'from "./$1.mjs"');
    writeFileSync(path.join(folder, file.replace(/js$/, "mjs")), text);
  }
  try {
    return await import(pathToFileURL(path.join(folder, name.replace(/js$/, "mjs"))));
  } finally {
    rmSync(folder, { recursive: true });
  }
};
const { equalBins, shellWord } = await part("format.js");
const { closeOf, closeRange, stretches } = await part("close.js");
const { clockText, setClock } = await part("axis.js");
const { FrameIndex, Track, bitsOf } = await withPlots("track.js");
const { matcher } = await part("search.js");
const { groupsOf } = await part("progress.js");

test("a coarser level keeps extremes and bits", () => {
  const track = new Track({ start_s: 0, width_s: 1, least: [5, 1, 7, 7, 2], most: [6, 9, 7, 7, 3], any: [1, 2, 4, 4, 8], all: [1, 0, 4, 4, 0] });
  assert.equal(track.levelFor(200, 100), 1);
  assert.deepEqual(track.at(1).map((r) => [r.from, r.to, r.least, r.most, r.any, r.all]), [[0, 2, 1, 9, 3, 0], [2, 4, 7, 7, 4, 4], [4, 6, 2, 3, 8, 0]]);
  assert.deepEqual(track.extent(2.5, 3.5, 1000), [7, 7]);
  assert.equal(track.pointText(0, 5, 1000), "one point = 1 s, band = smallest to largest value");
  assert.deepEqual(bitsOf(track, 8).moving, [0, 1, 2, 3]);
});

test("single values cut the band that they lie in, and every time has one value", () => {
  const close = { frames: [11, 12, 13], time_s: [1.4, 1.5, 1.6], values: [5, 9, 5] };
  const rows = new Track({ start_s: 0, width_s: 1, least: [1, 1, 1], most: [9, 9, 9] }, close).at(0);
  assert.deepEqual(rows.map((r) => [r.from, r.to, r.least, r.most, r.frame]), [[0, 1, 1, 9, null], [1, 1.4, 1, 9, null], [1.4, 1.4, 5, 5, 11],
    [1.5, 1.5, 9, 9, 12], [1.6, 1.6, 5, 5, 13], [1.6, 2, 1, 9, null], [2, 3, 1, 9, null]]);
  rows.slice(1).forEach((row, i) => assert.ok(row.from >= rows[i].to, "rows do not overlap"));
});

test("frames of a time", () => {
  const index = new FrameIndex({ start_s: 1, width_s: 1, at: [0, 2], least: [10, 30] });
  assert.equal(index.text(0.5), "");
  assert.equal(index.text(1.5), "frames 10 to 29");
  assert.equal(index.text(3.5), "frame 30");
  assert.equal(new FrameIndex(null).text(1), "");
});

test("a search needs all of its words", () => {
  assert.ok(matcher("AL refused")("slave 0: safeop refused, al status"));
  assert.ok(!matcher("al missing")("slave 0: al refused"));
  assert.ok(matcher(" ")("anything"));
});

test("a file name is one word of a shell, whatever it holds", () => {
  for (const name of ["trace.pcapng", "a b.pcap", "a;touch x", "$(id)", "`id`", "it's", "'", "-o", "*", "a\\b", "#x", "~", "\u00e4"]) {
    const said = spawnSync("sh", ["-c", `printf %s ${shellWord(name)}`], { encoding: "utf8" }).stdout;
    assert.equal(said, name.startsWith("-") ? `./${name}` : name);
  }
});

const bins = (width, counts, from = 999.424) => counts.map((count, i) => ({ from: from + i * width, to: from + (i + 1) * width, count }))
  .filter((bin) => bin.count > 0);

test("bins that touch in the report touch in the chart", () => {
  assert.deepEqual(equalBins(bins(1.024, [5, 7]), 60).counts, [5, 7]);
  for (let n = 1; n <= 200; n += 1) {
    const { counts } = equalBins(bins(1.024, new Array(n).fill(3)), 60);
    assert.ok(counts.every((count) => count > 0), `${n} bins: ${counts}`);
    assert.equal(counts.reduce((a, b) => a + b), 3 * n);
    assert.ok(counts.length <= 60);
  }
});

test("an outlier does not take the middle its shape", () => {
  const all = [...bins(1, [2, 30, 40, 20, 3], 998), { from: 301000, to: 301100, count: 1 }];
  const { counts, beyond } = equalBins(all, 60, { from: 998.5, to: 1002.5 });
  assert.deepEqual(counts, [2, 30, 40, 20, 3]);
  assert.equal(beyond, 1);
  assert.equal(equalBins(all, 60).beyond, 0);
});

test("a gap of the report stays a gap, and widths may differ", () => {
  assert.deepEqual(equalBins(bins(2, [4, 0, 0, 1]), 60).counts, [4, 0, 0, 1]);
  const mixed = [...bins(0.5, [1, 1, 1, 1], 0), ...bins(1, [1, 1, 1], 2)];
  assert.deepEqual(equalBins(mixed, 60).counts, [2, 2, 1, 1, 1]);
});

test("values around findings are told apart by their pauses", () => {
  assert.deepEqual(stretches([1.1, 1.2, 1.3, 4.0, 4.1]), [[0, 2], [3, 4]]);
});

test("what was kept around a time", () => {
  const drawn = { close: [{ frames: [1, 2], time_s: [1, 1.001] }] };
  assert.deepEqual(closeOf(drawn, { close: { at: 0, value: 3 } }).values, [3, 3]);
  assert.equal(closeOf(drawn, {}), null);
  const close = closeOf(drawn, { close: { at: 0, values: [3, 4] } });
  const [from, to] = closeRange(close, 1.0005);
  assert.ok(from < 1 && to > 1.001 && to - from < 0.0012);
  assert.equal(closeRange(close, 2), null);
  assert.equal(closeRange(null, 2), null);
});

test("times of the clock, also across midnight", () => {
  setClock("2026-03-02T23:59:59.999999000Z");
  assert.equal(clockText(0, 6), "23:59:59.999999");
  assert.equal(clockText(0.000001, 6), "00:00:00.000000");
  assert.equal(clockText(61.5, 0), "00:01:01");
});

test("slaves that got as far for the same reason share a ladder", () => {
  const rung = (more = {}) => ({ rung: "op", status: "reached", frame: 7, time_s: 0.1, until_frame: null, until_s: null, why: null, text: null, finding: null, ...more });
  const slave = (position, more, axes = []) => ({ position, progress: [rung(more)], axes });
  const lost = { status: "lost", until_frame: 9, why: "gone" };
  const findings = new Map([["f1", { id: "f1", rule: "a" }], ["f2", { id: "f2", rule: "a" }], ["f3", { id: "f3", rule: "b" }]]);
  const places = (slaves) => groupsOf(slaves, findings).map((group) => group.slaves.map((s) => s.position));
  assert.deepEqual(places([slave(0), slave(1, { frame: 8 }), slave(2)]), [[0, 1, 2]]);
  assert.deepEqual(places([slave(0), slave(1, lost), slave(2)]), [[0], [1], [2]]);
  assert.deepEqual(places([slave(0, { ...lost, finding: "f1" }), slave(1, { ...lost, finding: "f2" }), slave(2, { ...lost, finding: "f3" })]), [[0, 1], [2]]);
  assert.deepEqual(places([slave(0), slave(1, {}, [{ axis: 1, progress: [rung({ rung: "enabled" })] }])]), [[0], [1]]);
});
