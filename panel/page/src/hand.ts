import { type Answer, link } from "./link";
import { isHeld, type Status } from "./model";

// Moves by hand. A step goes its way. A held move goes on in the daemon, evenly, as long as this page says that it is
// still held: when the page, the network or the panel is lost, the daemon ends it by itself.

/** Along what: the frame of command_t. */
export const kFrames = [
  { frame: 0, name: "Joint", hint: "the one joint of the axis" },
  { frame: 1, name: "Machine", hint: "the machine's axes, whatever joints move for them" },
  { frame: 2, name: "Work", hint: "the program's axes, with its rotation and tilted plane" },
  { frame: 3, name: "Tool", hint: "the spindle's axes; Z away from the work" },
];
export const kOwn = 0;
/** Along the path of a held program, which has no axis. */
export const kPath = 4;
/** Farther than any path goes back, mm. */
const kFarMm = 1e6;

/** A move by hand as it is asked for: of an axis word, or of a joint by its index. */
export interface Way {
  word?: string;
  joint?: number;
  frame: number;
  sign: number;
  /** mm or rad; 0: as long as it is held. */
  step: number;
  /** Of the joint's velocity limit. */
  share: number;
}

/** The daemon ends a held move when it has not heard for so long. */
const kHeldMs = 250;
const kSayHeldMs = 50;
const kSayStepMs = 100;

const kPressRange = 2 ** 20;
// No other page's, and none of this page before it was loaded anew: a random start and a count.
const kFirstPress = (crypto.getRandomValues(new Uint32Array(1))[0] + 1) * kPressRange;
let presses = 0;
let busy = false;
let held = false;

/** The end of the move that was answered so. */
function rest(answer: Answer): Promise<void> {
  return new Promise((resolve) => {
    const rests = (status: Status) => ["idle", "fault", "estop"].includes(status.state) ||
      (isHeld(status) && !["jogs", "retraces"].includes(status.detour));
    // A status from before the move, at rest as well, may still be on the way.
    const ended = () => !link.connected ||
      (!!link.status && link.status.count >= (answer.status_count ?? 0) && rests(link.status));
    const ends = [link.on("status", check), link.on("link", check)];
    function check() {
      if (!ended()) return;
      ends.forEach((end) => end());
      resolve();
    }
    check();
  });
}

const target = (way: Way) => ({ verb: "jog" as const, frame: way.frame, ...(way.word ? { text: way.word } : { joint: way.joint ?? 0 }) });

/** What a press asks for beside its target. */
function asked(way: Way) {
  if (way.frame === kPath) return { value: way.sign * (way.step || kFarMm) };
  return way.step ? { value: way.sign * way.step, speed_share: way.share } : { value: way.sign, alive_ms: kHeldMs, speed_share: way.share };
}

function untilLetGo(): Promise<void> {
  return new Promise((resolve) => {
    const look = () => (held && link.mine && link.connected ? window.setTimeout(look, 5) : resolve());
    look();
  });
}

/** One press is one move: another press while that goes on asks for nothing. */
export async function press(way: Way) {
  if (busy) return;
  busy = held = true;
  const goesOn = way.step === 0;
  link.setAlive(goesOn ? kSayHeldMs : kSayStepMs);
  const answered = link.command({ ...target(way), ...asked(way), press: kFirstPress + ++presses });
  if (goesOn) {
    await untilLetGo();
    link.setAlive(0);
    const stopped = await link.command({ ...target(way), value: 0 });
    const answer = await answered;
    // A move along a direction is planned first: it may have begun behind the stop.
    const last = answer.outcome === "accepted" && way.frame !== kOwn ? await link.command({ ...target(way), value: 0 }) : stopped;
    if (answer.outcome === "accepted") await rest(last);
  } else {
    const answer = await answered;
    if (answer.outcome === "accepted") await rest(answer);
    link.setAlive(0);
  }
  busy = false;
}

export function letGo() {
  held = false;
}

// Whatever takes the attention away lets go.
for (const name of ["pointerup", "pointercancel", "blur"]) window.addEventListener(name, letGo);
document.addEventListener("visibilitychange", letGo);
