import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { link, useLink } from "./link";
import { durationText, isProgram, programName } from "./model";

// The text of the program, with the line that moves now. Only the lines in sight are drawn.

const kRow = 26;
/** Browsers draw nothing that is much higher. */
const kHeightMax = 8e6;
/** Where in sight the running line stands. */
const kRunningAt = 0.4;

const kScrolls = ["ArrowUp", "ArrowDown", "PageUp", "PageDown", "Home", "End", " "];

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
  const [follows, drawFollows] = useState(true);
  /** The same, known at once. */
  const following = useRef(true);
  /** How the text stood last: another top under the same sizes means that somebody has scrolled. */
  const stood = useRef({ top: 0, whole: 0, height: 0 });
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
  const stands = ({ scrollTop, scrollHeight, clientHeight }: HTMLElement) =>
    (stood.current = { top: scrollTop, whole: scrollHeight, height: clientHeight });
  const isScrolled = ({ scrollTop, scrollHeight, clientHeight }: HTMLElement) =>
    scrollHeight === stood.current.whole && clientHeight === stood.current.height && Math.abs(scrollTop - stood.current.top) > 1;
  const setFollows = (on: boolean) => {
    following.current = on;
    if (on && box.current) stands(box.current);
    drawFollows(on);
  };
  useEffect(() => setFollows(true), [program, wrong]);
  useEffect(() => {
    const at = wrong || marked;
    // Who has scrolled may be heard of only behind this.
    if (!following.current || !at || !box.current || isScrolled(box.current)) return;
    box.current.scrollTop = Math.max(0, (at - 1) * kRow - height * kRunningAt) / ratio;
    stands(box.current);
  }, [marked, wrong, follows, height, lines]);
  const scrolled = (element: HTMLElement) => {
    if (isScrolled(element)) setFollows(false);
    setTop(stands(element).top);
  };
  /** At once: a text that is set meanwhile would end a scrolling that has just begun. */
  const looks = () => whole > height && setFollows(false);
  const goesBack = () => {
    setFollows(true);
    box.current?.focus({ preventScroll: true });  // the button goes
  };
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
        onScroll={(e) => scrolled(e.currentTarget)} onWheel={looks} onTouchMove={looks} onPointerDown={looks}
        onKeyDown={(e) => kScrolls.includes(e.key) && looks()}>
        <div style={{ height: `${whole}px` }}>{rows}</div>
      </div>
      {!follows && marked > 0 && (
        <button class="follow accent" data-test="follow" onClick={goesBack}>To the running line</button>
      )}
    </div>
  );
}

/** Keeps a file in the panel's folder, and loads it; `tell` is told why it was not sent, "" before. */
async function send(file: File | undefined, tell: (why: string) => void) {
  if (!file) return;
  tell("");
  const why = await link.upload(file);
  tell(why);
  if (!why && link.mine) await link.command({ verb: "load", text: file.name });
}

function Loader({ tell }: { tell: (why: string) => void }) {
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
          onChange={(e) => { void send(e.currentTarget.files?.[0], tell); e.currentTarget.value = ""; }} />
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
  const [unsent, setUnsent] = useState("");
  useEffect(() => setUnsent(""), [program]);
  const path = status?.program ?? "";
  const error = program?.error || (plan && plan.head.program === program?.path ? plan.head.message : "");
  const wrong = program?.errorLine || Number(/:(\d+):/.exec(error)?.[1] ?? 0);
  const refused = !!program?.error;
  const shown = refused ? `${program.path}, not loaded` : path === "mdi" ? "Typed line" : path === "jog" ? "Move by hand" : programName(path) || "No program";
  const marked = runningLine();
  const other = isProgram(path) && marked === 0 && !!status?.block;
  return (
    <section class="card program" aria-label="Program" onDragOver={(e) => e.preventDefault()}
      onDrop={(e) => { e.preventDefault(); void send(e.dataTransfer?.files[0], setUnsent); }}>
      <div class="title">
        <div class="named">
          <strong data-test="program">{shown}</strong>
          <small>{program?.lines ? `${marked ? `line ${marked} of ` : ""}${program.lines} lines` : ""}</small>
        </div>
        <Loader tell={setUnsent} />
      </div>
      <Progress />
      {unsent && <p class="warn" role="alert" data-test="not-sent">{unsent}</p>}
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
