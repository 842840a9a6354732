import type { FleetMachine } from "./interface";
import { link, useLink } from "./link";
import { durationText, isProgram, programName, stateName, tone } from "./model";

// Every machine whose daemon tells its status on the network: what each does, and what it waits for.

const kBadFirst = ["fault", "estop", "holding", "stopping", "running", "jogging", "homing", "idle"];

/** What wants somebody stands first, then what works. */
function order(a: FleetMachine, b: FleetMachine): number {
  const rank = (one: FleetMachine) => (one.heard ? (one.alarms_open || one.waits_for ? -1 : kBadFirst.indexOf(one.state)) : 99);
  return rank(a) - rank(b) || a.name.localeCompare(b.name);
}

function sentence(one: FleetMachine): string {
  if (!one.heard) return "Says nothing any more: switched off, or cut from the network.";
  if (one.waits_for) return `Waits for ${one.waits_for}`;
  if (one.state === "running" && isProgram(one.program)) return `Works on ${programName(one.program)}, line ${one.line}.`;
  return isProgram(one.program) ? `${programName(one.program)} is loaded.` : "No program is loaded.";
}

function Machine({ one, own }: { one: FleetMachine; own: boolean }) {
  const share = one.time_total_s > 0 && one.time_left_s >= 0 ? 1 - Math.min(1, one.time_left_s / one.time_total_s) : 0;
  const works = one.heard && one.time_left_s >= 0 && ["running", "holding", "stopping"].includes(one.state);
  return (
    <section class={`card ${one.heard ? "" : "lost"}`} aria-label={one.name} data-test={`fleet-${one.name}`}>
      <div class="title">
        <h2>{one.name}</h2>
        <span class={`lamp ${one.heard ? tone(one.state) : "danger"}`}>{one.heard ? stateName(one.state) : "Not heard"}</span>
      </div>
      <p>{sentence(one)}</p>
      {works && (
        <p class="progress">
          <progress value={share} aria-label={`Progress of ${one.name}`} />
          <span><strong>{durationText(one.time_left_s)}</strong> left</span>
        </p>
      )}
      {one.alarms_open > 0 && <p class="alarm-line"><b class="badge">{one.alarms_open}</b> {one.alarm.replace(/^\w+: /, "")}</p>}
      <dl>
        <div><dt>Tool</dt><dd>{one.tool_name || "none"}</dd></div>
        <div><dt>Parts</dt><dd>{one.parts}</dd></div>
        <div><dt>Run time</dt><dd>{durationText(one.run_s)}</dd></div>
        <div><dt>Computer</dt><dd>{one.host}</dd></div>
      </dl>
      {own ? <small>The machine of this page.</small> : one.page ? <a class="button" href={one.page}>Open its page</a> : null}
    </section>
  );
}

export function Fleet() {
  const { fleet, machine } = useLink("fleet", "machine");
  const machines = [...fleet.machines].sort(order);
  return (
    <div class="fleet">
      {machines.map((one) => <Machine key={one.name} one={one} own={one.name === machine?.name} />)}
      {!machines.length && (
        <section class="card calm-card">
          <h2>No machine is heard</h2>
          <p>{link.fleet.silent || "Daemons tell their status over LCM; [lcm] url in the config says how far it goes."}</p>
        </section>
      )}
    </div>
  );
}
