// Made by panel/interface/make_interface.py: what the server and the page tell each other.

/** An element of `corrections`. */
export interface Correction {
  /** of the section in the config */
  name: string;
  on: boolean;
  /** greatest on any joint now, mm or rad; 0 for those in the plan */
  offset: number;
  /** e.g. which sensor is silent; empty if all is well */
  warning: string;
}

/** An element of `features`. */
export interface Feature {
  /** source line, counted from 1, with which it begins */
  line: number;
  /** and ends */
  last_line: number;
  /** a full circle; else a straight cut */
  circle: boolean;
  /** programmed: diameter of the path of the tool's middle, or length */
  size_mm: number;
  /** mean, outward from a circle's middle, or to the left of a cut */
  bending_mm: number;
  /** the same, with what the correction moved the path */
  offset_mm: number;
  /** diameter that the tool's middle really went round; a cut: length */
  predicted_mm: number;
  /** share of the time in which the load was not known */
  unknown: number;
}

/** An element of `joints`. */
export interface Joint {
  /** as in the config */
  name: string;
  /** "mm" or "rad" */
  unit: string;
  /** the joint knows its position */
  homed: boolean;
  /** the joint stands on a limit switch */
  limit_switch: boolean;
}

/** State of the machine and of the process, on channel "<machine>.status": ten times a second and at every change. */
export interface Status {
  /** Unix time of this message, us */
  time_us: number;
  /** the daemon's own clock, us, which only runs forward: what command_t.expires_us refers to */
  clock_us: number;
  /** counts the messages of this daemon from 1 */
  count: number;
  /** process id of the daemon */
  pid: number;
  /** of the daemon, as `trunnion --version` tells it */
  version: string;
  /** name from the config */
  machine: string;
  /** whole path of the config that the daemon has read */
  config_file: string;
  /** 16 digits that tell its content from any other; a client may compare them with its file's */
  config_mark: string;
  /** off, starting, idle, running, holding, stopping, jogging, homing, fault, estop, closing */
  state: string;
  /** name from the fault table, "ok" if none is latched */
  fault: string;
  /** name of the joint at fault, empty if none */
  fault_joint: string;
  /** last message of the program or the planner, empty if none */
  message: string;
  /** what the machine stands and waits for, and who goes on, e.g. "tool 2 (8 mm ball): ..."; empty if nothing */
  waits_for: string;
  /** alarms that nobody has acknowledged; alarms_t tells them */
  alarms_open: number;
  /** the newest of them, for people; empty if none */
  alarm: string;
  /** from where a program is held: "jogs" (moves away), "away" (stands there, or with spindle or outputs switched by hand), "returns" (on the way back, or held there), "retraces" (moves along its path, back or forward again); empty if none */
  detour: string;
  /** the last program ended early because of an error in it; `message` says where */
  program_failed: boolean;
  /** path of the loaded program, "mdi", "jog" (along a direction), or empty */
  program: string;
  /** source line that moves now, counted from 1; 0 if none */
  line: number;
  /** the end of the path of the file of that line: the program or a sub-program of it */
  file: string;
  /** its text, as far as 95 bytes go */
  block: string;
  /** in force there, as in "G1 G17 G21 G90 ... M5 M9 M48"; between programs: those which the next MDI line or program begins with */
  codes: string;
  /** the words that the machine has, as in "XYZAC" */
  axes: string;
  /** those of them that are angles on a circle, as in "C": people are shown 0 to 360 degrees */
  wrapped: string;
  /** of arcs and cycles: "G17", "G18" or "G19" */
  plane: string;
  /** the program's unit of length (G20); all lengths of this message are in mm */
  inch: boolean;
  /** in force: "G54" to "G59.3" */
  work_offset: string;
  /** of X Y Z (mm) A B C (rad) */
  work_offset_value: number[];
  /** in force, of G92 and G52, mm and rad */
  g92: number[];
  /** of the work offset, about Z */
  rotation_rad: number;
  /** in the spindle; 0: none */
  tool: number;
  /** the same for people, e.g. "tool 2 (8 mm ball)" */
  tool_name: string;
  /** by T, for the next M6; -1: none */
  tool_selected: number;
  /** in force (G43), gauge point to tip, mm and rad */
  tool_offset: number[];
  /** of the tool in the spindle, by the table */
  tool_radius_mm: number;
  /** F: program units a minute, moves a minute (G93), or program units a turn (G95) */
  feed: number;
  /** S: rpm, or surface speed in m or feet a minute (G96) */
  spindle_speed: number;
  /** coolant that is on, also where the operator has switched it in a hold */
  mist: boolean;
  flood: boolean;
  /** tool centre point control is on */
  rtcp: boolean;
  /** a program has probed since the daemon started: */
  probe_known: boolean;
  /** the last probe move met its work (or left it) */
  probe_contact: boolean;
  /** there, in the coordinates of that program, mm and rad */
  probe: number[];
  /** of the loaded program by its plan, at 100 %, s: motion and dwells; 0: not known */
  time_total_s: number;
  /** of it, up to where the machine is, s */
  time_done_s: number;
  /** to its end at the overrides of now, s; -1: not known, or an override is 0 */
  time_left_s: number;
  /** the program asks the machine (M66, G38), and its answers were guessed; or the block delete was switched while it ran */
  time_about: boolean;
  /** programs that came to their end, as it stands on disk */
  parts: number;
  /** of the present program, or the last one, without holds and stops, s */
  program_run_s: number;
  /** of all programs, s */
  run_s: number;
  /** of feed moves and jogs, as commanded; 1 = as programmed */
  override_wanted: number;
  /** of rapid moves, 0 to 1 */
  rapid_override: number;
  /** 1 = as programmed */
  spindle_override: number;
  /** second override of feed moves, where the program lets it act (M52) */
  adaptive_feed: number;
  /** as the spindle shall turn now, + clockwise */
  spindle_rpm: number;
  /** the spindle has an encoder, and it has moved: */
  spindle_real_known: boolean;
  /** as the encoder sees it, + clockwise */
  spindle_real_rpm: number;
  /** the machine stands at the end of every line */
  single_block: boolean;
  /** M1 stops */
  optional_stop: boolean;
  /** lines that begin with '/' are skipped */
  block_delete: boolean;
  /** feed moves go at rapid speed, the spindle stands */
  dry_run: boolean;
  /** programs run, and no joint moves */
  machine_lock: boolean;
  /** rate of the motion in this period, 0 = stands */
  override_now: number;
  /** period of the tick, s */
  period_s: number;
  /** ticks since start */
  periods: number;
  /** ticks that were not finished, or not begun, within their period */
  overruns: number;
  /** times the planner came too late, and the motion slowed down on its path or began slowly */
  starvations: number;
  /** lateness of the tick's start, us: median, 99.9th percentile, worst */
  wake_us_p50: number;
  wake_us_p999: number;
  wake_us_max: number;
  /** duration of the tick, us: median, 99.9th percentile, worst */
  tick_us_p50: number;
  tick_us_p999: number;
  tick_us_max: number;
  /** the kernel granted priority, processor and locked memory as configured */
  realtime: boolean;
  /** what was not granted, and how to mend it */
  warnings: string[];
  /** of the drives' buses: load, jitter, latency; empty if there are none */
  bus_health: string;
  corrections: Correction[];
  features: Feature[];
  /** features that have no room here; all are in the session's log */
  features_more: number;
  joints: Joint[];
}

