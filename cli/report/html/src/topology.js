// The bus as it is plugged in: a row for each slave, branches indented, what is not known drawn open.
import { h } from "./dom.js";
import { capitalised, count, hex, slaveName, slaveNumber } from "./format.js";

const ROW = 34;
const INDENT = 26;
const BOX = { width: 30, height: 22 };
const MOST = 128;

function svg(tag, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value !== null && value !== undefined && value !== false) element.setAttribute(name === "className" ? "class" : name, String(value));
  }
  for (const child of children.flat()) {
    if (child !== null && child !== undefined && child !== false) element.append(child);
  }
  return element;
}

const risen = (port) => Object.values(port.errors).reduce((a, b) => a + b, 0);
const troubled = (port) => port && (risen(port) > 0 || port.changes.length > 0);

/// Which nodes hang on which, and how far each is indented: the line goes on at port 1, other neighbours are branches.
function layout(nodes) {
  const byPosition = new Map(nodes.map((node) => [node.slave, node]));
  const children = new Map();
  for (const node of nodes) {
    const above = node.above?.slave;
    if (above === null || above === undefined) continue;
    if (!children.has(above)) children.set(above, []);
    children.get(above).push(node);
  }
  const goesOn = (slave) => {
    const all = children.get(slave) ?? [];
    return all.find((n) => n.above.port === 1) ?? all[0];
  };
  const depth = new Map();
  for (const node of nodes) {
    const above = node.above?.slave ?? null;
    depth.set(node.slave, above === null || !byPosition.has(above) ? 0 : depth.get(above) + (goesOn(above) === node ? 0 : 1));
  }
  return depth;
}

const ERRORS = { invalid_frames: "invalid frame", receive_errors: "receive error", forwarded_errors: "forwarded error", lost_links: "lost link" };

function portText(port) {
  const parts = Object.entries(port.errors).filter(([, n]) => n > 0).map(([name, n]) => `${count(n, ERRORS[name])} counted`);
  for (const change of port.changes) parts.push(`link ${change.link ? "there again" : "gone"} in frame ${change.frame}`);
  return parts.join(", ");
}

/// The link above a node, and what went wrong at either end of it.
function linkOf(capture, node, nodes) {
  const above = node.above ? nodes.find((n) => n.slave === node.above.slave) : null;
  const ends = [[node, node.ports[0]]];
  if (above && node.above.port !== null) ends.push([above, above.ports[node.above.port]]);
  const trouble = ends.filter(([, port]) => troubled(port));
  const from = !node.above ? "an unknown place" : above ? `${slaveName(capture, above.slave)}${node.above.port === null ? "" : ` port ${node.above.port}`}` : "the master";
  return {
    name: `between ${from} and ${slaveName(capture, node.slave)} port 0`,
    trouble: trouble.map(([end, port]) => `${slaveName(capture, end.slave)}: ${portText(port)}`).join("; "),
    delay: node.above?.measured_delay_ns ?? node.above?.delay_ns ?? null,
    port: node.above?.port ?? null,
  };
}

