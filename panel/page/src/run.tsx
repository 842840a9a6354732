import { useState } from "preact/hooks";
import { Jog } from "./jog";
import type { Verb } from "./interface";
import { link, useLink } from "./link";
import { durationText, isAngle, isHeld, kWords, positionText, shownValue, type Status, turnText, unitText, wordsOf } from "./model";
import { Program } from "./program";

type Shown = "work" | "machine" | "to_go" | "joints";
const kShown: [Shown, string][] = [["work", "Work"], ["machine", "Machine"], ["to_go", "To go"], ["joints", "Joints"]];

function Positions() {
  const { status, motion } = useLink("status", "motion");
  const [shown, setShown] = useState<Shown>("work");
  if (!status || !motion) return <section class="card dro" />;
  const { inch } = status;
  const turned = turnText(status.rotation_rad);
  const second = shown === "work" ? "machine" : "work";
  const small = (word: number, key: "work" | "machine" | "to_go") => positionText(motion[key][word], isAngle(word), inch);
  return (
    <section class="card dro" aria-label="Positions">
      <div class="switch wide" role="group" aria-label="Positions as">
        {kShown.map(([key, name]) => (
          <button key={key} aria-pressed={shown === key} onClick={() => setShown(key)}>
            {name}{key === "work" && <small>{status.work_offset}</small>}
            {key === "work" && turned && <small class="turned" data-test="work-turned">turned {turned}</small>}
          </button>
        ))}
      </div>
      <table>
        <thead class={shown === "joints" ? "" : "hidden-head"}>
          <tr>{shown === "joints" ? <><th scope="col">Joint</th><th scope="col">Measured</th><td /><th scope="col">State</th></>
            : <><th scope="col">Axis</th><th scope="col">{shown}</th><td /><th scope="col">{second}</th></>}</tr>
        </thead>
        <tbody>
          {shown === "joints" ? status.joints.map((joint, i) => (
            <tr key={joint.name}>
              <th scope="row">{joint.name}</th>
              <td class="big">{positionText(motion.q_measured[i] ?? 0, joint.unit === "rad", inch)}</td>
              <td class="unit">{unitText(joint.unit === "rad", inch)}</td>
              <td>{joint.limit_switch ? "on its switch" : joint.homed ? "homed" : "not homed"}</td>
            </tr>
          )) : wordsOf(status.axes).map((word) => (
            <tr key={word}>
              <th scope="row">{kWords[word]}</th>
              <td class="big" data-test={`${shown}-${kWords[word]}`}>{small(word, shown)}</td>
              <td class="unit">{unitText(isAngle(word), inch)}</td>
              <td class="second"><small>{second === "machine" ? "machine" : "work"}</small>
                <span data-test={`${second}-${kWords[word]}`}>{small(word, second)}</span></td>
            </tr>
          ))}
        </tbody>
      </table>
    </section>
  );
}

function Override({ name, verb, now, max }: { name: string; verb: Verb; now: number; max: number }) {
  const { mine } = useLink("link");
  const [asked, setAsked] = useState<number | null>(null);
  const percent = asked ?? Math.round(now * 100);
  const send = async (value: number) => {
    setAsked(value);
    await link.command({ verb, value: value / 100 });
    setAsked(null);
  };
  return (
    <div class="override">
      <label>
        <span>{name}</span>
        <input type="range" min={verb === "spindle_override" ? 50 : 0} max={max} step={5} value={percent}
          disabled={!mine} data-test={verb} onInput={(e) => setAsked(Number(e.currentTarget.value))}
          onChange={(e) => void send(Number(e.currentTarget.value))} />
      </label>
      <button disabled={!mine} onClick={() => void send(100)} aria-label={`${name} to 100 percent`}
        class={percent === 100 ? "" : "changed"}>{percent} %</button>
    </div>
  );
}

function Speeds() {
  const { status, motion } = useLink("status", "motion");
  if (!status) return <section class="card" />;
  const speed = motion ? shownValue(motion.speed_mm_s * 60, false, status.inch) : 0;
  return (
    <section class="card speeds" aria-label="Speeds">
      <div class="figures">
        <Figure name="Feed" value={speed.toFixed(status.inch ? 1 : 0)} unit={status.inch ? "in/min" : "mm/min"} />
        <Figure name="Spindle" value={Math.abs(status.spindle_rpm).toFixed(0)} unit="rpm" />
      </div>
      <Override name="Feed" verb="override" now={status.override_wanted} max={200} />
      <Override name="Rapid" verb="rapid_override" now={status.rapid_override} max={100} />
      <Override name="Spindle" verb="spindle_override" now={status.spindle_override} max={200} />
    </section>
  );
}

const Figure = ({ name, value, unit }: { name: string; value: string; unit: string }) => (
  <div class="figure"><span>{name}</span><div><strong>{value}</strong><small>{unit}</small></div></div>
);

