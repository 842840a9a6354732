import { render } from "preact";
import type { Machine } from "./interface";
import { link } from "./link";
import { programName } from "./model";
import { Path } from "./path";
import { Plan } from "./plan";
import { ProgramText } from "./program_text";
import "./style.css";

// The path of a run in three dimensions, on a page that 'trunnion run --report' writes: it works from a file, and no
// server answers it.

interface Run {
  machine: Machine;
  program: string;
  text: string;
  /** As GET /api/v1/plan has it, base64. */
  plan: string;
}

const run = JSON.parse(document.getElementById("trunnion")!.textContent!) as Run;
const bytes = Uint8Array.from(atob(run.plan), (letter) => letter.charCodeAt(0));
link.machine = run.machine;
link.program = new ProgramText(run.program, run.text);
link.planState = { state: "ready", program: run.program, text: "", number: 1 };
link.plan = new Plan(bytes.buffer);
document.documentElement.dataset.theme = matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";

render(
  <>
    <header>
      <div class="brand"><div><h1>{programName(run.program)}</h1><small>on {run.machine.name}, Trunnion {run.machine.version}</small></div></div>
    </header>
    <main aria-label="The path"><Path /></main>
  </>,
  document.getElementById("page")!,
);
