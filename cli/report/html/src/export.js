// The picture of the time line as a file, and picked signals as a table.
import uPlot from "uplot";
import { css } from "./theme.js";

function save(blob, name) {
  const address = URL.createObjectURL(blob);
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

const xml = (text) => String(text).replace(/[<>&"]/g, (c) => ({ "<": "&lt;", ">": "&gt;", "&": "&amp;", '"': "&quot;" })[c]);
const short = (value) => String(Number(value.toFixed(2)));

/// What plots call of a canvas context, as SVG elements.
class SvgContext {
  constructor(canvas) {
    this.canvas = canvas;
    this.out = [];
    this.clips = 0;
    this.state = { fillStyle: "#000", strokeStyle: "#000", lineWidth: 1, globalAlpha: 1, font: "12px sans-serif", textAlign: "left",
      textBaseline: "alphabetic", lineJoin: "miter", dash: [], open: 0, x: 0, y: 0 };
    this.stack = [];
    this.path = "";
    this.measure = document.createElement("canvas").getContext("2d");
    for (const name of ["fillStyle", "strokeStyle", "lineWidth", "globalAlpha", "font", "textAlign", "textBaseline", "lineJoin"]) {
      Object.defineProperty(this, name, { get: () => this.state[name], set: (value) => { this.state[name] = value; } });
    }
  }
  save() {
    this.stack.push(this.state);
    this.state = { ...this.state, dash: [...this.state.dash], open: 0 };
  }
  restore() {
    this.out.push("</g>".repeat(this.state.open));
    this.state = this.stack.pop() ?? this.state;
  }
  translate(x, y) {
    this.out.push(`<g transform="translate(${short(x)} ${short(y)})">`);
    this.state.open += 1;
  }
  setLineDash(dash) { this.state.dash = dash; }
  beginPath() { this.path = ""; }
  moveTo(x, y) { this.path += `M${short(x)} ${short(y)}`; }
  lineTo(x, y) { this.path += `L${short(x)} ${short(y)}`; }
  rect(x, y, w, h) { this.path += `M${short(x)} ${short(y)}h${short(w)}v${short(h)}h${short(-w)}z`; }
  clip() {
    this.clips += 1;
    this.out.push(`<clipPath id="c${this.clips}"><path d="${this.path}"/></clipPath><g clip-path="url(#c${this.clips})">`);
    this.state.open += 1;
  }
  #paint(kind) {
    const alpha = this.globalAlpha < 1 ? ` opacity="${this.globalAlpha}"` : "";
    return kind === "fill" ? `fill="${xml(this.fillStyle)}"${alpha}`
      : `fill="none" stroke="${xml(this.strokeStyle)}" stroke-width="${short(this.lineWidth)}" stroke-linejoin="${this.lineJoin}"` +
        `${this.state.dash.length ? ` stroke-dasharray="${this.state.dash.map(short).join(" ")}"` : ""}${alpha}`;
  }
  fill() { this.out.push(`<path d="${this.path}" ${this.#paint("fill")}/>`); }
  stroke() { if (this.path) this.out.push(`<path d="${this.path}" ${this.#paint("stroke")}/>`); }
  fillRect(x, y, w, h) { this.out.push(`<rect x="${short(x)}" y="${short(y)}" width="${short(Math.max(w, 0))}" height="${short(Math.max(h, 0))}" ${this.#paint("fill")}/>`); }
  measureText(text) {
    this.measure.font = this.font;
    return this.measure.measureText(text);
  }
  #text(text, x, y, paint) {
    const [, weight = "400", size = "12"] = /^(?:(\d+)\s+)?([\d.]+)px/.exec(this.font) ?? [];
    const anchor = { center: "middle", right: "end", end: "end" }[this.textAlign] ?? "start";
    const base = { middle: "central", top: "text-before-edge" }[this.textBaseline] ?? "auto";
    this.out.push(`<text x="${short(x)}" y="${short(y)}" font-family="sans-serif" font-size="${size}" font-weight="${weight}" ` +
      `text-anchor="${anchor}" dominant-baseline="${base}" ${paint}>${xml(text)}</text>`);
  }
  fillText(text, x, y) { this.#text(text, x, y, this.#paint("fill")); }
  strokeText(text, x, y) { this.#text(text, x, y, this.#paint("stroke")); }
}

/// The axis of time below a plot, and the numbers of its axis of values where that has some.
function drawAxes(u, ctx) {
  const r = uPlot.pxRatio;
  const [time, values] = u.axes;
  ctx.save();
  ctx.fillStyle = css("--muted");
  ctx.font = `${Math.round(12 * r)}px system-ui, sans-serif`;
  ctx.textAlign = "center";
  ctx.textBaseline = "top";
  (time._splits ?? []).forEach((at, i) => ctx.fillText(time._values?.[i] ?? "", u.valToPos(at, "x", true), u.bbox.top + u.bbox.height + 8 * r));
  ctx.textAlign = "right";
  ctx.textBaseline = "middle";
  (values?._splits ?? []).forEach((at, i) => {
    if (values._values?.[i]) ctx.fillText(values._values[i], u.bbox.left - 6 * r, u.valToPos(at, values.scale, true));
  });
  ctx.restore();
}

/// pictures: [{plot, draw(ctx)}], below each other; lines: texts above and below them.
function draw(ctx, pictures, above, below, width) {
  const r = uPlot.pxRatio;
  const text = (lines, y) => lines.forEach((line, i) => {
    ctx.fillStyle = css(i === 0 && lines === above ? "--text" : "--muted");
    ctx.font = `${i === 0 && lines === above ? "600 " : ""}${Math.round(13 * r)}px system-ui, sans-serif`;
    ctx.textAlign = "left";
    ctx.textBaseline = "middle";
    ctx.fillText(line, 8 * r, y + (i + 0.5) * 20 * r);
  });
  let y = (above.length * 20 + 6) * r;
  const height = y + pictures.reduce((sum, p) => sum + p.plot.ctx.canvas.height, 0) + (below.length * 20 + 6) * r;
  ctx.fillStyle = css("--panel");
  ctx.fillRect(0, 0, width, height);
  text(above, 4 * r);
  for (const picture of pictures) {
    ctx.save();
    ctx.translate(0, y);
    picture.draw(ctx);
    drawAxes(picture.plot, ctx);
    ctx.restore();
    y += picture.plot.ctx.canvas.height;
  }
  text(below, y);
  return height;
}

const heightOf = (pictures, lines) => pictures.reduce((sum, p) => sum + p.plot.ctx.canvas.height, 0) + (lines * 20 + 12) * uPlot.pxRatio;
const widthOf = (pictures) => Math.max(...pictures.map((p) => p.plot.ctx.canvas.width));

export function saveSvg(pictures, above, below, name) {
  const [width, height] = [widthOf(pictures), heightOf(pictures, above.length + below.length)];
  const ctx = new SvgContext({ width, height });
  draw(ctx, pictures, above, below, width);
  save(new Blob([`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${width} ${height}" width="${width}" height="${height}">${ctx.out.join("\n")}</svg>\n`],
    { type: "image/svg+xml" }), name);
}

export function savePng(pictures, above, below, name) {
  const canvas = document.createElement("canvas");
  canvas.width = widthOf(pictures);
  canvas.height = heightOf(pictures, above.length + below.length);
  draw(canvas.getContext("2d"), pictures, above, below, canvas.width);
  canvas.toBlob((blob) => save(blob, name), "image/png");
}

/// A cell that no spreadsheet takes for a formula.
export function csvCell(value) {
  const text = String(value ?? "");
  const safe = typeof value === "string" && /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
  return /[",\n\r]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}

export function saveCsv(rows, name) {
  save(new Blob([rows.map((row) => row.map(csvCell).join(",")).join("\n") + "\n"], { type: "text/csv" }), name);
}
