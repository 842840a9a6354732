import type { Status } from "./interface";

export type {
  Alarm, Chain, ChainAxis, JointInfo, LogEntry, Machine, Motion, Offset, PlatformChain, ProgramFile, SerialChain, Status, Tables, Tool,
} from "./interface";

// How what the server sends is shown.

export const kWords = "XYZABC";
const kMmPerInch = 25.4;
const kDegPerRad = 180 / Math.PI;

/** True for the words A, B and C, whose values are angles. */
export const isAngle = (word: number) => word >= 3;

/** Indices into the six words of a message that this machine has, in the order of `axes`. */
export function wordsOf(axes: string): number[] {
  return [...axes].map((letter) => kWords.indexOf(letter)).filter((word) => word >= 0);
}

/** A value of a word in what the program counts in: mm or inch, degrees. */
export function shownValue(value: number, angle: boolean, inch: boolean): number {
  if (angle) return value * kDegPerRad;
  return inch ? value / kMmPerInch : value;
}

/** The reverse of shownValue. */
export function keptValue(shown: number, angle: boolean, inch: boolean): number {
  if (angle) return shown / kDegPerRad;
  return inch ? shown * kMmPerInch : shown;
}

/** Text of a position, without the minus of a zero that is only rounded. */
/** A number for people: what rounds to zero has no sign. */
export function fixed(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}

export function positionText(value: number, angle: boolean, inch: boolean): string {
  const digits = inch && !angle ? 4 : 3;
  return fixed(shownValue(value, angle, inch), digits);
}

/** By how much an offset is turned about Z; "" where it is not. */
export function turnText(rad: number): string {
  const deg = Number((rad * kDegPerRad).toFixed(4));
  return deg === 0 ? "" : `${deg}°`;
}

export const unitText = (angle: boolean, inch: boolean) => (angle ? "°" : inch ? "in" : "mm");

const kStates: Record<string, string> = {
  off: "Switched off",
  starting: "Starting up",
  idle: "Ready",
  running: "Running",
  holding: "On hold",
  stopping: "Coming to a stop",
  jogging: "Moving by hand",
  homing: "Homing",
  fault: "Stopped by a fault",
  estop: "Emergency stop",
  closing: "Shutting down",
};

export const stateName = (state: string) => kStates[state] ?? state;

/** Of the lamp that shows a state. */
export function tone(state: string): string {
  if (state === "fault" || state === "estop") return "danger";
  if (state === "running" || state === "jogging" || state === "homing") return "active";
  return state === "holding" || state === "stopping" ? "waits" : "calm";
}

/** True for a program of a file; not for a typed line, or a move by hand. */
export const isProgram = (path: string) => path !== "" && path !== "mdi" && path !== "jog";

/** A program is held, and not a move along a direction. */
export const isHeld = (status: Status) => status.state === "holding" && status.program !== "jog";

/** Something moves that a hold ends. */
export const canHold = (status: Status | null) =>
  !!status && (["running", "jogging", "homing"].includes(status.state) || 
    (isHeld(status) && ["jogs", "retraces"].includes(status.detour)));

/** As a clock shows it: 1:05, 1:02:03. */
export function durationText(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  const two = (value: number) => String(value).padStart(2, "0");
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return h ? `${h}:${two(m)}:${two(s)}` : `${m}:${two(s)}`;
}

/** The program's own name, without the folders before it. */
export const programName = (path: string) => path.slice(path.lastIndexOf("/") + 1);

/** What the machine does, and what it waits for, in one sentence. */
export function sentence(status: Status): string {
  if (status.waits_for) return `Waits for ${status.waits_for}`;
  const unhomed = status.joints.filter((joint) => !joint.homed).map((joint) => joint.name);
  const name = programName(status.program);
  switch (status.state) {
    case "estop":
      return "The drives have no power. Make the machine safe, then reset.";
    case "fault":
      return "Look at Alarms for the cause and the cure, then reset.";
    case "running":
      if (name === "jog") return "Moves along a direction.";
      return name === "mdi" ? "Works on the line that was typed." : `Works on ${name}, line ${status.line}.`;
    case "holding":
      if (status.detour === "jogs") return "Moves away from the program that is held.";
      if (status.detour === "retraces") return "Moves along the path of the program that is held.";
      return "The motion stands. Resume goes on, Stop ends the program.";
    case "idle":
      if (unhomed.length) return `Not homed: ${unhomed.join(", ")}. Home the machine first.`;
      if (status.program_failed) return "The last program ended early; the message says where.";
      return isProgram(status.program) ? `${name} is loaded and can start.` : "Load a program, or type a line.";
    default:
      return "";
  }
}
