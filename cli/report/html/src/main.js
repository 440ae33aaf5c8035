// Puts the report into the page.
import { clocksPanel } from "./clocks.js";
import { h, table } from "./dom.js";
import { fileName, grouped, positionText, slaveNumber } from "./format.js";
import { findingsPanel, notJudgedPanel } from "./findings.js";
import { lanesPanel } from "./lanes.js";
import { live } from "./plots.js";
import { progressPanel } from "./progress.js";
import { identityText, slavePanel, startUp, unmetPanel } from "./slaves.js";
import { busPanel, capturePanel, summaryPanel } from "./summary.js";
import { timingPanel } from "./timing.js";
import { topologyPanel } from "./topology.js";
import { setClock, TimeAxis } from "./axis.js";
import { matcher } from "./search.js";
import { FrameIndex } from "./track.js";

let data;
let report;
let pages;
const root = document.documentElement;

function themeButton() {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : dark.matches);
  const button = h("button", { type: "button", id: "theme" });
  const say = () => {
    button.textContent = isDark() ? "Light" : "Dark";
    button.setAttribute("aria-label", isDark() ? "Switch to light colours" : "Switch to dark colours");
    for (const plot of live) plot.redraw(false, true);
  };
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    say();
  });
  dark.addEventListener("change", say);
  say();
  return button;
}

function slavesPart(capture, page, axis) {
  const unmet = (page.timeline?.slaves ?? []).filter((s) => s.slave === null);
  if (capture.slaves.length + unmet.length === 0) return null;
  const panels = capture.slaves.map((slave) => slavePanel(capture, page, slave, axis));
  if (panels.length === 1) panels[0].open = true; // the only slave
  if (capture.bus.startup?.steps.length) {
    panels.push(h("details", { className: "panel slave", id: "all-slaves-startup" },
      h("summary", null, h("h3", null, "All slaves at once"), h("span", { className: "muted" }, "what the master sent to everybody")),
      startUp(capture.bus.startup)));
  }
  panels.push(...unmet.map((drawn, i) => unmetPanel(drawn, i, axis, new FrameIndex(page.timeline?.frames))));
  const all = h("button", { type: "button", id: "all-slaves", onclick: () => {
    const open = panels.some((p) => !p.open);
    for (const panel of panels) panel.open = open;
    all.textContent = open ? "Close all" : "Open all";
  } }, "Open all");
  const field = h("input", { type: "search", id: "slave-search", autocomplete: "off", oninput: () => {
    const fits = matcher(field.value);
    panels.forEach((panel, i) => { panel.hidden = !fits(`${panel.querySelector("summary").textContent} ${texts[i] ?? ""}`.toLowerCase()); });
  } });
  const texts = capture.slaves.map((s) => `${identityText(s)} ${s.profile ?? ""} ${s.al.state ?? ""}`);
  const search = h("label", { className: "search", for: "slave-search" }, "Search slaves ", field);
  return h("section", { id: "slaves", "aria-labelledby": "slaves-title" },
    h("div", { className: "tools" }, h("h2", { id: "slaves-title" }, "Slaves"), h("span", { className: "space" }),
      panels.length > 3 && search,
      panels.length > 1 && panels.length <= 64 && all),
    page.timeline?.signals_left_out && h("p", { className: "note" }, "Not all signals are plotted: at most 16 of a slave, and 160 in all, so that the page stays small. 'ecaudit signals' writes all of them."),
    h("p", { className: "note paper" }, "Slaves that are folded on the screen are not printed."),
    panels);
}

function capturePage(index) {
  const capture = report.reports[index];
  const page = pages[index];
  setClock(capture.capture.first_time);
  const axis = new TimeAxis(0, capture.capture.duration_s ?? 0);
  const judged = capture.settings.judged !== "nothing";
  const lanes = lanesPanel(capture, page, axis);
  const parts = [
    ["summary", null, summaryPanel(capture, page)],
    ["progress", "Progress", progressPanel(capture, lanes?.show)],
    ["bus", "Bus", busPanel(capture)],
    ["time", "Time line", lanes?.panel],
    ["findings", "Findings", judged && (capture.slaves.length || page.order.length) ? findingsPanel(capture, page, data.rules ?? {}, lanes?.show) : null],
    ["topology", "Topology", topologyPanel(capture)],
    ["timing", "Cycle", timingPanel(capture, page, axis)],
    ["clocks", "Clocks", clocksPanel(capture, page, axis)],
    ["slaves", "Slaves", slavesPart(capture, page, axis)],
    ["not-judged", "Not evaluated", judged && (capture.slaves.length || capture.not_evaluable.length) ? notJudgedPanel(capture) : null],
    ["capture", "Capture", capturePanel(capture, report)],
  ].filter(([, , panel]) => panel);
  return { parts: parts.map(([, , panel]) => panel), links: parts.filter(([, title]) => title).map(([id, title]) => h("a", { href: `#${id}` }, title)) };
}

