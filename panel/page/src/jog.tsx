import { useEffect, useRef, useState } from "preact/hooks";
import { type Answer, link, useLink } from "./link";
import { isAngle, keptValue, kWords, unitText, wordsOf } from "./model";

// Jog by axis word. A step is one move. While a button is held the page asks for short moves, one after the other, so
// that a lost page, network or panel leaves at most one of them.

const kSteps = [0.01, 0.1, 1, 10];
const kMoveS = 0.25;
/** Of the joint's velocity limit. */
const kSpeedShare = 0.1;

const kHeld = 0;

const kPressRange = 2 ** 20;
// No other page's, and none of this page before it was loaded anew: a random start and a count.
const kFirstPress = (crypto.getRandomValues(new Uint32Array(1))[0] + 1) * kPressRange;
let presses = 0;

/** The end of the move that was answered so. */
function rest(answer: Answer): Promise<void> {
  return new Promise((resolve) => {
    // A status from before the move, at rest as well, may still be on the way.
    const ended = () => !link.connected || (!!link.status && link.status.count >= (answer.status_count ?? 0) &&
      link.status.state !== "jogging");
    const ends = [link.on("status", check), link.on("link", check)];
    function check() {
      if (!ended()) return;
      ends.forEach((end) => end());
      resolve();
    }
    check();
  });
}

function speedOf(word: number): number {
  const joint = link.machine?.joints.find((one) => one.name.toUpperCase() === kWords[word]);
  return joint ? joint.velocity * kSpeedShare : isAngle(word) ? 0.1 : 20;
}

export function Jog() {
  const { status, mine } = useLink("status", "link");
  const [step, setStep] = useState(1);
  const held = useRef(false);
  const busy = useRef(false);
  useEffect(() => {
    const letGo = () => (held.current = false);
    const events = ["pointerup", "pointercancel", "blur"];
    events.forEach((name) => window.addEventListener(name, letGo));
    document.addEventListener("visibilitychange", letGo);
    return () => {
      letGo();
      events.forEach((name) => window.removeEventListener(name, letGo));
      document.removeEventListener("visibilitychange", letGo);
    };
  }, []);
  if (!status) return <section class="card" />;
  const ready = mine && (status.state === "idle" || status.state === "jogging");
  const ask = async (word: number, way: number, press: number, part: number) => {
    const speed = speedOf(word);
    const answer = await link.command({ verb: "jog", text: kWords[word], value: way, speed, press, part });
    if (answer.outcome === "accepted") await rest(answer);
    return answer.outcome === "accepted";
  };
  const move = async (word: number, sign: number) => {
    // One press is one move: another press while that goes on asks for nothing.
    if (busy.current || !ready) return;
    busy.current = true;
    held.current = step === kHeld;
    const press = kFirstPress + ++presses;
    let part = 0;
    link.setAlive(true);
    if (step === kHeld)
      while (held.current && (await ask(word, sign * speedOf(word) * kMoveS, press, part++)));
    else await ask(word, sign * keptValue(step, isAngle(word), status.inch), press, part);
    link.setAlive(false);
    busy.current = false;
  };
  const button = (word: number, sign: number) => (
    <button disabled={!ready} data-test={`jog-${kWords[word]}${sign > 0 ? "+" : "-"}`}
      aria-label={`Move ${kWords[word]} ${sign > 0 ? "up" : "down"}`}
      onPointerDown={(e) => e.isPrimary && e.button === 0 && void move(word, sign)}
      onKeyDown={(e) => (e.key === " " || e.key === "Enter") && !e.repeat && void move(word, sign)}
      onKeyUp={() => (held.current = false)}>
      {kWords[word]}{sign > 0 ? "+" : "−"}
    </button>
  );
  const words = wordsOf(status.axes);
  return (
    <section class="card jog" aria-label="Move by hand">
      <div class="title">
        <h2>Move by hand <small>{unitText(false, status.inch)}, °</small></h2>
        <div class="switch">
          <button aria-pressed={step === kHeld} onClick={() => setStep(kHeld)}>Held</button>
          {kSteps.map((one) => (
            <button key={one} aria-pressed={step === one} onClick={() => setStep(one)}>{one}</button>
          ))}
        </div>
      </div>
      <div class="pairs">
        {words.map((word) => <div key={word}>{button(word, -1)}{button(word, 1)}</div>)}
      </div>
    </section>
  );
}