/** Where the machine is, on channel "<machine>.motion", fifty times a second. */
export interface Motion {
  /** Unix time of this message, us */
  time_us: number;
  /** number of the tick, counted from 0, that these values belong to */
  period: number;
  /** source line that moves now, counted from 1; 0 if none */
  line: number;
  /** sent to the drives, mm or rad, after all corrections, config order */
  q_setpoint: number[];
  /** answered by the drives in the same period, mm or rad */
  q_measured: number[];
  /** X Y Z (mm) A B C (rad) of the path: RTCP on: tip in the table frame B, else the machine's own axes; signs as in the program */
  word: number[];
  /** the same place in the program's coordinates, and */
  work: number[];
  /** as G53 counts, without any offset: X Y Z (mm) A B C (rad) */
  machine: number[];
  /** from `work` to the end of the move; 0 if there is none */
  to_go: number[];
  /** of the tip along the programmed path, >= 0 */
  speed_mm_s: number;
  /** rate of the motion, 0 = stands, 1 = as planned */
  override_now: number;
  /** the machine estimates the tool's load, and knows it now */
  tool_load_known: boolean;
  /** the load filter's model no longer fits the stage */
  tool_load_alarm: boolean;
  /** on the tool, along joints X and Y */
  tool_force_N: [number, number];
  /** of its tip, by that force */
  tool_deflection_mm: [number, number];
}

/** An element of `offsets`. */
export interface Offset {
  name: string;
  x: number;
  y: number;
  z: number;
  a: number;
  b: number;
  c: number;
  /** about Z; 0 for all that have none */
  rotation: number;
}

/** An element of `tools`. */
export interface Tool {
  number: number;
  pocket: number;
  /** gauge point to tip */
  x: number;
  y: number;
  z: number;
  a: number;
  b: number;
  c: number;
  diameter: number;
  remark: string;
}

