import { useState } from "preact/hooks";
import { link, useLink } from "./link";
import { isAngle, isHeld, keptValue, kWords, type Offset, positionText, type Status, turnText, unitText, wordsOf } from "./model";

// Tables are changed by the lines of G-code that a program would use, as 'trunnion offset' and 'touch-off' do.

const kSettable = ["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"];

/** While a program is held the daemon says where it may be: at a program stop. */
const mayChange = (status: Status) => status.state === "idle" || (isHeld(status) && ["", "away"].includes(status.detour));

const valueOf = (offset: Offset, word: number) => offset[kWords[word].toLowerCase() as "x" | "y" | "z" | "a" | "b" | "c"];

/** A number as G-code takes it; null if it is none. */
function numberOf(text: string): string | null {
  const trimmed = text.trim().replace(",", ".");
  return /^[+-]?(\d+\.?\d*|\.\d+)$/.test(trimmed) ? trimmed : null;
}

/** No machine is so long, and nothing turns so often: 100 m, 100 turns. What is beyond was mistyped. */
const kFarMm = 1e5;
const kFarRad = 200 * Math.PI;

/** Whether the text is a number that can be meant. */
function isMeant(text: string, angle: boolean, inch: boolean): boolean {
  const number = numberOf(text);
  return number !== null && Math.abs(keptValue(Number(number), angle, inch)) <= (angle ? kFarRad : kFarMm) * (1 + 1e-12);
}

/** Says that a number is too great, where one is. */
function TooFar({ lengths, angles, inch }: { lengths: string[]; angles: string[]; inch: boolean }) {
  const isFar = (angle: boolean) => (text: string) => numberOf(text) !== null && !isMeant(text, angle, inch);
  const far = lengths.find(isFar(false)) ?? angles.find(isFar(true));
  if (far === undefined) return null;
  const most = lengths.some(isFar(false)) ? `${inch ? Math.floor(kFarMm / 25.4) : kFarMm} ${unitText(false, inch)}` : "36000°";
  return <p class="hint wrong" role="alert" data-test="too-far">{far.trim()} is too much: {most} at most.</p>;
}

