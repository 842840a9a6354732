import faultsPage from "../../../docs/faults.md?raw";
import { link, useLink } from "./link";

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

function Present() {
  const { status, mine } = useLink("status", "link");
  if (!status) return null;
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
          <li key={i} class={entry.kind}>
            <time>{new Date(entry.time_us / 1000).toLocaleTimeString("en-GB")}</time>
            <span>{plain(entry.kind)}</span>
            {entry.kind === "fault" ? plain(entry.text) : entry.text}
          </li>
        ))}
        {!log.length && <li class="none">Nothing has happened yet.</li>}
      </ol>
    </section>
  );
}

export const Alarms = () => <div class="alarms"><Present /><Warnings /><LogList /></div>;
