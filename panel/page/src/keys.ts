import { link } from "./link";
import { canHold, isProgram } from "./model";

// The keyboard. A key that stops works everywhere, also while a line is typed; others only where no field has the focus.

export const kKeyHelp: [string, string][] = [
  ["F1", "Emergency stop"],
  ["Esc", "Stop the program, or the move by hand"],
  ["Space", "Hold, while something moves"],
  ["R", "Start the loaded program"],
  ["S", "Resume"],
  ["1 to 7", "Choose a view"],
  ["Arrows, page up, page down", "Move X, Y and Z, where “Arrow keys” is on"],
  ["Comma, full stop", "Back and forward along the path of a held program, where “Arrow keys” is on"],
  ["?", "Show these keys"],
];

const kMoving = ["running", "jogging", "homing", "stopping"];

let jogKey: ((key: string) => boolean) | null = null;
let jogEnd: (() => void) | null = null;

/** Keys that move the machine go to `begin`, which tells whether it takes one; `end` when it is let go. */
export function armKeys(begin: (key: string) => boolean, end: () => void): () => void {
  jogKey = begin;
  jogEnd = end;
  return () => {
    if (jogKey !== begin) return;
    end();
    jogKey = jogEnd = null;
  };
}

const typing = (target: EventTarget | null) =>
  target instanceof HTMLElement && target.matches("input, textarea, select, [contenteditable]");

/** True if the key has done its work. */
function stops(key: string, state: string): boolean {
  if (key === "F1") void link.command({ verb: "estop" });
  else if (key === "Escape" && (kMoving.includes(state) || state === "holding")) void link.command({ verb: "stop" });
  else return false;
  return true;
}

function acts(event: KeyboardEvent, state: string, show: (view: number) => void, help: () => void): boolean {
  const { key } = event;
  if (key === " " && canHold(link.status)) void link.command({ verb: "hold" });
  else if (key === "?") help();
  else if (key >= "1" && key <= "9") show(Number(key) - 1);
  else if (key.toLowerCase() === "r" && link.mine && state === "idle" && isProgram(link.status!.program))
    void link.command({ verb: "start" });
  else if (key.toLowerCase() === "s" && link.mine && state === "holding") void link.command({ verb: "resume" });
  else return jogKey?.(key) ?? false;
  return true;
}

/** `show` is given the index of a view. */
export function listenToKeys(show: (view: number) => void, help: () => void) {
  window.addEventListener("keydown", (event) => {
    const state = link.status?.state ?? "";
    // A key with another one is the browser's; one that is held down acts once.
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
    if (!stops(event.key, state) && (typing(event.target) || !acts(event, state, show, help))) return;
    event.preventDefault();
    event.stopPropagation();
  }, true);
  window.addEventListener("keyup", (event) => {
    if (event.key.startsWith("Arrow") || event.key.startsWith("Page") || ",.".includes(event.key)) jogEnd?.();
  });
}
