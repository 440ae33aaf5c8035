// HTML reports as people meet them: opened as a file in Chromium, read, zoomed, copied from, printed. No page may say
// anything on the console, or ask for anything beside itself.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import path from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

const { ECAUDIT, ECAUDIT_SOURCE_DIR, CHROMIUM, PLAYWRIGHT, AXE } = process.env;
const { chromium } = createRequire(import.meta.url)(PLAYWRIGHT);
const SAMPLES = path.join(ECAUDIT_SOURCE_DIR, "samples", "captures");
const folder = mkdtempSync(path.join(tmpdir(), "ecaudit-browser-"));

const probe = spawnSync(ECAUDIT, ["check", "--format", "html", path.join(SAMPLES, "no-ethercat.pcapng")], { encoding: "utf8" });
if (probe.stderr.includes("built without HTML reports")) {
  console.log("skipped: this program was built without HTML reports");
  process.exit(77);
}

let browser;
before(async () => {
  browser = await chromium.launch({
    executablePath: CHROMIUM,
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
      "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"],
  });
});
after(async () => {
  await browser.close();
  rmSync(folder, { recursive: true });
});

/// The report of captures as a file.
function report(name, ...args) {
  const file = path.join(folder, `${name}.html`);
  const run = spawnSync(ECAUDIT, ["check", "-o", file, ...args], { encoding: "utf8" });
  assert.ok(run.status === 0 || run.status === 1, run.stderr);
  return file;
}

/// Plots are made with the frames that follow.
const drawn = (page) => page.waitForFunction(() =>
  [...document.querySelectorAll(".plot")].every((e) => e.clientWidth === 0 || e.querySelector("canvas")));

