// Colours of states, and the stories of slaves as segments of time.

export const AL_STATES = [
  ["INIT", "init"], ["PREOP", "preop"], ["BOOT", "boot"], ["SAFEOP", "safeop"], ["OP", "op"], ["with error bit", "error"],
];
export const DRIVE_STATES = [
  ["Switch on disabled", "init"], ["Ready to switch on", "preop"], ["Switched on", "safeop"],
  ["Operation enabled", "op"], ["Quick stop", "quick"], ["Fault", "error"],
];

export function alColor(state, error) {
  if (error) return "error";
  return { INIT: "init", PREOP: "preop", "PRE-OP": "preop", BOOT: "boot", SAFEOP: "safeop", OP: "op" }[state] ?? "unknown";
}

export function driveColor(state) {
  const s = state.toLowerCase();
  if (s.includes("fault")) return "error";
  if (s.includes("quick")) return "quick";
  if (s === "operation enabled") return "op";
  if (s === "switched on") return "safeop";
  if (s === "ready to switch on") return "preop";
  if (s === "switch on disabled" || s === "not ready to switch on") return "init";
  return "unknown";
}

const COMMANDS = [
  ["fault reset", "error"], ["quick stop", "quick"], ["disable voltage", "init"], ["shutdown", "preop"],
  ["enable operation", "op"], ["disable operation", "safeop"], ["switch on", "safeop"],
];

/// What the control word asked for, until it asked for something else.
export function commandSegments(slave, end) {
  const history = slave.drive?.history ?? [];
  const steps = history.filter((s) => s.kind === "command" && s.time_s !== null);
  const cut = slave.drive?.history_left_out > 0 && steps.length ? steps[steps.length - 1].time_s : end;
  return segments(steps, cut, (s) => {
    const label = s.text.replace(/ \(.*$/, "");
    return { label, color: COMMANDS.find(([name]) => label.toLowerCase().includes(name))?.[1] ?? "unknown" };
  });
}

/// steps with a time, in order -> [{from, to, ...of(step)}], the last one up to `end`.
function segments(steps, end, of) {
  return steps.map((step, i) => ({
    from: step.time_s,
    to: i + 1 < steps.length ? steps[i + 1].time_s : end,
    frame: step.frame,
    ...of(step),
  }));
}

export function alSegments(slave, end) {
  const steps = slave.al.history.filter((s) => s.kind === "state" && s.time_s !== null);
  const cut = slave.al.history_left_out > 0 && steps.length ? steps[steps.length - 1].time_s : end;
  return segments(steps, cut, (s) => ({
    label: s.to + (s.error ? "+ERR" : ""),
    color: alColor(s.to, s.error),
  }));
}

export function driveSegments(slave, end) {
  const history = slave.drive?.history ?? [];
  const steps = history.filter((s) => s.kind === "state" && s.time_s !== null);
  const cut = slave.drive?.history_left_out > 0 && steps.length ? steps[steps.length - 1].time_s : end;
  return segments(steps, cut, (s) => ({ label: s.to ?? "unknown", color: driveColor(s.to ?? "") }));
}

const STATUS_WORDS = [
  [0x4f, 0x00, "Not ready to switch on"], [0x4f, 0x40, "Switch on disabled"], [0x6f, 0x21, "Ready to switch on"],
  [0x6f, 0x23, "Switched on"], [0x6f, 0x27, "Operation enabled"], [0x6f, 0x07, "Quick stop active"],
  [0x4f, 0x0f, "Fault reaction active"], [0x4f, 0x08, "Fault"],
];
const CONTROL_WORDS = [
  [0x82, 0x00, "Disable voltage"], [0x86, 0x02, "Quick stop"], [0x87, 0x06, "Shutdown"], [0x8f, 0x07, "Switch on"],
  [0x8f, 0x0f, "Enable operation"],
];
const meaning = (list, word) => list.find(([mask, bits]) => (word & mask) === bits)?.[2] ?? null;
/// CiA 402: the state in a status word, the command in a control word; null where the bits name none.
export const statusMeaning = (word) => meaning(STATUS_WORDS, word);
export const controlMeaning = (word) => meaning(CONTROL_WORDS, word);
