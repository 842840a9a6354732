import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import type { ScopeData, ScopeSignal, ScopeSignals } from "./interface";
import { link, useLink } from "./link";
import { type Line, type Marks, Plot } from "./plot";
import { crossing, csvOf, type Edge, ScopeRows, spectrum } from "./scope_data";

// Signals of the machine at every period: live, from a trigger on, and their frequencies.

const kColours = ["#3b82f6", "#f59e0b", "#10b981", "#ef4444", "#a855f7", "#14b8a6", "#ec4899", "#84cc16"];
const kWindows = [0.5, 1, 2, 5, 10];
const kSignalsMax = kColours.length;
const kAskMs = 100;
const kRowsMax = 20000;
const kFirst = ["X.setpoint", "X.measured"];

type Mode = "live" | "trigger" | "stopped";
interface Trigger { signal: string; edge: Edge; level: number }

/** The list of signals, once the daemon has told it. */
function useSignals(): { signals: ScopeSignal[]; periodS: number } {
  const { connected, gone } = useLink("link");
  const [list, setList] = useState<ScopeSignals | null>(null);
  useEffect(() => {
    let ends = false;
    const ask = async () => {
      const answer = connected && !gone ? await link.scope([], -1, 1) : null;
      if (ends) return;
      if (answer && "signals" in answer) setList(answer);
      else window.setTimeout(() => void ask(), 1000);
    };
    void ask();
    return () => { ends = true; };
  }, [connected, gone]);
  return { signals: list?.signals ?? [], periodS: list?.period_s ?? 0.001 };
}

/** Asks for what is new until it ends; `took` is told after each answer. */
function feed(rows: ScopeRows, took: (text: string) => void): () => void {
  let ends = false;
  const ask = async () => {
    if (ends) return;
    const began = performance.now();
    const data = document.hidden ? null : await link.scope(rows.signals, rows.next(), kRowsMax);
    if (ends) return;
    if (data && "periods" in data) {
      rows.take(data as ScopeData);
      took(data.text);
    }
    window.setTimeout(() => void ask(), Math.max(10, kAskMs - (performance.now() - began)));
  };
  void ask();
  return () => { ends = true; };
}

/** The part of the rows that is shown: the newest, or those around the trigger once they are all there. */
class Capture {
  private from = 0;
  private at = -1;

  constructor(private readonly trigger: Trigger | null, private readonly rowsShown: number) {}

  /** Rows around the trigger; null while it has not come, or what follows it is not there yet. */
  look(rows: ScopeRows): ScopeRows | null {
    const column = rows.columns[rows.signals.indexOf(this.trigger?.signal ?? "")];
    if (!this.trigger || !column || !rows.periods.length) return null;
    const first = rows.periods[0];
    if (this.at < 0) {
      // Nothing of before the trigger was set.
      if (this.from === 0) this.from = rows.periods[rows.periods.length - 1] + 1;
      const found = crossing(column, this.trigger.edge, this.trigger.level, this.from - first);
      if (found < 0) return null;
      this.at = rows.periods[found];
    }
    const begin = Math.max(0, this.at - first - Math.floor(this.rowsShown / 4));
    const end = begin + this.rowsShown;
    return rows.periods.length >= end ? rows.part(begin, end) : null;
  }

  get triggerPeriod() { return this.at; }
}

function useScope(names: string[], windowS: number, periodS: number, mode: Mode, trigger: Trigger, stop: () => void) {
  const [shown, setShown] = useState<ScopeRows | null>(null);
  const [text, setText] = useState("");
  const [zero, setZero] = useState(0);
  const key = names.join();
  const frozen = useRef(false);
  useEffect(() => {
    if (mode === "stopped" || !names.length) return;
    const count = Math.max(16, Math.round(windowS / periodS));
    const rows = new ScopeRows(names, Math.min(2 * kRowsMax, 3 * count));
    const capture = new Capture(mode === "trigger" ? trigger : null, count);
    return feed(rows, (why) => {
      setText(why);
      if (mode === "live") {
        if (!frozen.current) setShown(rows.part(Math.max(0, rows.periods.length - count), rows.periods.length));
        return;
      }
      const caught = capture.look(rows);
      if (!caught) return;
      setZero(capture.triggerPeriod);
      setShown(caught);
      stop();
    });
  }, [key, windowS, periodS, mode, trigger.signal, trigger.edge, trigger.level]);
  return { shown, text, zero, frozen };
}

