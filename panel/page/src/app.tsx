import { type JSX, render } from "preact";
import { useEffect, useState } from "preact/hooks";
import { Actions } from "./actions";
import { Alarms, OpenAlarms } from "./alarms";
import { Asked, Controls } from "./controls";
import { Fleet } from "./fleet";
import { kKeyHelp, listenToKeys } from "./keys";
import { link, useLink } from "./link";
import { LogIn, User } from "./log_in";
import { MachineView } from "./machine";
import { sentence, stateName, tone } from "./model";
import { Path } from "./path";
import { Run } from "./run";
import { Scope } from "./scope";
import "./fonts.css";
import "./style.css";
import { TablesView } from "./tables";

type Theme = "dark" | "light";
const kViews: { name: string; draw: (theme: Theme) => JSX.Element }[] = [
  { name: "Run", draw: () => <Run /> },
  { name: "Path", draw: () => <Path /> },
  { name: "Offsets and tools", draw: () => <TablesView /> },
  { name: "Machine", draw: () => <MachineView /> },
  { name: "Scope", draw: (theme) => <Scope theme={theme} /> },
  { name: "Alarms", draw: () => <Alarms /> },
  { name: "All machines", draw: () => <Fleet /> },
];
function firstTheme(): Theme {
  const kept = localStorage.getItem("theme");
  if (kept === "dark" || kept === "light") return kept;
  return matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
}

function StateLine() {
  const { status, gone, connected, refused, stale } = useLink("status", "link");
  if (refused) return <Silent name="No key" text={refused} />;
  if (!connected) return <Silent name="No connection" text="The panel does not answer; trying again." />;
  if (stale) return <Silent name="No connection" text="The panel says nothing any more: what is shown here is old." />;
  if (gone) return <Silent name="No machine" text={`${gone} What is shown here is old.`} />;
  if (!status) return <Silent name="Connecting" text="" />;
  return (
    <div class="state" role="status" aria-live="polite">
      <span class={`lamp ${tone(status.state)}`} data-test="state">{stateName(status.state)}</span>
      <span class="sentence" data-test="sentence" title={sentence(status)}>{sentence(status)}</span>
    </div>
  );
}

const Silent = ({ name, text }: { name: string; text: string }) => (
  <div class="state" role="status">
    <span class="lamp danger" data-test="state">{name}</span>
    <span class="sentence" data-test="sentence" title={text}>{text}</span>
  </div>
);

/** Under the head where the machine is on another computer. */
function RemoteLine() {
  const { machine } = useLink("machine");
  const remote = machine?.remote;
  if (!remote) return null;
  const may = { look: "only look and stop it", operate: "operate it", "set up": "operate it and set it up" }[remote.role];
  return (
    <p class="remote" data-test="remote">
      <strong>This machine is on another computer.</strong> With the key “{remote.key}” this page may {may}. What it shows comes
      unsigned over the network.
    </p>
  );
}

function KeyHelp({ close }: { close: () => void }) {
  return (
    <dialog open aria-label="Keys" data-test="keys">
      <h2>Keys</h2>
      <dl>{kKeyHelp.map(([key, what]) => <div key={key}><dt><kbd>{key}</kbd></dt><dd>{what}</dd></div>)}</dl>
      <button onClick={close} autoFocus>Close</button>
    </dialog>
  );
}

function App() {
  const { machine, needsLogIn, old } = useLink("machine", "link");
  const [view, setView] = useState(0);
  const [theme, setTheme] = useState<Theme>(firstTheme);
  const [help, setHelp] = useState(false);
  useEffect(() => listenToKeys((wanted) => setView((now) => (wanted < kViews.length ? wanted : now)),
    () => setHelp((now) => !now)), []);
  // On a narrow screen the tabs are scrolled.
  useEffect(() => document.querySelector('[role="tab"][aria-selected="true"]')?.scrollIntoView({ block: "nearest", inline: "nearest" }), [view]);
  useEffect(() => {
    document.documentElement.dataset.theme = theme;
    localStorage.setItem("theme", theme);
  }, [theme]);
  if (needsLogIn) return <LogIn />;
  return (
    <>
      <header>
        <div class="brand">
          <img src="./icon.svg" alt="" width="32" height="32" />
          <div><h1>{machine?.name ?? "Trunnion"}</h1><small>Trunnion {machine?.version ?? ""}</small></div>
        </div>
        <StateLine />
        <Controls />
        <button class="estop" data-test="estop" onClick={() => void link.command({ verb: "estop" })}>
          Emergency stop
        </button>
      </header>
      <nav>
        <div role="tablist" aria-label="Views">
        {kViews.map(({ name }, i) => (
          <button key={name} role="tab" aria-selected={view === i} onClick={() => setView(i)}>
            {name}{name === "Alarms" && <OpenAlarms />}
          </button>
        ))}
        </div>
        <button class="theme" onClick={() => setHelp(!help)} title="Keys that operate the machine">Keys</button>
        <User />
        <button onClick={() => setTheme(theme === "dark" ? "light" : "dark")}>
          {theme === "dark" ? "Light" : "Dark"}
        </button>
      </nav>
      <RemoteLine />
      <Asked />
      <main tabIndex={0} aria-label={kViews[view].name} class={old ? "old" : ""} data-test={old ? "old" : undefined}>{kViews[view].draw(theme)}</main>
      <Actions />
      {help && <KeyHelp close={() => setHelp(false)} />}
    </>
  );
}

link.start();
render(<App />, document.getElementById("page")!);