/// Opens the file and runs `use` with the page; fails when the page complained, or asked for something.
async function open(file, use, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  const page = await context.newPage();
  const complaints = [];
  page.on("console", (message) => complaints.push(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("dialog", (dialog) => complaints.push(`dialog: ${dialog.message()}`));
  const asked = [];
  page.on("request", (request) => asked.push(request.url()));
  await page.goto(pathToFileURL(file).href);
  await page.waitForSelector("main h1");
  await drawn(page);
  try {
    await use(page);
    assert.deepEqual(complaints, []);
    assert.deepEqual(asked.filter((url) => !url.startsWith("data:")), [pathToFileURL(file).href]);
  } finally {
    await context.close();
  }
}

const range = (page) => page.$eval("#time", (e) => [Number(e.dataset.from), Number(e.dataset.to)]);
const plotArea = async (page, selector) => (await page.$(`${selector} .u-over`)).boundingBox();

const refused = () => report("refused", path.join(SAMPLES, "init-to-op-refused.pcapng"));

test("the first screen has the verdict, the sentence and the bus", async () => {
  await open(refused(), async (page) => {
    assert.equal(await page.textContent(".stamp"), "FAIL");
    assert.equal(await page.textContent("h1"), "Slave 0 (0x1001): OP requested in INIT: not allowed (frame 109)");
    assert.match(await page.title(), /^init-to-op-refused\.pcapng - ecaudit$/);
    const bus = await (await page.$("#bus")).boundingBox();
    assert.ok(bus.y + bus.height < 900, "the bus lies on the first screen");
    assert.match(await page.textContent("#bus"), /0x1001.*kollmorgen-akd-2011.*INIT/);
  });
});

test("a clean capture passes", async () => {
  const eni = path.join(ECAUDIT_SOURCE_DIR, "samples", "descriptions", "two-axes.eni.xml");
  await open(report("clean", "--eni", eni, path.join(SAMPLES, "clean-startup.pcapng")), async (page) => {
    assert.equal(await page.textContent(".stamp"), "PASS");
    assert.match(await page.textContent("#findings"), /None\./);
    assert.ok(await page.isVisible("#slave-0 figure canvas"), "signals are plotted");
  });
});

test("the start-up of a slave, phase by phase and step by step", async () => {
  await open(refused(), async (page) => {
    const phases = await page.$$eval("#slave-0 h3:has-text('Start-up') ~ .scroll >> nth=0", (all) => all[0].innerText);
    assert.match(phases, /eeprom[^]*PREOP reached[^]*mailbox-setup[^]*SAFEOP reached[^]*\bOP reached/);
    await page.click("#slave-0 summary:has-text(' steps')");
    assert.match(await page.innerText("#slave-0 details.more[open]"), /state request\s+PREOP/);
  });
});

test("an edge that has not come is no captured position", async () => {
  // The latch is armed in frame 379, and its valid bit is set in 410.
  const titles = { "#400": "0 captured positions, 1 armed without a capture", "#440": "1 captured position" };
  for (const [to, title] of Object.entries(titles)) {
    await open(report(`latch-${to.slice(1)}`, "--isolate", "--to", to, path.join(SAMPLES, "latch-misuse.pcapng")), async (page) => {
      assert.equal(await page.textContent("#slave-0 summary:has-text('captured position')"), title);
    });
  }
});

test("process data of slaves that only the ENI file knows", async () => {
  const eni = path.join(ECAUDIT_SOURCE_DIR, "samples", "descriptions", "two-axes.eni.xml");
  await open(report("mid-run", "--eni", eni, path.join(SAMPLES, "mid-run.pcapng")), async (page) => {
    // The working counter says that they exchange their data: they are slaves like those that are addressed.
    assert.equal((await page.$$("#slaves details[id^=slave-]")).length, 2);
    await page.$eval("#slave-1", (details) => { details.open = true; });
    await drawn(page);
    assert.ok(await page.isVisible("#slave-1 figure canvas"), "signals are plotted");
  });
});

test("every sample opens without complaint", async () => {
  const expected = JSON.parse(readFileSync(path.join(SAMPLES, "expected.json"), "utf8"));
  const files = Object.keys(expected).map((name) => path.join(SAMPLES, name));
  await open(report("all", ...files), async (page) => {
    const choice = await page.$("#choice");
    assert.equal((await choice.$$("option")).length, files.length);
    for (let i = 0; i < files.length; ++i) {
      await choice.selectOption(String(i));
      await drawn(page);
      assert.match(await page.textContent(".file"), new RegExp(path.basename(files[i]).replaceAll(".", "\\.")));
    }
  });
});

test("zoom by mouse, keys and buttons", async () => {
  await open(refused(), async (page) => {
    const whole = await range(page);
    const area = await plotArea(page, "#time");
    const y = area.y + area.height / 2;
    await page.mouse.move(area.x + area.width * 0.25, y);
    await page.mouse.down();
    await page.mouse.move(area.x + area.width * 0.5, y, { steps: 5 });
    await page.mouse.up();
    const [from, to] = await range(page);
    const length = whole[1] - whole[0];
    assert.ok(Math.abs(from - (whole[0] + length * 0.25)) < length * 0.02, `${from}`);
    assert.ok(Math.abs(to - (whole[0] + length * 0.5)) < length * 0.02, `${to}`);

    await page.focus("#time .u-over");
    await page.keyboard.press("+");
    const closer = await range(page);
    assert.ok(closer[1] - closer[0] < (to - from) * 0.6);
    await page.keyboard.press("ArrowRight");
    assert.ok((await range(page))[0] > closer[0]);
    await page.keyboard.press("Home");
    assert.deepEqual(await range(page), whole);
    await page.click("#time button[aria-label='Zoom in']");
    assert.ok((await range(page))[1] - (await range(page))[0] < length);
    await page.click("text=Whole capture");
    assert.deepEqual(await range(page), whole);
  });
});

test("a finding leads to its place in the time line, and back", async () => {
  await open(refused(), async (page) => {
    await page.click("#finding-f2 >> text=Show in time line");
    assert.equal(await page.getAttribute("#time", "data-focus"), "f2");
    const [from, to] = await range(page);
    assert.ok(from < 0.005238 && 0.005238 < to && to - from < 0.02, `${from} ${to}`);
    assert.equal(await page.evaluate(() => document.activeElement.closest("#time") !== null), true);

    await page.click("text=Whole capture");
    const area = await plotArea(page, "#time");
    const whole = await range(page);
    const at = (0.004158 - whole[0]) / (whole[1] - whole[0]);
    await page.mouse.click(area.x + area.width * at, area.y + 10);
    await page.waitForFunction(() => location.hash === "#finding-f1");
    assert.equal(await page.evaluate(() => document.activeElement.id), "finding-f1");

    await page.mouse.move(area.x + area.width * 0.8, area.y + 24);
    await page.click("#finding-f2 .chain a");
    assert.equal(await page.evaluate(() => location.hash), "#finding-f1");
  });
});

test("what lies under the pointer is told", async () => {
  await open(refused(), async (page) => {
    const area = await plotArea(page, "#time");
    await page.mouse.move(area.x + area.width * 0.7, area.y + 24);
    assert.match(await page.textContent("#time .tip:not([hidden])"), /AL state: OP, from frame 174/);
  });
});

test("filters are copied", async () => {
  await open(refused(), async (page) => {
    await page.click("#finding-f1 >> text=Copy filter");
    await page.waitForSelector("[role=status]:has-text('Copied')");
    assert.equal(await page.evaluate(() => navigator.clipboard.readText()), "frame.number==109 || frame.number==108");
  });
});

test("the content security policy forbids everything else", async () => {
  const file = refused();
  const html = readFileSync(file, "utf8");
  const policy = html.match(/Content-Security-Policy" content="([^"]*)"/)[1];
  assert.match(policy, /^default-src 'none'; script-src 'sha256-[^']+'; style-src 'sha256-[^']+'; /);
  assert.ok(!policy.includes("unsafe"));
  const asked = [];
  const server = createServer((request, response) => {
    asked.push(request.url);
    response.end();
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.goto(pathToFileURL(file).href);
  const outcome = await page.evaluate(async (url) => {
    const script = document.createElement("script");
    script.textContent = "window.injected = true";
    document.body.append(script);
    const image = new Promise((resolve) => {
      const element = new Image();
      element.onload = () => resolve("loaded");
      element.onerror = () => resolve("refused");
      element.src = `${url}/x.png`;
    });
    return { script: window.injected ?? "refused", image: await image,
      fetch: await fetch(url).then(() => "fetched", () => "refused") };
  }, `http://127.0.0.1:${server.address().port}`);
  assert.deepEqual(outcome, { script: "refused", image: "refused", fetch: "refused" });
  assert.deepEqual(asked, []);
  await context.close();
  server.close();
});

test("texts of others stay texts", async () => {
  const eni = readFileSync(path.join(ECAUDIT_SOURCE_DIR, "samples", "descriptions", "two-axes.eni.xml"), "utf8");
  const evil = "</script><img src=x onerror=alert(1)><b>x";
  const file = path.join(folder, "evil.eni.xml");
  writeFileSync(file, eni.replace(/<Name>[^<]*<\/Name>/g, `<Name>${evil.replaceAll("<", "&lt;")}</Name>`));
  const html = report("evil", "--eni", file, path.join(SAMPLES, "clean-startup.pcapng"));
  await open(html, async (page) => {
    assert.ok((await page.textContent("main")).includes(evil), "the name is shown");
    assert.equal(await page.$("main img"), null);
    assert.equal(await page.$("main b:text-is('x')"), null);
  });
});

test("headings, landmarks and names for screen readers", async () => {
  await open(refused(), async (page) => {
    for (const landmark of ["header", "nav", "main", "footer"]) assert.equal((await page.$$(landmark)).length, 1, landmark);
    assert.equal((await page.$$("h1")).length, 1);
    const levels = await page.$$eval("h1, h2, h3, h4", (all) => all.map((e) => Number(e.tagName[1])));
    levels.reduce((before, level) => {
      assert.ok(level <= before + 1, `a heading of level ${level} follows one of level ${before}`);
      return level;
    }, 0);
    const nameless = await page.$$eval("button, a, select, [role=img]", (all) =>
      all.filter((e) => !(e.textContent.trim() || e.getAttribute("aria-label"))).map((e) => e.outerHTML));
    assert.deepEqual(nameless, []);
    assert.equal(await page.getAttribute("html", "lang"), "en");
    await page.keyboard.press("Tab");
    assert.equal(await page.evaluate(() => document.activeElement.className), "skip");
    const ids = await page.$$eval("[id]", (all) => all.map((e) => e.id));
    assert.equal(new Set(ids).size, ids.length, "no id twice");
    const dangling = await page.$$eval("a[href^='#']", (all) => all.map((e) => e.getAttribute("href").slice(1)).filter((id) => !document.getElementById(id)));
    assert.deepEqual(dangling, []);
  });
});

/// Texts whose contrast to what lies behind them is below 4.5 to 1.
const faint = (page) => page.evaluate(() => {
  const numbers = (color) => color.match(/[\d.]+/g).map(Number);
  const light = ([r, g, b]) => {
    const part = (v) => (v / 255 <= 0.03928 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
    return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
  };
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const color = numbers(getComputedStyle(e).backgroundColor);
      if (color.length === 3 || color[3] > 0.99) return color;
    }
    return [255, 255, 255];
  };
  const found = [];
  for (const element of document.querySelectorAll("main *, header *, footer")) {
    const own = [...element.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !element.checkVisibility()) continue;
    const [a, b] = [light(numbers(getComputedStyle(element).color)), light(behind(element))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) found.push(`${element.className} ${element.textContent.slice(0, 30)}: ${contrast.toFixed(2)}`);
  }
  return found;
});

test("light and dark, both legible", async () => {
  const file = refused();
  for (const colorScheme of ["light", "dark"]) {
    await open(file, async (page) => {
      const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
      const before = await background();
      assert.deepEqual(await faint(page), []);
      await page.click("#theme");
      assert.notEqual(await background(), before);
      assert.deepEqual(await faint(page), []);
      await page.click("#theme");
      assert.equal(await background(), before);
    }, { colorScheme });
  }
});

/// What axe-core finds wrong, in a line each.
const violations = async (page) => {
  await page.evaluate(readFileSync(AXE, "utf8"));
  return page.evaluate(async () => (await window.axe.run(document, { resultTypes: ["violations"] })).violations
    .map((v) => `${v.id}: ${v.help}: ${v.nodes.slice(0, 3).map((n) => `${n.html.slice(0, 120)} ${n.any[0]?.message ?? ""}`).join(" | ")}`));
};

test("axe-core finds no violation, light and dark, wide and narrow", async () => {
  const eni = path.join(ECAUDIT_SOURCE_DIR, "samples", "descriptions", "two-axes.eni.xml");
  const files = [refused(), report("axe-bus", path.join(SAMPLES, "clean-mixed-bus.pcapng")), report("axe-link", path.join(SAMPLES, "link-errors.pcapng")),
    report("axe-axes", "--eni", eni, path.join(SAMPLES, "latch-misuse.pcapng")),
    report("axe-fault", path.join(SAMPLES, "drive-fault.pcapng")), report("axe-cycle", path.join(SAMPLES, "irregular-master.pcapng")),
    report("axe-clocks", clockCapture("axe-clocks.pcap", Array.from({ length: 9 }, (_, i) => falling(100_000 * (i + 1), 0.7))))];
  for (const file of files) {
    for (const colorScheme of ["light", "dark"]) {
      for (const width of [1400, 420]) {
        await open(file, async (page) => {
          await page.$$eval("details", (all) => { for (const details of all) details.open = true; });
          await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
          await page.$$eval("details details, article details", (all) => { for (const details of all) details.open = true; });
          for (const input of (await page.$$("#overlay fieldset input")).slice(0, 2)) await input.check();
          await drawn(page);
          assert.deepEqual(await violations(page), [], `${path.basename(file)} ${colorScheme} ${width}`);
        }, { colorScheme, viewport: { width, height: 900 } });
      }
    }
  }
});

test("signals are picked and laid over the time line", async () => {
  await open(report("overlay", path.join(SAMPLES, "latch-misuse.pcapng")), async (page) => {
    await page.click("#overlay summary");
    const boxes = await page.$$("#overlay fieldset input");
    assert.ok(boxes.length >= 2);
    assert.equal(await page.$("#overlay canvas"), null);
    // By keyboard alone.
    await boxes[0].focus();
    await page.keyboard.press("Space");
    await boxes[1].focus();
    await page.keyboard.press("Space");
    await drawn(page);
    assert.equal((await page.$$("#overlay .picked li")).length, 2);
    const label = await page.getAttribute("#overlay .u-over", "aria-label");
    assert.match(label, /over time, each on a scale of its own/);
    await page.check("#one-scale");
    await drawn(page);
    assert.match(await page.getAttribute("#overlay .u-over", "aria-label"), /on the same scale/);
    const area = await plotArea(page, "#overlay");
    await page.mouse.move(area.x + area.width * 0.7, area.y + 40);
    assert.match(await page.textContent("#overlay .picked .value"), /\d/);
    // Zooms with all others.
    const whole = await range(page);
    await page.focus("#overlay .u-over");
    await page.keyboard.press("+");
    assert.ok((await range(page))[1] - (await range(page))[0] < (whole[1] - whole[0]) * 0.6);
    for (const input of (await page.$$("#overlay fieldset input")).slice(2, 6)) await input.check();
    if (boxes.length > 6) assert.equal(await boxes[6].isDisabled(), true, "no more than can be told apart");
    await boxes[0].uncheck();
    if (boxes.length > 6) assert.equal(await boxes[6].isDisabled(), false);
  });
});

test("around a finding every cycle is shown", async () => {
  await open(report("close", path.join(SAMPLES, "drive-fault.pcapng")), async (page) => {
    const kept = await page.evaluate(() => {
      const { report, pages } = JSON.parse(document.getElementById("data").textContent);
      const finding = report.reports[0].findings[0];
      const slave = pages[0].timeline.slaves.find((s) => s.slave === finding.slave);
      return { frame: finding.frame, slave: finding.slave, time: finding.time_s, close: slave?.close?.[0]?.frames ?? [],
        cycles: pages[0].timeline.cycle_close?.frames ?? [] };
    });
    const frames = kept.close.length ? kept.close : kept.cycles;
    assert.ok(frames.filter((f) => f <= kept.frame).length >= 5 && frames.length <= 2000, `${frames.length} around ${kept.frame}`);
    await page.click("#finding-f1 >> text=Show in time line");
    const [from, to] = await range(page);
    assert.ok(from <= kept.time && kept.time <= to && to - from < 0.2, `${from} ${to}`);
  });
});

test("two cursors and what lies between them, by mouse and keys", async () => {
  await open(report("cursors", path.join(SAMPLES, "latch-misuse.pcapng")), async (page) => {
    await page.click("#overlay summary");
    await page.check("#overlay fieldset input >> nth=1");
    await drawn(page);
    const area = await plotArea(page, "#time");
    await page.click("#cursor-a");
    await page.mouse.click(area.x + area.width * 0.6, area.y + 30);
    assert.match(await page.innerText("#cursors"), /^A [\d.]+ s.*, frames? \d+/);
    await page.mouse.move(area.x + area.width * 0.85, area.y + 30);
    await page.focus("#time .u-over");
    await page.keyboard.press("b");
    const [from, to] = await range(page);
    const said = await page.innerText("#cursors");
    const between = Number(/B \u2212 A = ([\d.]+) ms/.exec(said)[1]);
    assert.ok(Math.abs(between - (to - from) * 250) < (to - from) * 10, said);
    assert.match(said, /\d+ frames/);
    assert.match(await page.textContent("#overlay .picked .value"), /B \u2212 A = /);
    await page.click("text=Remove cursors");
    assert.equal(await page.isVisible("#cursors"), false);
  });
});

test("a zoomed signal says what a point is, and which command gives all values", async () => {
  await open(report("points", longCapture(30_000)), async (page) => {
    await page.waitForSelector("#timing .point");
    await drawn(page);
    const whole = await page.textContent("#timing .point");
    assert.match(whole, /one point = [\d.]+ (ms|s), band = smallest to largest value/);
    await page.focus("#time .u-over");
    for (let i = 0; i < 5; ++i) await page.keyboard.press("+");
    const width = (text) => Number(/= ([\d.]+) ms/.exec(text)?.[1] ?? 0);
    assert.ok(width(await page.textContent("#timing .point")) < width(whole), `a finer level when zoomed: ${whole}`);
    await page.waitForFunction(() => /--around '#\d+' --window [\d.]+/.test(document.getElementById("all-samples").textContent));
    const command = await page.textContent("#all-samples code");
    const run = spawnSync("sh", ["-c", command.replace(/^ecaudit/, ECAUDIT).replace("-o signals.csv", "")], { encoding: "utf8" });
    assert.equal(run.status, 0, run.stderr);
    assert.match(run.stdout, /^time_s,/);
  });
});

test("bits of words have lanes", async () => {
  await open(report("bits", path.join(SAMPLES, "latch-misuse.pcapng")), async (page) => {
    await page.click("#slave-0 .bits summary >> nth=0");
    await page.waitForSelector("#slave-0 .bits canvas");
    assert.match(await page.textContent("#slave-0 .bits[open]"), /Bits: \d+[, ]/);
  });
});

test("the picture and the picked signals as files", async () => {
  await open(report("files", path.join(SAMPLES, "latch-misuse.pcapng")), async (page) => {
    await page.click("#overlay summary");
    await page.check("#overlay fieldset input >> nth=0");
    await drawn(page);
    const saved = async (button) => {
      const [download] = await Promise.all([page.waitForEvent("download"), page.click(button)]);
      return { name: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
    };
    const png = await saved("#save-png");
    assert.equal(png.name, "latch-misuse.pcapng.png");
    assert.deepEqual([...png.bytes.subarray(1, 4)], [80, 78, 71]);
    const svg = (await saved("#save-svg")).bytes.toString();
    const problem = await page.evaluate((text) => new DOMParser().parseFromString(text, "image/svg+xml").querySelector("parsererror")?.textContent ?? "", svg);
    assert.equal(problem, "");
    assert.match(svg, /<svg [^>]*viewBox[^]*>OP<\/text>/);
    const rows = (await saved("#save-csv")).bytes.toString().trim().split("\n");
    assert.equal(rows[0], "from_s,to_s,first_frame,slave,signal,object,unit,smallest,largest");
    assert.ok(rows.length > 5);
  });
});

test("findings, slaves and signals are searched, and alike findings fold", async () => {
  await open(report("search", path.join(SAMPLES, "latch-misuse.pcapng")), async (page) => {
    const visible = () => page.$$eval("#findings article", (all) => all.filter((e) => e.checkVisibility()).length);
    if (await page.$("#finding-search")) {
      await page.selectOption("#finding-severity", "error");
      assert.ok((await page.$$eval("#findings article", (all) => all.filter((e) => e.checkVisibility()).map((e) => e.querySelector(".badge").textContent)))
        .every((text) => text.startsWith("error")));
      await page.fill("#finding-search", "no such word");
      assert.equal(await visible(), 0);
      assert.match(await page.textContent("#finding-count"), /^0 of \d+ findings$/);
    } else assert.ok((await visible()) <= 3);
    await page.click("#overlay summary");
    await page.fill("#signal-search", "6041h");
    assert.equal((await page.$$eval("#overlay fieldset label", (all) => all.filter((e) => e.checkVisibility()).length)), 1);
  });
});

test("times of the clock on the axis and under the pointer", async () => {
  await open(refused(), async (page) => {
    assert.equal(await page.getAttribute("#clock", "aria-pressed"), "false");
    await page.click("#clock");
    assert.equal(await page.getAttribute("#clock", "aria-pressed"), "true");
    const area = await plotArea(page, "#time");
    await page.mouse.move(area.x + area.width * 0.7, area.y + 24);
    assert.match(await page.textContent("#time .tip:not([hidden])"), /0\.0\d+ s, 09:00:00\.5\d{5} UTC/);
  });
});

test("prints without buttons, with what was folded", async () => {
  await open(report("mixed", path.join(SAMPLES, "clean-mixed-bus.pcapng")), async (page) => {
    await page.emulateMedia({ media: "print" });
    // The new layout is told to the plots before the browser prints, not after.
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    await page.evaluate(() => dispatchEvent(new Event("beforeprint")));
    assert.equal(await page.isVisible("header.top"), false);
    assert.equal(await page.isVisible("#slave-2 table"), true);
    assert.equal(await page.evaluate(() => getComputedStyle(document.body).backgroundColor), "rgb(255, 255, 255)");
    await drawn(page);
    const widths = await page.$$eval(".uplot", (all) => all.map((e) => e.clientWidth));
    assert.ok(widths.length > 1 && Math.max(...widths) <= 690, `${widths}`);
    const pdf = await page.pdf({ format: "A4" });
    assert.ok(pdf.length > 10_000);
    await page.emulateMedia({ media: "screen" });
    await page.evaluate(() => dispatchEvent(new Event("afterprint")));
    assert.notEqual(await page.evaluate(() => getComputedStyle(document.body).backgroundColor), "rgb(255, 255, 255)");
  }, { colorScheme: "dark" });
});

test("a narrow window scrolls down only", async () => {
  await open(refused(), async (page) => {
    const widths = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(widths[0] <= widths[1], `${widths}`);
  }, { viewport: { width: 420, height: 800 } });
});

test("nothing is cut in a narrow window, nor on paper", async () => {
  const file = report("bus", path.join(SAMPLES, "clean-mixed-bus.pcapng"));
  const beyond = (page, edge) => page.$$eval("#bus td, #bus th, #not-judged td, #topology svg", (all, most) =>
    all.filter((e) => e.getBoundingClientRect().right > most + 1).map((e) => e.textContent.slice(0, 40)), edge);
  await open(file, async (page) => {
    assert.deepEqual(await beyond(page, 420), []);
    assert.ok((await page.$$("#bus td[data-title=Family]")).length > 0, "a card names what it shows");
  }, { viewport: { width: 420, height: 800 } });
  await open(file, async (page) => {
    await page.emulateMedia({ media: "print" });
    assert.deepEqual(await beyond(page, 690), []);
  }, { viewport: { width: 690, height: 900 } });
});

test("the topology, and the link that gave trouble", async () => {
  await open(report("link", path.join(SAMPLES, "link-errors.pcapng")), async (page) => {
    assert.ok((await page.$$("#topology rect.node")).length >= 1);
    assert.ok((await page.$$("#topology path.trouble")).length + (await page.$$("#topology .notes li")).length > 0);
    assert.match(await page.textContent("#topology .notes"), /counted|link/);
  });
});

test("findings last as long as they do, with the page of their rule", async () => {
  await open(report("falls", path.join(SAMPLES, "falls-out-of-op.pcapng")), async (page) => {
    assert.match(await page.textContent("#finding-f1 .meta"), /\d\d:\d\d:\d\d\.\d{3} UTC/);
    await page.click("#finding-f1 summary:has-text('About this rule')");
    assert.match(await page.innerText("#finding-f1 .rule"), /What it checks/);
    assert.match(await page.textContent("#time .legend"), /process data.*pause, or absent/);
  });
});

test("the index of many captures sorts and filters", async () => {
  const pages = path.join(folder, "pages");
  const run = spawnSync(ECAUDIT, ["batch", "--output-dir", path.join(folder, "reports"), "-o", `html=${pages}`,
    ...["init-to-op-refused", "falls-out-of-op", "clean-startup", "outbound-only"].map((n) => path.join(SAMPLES, `${n}.pcapng`))], { encoding: "utf8" });
  assert.equal(run.status, 1, run.stderr);
  const index = pathToFileURL(path.join(pages, "index.html")).href;
  for (const viewport of [{ width: 1400, height: 900 }, { width: 420, height: 800 }]) {
    const context = await browser.newContext({ viewport, colorScheme: viewport.width > 1000 ? "light" : "dark" });
    const page = await context.newPage();
    const complaints = [];
    page.on("console", (message) => complaints.push(message.text()));
    page.on("pageerror", (error) => complaints.push(String(error)));
    await page.goto(index);
    const shown = () => page.$$eval(".captures tbody tr:not([hidden]) .path", (all) => all.map((e) => e.textContent.replace(/.*\//, "")));
    assert.deepEqual(await shown(), ["falls-out-of-op.pcapng", "init-to-op-refused.pcapng", "outbound-only.pcapng", "clean-startup.pcapng"], "failures first");
    const widths = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(widths[0] <= widths[1], `${widths}`);
    await page.selectOption("#verdict", "fail");
    assert.deepEqual(await shown(), ["falls-out-of-op.pcapng", "init-to-op-refused.pcapng"]);
    await page.selectOption("#verdict", "");
    await page.fill("#text", "falls op");
    assert.deepEqual(await shown(), ["falls-out-of-op.pcapng"]);
    await page.fill("#text", "");
    if (viewport.width > 1000) {
      await page.click(".captures th:nth-child(6) button");
      await page.click(".captures th:nth-child(6) button");
      assert.equal(await page.getAttribute(".captures th:nth-child(6)", "aria-sort"), "descending");
      assert.notEqual((await shown())[0], "clean-startup.pcapng");
    }
    await page.click(".same >> nth=0");
    assert.equal((await shown()).length, 1);
    assert.deepEqual(await faint(page), []);
    await page.click(".captures tbody tr:not([hidden]) a");
    await page.waitForSelector(".stamp");
    assert.equal(await page.textContent(".stamp"), "FAIL");
    assert.deepEqual(complaints, []);
    await context.close();
  }
});

/// A capture of `packets` packets: the cycles of a sample again and again.
function longCapture(packets) {
  const source = readFileSync(path.join(SAMPLES, "clean-startup.pcapng"));
  const all = [];
  for (let at = 0; at < source.length; at += source.readUInt32LE(at + 4)) {
    if (source.readUInt32LE(at) !== 6) continue;
    const time = (BigInt(source.readUInt32LE(at + 12)) << 32n) | BigInt(source.readUInt32LE(at + 16));
    all.push([time, source.subarray(at + 28, at + 28 + source.readUInt32LE(at + 20))]);
  }
  const record = ([time, bytes], shift) => {
    const header = Buffer.alloc(16);
    header.writeUInt32LE(Number((time + shift) / 1_000_000_000n), 0);
    header.writeUInt32LE(Number((time + shift) % 1_000_000_000n), 4);
    header.writeUInt32LE(bytes.length, 8);
    header.writeUInt32LE(bytes.length, 12);
    return Buffer.concat([header, bytes]);
  };
  const file = Buffer.alloc(24);
  file.writeUInt32LE(0xa1b23c4d, 0);
  file.writeUInt16LE(2, 4);
  file.writeUInt16LE(4, 6);
  file.writeUInt32LE(262144, 16);
  file.writeUInt32LE(1, 20);
  const [from, to] = [250, 350]; // cyclic process data in OP
  const period = all[to][0] - all[from][0];
  const parts = [file, ...all.slice(0, from).map((p) => record(p, 0n))];
  let shift = 0n;
  for (let n = all.length; n < packets; n += to - from, shift += period) {
    for (const packet of all.slice(from, to)) parts.push(record(packet, shift));
  }
  for (const packet of all.slice(to)) parts.push(record(packet, shift - period));
  const name = path.join(folder, `long-${packets}.pcap`);
  writeFileSync(name, Buffer.concat(parts));
  return name;
}

test("the page of a start-up stays small", () => {
  for (const name of Object.keys(JSON.parse(readFileSync(path.join(SAMPLES, "expected.json"), "utf8")))) {
    const size = readFileSync(report("size", path.join(SAMPLES, name))).length;
    assert.ok(size <= 500_000, `${name}: ${size} bytes`);
  }
});

test("a long capture gives a small page that opens at once", async () => {
  const short = readFileSync(report("short", longCapture(2_000))).length;
  const file = report("long", longCapture(150_000));
  const size = readFileSync(file).length;
  assert.ok(size < short + 400_000, `${short} -> ${size} bytes`);
  const start = Date.now();
  await open(file, async (page) => {
    assert.ok(Date.now() - start < 20_000);
    assert.match(await page.textContent("#summary"), /149,\d{3}/);
    assert.ok(await page.isVisible("#timing canvas"));
  });
});

/// A capture in which a master reads 0x092C of slaves every ms. curves: of each slave the raw values, one a cycle.
function clockCapture(name, curves) {
  const records = [];
  let time = 1_000_000n; // us
  const frame = (command, address, register, data) => {
    for (const returned of [false, true]) {
      const bytes = Buffer.alloc(60);
      bytes.fill(0xff, 0, 6);
      bytes.set([returned ? 2 : 0, 1, 2, 3, 4, 5, 0x88, 0xa4], 6);
      bytes.writeUInt16LE(0x1000 | (12 + data.length), 14);
      bytes.set([command, (records.length >> 2) & 0xff], 16);
      // The slave's position counts up on the way.
      bytes.writeUInt16LE(command === 1 && returned ? (address + curves.length) & 0xffff : address, 18);
      bytes.writeUInt16LE(register, 20);
      bytes.writeUInt16LE(data.length, 22);
      if (returned) bytes.set(data, 26);
      bytes.writeUInt16LE(returned ? 1 : 0, 26 + data.length);
      const header = Buffer.alloc(16);
      header.writeUInt32LE(Number(time / 1_000_000n), 0);
      header.writeUInt32LE(Number(time % 1_000_000n), 4);
      header.writeUInt32LE(bytes.length, 8);
      header.writeUInt32LE(bytes.length, 12);
      records.push(header, bytes);
      time += 5n;
    }
  };
  const word = (value, size) => {
    const data = Buffer.alloc(size);
    data.writeUIntLE(value, 0, size);
    return data;
  };
  curves.forEach((_, i) => frame(1, -i & 0xffff, 0x0010, word(0x1001 + i, 2)));
  for (let k = 0; k < curves[0].length; ++k) {
    curves.forEach((curve, i) => frame(4, 0x1001 + i, 0x092c, word(curve[k], 4)));
    time += 1000n;
  }
  const file = Buffer.alloc(24);
  file.writeUInt32LE(0xa1b2c3d4, 0);
  file.writeUInt16LE(2, 4);
  file.writeUInt16LE(4, 6);
  file.writeUInt32LE(262144, 16);
  file.writeUInt32LE(1, 20);
  writeFileSync(path.join(folder, name), Buffer.concat([file, ...records]));
  return path.join(folder, name);
}

const falling = (from, factor, n = 60) => Array.from({ length: n }, (_, k) => Math.floor(from * factor ** k));

test("the clocks: one line a slave, when each locked, and the last of them", async () => {
  const negative = falling(2_000_000, 0.7).map((v) => v + 2 ** 31);
  const capture = clockCapture("clocks.pcap", [falling(200_000, 0.5), negative, falling(900_000, 0.8), falling(900_000, 0.8)]);
  await open(report("clocks", capture), async (page) => {
    assert.match(await page.textContent("#clocks p"), /^4 clocks exceeded 1 µs, all locked\. The last one was slave 3 at 0\.0\d+ s, frame \d+\.$/);
    const rows = await page.$$eval("#clocks tbody tr", (all) => all.map((r) => [...r.cells].map((c) => c.textContent)));
    assert.deepEqual(rows.map((r) => [r[0], r[1]]), [["Slaves 2, 3 (alike)", "900,000 ns"], ["Slave 1", "2,000,000 ns"], ["Slave 0", "200,000 ns"]]);
    assert.equal((await page.$$("#clocks .legend li")).length, 3);
    assert.ok(await page.isVisible("#clocks canvas"));
    // Under the pointer, each line has its value.
    await (await page.$("#clocks .u-over")).scrollIntoViewIfNeeded();
    const area = await plotArea(page, "#clocks");
    await page.mouse.move(area.x + area.width / 2, area.y + area.height / 2);
    await page.waitForFunction(() => /^[\d,]+ ns( to [\d,]+ ns)?$/.test(document.querySelector("#clocks .legend .value").textContent));
  });
});

test("the clocks: one that never locks comes first, and the rest of many is in the table", async () => {
  const curves = Array.from({ length: 9 }, (_, i) => (i === 4 ? new Array(60).fill(50_000) : falling(100_000 * (i + 1), 0.7)));
  await open(report("clocks-open", clockCapture("clocks-open.pcap", curves)), async (page) => {
    assert.match(await page.textContent("#clocks p"), /^9 clocks exceeded 1 µs, 1 did not lock before the capture ends\./);
    assert.match(await page.textContent("#clocks .legend li"), /^Slave 4not locked, last 50,000 ns$/);
    assert.equal((await page.$$("#clocks .legend li")).length, 6);
    assert.match(await page.textContent("#clocks .note"), /^The worst 6 are drawn; 3 more clocks in the table\.$/);
    assert.equal((await page.$$("#clocks tbody tr")).length, 9);
  });
});

test("clocks within the limit get no part of the page", async () => {
  await open(report("clocks-good", clockCapture("clocks-good.pcap", [falling(900, 0.9), falling(1000, 0.8)])), async (page) => {
    await page.click("#slave-0 > summary");
    await page.waitForFunction(() => document.querySelector("#slave-0").textContent.includes("at most 900 ns"));
    assert.equal(await page.$("#clocks"), null);
  });
});

test("irregular cycles show their origins as shares, regular ones do not", async () => {
  await open(report("irregular", path.join(SAMPLES, "irregular-master.pcapng")), async (page) => {
    const parts = await page.$$eval("#origins li", (all) => all.map((e) => e.textContent));
    assert.match(parts[0], /^Sending \(master\)100 %, 1403 µs$/);
    assert.deepEqual(parts.map((p) => p.replace(/\d.*/, "")), ["Sending (master)", "Return (line, slaves, network card)", "Stamps (recorder)"]);
    const [sending, back] = await page.$$eval("#origins .shares .share", (all) => all.map((e) => e.getBoundingClientRect().width));
    assert.ok(sending > 20 * back && back >= 2, `${sending} ${back}`);
  });
  await open(report("regular", path.join(SAMPLES, "clean-startup.pcapng")), async (page) => {
    assert.equal(await page.$("#origins"), null);
  });
});

test("the values before a fault are a table with words", async () => {
  await open(report("before", path.join(SAMPLES, "drive-fault.pcapng")), async (page) => {
    const cells = await page.$$eval("table.before tr", (all) => all.map((r) => [...r.cells].map((c) => c.textContent)));
    assert.deepEqual(cells, [["Before it", "In frame 290", "Change in 45.032 ms"], ["Control word", "0x000f Enable operation", ""],
      ["Status word", "0x0237 Operation enabled", ""], ["Set point (607Ah:0)", "4000", "+4000"]]);
  });
});

test("counting from 1 limits nothing, and the page names the way of counting", async () => {
  const sample = path.join(SAMPLES, "wkc-link-break.pcapng");
  await open(report("counted", "--count-from", "1", sample), async (page) => {
    const text = await page.textContent("#capture");
    assert.doesNotMatch(text, /Limited by/);
    assert.match(text, /Slaves counted from1 \(position 0 is slave 1\)/);
    assert.match(await page.textContent("#slaves"), /Slave 3 \(position 2, 0x1003\)/);
  });
  await open(report("counted-one", "--count-from", "1", "--slave", "3", sample), async (page) => {
    assert.match(await page.textContent("#capture"), /Limited by--count-from 1 --slave 3/);
  });
});
