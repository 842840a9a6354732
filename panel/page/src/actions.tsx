import { link, useLink } from "./link";
import { durationText, isProgram, type Status } from "./model";

// What operates the machine, at the foot of every view.

/** How far the program is, 0 to 1; null where the daemon does not tell. */
export function progressOf(status: Status): number | null {
  if (!isProgram(status.program) || status.progress === undefined || status.progress < 0) return null;
  return Math.min(1, status.progress);
}

function Progress() {
  const { status } = useLink("status");
  const share = status && progressOf(status);
  if (!status || share === null) return null;
  const left = status.time_left_s;
  return (
    <div class="progress" data-test="progress">
      <progress max={1} value={share} aria-label="Progress of the program" />
      <strong>{Math.floor(share * 100)} %</strong>
      {left !== undefined && left >= 0 && <span><strong>{durationText(left)}</strong> left</span>}
    </div>
  );
}

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
  const sends = (verb: string) => (on: boolean) => void link.command({ verb, value: on ? 1 : 0 });
  return (
    <div class="toggles">
      <Toggle name="Single block" test="single" on={status.single_block} disabled={!mine}
        hint="The machine stands at the end of every line" set={sends("single_block")} />
      <Toggle name="Optional stop" test="optional-stop" on={status.optional_stop} disabled={!mine}
        hint="The program stops at M1" set={sends("optional_stop")} />
      <Toggle name="Block delete" test="block-delete" on={status.block_delete} disabled={!mine || status.state !== "idle"}
        hint="Lines that begin with / are skipped; switched while the machine is idle" set={sends("block_delete")} />
      <Toggle name="Hold if lost" test="hold-when-lost" on={holdWhenLost} disabled={false}
        hint="The program holds when this page has the controls and its connection is lost"
        set={(on) => link.setHoldWhenLost(on)} />
    </div>
  );
}

export function Actions() {
  const { status, mine } = useLink("status", "link");
  const state = status?.state ?? "";
  const can: Record<string, boolean> = {
    hold: ["running", "jogging", "homing"].includes(state),
    stop: ["running", "holding", "jogging", "homing"].includes(state),
    start: mine && state === "idle" && !!status && isProgram(status.program),
    resume: mine && state === "holding",
    reset: mine && (state === "fault" || state === "estop"),
  };
  const button = (verb: string, text: string, extra = "") => (
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
      <Progress />
      <Switches />
    </footer>
  );
}