function Picker({ signals, chosen, toggle }: { signals: ScopeSignal[]; chosen: string[]; toggle: (name: string) => void }) {
  const [filter, setFilter] = useState("");
  const listed = signals.filter((one) => `${one.name} ${one.meaning}`.toLowerCase().includes(filter.toLowerCase()));
  return (
    <section class="card picker" aria-label="Signals">
      <h2>Signals</h2>
      <input value={filter} onInput={(e) => setFilter(e.currentTarget.value)} placeholder="Find a signal" aria-label="Find a signal" data-test="scope-filter" />
      <ul tabIndex={0} aria-label="All signals">
        {listed.map((one) => {
          const on = chosen.includes(one.name);
          return (
            <li key={one.name}>
              <label title={one.meaning}>
                <input type="checkbox" checked={on} disabled={!on && chosen.length >= kSignalsMax} data-test={`signal-${one.name}`}
                  onChange={() => toggle(one.name)} />
                {on && <i style={{ background: kColours[chosen.indexOf(one.name)] }} />}
                <span>{one.name}</span><small>{one.unit}</small>
              </label>
            </li>
          );
        })}
        {!signals.length && <li class="none">The daemon has told no signals yet.</li>}
      </ul>
    </section>
  );
}

function save(rows: ScopeRows, periodS: number) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(new Blob([csvOf(rows, periodS)], { type: "text/csv" }));
  anchor.download = "scope.csv";
  anchor.click();
  window.setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
}

