// What the server sends (docs/panel.md): lengths in mm, angles in rad, times in s.

export interface JointInfo {
  name: string;
  unit: "mm" | "rad";
  min: number;
  max: number;
  velocity: number;
  acceleration: number;
  jerk: number;
}

/** An axis of a branch of a serial machine: an offset, and the joint behind it (-1: none). */
export interface ChainAxis {
  joint: number;
  offset_mm: [number, number, number];
  kind?: "linear" | "rotary";
  direction?: [number, number, number];
}

export interface SerialChain {
  type: "serial";
  tool: ChainAxis[];
  work: ChainAxis[];
}

export interface PlatformChain {
  type: "hexapod" | "rail_mill";
  carries: "work" | "spindle";
  spindle_mm: [number, number, number];
  home_mm: [number, number, number];
  actuators: {
    platform_mm: [number, number, number];
    base_mm?: [number, number, number];
    rail_mm?: [number, number, number];
    direction?: [number, number, number];
  }[];
}

export type Chain = SerialChain | PlatformChain;

export interface Machine {
  name: string;
  version: string;
  config_path: string;
  period_s: number;
  axes: string;
  kinematics: Chain;
  joints: JointInfo[];
}

export interface Status {
  count: number;
  machine: string;
  state: string;
  fault: string;
  fault_joint: string;
  message: string;
  waits_for: string;
  /** Alarms that nobody has acknowledged. */
  alarms_open: number;
  /** Of a held program: "jogs" leads away, "away" stands there, "returns" leads back; else empty. */
  detour: "" | "jogs" | "away" | "returns";
  program: string;
  program_failed: boolean;
  line: number;
  file: string;
  block: string;
  codes: string;
  axes: string;
  inch: boolean;
  work_offset: string;
  work_offset_value: number[];
  g92: number[];
  rotation_rad: number;
  tool: number;
  tool_name: string;
  tool_selected: number;
  tool_offset: number[];
  tool_radius_mm: number;
  feed: number;
  spindle_speed: number;
  mist: boolean;
  flood: boolean;
  rtcp: boolean;
  override_wanted: number;
  rapid_override: number;
  spindle_override: number;
  spindle_rpm: number;
  single_block: boolean;
  optional_stop: boolean;
  block_delete: boolean;
  dry_run: boolean;
  machine_lock: boolean;
  /** Of the loaded program; 0: not known. */
  time_total_s: number;
  time_done_s: number;
  /** -1: not known. */
  time_left_s: number;
  /** What the program asks the machine was guessed. */
  time_about: boolean;
  parts: number;
  /** Of the present program, and of all. */
  program_run_s: number;
  run_s: number;
  warnings: string[];
  pid: number;
  config_file: string;
  period_s: number;
  periods: number;
  overruns: number;
  starvations: number;
  wake_us_p50: number;
  wake_us_p999: number;
  wake_us_max: number;
  tick_us_p50: number;
  tick_us_p999: number;
  tick_us_max: number;
  realtime: boolean;
  bus_health: string;
  corrections?: { name: string; on: boolean; offset: number; warning: string }[];
  features?: {
    line: number; last_line: number; circle: boolean; size_mm: number; bending_mm: number; offset_mm: number;
    predicted_mm: number; unknown: number;
  }[];
  features_more: number;
  joints: { name: string; unit: string; homed: boolean; limit_switch: boolean }[];
}

export interface Motion {
  line: number;
  q_measured: number[];
  q_setpoint: number[];
  work: number[];
  machine: number[];
  to_go: number[];
  speed_mm_s: number;
  override_now: number;
  tool_load_known: boolean;
  tool_load_alarm: boolean;
  tool_force_N: [number, number];
  tool_deflection_mm: [number, number];
}

export interface Offset {
  name: string;
  x: number; y: number; z: number;
  a: number; b: number; c: number;
  rotation: number;
}

export interface Tool {
  number: number;
  pocket: number;
  x: number; y: number; z: number;
  diameter: number;
  remark: string;
}

export interface Tables {
  offsets: Offset[];
  tools: Tool[];
  tools_more: number;
}

/** What went wrong: listed until it is over and acknowledged. */
export interface Alarm {
  number: number;
  name: string;
  text: string;
  cure: string;
  did: string;
  program: string;
  line: number;
  cause: string;
  since_us: number;
  times: number;
  active: boolean;
  acknowledged: boolean;
}

export interface LogEntry {
  time_us: number;
  kind: string;
  text: string;
}

/** A file of the panel's folder of programs. */
export interface ProgramFile {
  name: string;
  size: number;
  modified_s: number;
}

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
export function positionText(value: number, angle: boolean, inch: boolean): string {
  const digits = inch && !angle ? 4 : 3;
  const text = shownValue(value, angle, inch).toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
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

/** True for a program of a file; not for a typed line, or a move by hand. */
export const isProgram = (path: string) => path !== "" && path !== "mdi" && path !== "jog";

/** A program is held, and not a move along a direction. */
export const isHeld = (status: Status) => status.state === "holding" && status.program !== "jog";

/** Something moves that a hold ends. */
export const canHold = (status: Status | null) =>
  !!status && (["running", "jogging", "homing"].includes(status.state) || (isHeld(status) && status.detour === "jogs"));

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
      return "The motion stands. Resume goes on, Stop ends the program.";
    case "idle":
      if (unhomed.length) return `Not homed: ${unhomed.join(", ")}. Home the machine first.`;
      if (status.program_failed) return "The last program ended early; the message says where.";
      return isProgram(status.program) ? `${name} is loaded and can start.` : "Load a program, or type a line.";
    default:
      return "";
  }
}