export function topologyPanel(capture) {
  const topology = capture.bus.topology;
  if (!topology || topology.slaves.length === 0) return null;
  const nodes = topology.slaves.slice(0, MOST);
  const depth = layout(nodes);
  const rowOf = new Map(nodes.map((node, i) => [node.slave, i + 1]));
  const x = (node) => 12 + depth.get(node.slave) * INDENT;
  const y = (row) => row * ROW + 6;
  const width = 640;
  const lines = [];
  const boxes = [svg("rect", { className: "master", x: 12, y: y(0), width: 66, height: BOX.height, rx: 4 }),
    svg("text", { x: 45, y: y(0) + 15, className: "inside" }, "master")];
  const notes = [];
  nodes.forEach((node) => {
    const row = rowOf.get(node.slave);
    const link = linkOf(capture, node, nodes);
    const middle = x(node) + BOX.width / 2;
    const top = y(row);
    const kind = `link${link.trouble ? " trouble" : ""}${node.above && (link.port !== null || node.above.slave === null) ? "" : " open"}`;
    const above = node.above && node.above.slave !== null ? nodes.find((n) => n.slave === node.above.slave) : null;
    let path;
    if (!node.above) path = `M${middle} ${top - 10}V${top}`;
    else if (!above) path = `M${middle} ${y(0) + BOX.height}V${top}`;
    else if (depth.get(above.slave) === depth.get(node.slave)) path = `M${middle} ${y(rowOf.get(above.slave)) + BOX.height}V${top}`;
    else path = `M${x(above) + BOX.width / 2} ${y(rowOf.get(above.slave)) + BOX.height}V${top + BOX.height / 2}H${x(node)}`;
    lines.push(svg("path", { className: kind, d: path }, svg("title", null, link.trouble ? `${link.name}: ${link.trouble}` : link.name)));
    if (!node.above) lines.push(svg("text", { x: middle + 6, y: top - 3, className: "port" }, "?"));
    const slave = capture.slaves.find((s) => s.position === node.slave);
    const found = capture.findings.filter((f) => f.slave === node.slave && !f.known);
    const worst = ["error", "warning"].find((severity) => found.some((f) => f.severity === severity)) ?? "";
    const label = [slave?.name, slave?.station_address !== null && slave ? hex(slave.station_address) : null].filter(Boolean).join(", ");
    const about = [link.port === null ? null : `from port ${link.port}`, link.delay === null ? null : `${link.delay} ns`].filter(Boolean).join(", ");
    const open = node.ports.filter((p) => p.communication && p.port > 0 && !nodes.some((n) => n.above?.slave === node.slave && n.above.port === p.port));
    boxes.push(
      svg("rect", { className: `node ${worst}`, x: x(node), y: top, width: BOX.width, height: BOX.height, rx: 4 }),
      svg("text", { x: middle, y: top + 15, className: "inside" }, String(slaveNumber(capture, node.slave))),
      svg("text", { x: x(node) + BOX.width + 10, y: top + 15, className: "name" }, label,
        about && svg("tspan", { className: "port", dx: label ? 8 : 0 }, about),
        open.length > 0 && svg("tspan", { className: "port", dx: 8 }, `port ${open.map((p) => p.port).join(", ")} leads on, to whom is not known`),
        node.entry_port !== null && node.entry_port !== undefined &&
          svg("tspan", { className: "bad", dx: 8 }, `frames enter at port ${node.entry_port}, not at port 0`),
        node.dl_status_frame === null && svg("tspan", { className: "port", dx: 8 }, "ports not read"),
        link.trouble && svg("tspan", { className: "bad", dx: 8 }, "\u26a0")));
    if (link.trouble) notes.push(h("li", null, h("b", null, link.name.charAt(0).toUpperCase() + link.name.slice(1)), `: ${link.trouble}`));
    const other = node.ports.filter((p) => p.port > 0 && troubled(p) && !nodes.some((n) => n.above?.slave === node.slave && n.above.port === p.port));
    for (const port of other) notes.push(h("li", null, h("b", null, `At ${slaveName(capture, node.slave)} port ${port.port}`), `: ${portText(port)}`));
    if (node.processing_errors > 0) notes.push(h("li", null, h("b", null, capitalised(slaveName(capture, node.slave))), `: its processing unit counted ${count(node.processing_errors, "bad frame")}`));
  });
  const height = y(nodes.length) + BOX.height + 8;
  const counted = nodes.filter((n) => n.counter_reads > 1);
  return h("section", { className: "panel", id: "topology", "aria-labelledby": "topology-title" },
    h("h2", { id: "topology-title" }, "Topology"),
    svg("svg", { className: "topology", viewBox: `0 0 ${width} ${height}`, width, height, role: "img",
      "aria-label": `The tree of ${count(nodes.length, "slave")}${notes.length ? `; trouble at ${count(notes.length, "place")}, listed below` : ""}` }, lines, boxes),
    topology.slaves.length > MOST && h("p", { className: "note" }, `The first ${MOST} of ${topology.slaves.length} slaves.`),
    notes.length > 0 && h("ul", { className: "notes" }, notes),
    notes.length === 0 && h("p", { className: "note" }, counted.length === 0 ? "The error counters were not read twice." :
      `Error counters of ${count(counted.length, "slave")} read up to ${count(Math.max(...counted.map((n) => n.counter_reads)), "time")}: none rose.`),
    h("p", { className: "note" }, "By DL status (0x0110) and the order of positions: a frame leaves a slave at port 3, then 1, then 2. Delays by the receive times of the ports, else as the master wrote them."));
}
