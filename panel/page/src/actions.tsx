import { useEffect, useRef, useState } from "preact/hooks";
import type { Verb } from "./interface";
import { link, useLink } from "./link";
import { canHold, isProgram } from "./model";

// What operates the machine, at the foot of every view.

function Toggle({ name, test, on, disabled, hint, set }: {
  name: string; test: string; on: boolean; disabled: boolean; hint: string; set: (on: boolean) => void;
}) {
  return (
    <button class="toggle" role="switch" aria-checked={on} disabled={disabled} data-test={test} title={hint}
      onClick={() => set(!on)}><i />{name}</button>
  );
}

function Switches() {
  const { status, mine, holdWhenLost } = useLink("status", "link");
  if (!status) return null;
  const sends = (verb: Verb) => (on: boolean) => void link.command({ verb, value: on ? 1 : 0 });
  return (
    <div class="toggles">
      <Toggle name="Single block" test="single" on={status.single_block} disabled={!mine}
        hint="The machine stands at the end of every line" set={sends("single_block")} />
      <Toggle name="Optional stop" test="optional-stop" on={status.optional_stop} disabled={!mine}
        hint="The program stops at M1" set={sends("optional_stop")} />
      <Toggle name="Block delete" test="block-delete" on={status.block_delete}
        disabled={!mine || !["idle", "running", "holding"].includes(status.state)}
        hint="Lines that begin with / are skipped; of a program that runs, those that are not read yet" set={sends("block_delete")} />
      <Toggle name="Dry run" test="dry-run" on={status.dry_run} disabled={!mine || status.state !== "idle"}
        hint="Feed moves go as fast as the joints can, the spindle stands and the tool keeps away; switched while the machine is idle"
        set={sends("dry_run")} />
      <Toggle name="Machine lock" test="machine-lock" on={status.machine_lock} disabled={!mine || status.state !== "idle"}
        hint="Programs run while no joint moves; switched while the machine is idle" set={sends("machine_lock")} />
      <Toggle name="Hold if lost" test="hold-when-lost" on={holdWhenLost} disabled={false}
        hint="The program holds when this page has the controls and its connection is lost"
        set={(on) => link.setHoldWhenLost(on)} />
    </div>
  );
}

/** A second click on "Start" comes to where "Resume" stands by then; it must not say that a tool is in. */
const kSettleMs = 800;

/** True for a while after the state has become this one. */
function useFresh(state: string): boolean {
  const [, again] = useState(0);
  const since = useRef({ state, at: -kSettleMs });
  if (since.current.state !== state) since.current = { state, at: performance.now() };
  const left = since.current.at + kSettleMs - performance.now();
  useEffect(() => {
    if (left <= 0) return;
    const timer = window.setTimeout(() => again((count) => count + 1), left);
    return () => window.clearTimeout(timer);
  }, [state]);
  return left > 0;
}

export function Actions() {
  const { status, mine } = useLink("status", "link");
  const state = status?.state ?? "";
  const fresh = useFresh(state);
  const can: Partial<Record<Verb, boolean>> = {
    hold: canHold(status),
    stop: ["running", "holding", "jogging", "homing"].includes(state),
    start: mine && state === "idle" && !!status && isProgram(status.program),
    resume: mine && state === "holding" && !fresh && !["jogs", "retraces"].includes(status?.detour ?? ""),
    reset: mine && (state === "fault" || state === "estop"),
  };
  const button = (verb: Verb, text: string, extra = "") => (
    <button class={`large ${extra}`} data-test={verb} disabled={!can[verb]} onClick={() => void link.command({ verb })}>
      {text}
    </button>
  );
  const first = state === "holding" ? button("resume", "Resume", "accent")
    : state === "fault" || state === "estop" ? button("reset", "Reset", "accent") : button("start", "Start", "accent");
  return (
    <footer aria-label="Operation">
      {first}
      {button("hold", "Hold")}
      {button("stop", "Stop")}
      <Switches />
    </footer>
  );
}