function Offsets() {
  const { status, tables, mine } = useLink("status", "tables", "link");
  const [name, setName] = useState("");
  const [values, setValues] = useState<Record<string, string>>({});
  if (!status || !tables) return <section class="card" />;
  const words = wordsOf(status.axes);
  const chosen = name || status.work_offset;
  const given = words.map((word) => [kWords[word], values[kWords[word]]?.trim() ?? ""]).filter(([, text]) => text);
  const textOf = (word: number) => values[kWords[word]] ?? "";
  const wrong = (word: number) => !!textOf(word).trim() && !isMeant(textOf(word), isAngle(word), status.inch);
  const sound = given.length > 0 && !words.some(wrong);
  const turned = turnText(tables.offsets.find((one) => one.name === chosen)?.rotation ?? 0);
  const ready = mine && mayChange(status) && sound;
  const send = async (code: string) => {
    const number = kSettable.indexOf(chosen) + 1;
    const line = `G10 ${code} P${number} ${given.map(([letter, text]) => letter + numberOf(text)).join(" ")}`;
    const answer = await link.command({ verb: "mdi", text: line });
    if (answer.outcome === "accepted") setValues({});
  };
  const unit = (word: number) => unitText(isAngle(word), status.inch);
  return (
    <>
    <section class="card change">
      <h2>Change {chosen}</h2>
      <p class="hint">Touch off makes the place where the tool stands read these values.</p>
      <div class="fields">
        {words.map((word) => (
          <label key={word}>{kWords[word]} {unit(word)}
            <input inputMode="decimal" value={textOf(word)} data-test={`set-${kWords[word]}`} aria-invalid={wrong(word)}
              onInput={(e) => setValues({ ...values, [kWords[word]]: e.currentTarget.value })} />
          </label>
        ))}
      </div>
      <TooFar lengths={words.filter((word) => !isAngle(word)).map(textOf)} angles={words.filter(isAngle).map(textOf)} inch={status.inch} />
      {turned && (
        <p class="hint" data-test="turned">
          {chosen} is turned by {turned} about Z. The line “G10 L2 P{kSettable.indexOf(chosen) + 1} R0” turns it back.
        </p>
      )}
      <div class="actions">
        <button disabled={!ready} data-test="set-offset" onClick={() => void send("L2")}>Set to these values</button>
        <button class="accent" disabled={!ready} data-test="touch-off" onClick={() => void send("L20")}>
          Touch off here
        </button>
      </div>
    </section>
    <section class="card offsets">
      <h2>Work offsets</h2>
      <table class="rows">
        <thead><tr><th>Offset</th>{words.map((word) => <th key={word}>{kWords[word]} <small>{unit(word)}</small></th>)}<th>Turned</th></tr></thead>
        <tbody>
          {tables.offsets.map((offset) => (
            <tr key={offset.name} class={offset.name === status.work_offset ? "in-force" : ""}
              data-test={`offset-${offset.name}`}>
              <th>
                {kSettable.includes(offset.name)
                  ? <button aria-pressed={offset.name === chosen} onClick={() => setName(offset.name)}>{offset.name}</button>
                  : <span>{offset.name}</span>}
              </th>
              {words.map((word) => <td key={word}>{positionText(valueOf(offset, word), isAngle(word), status.inch)}</td>)}
              <td data-test={`rotation-${offset.name}`}>{turnText(offset.rotation) || "–"}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </section>
    </>
  );
}

const isWhole = (text: string) => /^\d{1,8}$/.test(text.trim());

/** Changes a tool, or adds one (`number` 0), by a line of G10 with the tool's remark. */
function ChangeTool({ number, done }: { number: number; done: () => void }) {
  const { status, mine, tables } = useLink("status", "link", "tables");
  const tool = tables?.tools.find((one) => one.number === number);
  const [length, setLength] = useState("");
  const [diameter, setDiameter] = useState("");
  const [pocket, setPocket] = useState("");
  const [given, setGiven] = useState("");
  const [remark, setRemark] = useState(tool?.remark ?? "");
  const [refused, setRefused] = useState("");
  const [asked, setAsked] = useState(false);
  const adds = number === 0;
  const inch = status?.inch ?? false;
  const wrongLength = (text: string) => !!text.trim() && !isMeant(text, false, inch);
  const known = adds && !!tables?.tools.some((one) => one.number === Number(given));
  const said = remark.trim() !== (tool?.remark ?? "").trim();
  const words = [length.trim() && `Z${numberOf(length)}`, diameter.trim() && `R${Number(numberOf(diameter)) / 2}`,
    pocket.trim() ? `H${pocket.trim()}` : !length.trim() && !diameter.trim() && said && tool ? `H${tool.pocket}` : ""].filter(Boolean);
  const sound = words.length > 0 && ![length, diameter].some(wrongLength) &&
    (!pocket.trim() || isWhole(pocket)) && (!adds || (isWhole(given) && Number(given) > 0 && !known)) && !/[()]/.test(remark);
  const send = async () => {
    const line = `G10 L1 P${adds ? Number(given) : number} ${words.join(" ")}${said ? ` (${remark.trim() || " "})` : ""}`;
    const answer = await link.command({ verb: "mdi", text: line });
    if (answer.outcome === "accepted") done();
    else setRefused(answer.text);
  };
  const remove = async () => {
    if (!asked) return setAsked(true);
    const answer = await link.command({ verb: "delete_tool", value: number });
    if (answer.outcome === "accepted") done();
    else setRefused(answer.text);
  };
  const unit = unitText(false, inch);
  const field = (name: string, value: string, wrong: boolean, set: (text: string) => void, asText = false) => (
    <label class={asText ? "long" : ""}>{name} {name === "Length" || name === "Diameter" ? unit : ""}
      <input inputMode={asText ? "text" : "decimal"} value={value} data-test={`tool-${name.toLowerCase()}`} maxLength={asText ? 80 : 20}
        aria-invalid={!!value.trim() && wrong} onInput={(e) => set(e.currentTarget.value)} />
    </label>
  );
  return (
    <div class="change-tool">
      <h2>{adds ? "Add a tool" : `Change tool ${number}`}</h2>
      <div class="fields">
        {adds && field("Number", given, !isWhole(given) || known, setGiven)}
        {field("Length", length, wrongLength(length), setLength)}
        {field("Diameter", diameter, wrongLength(diameter), setDiameter)}
        {field("Pocket", pocket, !isWhole(pocket), setPocket)}
        {field("Remark", remark, /[()]/.test(remark), setRemark, true)}
      </div>
      <TooFar lengths={[length, diameter]} angles={[]} inch={inch} />
      {[given, pocket].some((text) => /^\d{9,}$/.test(text.trim())) && (
        <p class="hint wrong" role="alert" data-test="too-great">Numbers of tools and pockets have eight digits at most.</p>
      )}
      {known && <p class="hint">Tool {Number(given)} is in the table; choose it there to change it.</p>}
      {refused && <p class="hint wrong" role="alert" data-test="tool-refused">{refused}</p>}
      <div class="actions">
        <button class="accent" disabled={!mine || !status || !mayChange(status) || !sound} data-test="set-tool" onClick={() => void send()}>
          {adds ? "Add the tool" : `Set tool ${number}`}
        </button>
        {!adds && (
          <button class={asked ? "danger" : ""} disabled={!mine || status?.state !== "idle"} data-test="delete-tool" onClick={() => void remove()}>
            {asked ? `Really delete tool ${number}?` : `Delete tool ${number}`}
          </button>
        )}
        <button onClick={done}>Close</button>
      </div>
    </div>
  );
}

function Tools() {
  const { status, tables } = useLink("status", "tables");
  const [chosen, setChosen] = useState<number | null>(null);
  if (!status || !tables) return <section class="card" />;
  const length = (value: number) => positionText(value, false, status.inch);
  return (
    <section class="card">
      <h2>Tools</h2>
      {!tables.tools.length && <p class="none">The machine has no tool table.</p>}
      {tables.tools.length > 0 && (
        <table class="rows">
          <thead><tr><th>Tool</th><th>Pocket</th><th>Length</th><th>Diameter</th><th class="text">Remark</th></tr></thead>
          <tbody>
            {tables.tools.map((tool) => (
              <tr key={tool.number} data-test={`tool-row-${tool.number}`} class={tool.number === status.tool ? "in-force" : ""}>
                <th><button aria-pressed={tool.number === chosen} data-test={`tool-${tool.number}`} onClick={() => setChosen(tool.number)}>{tool.number}</button></th><td>{tool.pocket}</td><td>{length(tool.z)}</td>
                <td>{length(tool.diameter)}</td><td class="text">{tool.remark}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
      {chosen !== null && <ChangeTool key={chosen} number={chosen} done={() => setChosen(null)} />}
      {chosen === null && (
        <div class="actions"><button data-test="add-tool" onClick={() => setChosen(0)}>Add a tool</button></div>
      )}
      {tables.tools_more > 0 && <p class="none">And {tables.tools_more} more.</p>}
    </section>
  );
}

export const TablesView = () => <div class="tables"><Offsets /><Tools /></div>;