/** The values at both cursors, and what is between them. */
function Readings({ lines, data, marks, unit }: { lines: Line[]; data: (number | null)[][]; marks: Marks; unit: string }) {
  if (marks.a === null && marks.b === null) return <p class="hint">Tap the plot: cursor A, then B. Drag to zoom in, double-click to zoom out.</p>;
  const at = (x: number | null) => (x === null ? -1 : data[0].findIndex((one) => one !== null && one >= x));
  const [a, b] = [at(marks.a), at(marks.b)];
  const text = (value: number | null | undefined) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(6))));
  const between = (column: (number | null)[]) => (a >= 0 && b >= 0 ? (column[b] ?? 0) - (column[a] ?? 0) : undefined);
  return (
    <table class="rows readings-table" data-test="cursors">
      <thead><tr><th scope="col">Cursors</th><th scope="col">A</th><th scope="col">B</th><th scope="col">B − A</th></tr></thead>
      <tbody>
        {[{ name: unit === "Hz" ? "Frequency" : "Time", unit, colour: "transparent" }, ...lines].map((line, k) => (
          <tr key={line.name}>
            <th scope="row"><i class="dot" style={{ background: line.colour }} />{line.name} <small>{line.unit}</small></th>
            <td>{text(data[k][a])}</td><td>{text(data[k][b])}</td><td>{text(between(data[k]))}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function TriggerFields({ trigger, set, names }: { trigger: Trigger; set: (trigger: Trigger) => void; names: string[] }) {
  const level = (text: string) => Number.isFinite(Number(text)) && text.trim() !== "" && set({ ...trigger, level: Number(text) });
  return (
    <>
      <select aria-label="Trigger on" value={trigger.signal} data-test="trigger-signal" onChange={(e) => set({ ...trigger, signal: e.currentTarget.value })}>
        {names.map((name) => <option key={name}>{name}</option>)}
      </select>
      <select aria-label="Edge" value={trigger.edge} data-test="trigger-edge" onChange={(e) => set({ ...trigger, edge: e.currentTarget.value as Edge })}>
        <option>rising</option><option>falling</option>
      </select>
      <input aria-label="Level" defaultValue={String(trigger.level)} data-test="trigger-level" inputMode="decimal" onChange={(e) => level(e.currentTarget.value)} />
    </>
  );
}

/** Axes of decades have no zero: what is a millionth of the greatest is as good as none. */
function aboveFloor(amplitude: number[]): number[] {
  const floor = Math.max(1e-12, 1e-6 * Math.max(0, ...amplitude));
  return amplitude.map((value) => Math.max(value, floor));
}

export function Scope({ theme }: { theme: string }) {
  const { signals, periodS } = useSignals();
  const [chosen, setChosen] = useState<string[]>(() => JSON.parse(localStorage.getItem("scope") ?? "null") ?? kFirst);
  const [windowS, setWindow] = useState(2);
  const [mode, setMode] = useState<Mode>("live");
  const [frequencies, setFrequencies] = useState(false);
  const [marks, setMarks] = useState<Marks>({ a: null, b: null });
  const [wanted, setTrigger] = useState<Trigger>({ signal: "", edge: "rising", level: 0 });
  const names = chosen.filter((name) => signals.some((one) => one.name === name));
  const trigger = { ...wanted, signal: names.includes(wanted.signal) ? wanted.signal : names[0] ?? "" };
  const { shown, text, zero, frozen } = useScope(names, windowS, periodS, mode, trigger, () => setMode("stopped"));
  const toggle = (name: string) => {
    const next = chosen.includes(name) ? chosen.filter((one) => one !== name) : [...chosen, name];
    setChosen(next);
    localStorage.setItem("scope", JSON.stringify(next));
  };
  const remote = useLink("machine").machine?.remote;
  const drawn = shown?.signals ?? [];
  const lines: Line[] = drawn.map((name) => ({
    name, unit: signals.find((one) => one.name === name)?.unit ?? "", colour: kColours[Math.max(0, chosen.indexOf(name))],
  }));
  const data = useMemo(() => {
    if (!shown) return [[], ...lines.map(() => [])];
    if (!frequencies) {
      const from = zero || shown.periods[shown.periods.length - 1] + 1;
      return [shown.periods.map((period) => (period - from) * periodS), ...shown.columns];
    }
    const all = shown.columns.map((column) => spectrum(column, periodS));
    return [all[0]?.frequency ?? [], ...all.map((one) => aboveFloor(one.amplitude))];
  }, [shown, frequencies, zero, periodS]);
  const pick = (x: number) => setMarks((before) => (before.a === null || before.b !== null ? { a: x, b: null } : { ...before, b: x }));
  return (
    <div class="scope">
      <Picker signals={signals} chosen={chosen} toggle={toggle} />
      <section class="card view" aria-label="Plot">
        <div class="bar">
          <div class="switch" role="group" aria-label="What is shown">
            <button aria-pressed={mode === "live"} data-test="scope-live" onClick={() => setMode("live")}>Live</button>
            <button aria-pressed={mode === "trigger"} data-test="scope-trigger" onClick={() => setMode("trigger")}>Trigger</button>
            <button aria-pressed={mode === "stopped"} data-test="scope-stop" onClick={() => setMode("stopped")}>Stop</button>
          </div>
          <select aria-label="Seconds shown" value={windowS} data-test="scope-window" onChange={(e) => setWindow(Number(e.currentTarget.value))}>
            {kWindows.map((one) => <option key={one} value={one}>{one} s</option>)}
          </select>
          <TriggerFields trigger={trigger} set={setTrigger} names={names} />
          <button class="slim" aria-pressed={frequencies} data-test="scope-fft" onClick={() => { setFrequencies(!frequencies); setMarks({ a: null, b: null }); }}>FFT</button>
          <button class="slim" disabled={!shown} data-test="scope-save" onClick={() => shown && save(shown, periodS)}>Save CSV</button>
        </div>
        <p class="hint" data-test="scope-text">
          {remote ? "The scope is asked on the machine's own computer: open the page of a panel that runs there." : text || (mode === "trigger" ? `Waits until ${trigger.signal} crosses ${trigger.level}, ${trigger.edge}.`
            : shown?.lost ? `${shown.lost} periods came too late for this page.` : `${Math.round(1 / periodS)} values a second of each signal.`)}
        </p>
        <Plot lines={lines} data={data} xText={frequencies ? "Hz" : "s"} marks={marks} pick={pick}
          zoomed={(on) => { frozen.current = on && mode === "live"; }} again={theme + frequencies} decades={frequencies} />
        <Readings lines={lines} data={data} marks={marks} unit={frequencies ? "Hz" : "s"} />
      </section>
    </div>
  );
}
