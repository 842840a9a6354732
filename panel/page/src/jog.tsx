import { useLayoutEffect, useState } from "preact/hooks";
import { kFrames, kOwn, kPath, letGo, press, type Way } from "./hand";
import { armKeys } from "./keys";
import { link, useLink } from "./link";
import { isAngle, isHeld, keptValue, kWords, type Machine, type Status, unitText, wordsOf } from "./model";

const kSteps = [0.01, 0.1, 1, 10];
const kHeld = 0;
const kShares = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1];
const kFirstShare = 4;

/** True where every axis word has a joint of its own. */
const wordsAreJoints = (machine: Machine, status: Status) =>
  wordsOf(status.axes).every((word) => machine.joints.some((joint) => joint.name.toUpperCase() === kWords[word]));

interface Target {
  name: string;
  angle: boolean;
  way: { word?: string; joint?: number };
}

/** What can be moved along this frame. */
function targets(machine: Machine, status: Status, frame: number): Target[] {
  if (frame === kOwn && !wordsAreJoints(machine, status))
    return machine.joints.map((joint, i) => ({ name: joint.name, angle: joint.unit === "rad", way: { joint: i } }));
  const words = wordsOf(status.axes).filter((word) => frame < 2 || !isAngle(word));
  return words.map((word) => ({ name: kWords[word], angle: isAngle(word), way: { word: kWords[word] } }));
}

const kPairs: Record<string, [string, number]> = {
  ArrowRight: ["X", 1], ArrowLeft: ["X", -1], ArrowUp: ["Y", 1], ArrowDown: ["Y", -1], PageUp: ["Z", 1], PageDown: ["Z", -1],
};

/** Along the path of a held program. */
const kAlong: Record<string, number> = { ",": -1, ".": 1 };

/** What moves by hand mean while a program is held, by the detour of the status. */
const kDetours: Record<Status["detour"], string> = {
  "": "The program is held: you may move the axes away. Resume then leads back first.",
  jogs: "Moves away from the held program. Hold ends that.",
  away: "Away from the held program. Resume leads back the same way, then goes on.",
  returns: "On the way back to the held program. Hold stops that.",
  retraces: "Moves along the path of the held program. Hold stops that.",
};

export function Jog() {
  const { status, mine, machine } = useLink("status", "link", "machine");
  const [step, setStep] = useState(1);
  const [chosen, setFrame] = useState<number | null>(null);
  const [share, setShare] = useState(kFirstShare);
  const [keys, setKeys] = useState(false);
  const held = !!status && isHeld(status);
  const frame = chosen ?? (machine && status && !wordsAreJoints(machine, status) ? 1 : kOwn);
  const along = machine && status ? targets(machine, status, frame) : [];
  const ready = mine && (status?.state === "idle" || status?.state === "jogging" || status?.program === "jog" || held);
  const move = (one: Target, sign: number) => {
    if (!ready) return;
    const way: Way = { ...one.way, frame, sign, share: kShares[share], step: keptValue(step, one.angle, status!.inch) };
    void press(way);
  };
  const retrace = (sign: number) => {
    if (ready && held && status!.detour !== "away")
      void press({ frame: kPath, sign, share: 0, step: keptValue(step, false, status!.inch) });
  };
  // At once with the picture: whoever sees that the keys are on may press one.
  useLayoutEffect(() => {
    if (!keys || !mine) return;
    return armKeys((key) => {
      if (held && kAlong[key]) {
        retrace(kAlong[key]);
        return true;
      }
      const pair = kPairs[key];
      const one = pair && along.find((each) => each.name === pair[0]);
      if (!one) return false;
      move(one, pair[1]);
      return true;
    }, letGo);
  }, [keys, mine, ready, held, status?.detour, step, frame, share, along.length]);
  if (!status) return <section class="card" />;
  const button = (one: Target, sign: number) => (
    <button disabled={!ready} data-test={`jog-${one.name}${sign > 0 ? "+" : "-"}`}
      aria-label={`Move ${one.name} ${sign > 0 ? "up" : "down"}`}
      onPointerDown={(e) => e.isPrimary && e.button === 0 && move(one, sign)}
      onKeyDown={(e) => (e.key === " " || e.key === "Enter") && !e.repeat && move(one, sign)}
      onKeyUp={letGo} onContextMenu={(e) => e.preventDefault()}>
      {one.name}{sign > 0 ? "+" : "−"}
    </button>
  );
  const alongPath = (sign: number) => (
    <button disabled={!ready || status.detour === "away"} data-test={sign > 0 ? "path-forward" : "path-back"}
      title={status.detour === "away" ? "Away from the path: Resume leads back to it" : "By the step, or as long as it is held"}
      onPointerDown={(e) => e.isPrimary && e.button === 0 && retrace(sign)}
      onKeyDown={(e) => (e.key === " " || e.key === "Enter") && !e.repeat && retrace(sign)}
      onKeyUp={letGo} onContextMenu={(e) => e.preventDefault()}>
      {sign > 0 ? "Path forward" : "Path back"}
    </button>
  );
  const unit = unitText(false, status.inch);
  return (
    <section class="card jog" aria-label="Move by hand">
      <div class="title">
        <h2>Move by hand</h2>
        <button class="slim" aria-pressed={keys} disabled={!mine} data-test="jog-keys" onClick={() => setKeys(!keys)}
          title="Arrow keys move X and Y, page up and page down move Z">Arrow keys</button>
        <button class="slim" disabled={!mine || status.state !== "idle"} data-test="home"
          onClick={() => void link.command({ verb: "home", joint: -1 })}>Home all</button>
      </div>
      <div class="switch wide" role="group" aria-label="Along">
        {kFrames.map((one) => (
          <button key={one.name} aria-pressed={frame === one.frame} title={`Along ${one.hint}`} data-test={`along-${one.name}`}
            onClick={() => setFrame(one.frame)}>{one.name}</button>
        ))}
      </div>
      <div class="pairs">
        {along.map((one) => <div key={one.name}>{button(one, 1)}{button(one, -1)}</div>)}
      </div>
      {held && <div class="along" role="group" aria-label="Along the path of the held program">{alongPath(-1)}{alongPath(1)}</div>}
      <div class="switch wide" role="group" aria-label={`Step in ${unit} or degrees`}>
        <button aria-pressed={step === kHeld} data-test="held" onClick={() => setStep(kHeld)}>Held</button>
        {kSteps.map((one) => (
          <button key={one} aria-pressed={step === one} onClick={() => setStep(one)}>{one}</button>
        ))}
      </div>
      <div class="override">
        <label>
          <span>Speed</span>
          <input type="range" min={0} max={kShares.length - 1} step={1} value={share} data-test="jog-speed"
            aria-valuetext={`${kShares[share] * 100} percent of the joint's limit`}
            onInput={(e) => setShare(Number(e.currentTarget.value))} />
        </label>
        <output>{kShares[share] * 100} %</output>
      </div>
      {(held || status.detour) && <p class="hint" data-test="detour">{kDetours[status.detour]}</p>}
    </section>
  );
}