function coolant(status: Status): string {
  const on = [status.mist && "mist", status.flood && "flood"].filter(Boolean);
  return on.length ? on.join(" and ") : "off";
}

function InForce() {
  const { status } = useLink("status");
  if (!status) return <section class="card" />;
  const length = status.tool_offset[2];
  const turned = turnText(status.rotation_rad);
  const rows: [string, string][] = [
    ["Tool", status.tool_name + (length ? `, length ${positionText(length, false, status.inch)}` : "")],
    ...(turned ? [["Work offset", `${status.work_offset}, turned by ${turned}`] as [string, string]] : []),
    ["Coolant", coolant(status)],
    ["Tip control", status.rtcp ? "on" : "off"],
    ["Parts", String(status.parts)],
    ["Run time", `${durationText(status.program_run_s)}, ${durationText(status.run_s)} in all`],
  ];
  return (
    <section class="card force" aria-label="In force">
      <dl>{rows.map(([name, value]) => <div key={name}><dt>{name}</dt><dd data-test={`force-${name}`}>{value}</dd></div>)}</dl>
      <p class="codes">{status.codes}</p>
    </section>
  );
}

/** The daemon's columns count the bytes of UTF-8 from 1: how many letters stand before one. */
const lettersBefore = (line: string, column: number) =>
  new TextDecoder().decode(new TextEncoder().encode(line).subarray(0, column - 1)).length;

/** Why a typed line was not run, under the place that is wrong in it. */
function Refused({ line, why, close }: { line: string; why: string; close: () => void }) {
  const place = /^mdi:(\d+):(\d+): /.exec(why);
  const before = place && place[1] === "1" ? lettersBefore(line, Number(place[2])) : -1;
  return (
    <div class="not-run" data-test="mdi-refused">
      {before >= 0 && (
        <code>{line.slice(0, before)}<mark data-test="mdi-wrong">{line.slice(before) || "\u00a0"}</mark></code>
      )}
      <p>Not run: {place ? why.slice(place[0].length) : why}</p>
      <button class="slim" onClick={close} aria-label="Close the message">Close</button>
    </div>
  );
}

function Mdi() {
  const { status, mine } = useLink("status", "link");
  const [text, setText] = useState("");
  const [history, setHistory] = useState<string[]>([]);
  const [at, setAt] = useState(0);
  const [refused, setRefused] = useState<{ line: string; why: string } | null>(null);
  const send = async (event: Event) => {
    event.preventDefault();
    const line = text.trim();
    if (!line) return;
    setHistory((before) => [...before.filter((old) => old !== line), line].slice(-50));
    setAt(0);
    setText("");
    setRefused(null);
    const answer = await link.command({ verb: "mdi", text: line });
    if (answer.outcome === "accepted") return;
    // To be mended, unless another one is being typed already.
    setText((now) => now || line);
    setRefused({ line, why: answer.text });
  };
  const browse = (event: KeyboardEvent) => {
    const step = event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0;
    const next = Math.max(0, Math.min(history.length, at + step));
    if (!step || next === at) return;
    event.preventDefault();
    setAt(next);
    setText(next ? history[history.length - next] : "");
  };
  const away = !!status && isHeld(status) && status.detour !== "jogs" && status.detour !== "returns";
  const takes = status?.state === "idle" || away;
  return (
    <section class="card mdi" aria-label="Type a line">
      <form onSubmit={send}>
        <input value={text} placeholder={away ? "On hold: M3 to M9, S, M64; at M0 G10" : "Type a line, as G0 X10 Y20"} aria-label="Line of G-code" data-test="mdi"
          spellcheck={false} autocomplete="off" onInput={(e) => setText(e.currentTarget.value)} onKeyDown={browse}
          aria-invalid={!!refused && text === refused.line} aria-describedby="mdi-refused" />
        <button disabled={!mine || !takes || !text.trim()}>Run line</button>
      </form>
      <div id="mdi-refused" role="alert">
        {refused && <Refused line={refused.line} why={refused.why} close={() => setRefused(null)} />}
      </div>
    </section>
  );
}

function LastMessages() {
  const { log } = useLink("log");
  return (
    <section class="card messages" aria-label="Messages" tabIndex={0}>
      <h2>Messages</h2>
      <ol data-test="messages">
        {log.slice(-20).reverse().map((entry, i) => (
          <li key={i} class={`kind-${entry.kind}`}>
            <time>{new Date(entry.time_us / 1000).toLocaleTimeString("en-GB")}</time>
            <span>{entry.text.replace(/_/g, entry.kind === "fault" ? " " : "_")}</span>
          </li>
        ))}
        {!log.length && <li class="none">No messages.</li>}
      </ol>
    </section>
  );
}

export function Run() {
  return (
    <div class="run">
      <div class="column"><Positions /><Speeds /></div>
      <div class="column middle"><Program /><Mdi /><LastMessages /></div>
      <div class="column"><Jog /><InForce /></div>
    </div>
  );
}
