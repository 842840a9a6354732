import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { link, useLink } from "./link";
import { durationText, isProgram, programName } from "./model";

// The text of the program, with the line that moves now. Only the lines in sight are drawn.

const kRow = 26;
/** Browsers draw nothing that is much higher. */
const kHeightMax = 8e6;
/** Where in sight the running line stands. */
const kRunningAt = 0.4;

const kPiece = /(\([^)]*\)|;.*)|([A-Za-z])\s*([-+]?[\d.#[]\S*)?/g;

/** A line with its comments and letters told apart. */
function Coloured({ text }: { text: string }) {
  const out = [];
  let at = 0;
  for (const found of text.matchAll(kPiece)) {
    if (found.index > at) out.push(text.slice(at, found.index));
    at = found.index + found[0].length;
    if (found[1]) out.push(<i>{found[1]}</i>);
    else out.push(<b class={/[GM]/i.test(found[2]) ? "code" : ""}>{found[2]}</b>, found[0].slice(1));
  }
  out.push(text.slice(at));
  return <>{out}</>;
}

export function ProgramLines({ marked, wrong }: { marked: number; wrong: number }) {
  const { program } = useLink("program");
  const box = useRef<HTMLDivElement>(null);
  const [top, setTop] = useState(0);
  const [height, setHeight] = useState(300);
  const [follows, setFollows] = useState(true);
  const lines = program?.lines ?? 0;
  const whole = Math.min(lines * kRow, kHeightMax);
  const shown = Math.ceil(height / kRow) + 1;
  // Long programs: a pixel of the bar stands for more than one of the text.
  const ratio = whole > height ? (lines * kRow - height) / (whole - height) : 1;
  const from = Math.max(0, Math.min(lines - 1, Math.floor((top * ratio) / kRow)));
  useLayoutEffect(() => {
    const sizes = new ResizeObserver(() => setHeight(box.current!.clientHeight));
    sizes.observe(box.current!);
    return () => sizes.disconnect();
  }, []);
  useEffect(() => {
    const at = wrong || marked;
    if ((follows || wrong) && at && box.current)
      box.current.scrollTop = Math.max(0, (at - 1) * kRow - height * kRunningAt) / ratio;
  }, [marked, wrong, follows, height, lines]);
  const rows = [];
  for (let i = from; i < Math.min(lines, from + shown); ++i) {
    const number = i + 1;
    rows.push(
      <div key={number} class={`row ${number === wrong ? "wrong" : number === marked ? "running" : ""}`}
        style={{ top: `${top + (i * kRow - top * ratio)}px` }}
        data-test={number === wrong ? "wrong-line" : number === marked ? "running-line" : undefined} aria-current={number === marked ? "true" : undefined}>
        <span>{number}</span><code><Coloured text={program!.line(number)} /></code>
      </div>,
    );
  }
  return (
    <div class="listing">
      <div class="lines" ref={box} tabIndex={0} role="region" aria-label="Text of the program" data-test="lines"
        onScroll={(e) => setTop(e.currentTarget.scrollTop)} onWheel={() => setFollows(false)}
        onTouchMove={() => setFollows(false)} onPointerDown={() => setFollows(false)}>
        <div style={{ height: `${whole}px` }}>{rows}</div>
      </div>
      {!follows && marked > 0 && <button class="follow accent" onClick={() => setFollows(true)}>Follow line {marked}</button>}
    </div>
  );
}

/** Keeps a file in the panel's folder, and loads it. */
async function send(file: File | undefined) {
  if (file && !(await link.upload(file)) && link.mine) await link.command({ verb: "load", text: file.name });
}

function Loader() {
  const { mine, programs, status, machine } = useLink("link", "programs", "status", "machine");
  const [name, setName] = useState("");
  const [busy, setBusy] = useState(false);
  const load = async (event: Event) => {
    event.preventDefault();
    setBusy(true);
    await link.command({ verb: "load", text: name.trim() });
    setBusy(false);
  };
  return (
    <form onSubmit={load}>
      <input value={name} onInput={(e) => setName(e.currentTarget.value)} placeholder={machine?.remote ? "Whole path there" : "Program"}
        aria-label="Name of a program" data-test="load-name" spellcheck={false} list="programs" autocomplete="off"
        onFocus={() => void link.fetchPrograms()} />
      <datalist id="programs" data-test="programs">
        {programs.map(({ name }) => <option key={name} value={name} />)}
      </datalist>
      <button disabled={!mine || busy || !name.trim() || status?.state === "running"} data-test="load">
        {busy ? "Loading" : "Load"}
      </button>
      {!machine?.remote && <label class="button" title="Send a program of this computer; it may be dropped onto its text as well">
        Send
        <input type="file" accept=".ngc,.nc,.cnc,.tap,.gcode" data-test="upload" aria-label="Send a program of this computer"
          onChange={(e) => { void send(e.currentTarget.files?.[0]); e.currentTarget.value = ""; }} />
      </label>}
    </form>
  );
}

/** The line of the loaded program that moves now; 0: none of its own text. */
export function runningLine(): number {
  const { status, program } = link;
  if (!status || !program || status.program !== program.path) return 0;
  return programName(status.file || status.program) === programName(program.path) ? status.line : 0;
}

/** How far the loaded program is, where its time is known. */
function Progress() {
  const { status } = useLink("status");
  if (!status || !isProgram(status.program) || status.time_total_s <= 0) return null;
  const share = Math.min(1, status.time_done_s / status.time_total_s);
  const about = status.time_about ? "about " : "";
  return (
    <div class="progress" title={status.time_about ? "The program asks the machine; the answers were guessed" : undefined}>
      <progress max={1} value={share} aria-label="Progress of the program" data-test="progress" />
      <strong>{Math.floor(share * 100)} %</strong>
      <span data-test="time-left">
        {`${durationText(status.time_done_s)} of ${durationText(status.time_total_s)} done, `}
        {status.time_left_s < 0 ? "time left unknown" : <>{about}<strong>{durationText(status.time_left_s)}</strong> left</>}
      </span>
    </div>
  );
}

export function Program() {
  const { status, program, plan } = useLink("status", "program", "plan");
  const path = status?.program ?? "";
  const error = program?.error || (plan && plan.head.program === program?.path ? plan.head.message : "");
  const wrong = program?.errorLine || Number(/:(\d+):/.exec(error)?.[1] ?? 0);
  const refused = !!program?.error;
  const shown = refused ? `${program.path}, not loaded` : path === "mdi" ? "Typed line" : path === "jog" ? "Move by hand" : programName(path) || "No program";
  const marked = runningLine();
  const other = isProgram(path) && marked === 0 && !!status?.block;
  return (
    <section class="card program" aria-label="Program" onDragOver={(e) => e.preventDefault()}
      onDrop={(e) => { e.preventDefault(); void send(e.dataTransfer?.files[0]); }}>
      <div class="title">
        <div class="named">
          <strong data-test="program">{shown}</strong>
          <small>{program?.lines ? `${marked ? `line ${marked} of ` : ""}${program.lines} lines` : ""}</small>
        </div>
        <Loader />
      </div>
      <Progress />
      {error && <p class="warn" role="alert" data-test="program-error">{programName(error)}</p>}
      {program?.lines ? <ProgramLines marked={refused ? 0 : marked} wrong={wrong} /> : (
        <div class="empty"><p>{program ? "The text of this program cannot be read from here." : "Load a program, and its text stands here."}</p></div>
      )}
      <div class={`block ${other || !program?.lines || !isProgram(path) ? "" : "hidden"}`}>
        <span class="line">{status?.block ? status.line : "–"}</span>
        <code data-test="block">{status?.block || "No block is running."}</code>
      </div>
    </section>
  );
}
