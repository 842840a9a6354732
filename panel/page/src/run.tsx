import { useState } from "preact/hooks";
import { Jog } from "./jog";
import { link, useLink } from "./link";
import { isAngle, kWords, positionText, programName, shownValue, type Status, unitText, wordsOf } from "./model";

function Positions() {
  const { status, motion } = useLink("status", "motion");
  const [joints, setJoints] = useState(false);
  if (!status || !motion) return <section class="card dro" />;
  const { inch } = status;
  return (
    <section class="card dro" aria-label="Positions">
      <div class="title">
        <h2>Position</h2>
        <div class="switch">
          <button aria-pressed={!joints} onClick={() => setJoints(false)}>Axes</button>
          <button aria-pressed={joints} onClick={() => setJoints(true)}>Joints</button>
        </div>
      </div>
      <table>
        <thead>
          <tr>{joints ? <><th /><th>Measured</th><th>State</th></>
            : <><th /><th>Work {status.work_offset}</th><th /><th>Machine</th><th>To go</th></>}</tr>
        </thead>
        <tbody>
          {joints ? status.joints.map((joint, i) => (
            <tr key={joint.name}>
              <th>{joint.name}</th>
              <td class="big">{positionText(motion.q_measured[i] ?? 0, joint.unit === "rad", inch)}
                <small>{unitText(joint.unit === "rad", inch)}</small></td>
              <td>{joint.limit_switch ? "on its switch" : joint.homed ? "homed" : "not homed"}</td>
            </tr>
          )) : wordsOf(status.axes).map((word) => (
            <tr key={word}>
              <th>{kWords[word]}</th>
              <td class="big" data-test={`work-${kWords[word]}`}>{positionText(motion.work[word], isAngle(word), inch)}</td>
              <td class="unit">{unitText(isAngle(word), inch)}</td>
              <td data-test={`machine-${kWords[word]}`}>{positionText(motion.machine[word], isAngle(word), inch)}</td>
              <td>{positionText(motion.to_go[word], isAngle(word), inch)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </section>
  );
}

function Program() {
  const { status, mine, programs } = useLink("status", "link", "programs");
  const [name, setName] = useState("");
  const [busy, setBusy] = useState(false);
  const load = async (event: Event) => {
    event.preventDefault();
    setBusy(true);
    await link.command({ verb: "load", text: name.trim() });
    setBusy(false);
  };
  const shown = status?.program === "mdi" ? "Typed line" : programName(status?.program ?? "") || "No program";
  return (
    <section class="card program" aria-label="Program">
      <div class="title">
        <strong data-test="program">{shown}</strong>
        <form onSubmit={load}>
          <input value={name} onInput={(e) => setName(e.currentTarget.value)} placeholder="Name of a program"
            aria-label="Name of a program" data-test="load-name" spellcheck={false} list="programs" autocomplete="off"
            onFocus={() => void link.fetchPrograms()} />
          <datalist id="programs" data-test="programs">
            {programs.map(({ name }) => <option key={name} value={name} />)}
          </datalist>
          <button disabled={!mine || busy || !name.trim()} data-test="load">{busy ? "Loading" : "Load"}</button>
        </form>
      </div>
      <div class="block">
        <span class="line">{status?.block ? status.line : "–"}</span>
        <code data-test="block">{status?.block || "No block is running."}</code>
      </div>
    </section>
  );
}

function Buttons() {
  const { status, mine } = useLink("status", "link");
  const state = status?.state ?? "";
  const rest = state === "idle";
  const can = (verb: string): boolean => {
    if (verb === "hold") return ["running", "jogging", "homing"].includes(state);
    if (verb === "stop") return ["running", "holding", "jogging", "homing"].includes(state);
    if (!mine) return false;
    if (verb === "start") return rest && !!status?.program && status.program !== "mdi";
    if (verb === "resume") return state === "holding";
    return verb === "home" ? rest : state === "fault" || state === "estop";
  };
  const button = (verb: string, text: string, extra = "", values = {}) => (
    <button class={extra} data-test={verb} disabled={!can(verb)} onClick={() => void link.command({ verb, ...values })}>
      {text}
    </button>
  );
  const single = status?.single_block ?? false;
  return (
    <section class="card buttons" aria-label="Operation">
      {state === "holding" ? button("resume", "Resume", "accent large") : button("start", "Start", "accent large")}
      {button("hold", "Hold", "large")}
      {button("stop", "Stop", "large")}
      <button aria-pressed={single} disabled={!mine} data-test="single"
        onClick={() => void link.command({ verb: "single_block", value: single ? 0 : 1 })}>Single block</button>
      {button("home", "Home", "", { joint: -1 })}
      {button("reset", "Reset")}
    </section>
  );
}

function Override({ name, verb, now, max }: { name: string; verb: string; now: number; max: number }) {
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
      <button disabled={!mine} onClick={() => void send(100)} aria-label={`${name} to 100 percent`}>{percent} %</button>
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
  <div class="figure"><span>{name}</span><strong>{value}</strong><small>{unit}</small></div>
);

function coolant(status: Status): string {
  const on = [status.mist && "mist", status.flood && "flood"].filter(Boolean);
  return on.length ? on.join(" and ") : "off";
}

function InForce() {
  const { status } = useLink("status");
  if (!status) return <section class="card" />;
  const length = status.tool_offset[2];
  const rows: [string, string][] = [
    ["Tool", status.tool_name + (length ? `, length ${positionText(length, false, status.inch)}` : "")],
    ["Work offset", status.work_offset],
    ["Coolant", coolant(status)],
    ["Tip control", status.rtcp ? "on" : "off"],
  ];
  return (
    <section class="card force" aria-label="In force">
      <dl>{rows.map(([name, value]) => <div key={name}><dt>{name}</dt><dd>{value}</dd></div>)}</dl>
      <p class="codes">{status.codes}</p>
    </section>
  );
}

function Mdi() {
  const { status, mine } = useLink("status", "link");
  const [text, setText] = useState("");
  const [history, setHistory] = useState<string[]>([]);
  const [at, setAt] = useState(0);
  const send = (event: Event) => {
    event.preventDefault();
    const line = text.trim();
    if (!line) return;
    setHistory((before) => [...before.filter((old) => old !== line), line].slice(-50));
    setAt(0);
    setText("");
    void link.command({ verb: "mdi", text: line });
  };
  const browse = (event: KeyboardEvent) => {
    const step = event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0;
    const next = Math.max(0, Math.min(history.length, at + step));
    if (!step || next === at) return;
    event.preventDefault();
    setAt(next);
    setText(next ? history[history.length - next] : "");
  };
  return (
    <section class="card mdi" aria-label="Type a line">
      <form onSubmit={send}>
        <input value={text} placeholder="Type a line, as G0 X10 Y20" aria-label="Line of G-code" data-test="mdi"
          spellcheck={false} autocomplete="off" onInput={(e) => setText(e.currentTarget.value)} onKeyDown={browse} />
        <button disabled={!mine || status?.state !== "idle" || !text.trim()}>Run line</button>
      </form>
    </section>
  );
}

function LastMessages() {
  const { log } = useLink("log");
  return (
    <section class="card messages" aria-label="Messages">
      <h2>Messages</h2>
      <ol data-test="messages">
        {log.slice(-6).reverse().map((entry, i) => (
          <li key={i} class={entry.kind}>
            <time>{new Date(entry.time_us / 1000).toLocaleTimeString("en-GB")}</time>{entry.text}
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
      <div class="column"><Positions /><Buttons /><Mdi /><LastMessages /></div>
      <div class="column"><Program /><Speeds /><Jog /><InForce /></div>
    </div>
  );
}
