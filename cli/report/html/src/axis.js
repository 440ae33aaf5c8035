// The part of time that all plots show, and how times are told.

/// `start`: seconds since midnight (UTC) of the first packet, null where the capture has no times. `on`: axes show the
/// time of the clock.
export const clock = { start: null, on: false };

/// first: "2026-03-02T09:00:00.000000000Z" or null
export function setClock(first) {
  const parts = /T(\d\d):(\d\d):(\d\d(?:\.\d+)?)/.exec(first ?? "");
  clock.start = parts ? Number(parts[1]) * 3600 + Number(parts[2]) * 60 + Number(parts[3]) : null;
  clock.on = clock.on && clock.start !== null;
}

/// "09:00:00.005"; the day begins anew at midnight.
export function clockText(time, decimals = 6) {
  const step = 10 ** decimals;
  const units = Math.round((clock.start + time) * step);
  const day = 86400 * step;
  const inDay = ((units % day) + day) % day;
  const seconds = Math.floor(inDay / step);
  const two = (value) => String(value).padStart(2, "0");
  return `${two(Math.floor(seconds / 3600))}:${two(Math.floor(seconds / 60) % 60)}:${two(seconds % 60)}` +
    (decimals > 0 ? `.${String(inDay - seconds * step).padStart(decimals, "0")}` : "");
}

export class TimeAxis {
  constructor(min, max) {
    this.full = { min, max: max > min ? max : min + 0.001 };
    this.min = this.full.min;
    this.max = this.full.max;
    this.listeners = new Set();
    this.cursors = { a: null, b: null }; // seconds; what lies between is measured
    this.armed = null; // "a" or "b": the next click in a plot puts it there
    this.cursorListeners = new Set();
  }
  onCursor(listener) {
    this.cursorListeners.add(listener);
    return () => this.cursorListeners.delete(listener);
  }
  setCursor(which, time) {
    if (which) this.cursors[which] = time === null ? null : Math.min(Math.max(time, this.full.min), this.full.max);
    this.armed = null;
    for (const listener of this.cursorListeners) listener();
  }
  arm(which) {
    this.armed = this.armed === which ? null : which;
    for (const listener of this.cursorListeners) listener();
  }
  onChange(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  set(min, max) {
    const least = Math.max((this.full.max - this.full.min) * 1e-7, 2e-7);
    if (max - min < least) {
      const middle = (min + max) / 2;
      min = middle - least / 2;
      max = middle + least / 2;
    }
    const width = Math.min(max - min, this.full.max - this.full.min);
    this.min = Math.min(Math.max(min, this.full.min), this.full.max - width);
    this.max = this.min + width;
    for (const listener of this.listeners) listener(this.min, this.max);
  }
  zoom(factor, at = (this.min + this.max) / 2) {
    this.set(at - (at - this.min) * factor, at + (this.max - at) * factor);
  }
  pan(part) {
    const by = (this.max - this.min) * part;
    this.set(this.min + by, this.max + by);
  }
  reset() {
    this.set(this.full.min, this.full.max);
  }
  /// Shows what lies around `at`, closer than now when the whole capture is shown.
  center(at) {
    const width = Math.min(this.max - this.min, (this.full.max - this.full.min) / 10);
    this.set(at - width / 2, at + width / 2);
  }
}

/// Keys of a focused plot.
export function zoomKey(axis, event) {
  const actions = {
    ArrowLeft: () => axis.pan(-0.25),
    ArrowRight: () => axis.pan(0.25),
    "+": () => axis.zoom(0.5),
    "=": () => axis.zoom(0.5),
    "-": () => axis.zoom(2),
    0: () => axis.reset(),
    Home: () => axis.reset(),
  };
  if (!actions[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  actions[event.key]();
}