/** Work offsets and tools of the machine, on channel "<machine>.tables": when a client connects, at every change, and every two seconds. Lengths in mm, angles in rad. */
export interface Tables {
  /** Unix time of this message, us */
  time_us: number;
  offsets: Offset[];
  tools: Tool[];
  /** tools of the table that have no room here */
  tools_more: number;
}

/** An element of `alarms`. */
export interface Alarm {
  /** counts the alarms of this daemon from 1 */
  number: number;
  /** from the fault table (docs/faults.md), or "program", "counters" */
  name: string;
  /** what happened */
  text: string;
  /** what to do; empty where the text says it */
  cure: string;
  /** what the machine did about it */
  did: string;
  /** that ran; empty if none */
  program: string;
  /** of it; 0 if none */
  line: number;
  /** command and client that led to it; empty: the machine itself */
  cause: string;
  /** Unix time of the first time, us */
  since_us: number;
  /** how often it came before it was acknowledged */
  times: number;
  /** it lasts; else it is over */
  active: boolean;
  /** somebody has seen it */
  acknowledged: boolean;
}

/** What went wrong, on channel "<machine>.alarms": when a client connects, at every change, and every second. Oldest first. An alarm is listed until it is over and acknowledged (command_t.ACKNOWLEDGE); 32 at most. */
export interface Alarms {
  /** Unix time of this message, us */
  time_us: number;
  alarms: Alarm[];
}

/** x, y, z */
export type Vector = [number, number, number];

/** A joint of the machine and its limits, as the config has them; mm or rad, s. */
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
  offset_mm: Vector;
  kind?: "linear" | "rotary";
  direction?: Vector;
}

/** From the machine's base to the spindle, and to the work. */
export interface SerialChain {
  type: "serial";
  tool: ChainAxis[];
  work: ChainAxis[];
  /** How a tilted head turns the spindle: about this line, as far as it is long; zero without */
  spindle_turn_rad: Vector;
}

/** A leg or rail: where it holds the platform, and its other end. */
export interface Actuator {
  platform_mm: Vector;
  base_mm?: Vector;
  rail_mm?: Vector;
  direction?: Vector;
}

/** A machine whose legs or rails carry one platform. */
export interface PlatformChain {
  type: "hexapod" | "rail_mill";
  carries: "work" | "spindle";
  spindle_mm: Vector;
  home_mm: Vector;
  actuators: Actuator[];
}

/** What the machine is drawn of. */
export type Chain = SerialChain | PlatformChain;

/** The machine of this panel. */
export interface Machine {
  name: string;
  version: string;
  config_path: string;
  period_s: number;
  /** As in XYZAC; empty until the daemon has spoken. */
  axes: string;
  kinematics: Chain;
  joints: JointInfo[];
  /** Bodies with a drawing of their own: what each moves with (base, table, spindle or a joint). */
  drawings: string[];
  /** The machine's daemon is on another computer; missing: on the panel's own. */
  remote?: Remote;
}

/** How the panel commands a machine on another computer: through its gateway, signed. */
export interface Remote {
  /** Name of the panel's key. */
  key: string;
  /** What its commands may do at most. */
  role: "look" | "operate" | "set up";
}

/** A file of the panel's folder of programs. */
export interface ProgramFile {
  name: string;
  size: number;
  /** Unix time, s */
  modified_s: number;
}

/** Something that happened, for people. */
export interface LogEntry {
  /** Unix time, us */
  time_us: number;
  /** message, fault, refused, dead_man, controls, did, and others */
  kind: string;
  text: string;
}

/** All that was heard of the daemon last. */
export interface State {
  connected: boolean;
  /** of the status; -1: none was heard */
  age_s: number;
  status: Status | null;
  motion: Motion | null;
  tables: Tables | null;
  alarms: Alarms | null;
}

/** Who has logged in. */
export interface Session {
  /** False: a key opens this panel. */
  log_in: boolean;
  /** Empty: nobody. */
  name: string;
  role: "" | "look" | "operate" | "set up";
}

/** Who wants to log in. */
export interface LogIn {
  name: string;
  password: string;
}

/** How the plan of the loaded program stands. */
export interface PlanState {
  state: "none" | "working" | "ready" | "failed";
  program: string;
  /** What is wrong with the program, or why there is no plan. */
  text: string;
  /** Another one for each plan. */
  number: number;
}

/** What a program needs of a joint; mm or rad, s. */
export interface PlanJoint {
  name: string;
  unit: "mm" | "rad";
  min: number;
  max: number;
  from: number;
  to: number;
  limited_s: number;
}

/** The head of a plan's file; docs/panel.md has what follows it. */
export interface PlanHead {
  program: string;
  count: number;
  time_s: number;
  cut_mm: number;
  rapid_mm: number;
  free_s: number;
  blocks: number;
  message: string;
  message_line: number;
  box?: Vector[];
  joints: PlanJoint[];
}