/// Of several captures: which ones failed, and why.
function overviewPanel(current, show) {
  const rows = report.reports.map((r, i) => ({ r, page: pages[i], i }));
  return h("details", { className: "panel slave", id: "captures", open: rows.length <= 8 },
    h("summary", null, h("h2", null, `${grouped(rows.length)} captures`),
      h("span", { className: "muted" }, `${grouped(pages.filter((p) => p.verdict === "FAIL" || p.verdict === "UNMET").length)} failed`)),
    table(rows, [
      { title: "Verdict", value: ({ page }) => h("span", { className: `badge ${{ FAIL: "error", UNMET: "error", LIMITED: "warning", PASS: "good" }[page.verdict] ?? "plain"}` }, page.verdict.replaceAll("-", " ")) },
      { title: "Capture", value: ({ r, i }) => h("button", { type: "button", "aria-current": i === current ? "true" : null, onclick: () => show(i) }, fileName(r.capture.path)) },
      { title: "Why", value: ({ page }) => page.sentence, long: true },
    ], null, "wide"));
}

/// Opens what the address points to, also where it is not made yet.
function follow() {
  const id = location.hash.slice(1);
  if (!id) return;
  if (!document.getElementById(id)) document.getElementById("findings")?.dispatchEvent(new Event("all"));
  const target = document.getElementById(id);
  if (!target) return;
  target.hidden = false;
  for (let e = target; e; e = e.parentElement) if (e.tagName === "DETAILS") e.open = true;
  target.scrollIntoView();
  if (target.hasAttribute("tabindex")) target.focus({ preventScroll: true });
}

/// Paper is white, narrow, and cannot be unfolded.
function printing() {
  const width = 690; // A4 less its margins
  let theme;
  const prepare = () => {
    const closed = document.querySelectorAll("details.slave:not([open])");
    if (closed.length <= 8) for (const details of closed) details.open = true;
    theme = root.dataset.theme;
    root.dataset.theme = "light";
    for (const plot of live) plot.setSize({ width: Math.min(plot.width, width), height: plot.height });
  };
  const restore = () => {
    if (theme) root.dataset.theme = theme;
    else delete root.dataset.theme;
    for (const plot of live) plot.setSize({ width: plot.root.parentElement.clientWidth, height: plot.height });
  };
  addEventListener("beforeprint", prepare);
  addEventListener("afterprint", restore);
}

function start() {
  const app = document.getElementById("app");
  const nav = h("nav", { "aria-label": "Parts of the report" });
  const main = h("main", { id: "main", tabindex: "-1" });
  const show = (index) => {
    live.clear();
    const { parts, links } = capturePage(index);
    nav.replaceChildren(...links);
    main.replaceChildren(...(report.reports.length > 1 ? [overviewPanel(index, (i) => {
      choice.value = String(i);
      show(i);
      scrollTo(0, 0);
    })] : []), ...parts);
  };
  const choice = report.reports.length > 1 && h("select", { "aria-label": "Capture", id: "choice", onchange: (event) => show(Number(event.target.value)) },
    report.reports.map((r, i) => h("option", { value: i }, `${pages[i].verdict === "NOTHING-TO-CHECK" ? "\u2013" : pages[i].verdict} ${fileName(r.capture.path)}`)));
  app.append(
    h("a", { className: "skip", href: "#main" }, "Skip to the report"),
    h("header", { className: "top" }, h("div", null, h("span", { className: "brand" }, "ecaudit"), choice, nav, h("span", { className: "space" }), themeButton())),
    main,
    h("footer", null, `ecaudit ${report.tool.version}. This page is complete in itself and loads nothing.`));
  // The worst capture first.
  const first = ["FAIL", "UNMET", "LIMITED"].map((v) => pages.findIndex((p) => p.verdict === v)).find((i) => i >= 0) ?? 0;
  if (choice) choice.value = String(first);
  show(first);
  addEventListener("hashchange", follow);
  follow();
  printing();
}

/// Large reports are packed: zlib in Base64.
async function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).json();
}

/// Steps that several slaves have alike are told once.
function completeSteps(capture) {
  for (const slave of capture.slaves) {
    slave.label = `${slaveNumber(capture, slave.position)}`;
    slave.place = positionText(capture, slave.position);
  }
  for (const { startup } of capture.slaves) {
    if (startup) startup.steps = startup.steps.map((step) => ({ ...capture.alike_steps[step.alike], ...step }));
  }
}

async function begin() {
  data = JSON.parse(document.getElementById("data").textContent);
  if (data.packed) {
    if (typeof DecompressionStream === "undefined") {
      document.getElementById("app").append(h("main", null, h("h1", null, "This browser is too old for a report of this size"),
        h("p", null, "It cannot unpack it (DecompressionStream). A browser of 2023 or later can; 'ecaudit check' also writes text and JSON.")));
      return;
    }
    data = await unpack(data.packed);
  }
  ({ report, pages } = data);
  for (const capture of report.reports) completeSteps(capture);
  start();
}

begin();
