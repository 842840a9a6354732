import faultsPage from "../../../docs/faults.md?raw";
import { link, useLink } from "./link";
import { type Alarm, programName, type Status } from "./model";

interface Fault {
  meaning: string;
  reaction: string;
  cure: string;
}

/** The rows of the table of docs/faults.md, by the fault's name. */
function readFaults(page: string): Map<string, Fault> {
  const faults = new Map<string, Fault>();
  for (const line of page.split("\n")) {
    const row = /^\| `(\w+)` \| (.*) \| (.*) \| (.*) \|$/.exec(line);
    if (row) faults.set(row[1], { meaning: row[2], reaction: row[3], cure: row[4] });
  }
  return faults;
}

const kFaults = readFaults(faultsPage);
const plain = (name: string) => name.replace(/_/g, " ");

/** The alarm that tells of the fault which stops the machine. */
const tells = (alarm: Alarm, status: Status | null) => alarm.active && alarm.name === status?.fault;

/** How many alarms nobody has acknowledged; nothing where there are none. */
export function OpenAlarms() {
  const { status } = useLink("status");
  return status?.alarms_open ? <b class="badge" data-test="alarms-open" title="Not acknowledged">{status.alarms_open}</b> : null;
}

function since(alarm: Alarm): string {
  const began = new Date(alarm.since_us / 1000);
  const today = began.toDateString() === new Date().toDateString();
  const text = today ? began.toLocaleTimeString("en-GB") : began.toLocaleString("en-GB");
  return alarm.times > 1 ? `${text}, ${alarm.times} times` : text;
}

const acknowledge = (number: number) => void link.command({ verb: "acknowledge", value: number });

function AlarmCard({ alarm }: { alarm: Alarm }) {
  const { status, mine } = useLink("status", "link");
  const named = alarm.program === "mdi" ? "a typed line" : alarm.program === "jog" ? "a move by hand" : programName(alarm.program);
  const place = alarm.program && `${named}${alarm.line && named !== "a typed line" ? `, line ${alarm.line}` : ""}`;
  const rows = [["Cure", alarm.cure], ["What the machine did", alarm.did], ["Program", place], ["Cause", alarm.cause]];
  return (
    <section class={`card alarm ${alarm.active ? "fault" : ""}`} role={alarm.active ? "alert" : undefined} data-test="alarm"
      aria-label={`Alarm ${alarm.number}`}>
      <div class="title">
        <h2>{plain(alarm.name)}</h2>
        <small>since {since(alarm)}</small>
        <strong data-test="alarm-state">{alarm.active ? "active" : "over"}</strong>
        {tells(alarm, status) && (
          <button class="accent" disabled={!mine} data-test="alarm-reset" onClick={() => void link.command({ verb: "reset" })}>Reset</button>
        )}
        <button disabled={!mine || alarm.acknowledged} data-test="acknowledge" onClick={() => acknowledge(alarm.number)}>
          {alarm.acknowledged ? "Acknowledged" : "Acknowledge"}
        </button>
      </div>
      <p>{alarm.text}</p>
      <dl>
        {rows.map(([name, text]) => text && (
          <div key={name}><dt>{name}</dt><dd data-test={name === "Cure" ? "cure" : undefined}>{text}</dd></div>
        ))}
      </dl>
    </section>
  );
}

function AlarmList() {
  const { alarms, mine } = useLink("alarms", "link");
  return (
    <>
      {alarms.filter((alarm) => !alarm.acknowledged).length > 1 && (
        <button class="all" disabled={!mine} data-test="acknowledge-all" onClick={() => acknowledge(0)}>Acknowledge all</button>
      )}
      {[...alarms].reverse().map((alarm) => <AlarmCard key={alarm.number} alarm={alarm} />)}
    </>
  );
}

/** The fault that stops the machine, where no alarm tells of it. */
function Present() {
  const { status, mine, alarms } = useLink("status", "link", "alarms");
  if (!status || alarms.some((alarm) => tells(alarm, status))) return null;
  if (status.fault === "ok") return <section class="card calm-card"><h2>No fault</h2><p>Nothing stops the machine.</p></section>;
  const fault = kFaults.get(status.fault);
  return (
    <section class="card fault" role="alert" data-test="fault">
      <h2>{plain(status.fault)}{status.fault_joint && ` at joint ${status.fault_joint}`}</h2>
      <dl>
        <div><dt>Cause</dt><dd>{fault?.meaning ?? "This fault is not in the page's table."}</dd></div>
        {status.message && <div><dt>Message</dt><dd>{status.message}</dd></div>}
        <div><dt>Reaction</dt><dd>{fault?.reaction}</dd></div>
        <div><dt>Cure</dt><dd data-test="cure">{fault?.cure}</dd></div>
      </dl>
      <button class="accent large" disabled={!mine} onClick={() => void link.command({ verb: "reset" })}>Reset</button>
    </section>
  );
}

function Warnings() {
  const { status } = useLink("status");
  if (!status?.warnings.length) return null;
  return (
    <section class="card">
      <h2>Warnings</h2>
      <ul class="warnings">{status.warnings.map((text) => <li key={text}>{text}</li>)}</ul>
    </section>
  );
}

function LogList() {
  const { log } = useLink("log");
  return (
    <section class="card">
      <h2>Log</h2>
      <ol class="log">
        {[...log].reverse().map((entry, i) => (
          <li key={i} class={`kind-${entry.kind}`}>
            <time>{new Date(entry.time_us / 1000).toLocaleTimeString("en-GB")}</time>
            <span class="kind">{plain(entry.kind)}</span>
            <span>{entry.kind === "fault" ? plain(entry.text) : entry.text}</span>
          </li>
        ))}
        {!log.length && <li class="none">Nothing has happened yet.</li>}
      </ol>
    </section>
  );
}

export const Alarms = () => <div class="alarms"><Present /><AlarmList /><Warnings /><LogList /></div>;
