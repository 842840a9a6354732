// The plan of the loaded program, as the server sends it (docs/panel.md, "The plan").

import type { PlanHead } from "./interface";

/** Less is nothing: rounding, and the ends of numbers of four bytes. */
const kNothingMm = 1e-4;
const kMark = "TRNPLAN2";
/** A limit that is used whole. */
export const kWhole = 200;
export const kNoJoint = 255;

export class Plan {
  readonly head: PlanHead;
  /** Places of the tip in the table frame: x, y, z of each point in turn; mm. */
  readonly places: Float32Array;
  readonly times: Float32Array;
  readonly speeds: Float32Array;
  /** Asked for; 0: a rapid. */
  readonly feeds: Float32Array;
  /** mm; a coarser picture may leave the point out. */
  readonly significance: Float32Array;
  /** Of the tip from the programmed path; mm. */
  readonly deviations: Float32Array;
  readonly lines: Uint32Array;
  readonly velocity: Uint8Array;
  readonly acceleration: Uint8Array;
  readonly jerk: Uint8Array;
  /** The joint that limits on the way to the point. */
  readonly joints: Uint8Array;
  readonly rapid: Uint8Array;
  /** No way leads to the point. */
  readonly jump: Uint8Array;

  constructor(bytes: ArrayBuffer) {
    const text = new TextDecoder();
    const mark = new Uint8Array(bytes, 0, kMark.length);
    if (text.decode(mark) !== kMark) throw new Error("This is no plan.");
    const size = new DataView(bytes).getUint32(kMark.length, true);
    this.head = JSON.parse(text.decode(new Uint8Array(bytes, kMark.length + 4, size)));
    const n = this.head.count;
    let at = (kMark.length + 4 + size + 3) & ~3;
    const take = <T>(make: new (bytes: ArrayBuffer, at: number, n: number) => T, width: number): T => {
      const out = new make(bytes, at, n);
      at = (at + n * width + 3) & ~3;
      return out;
    };
    const axes = [take(Float32Array, 4), take(Float32Array, 4), take(Float32Array, 4)];
    this.places = new Float32Array(3 * n);
    axes.forEach((axis, k) => axis.forEach((value, i) => (this.places[3 * i + k] = value)));
    this.times = take(Float32Array, 4);
    this.speeds = take(Float32Array, 4);
    this.feeds = take(Float32Array, 4);
    this.significance = take(Float32Array, 4);
    this.deviations = take(Float32Array, 4);
    this.lines = take(Uint32Array, 4);
    this.velocity = take(Uint8Array, 1);
    this.acceleration = take(Uint8Array, 1);
    this.jerk = take(Uint8Array, 1);
    this.joints = take(Uint8Array, 1);
    const flags = take(Uint8Array, 1);
    this.rapid = flags.map((flag) => flag & 1);
    this.jump = flags.map((flag) => flag & 2);
  }

  get count(): number {
    return this.head.count;
  }

  /** The greatest deviation of a cut; mm. */
  farthest(): number {
    let most = kNothingMm;
    for (let i = 0; i < this.count; ++i) if (!this.rapid[i]) most = Math.max(most, this.deviations[i]);
    return most;
  }

  /** The fastest speed of a cut. */
  fastest(): number {
    let most = 1e-9;
    for (let i = 0; i < this.count; ++i) if (!this.rapid[i]) most = Math.max(most, this.speeds[i]);
    return most;
  }
}

export type Colouring = "speed" | "joint" | "acceleration" | "jerk" | "feed" | "deviation";
export const kColourings: { mode: Colouring; name: string; hint: string }[] = [
  { mode: "speed", name: "Speed", hint: "how fast the tip goes" },
  { mode: "joint", name: "Limit", hint: "which joint limits the speed here" },
  { mode: "acceleration", name: "Acceleration", hint: "how much of its acceleration the busiest joint uses" },
  { mode: "jerk", name: "Jerk", hint: "how much of its jerk the busiest joint uses" },
  { mode: "feed", name: "Feed kept", hint: "how much of the feed that the program asks for is reached" },
  { mode: "deviation", name: "Deviation", hint: "how far the tip leaves the programmed path" },
];

type Colour = [number, number, number];
const hex = (text: string): Colour => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16)) as Colour;

/** From little to much; each is told from its neighbours also without colours, by its lightness. */
const kRamp = ["#3949ab", "#1e88e5", "#00acc1", "#43a047", "#c0ca33", "#fdd835"].map(hex);
const kUse = ["#4a6fa5", "#5aa9a0", "#c9b458", "#e8893a", "#e0452f"].map(hex);
const kJointColours = ["#e4572e", "#2e86de", "#27ae60", "#f2b134", "#a55eea", "#16a3a3", "#e377c2", "#8c8c3e", "#c0392b"].map(hex);
const kFree: Colour = hex("#8fa1b3");
const kRapid: Colour = hex("#66727f");

const css = (colour: Colour) => `rgb(${colour.map(Math.round).join(" ")})`;

function ramp(stops: Colour[], share: number): Colour {
  const at = Math.max(0, Math.min(1, share)) * (stops.length - 1);
  const i = Math.min(stops.length - 2, Math.floor(at));
  return stops[i].map((value, k) => value + (at - i) * (stops[i + 1][k] - value)) as Colour;
}

export const rampOf = (mode: Colouring) => (mode === "speed" || mode === "feed" ? kRamp : kUse);
export const rampCss = (mode: Colouring) => `linear-gradient(90deg, ${rampOf(mode).map(css).join(", ")})`;
export const jointColour = (joint: number) => css(joint === kNoJoint ? kFree : kJointColours[joint % kJointColours.length]);
export const rapidColour = css(kRapid);

/** Colours of points are mixed as light, whose amounts a screen's numbers do not tell. */
function light(value: number): number {
  const share = value / 255;
  return 255 * (share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4);
}

/** Red, green and blue of every point. */
export function coloursOf(plan: Plan, mode: Colouring): Uint8Array {
  const out = new Uint8Array(3 * plan.count);
  const fastest = plan.fastest();
  const farthest = plan.farthest();
  const table = Array.from({ length: 256 }, (_, i) => ramp(rampOf(mode), i / 255));
  const pick = (share: number) => table[Math.max(0, Math.min(255, Math.round(share * 255)))];
  const colour = (i: number): Colour => {
    if (mode === "joint") return plan.joints[i] === kNoJoint ? kFree : kJointColours[plan.joints[i] % kJointColours.length];
    if (plan.rapid[i]) return kRapid;
    if (mode === "speed") return pick(plan.speeds[i] / fastest);
    if (mode === "acceleration") return pick(plan.acceleration[i] / kWhole);
    if (mode === "deviation") return pick(plan.deviations[i] / farthest);
    if (mode === "jerk") return pick(plan.jerk[i] / kWhole);
    return plan.feeds[i] > 0 ? pick(plan.speeds[i] / plan.feeds[i]) : kFree;
  };
  const lights = Uint8Array.from({ length: 256 }, (_, i) => Math.round(light(i)));
  for (let i = 0; i < plan.count; ++i) out.set(colour(i).map((value) => lights[Math.round(value)]), 3 * i);
  return out;
}