/** Who has the controls, and who asks for them. Pages are numbers; 0 is none. */
export interface Controls {
  /** this one */
  page: number;
  mine: boolean;
  holder: number;
  holder_name: string;
  asker: number;
  asker_name: string;
  /** The asker had no answer and may take them. */
  may_take: boolean;
}

/** Of a command. */
export type Outcome = "accepted" | "refused" | "bad_program" | "fault" | "unreachable";

/** To a command. */
export interface Answer {
  id: Id;
  outcome: Outcome;
  text: string;
  /** The first status behind it has this count. */
  status_count: number;
}

/** Of a command: what the page chose. */
export type Id = number | string;

/** A machine whose daemon tells its status over LCM. */
export interface FleetMachine {
  name: string;
  /** Address of its computer, or: this computer. */
  host: string;
  /** Address of its own panel; empty: not known. */
  page: string;
  /** Within the last three seconds. */
  heard: boolean;
  version: string;
  state: string;
  fault: string;
  alarm: string;
  alarms_open: number;
  waits_for: string;
  program: string;
  line: number;
  tool_name: string;
  time_total_s: number;
  time_left_s: number;
  parts: number;
  run_s: number;
}

/** Every machine that the LCM network shows. */
export interface Fleet {
  machines: FleetMachine[];
  /** Why none can be heard; empty: they can. */
  silent: string;
}

/** The first thing that a page is told. */
export interface Hello {
  version: string;
  machine: string;
  clock_us: number;
  server_time_us: number;
}

/** What can be watched every period. */
export interface ScopeSignal {
  name: string;
  unit: string;
  meaning: string;
}

/** All that can be watched. */
export interface ScopeSignals {
  id: Id;
  period_s: number;
  signals: ScopeSignal[];
}

/** Signals of past periods, in the order in which they were asked for. */
export interface ScopeData {
  id: Id;
  /** Why there is nothing; empty: all is well. */
  text: string;
  period_s: number;
  /** period that the daemon still knows; -1: none */
  oldest: number;
  newest: number;
  periods: number[];
  /** A list for each signal; null: not known. */
  values: ((number | null)[])[];
}

/** For signals of past periods; without signals, for the list of them. */
export interface ScopeQuestion {
  id: Id;
  /** 16 at most */
  signals: string[];
  /** The first period wanted; -n: the last n. */
  from?: number;
  rows?: number;
}

/** No daemon is heard. */
export interface Gone {
  text: string;
}

/** What the page sent is no message. */
export interface BadMessage {
  text: string;
}

/** The first message of a page that a key opens. */
export interface Key {
  key: string;
}

/** Its type says all. */
export interface Empty {
}

/** A program holds when this page is lost. */
export interface HoldWhenLost {
  on: boolean;
}

/** To the daemon; the values are those of hal/lcm/command_t.lcm. */
export interface Command {
  id: Id;
  verb: Verb;
  joint?: number;
  value?: number;
  speed?: number;
  speed_share?: number;
  /** Of a jog that goes on while it is held. */
  alive_ms?: number;
  /** Of a jog: along what it goes. */
  frame?: number;
  text?: string;
  /** Of a jog with a value: a number that no other press has. */
  press?: number;
}

/** Of a command: those of hal/lcm/command_t.lcm. */
export type Verb = "load" | "start" | "hold" | "resume" | "stop" | "mdi" | "jog" | "home" | "override" | "estop" | "reset" | "correction" | "rapid_override" | "spindle_override" | "adaptive_feed" | "single_block" | "optional_stop" | "block_delete" | "acknowledge" | "parts" | "dry_run" | "machine_lock" | "delete_tool";

export type ServerMessage =
  | ({ type: "fleet" } & Fleet)
  | ({ type: "scope_signals" } & ScopeSignals)
  | ({ type: "scope_data" } & ScopeData)
  | ({ type: "hello" } & Hello)
  | ({ type: "status" } & Status)
  | ({ type: "motion" } & Motion)
  | ({ type: "tables" } & Tables)
  | ({ type: "alarms" } & Alarms)
  | ({ type: "message" } & LogEntry)
  | ({ type: "controls" } & Controls)
  | ({ type: "plan" } & PlanState)
  | ({ type: "answer" } & Answer)
  | ({ type: "error" } & BadMessage)
  | ({ type: "gone" } & Gone);

export type PageMessage =
  | ({ type: "key" } & Key)
  | ({ type: "command" } & Command)
  | ({ type: "take_controls" } & Empty)
  | ({ type: "give_controls" } & Empty)
  | ({ type: "keep_controls" } & Empty)
  | ({ type: "hold_when_lost" } & HoldWhenLost)
  | ({ type: "scope" } & ScopeQuestion)
  | ({ type: "alive" } & Empty);
