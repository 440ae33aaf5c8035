// Numbers as the rest of the program writes them.

export const hex = (value, digits = 4) => `0x${value.toString(16).padStart(digits, "0")}`;
export const grouped = (value) => value.toLocaleString("en-US", { maximumFractionDigits: 6 });
export const count = (n, noun) => `${grouped(n)} ${noun}${n === 1 ? "" : "s"}`;
export const objectName = (index, subindex) =>
  index.toString(16).toUpperCase().padStart(4, "0") + "h" +
  (subindex === undefined || subindex === null ? "" : `:${subindex.toString(16).toUpperCase()}`);

/// A duration given in milliseconds.
export function duration(ms) {
  if (ms === null || ms === undefined) return "";
  const size = Math.abs(ms);
  if (size >= 1000) return `${trim(ms / 1000, size >= 100000 ? 1 : 3)} s`;
  if (size >= 1) return `${trim(ms, 3)} ms`;
  if (size === 0) return "0 s";
  return `${trim(ms * 1000, 3)} \u00b5s`;
}

/// "0 x 0.1 %" where the unit itself begins with a digit.
export const withUnit = (text, unit) => (!unit ? text : /^\d/.test(unit) ? `${text} \u00d7 ${unit}` : `${text} ${unit}`);

export const trim = (value, decimals) => String(Number(value.toFixed(decimals)));
export const seconds = (s) => (s === null || s === undefined ? "" : `${s.toFixed(6)} s`);

/// Plain, or "1.23e+9" where digits would not tell anything.
export function number(value) {
  if (Number.isInteger(value)) return grouped(value);
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-4 || size >= 1e12) ? value.toExponential(3) : grouped(Number(value.toPrecision(7)));
}

/// The number of a slave as the report counts: from 0, or from 1 (--count-from 1).
export const slaveNumber = (capture, position) => position + (capture.settings.count_from ?? 0);
/// "position 0" where the number is another one.
export const positionText = (capture, position) => (capture.settings.count_from ? `position ${position}` : null);
/// "slave 0"; counted from 1 "slave 1 (position 0)".
export function slaveName(capture, position) {
  const place = positionText(capture, position);
  return `slave ${slaveNumber(capture, position)}${place ? ` (${place})` : ""}`;
}
export const capitalised = (text) => text.charAt(0).toUpperCase() + text.slice(1);

export function slaveLabel(slave) {
  const inside = [slave.place, slave.name, slave.station_address !== null ? hex(slave.station_address) : null].filter(Boolean);
  return `Slave ${slave.label}` + (inside.length ? ` (${inside.join(", ")})` : "");
}

export const fileName = (path) => path.slice(path.lastIndexOf("/") + 1) || path;

/// A file name as one word of a shell's command line that is no option, whatever it holds.
export function shellWord(text) {
  const name = text.startsWith("-") ? `./${text}` : text;
  return /^[\w@%+=:,./-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`;
}

/// Equal bins for a chart over those of the report: at most `most`, and none narrower than the widest of the report, so
/// that bins which touch there leave no gap between them here.
export function equalBins(all, most, middle) {
  // One outlier would make two bars of it: what lies far from the middle is counted, not drawn.
  const spread = middle ? Math.max(middle.to - middle.from, 1e-3 * Math.abs(middle.to), 1e-6) : Infinity;
  const near = middle ? all.filter((b) => b.to >= middle.from - 4 * spread && b.from <= middle.to + 4 * spread) : all;
  const bins = near.length > 0 ? near : all;
  const beyond = all.reduce((sum, b) => sum + b.count, 0) - bins.reduce((sum, b) => sum + b.count, 0);
  const low = bins[0].from;
  const high = Math.max(bins[bins.length - 1].to, low + 1e-9);
  const widest = Math.max(...bins.map((b) => b.to - b.from));
  const n = Math.max(1, Math.min(most, Math.floor((high - low) / widest + 1e-6)));
  const width = (high - low) / n;
  const counts = new Array(n).fill(0);
  for (const bin of bins) {
    counts[Math.min(n - 1, Math.max(0, Math.floor(((bin.from + bin.to) / 2 - low) / width)))] += bin.count;
  }
  return { low, high, width, counts, beyond };
}
