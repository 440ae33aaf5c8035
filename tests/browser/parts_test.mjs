// Parts of the page of HTML reports that need no browser.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import path from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const source = path.join(process.env.ECAUDIT_SOURCE_DIR, "cli", "report", "html", "src", "format.js");
const { equalBins, shellWord } = await import(pathToFileURL(source));

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
