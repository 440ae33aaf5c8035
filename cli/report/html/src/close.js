// Every value around findings, as the frames carried them, where the series elsewhere holds buckets.

/// The values of a signal with their frames and times; null where none were kept.
export function closeOf(drawn, signal) {
  const frames = signal.close && drawn.close?.[signal.close.at];
  return frames ? spread({ ...frames, ...signal.close }) : null;
}

/// One value for all -> one each.
export const spread = (close) => (close ? { ...close, values: close.values ?? close.frames.map(() => close.value) } : null);

/// [first, last] index of what was kept around one finding each: between two of them there is a pause.
export function stretches(times) {
  if (times.length === 0) return [];
  const steps = times.slice(1).map((t, i) => t - times[i]).sort((a, b) => a - b);
  const pause = Math.max(1e-7, (steps[Math.floor(steps.length / 2)] ?? 0) * 8);
  const out = [[0, 0]];
  times.forEach((t, i) => {
    if (i > 0 && t - times[i - 1] > pause) out.push([i, i]);
    else out[out.length - 1][1] = i;
  });
  return out;
}

/// [from, to] in seconds of what was kept around `time`; null where nothing was.
export function closeRange(close, time) {
  for (const [first, last] of close ? stretches(close.time_s) : []) {
    const [from, to] = [close.time_s[first], close.time_s[last]];
    const margin = (to - from) * 0.05 + 1e-6;
    if (time >= from - margin && time <= to + margin && to > from) return [from - margin, to + margin];
  }
  return null;
}
