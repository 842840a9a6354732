import { useEffect, useRef, useState } from "preact/hooks";
import { useLink } from "./link";
import { durationText, programName, shownValue, unitText } from "./model";
import { type Colouring, jointColour, kColourings, kNoJoint, kWhole, type Plan, rampCss, rapidColour } from "./plan";
import { PlanLines } from "./plan_lines";
import { clearTrail, Scene, type Standpoint } from "./scene";

const percent = (share: number) => `${Math.round(100 * share)} %`;
const feedText = (mm_s: number, inch: boolean) =>
  `${shownValue(mm_s * 60, false, inch).toFixed(inch ? 1 : 0)} ${inch ? "in" : "mm"}/min`;

const micrometres = (mm: number) => `${(1000 * mm).toFixed(mm < 0.01 ? 1 : 0)} µm`;

function Legend({ plan, mode }: { plan: Plan; mode: Colouring }) {
  const { status } = useLink("status");
  if (mode === "joint") {
    const used = plan.head.joints.map((joint, i) => ({ ...joint, i })).filter((joint) => joint.limited_s > 0);
    return (
      <ul class="keys">
        {used.map((joint) => <li key={joint.name}><i style={{ background: jointColour(joint.i) }} />{joint.name}</li>)}
        <li><i style={{ background: jointColour(kNoJoint) }} />the feed decides</li>
      </ul>
    );
  }
  const ends = mode === "speed" ? ["0", feedText(plan.fastest(), status?.inch ?? false)]
    : mode === "deviation" ? ["0", micrometres(plan.farthest())] : ["0", "100 %"];
  return (
    <div class="ramp">
      <i style={{ background: rampCss(mode) }} />
      <div><span>{ends[0]}</span><span>{ends[1]}</span></div>
      <small><i style={{ background: rapidColour }} /> rapid</small>
    </div>
  );
}

function Limits({ plan }: { plan: Plan }) {
  const { head } = plan;
  const moved = head.free_s + head.joints.reduce((sum, joint) => sum + joint.limited_s, 0) || 1;
  const rows = head.joints.map((joint, i) => ({ name: joint.name, share: joint.limited_s / moved, colour: jointColour(i) }))
    .filter((row) => row.share >= 0.001).sort((a, b) => b.share - a.share);
  rows.unshift({ name: "feed", share: head.free_s / moved, colour: jointColour(kNoJoint) });
  return (
    <ul class="bars" data-test="limits">
      {rows.map((row) => (
        <li key={row.name}>
          <span>{row.name}</span>
          <b><i style={{ width: `${100 * row.share}%`, background: row.colour }} /></b>
          <em>{(100 * row.share).toFixed(row.share < 0.1 ? 1 : 0)} %</em>
        </li>
      ))}
    </ul>
  );
}

/** How much of each joint's way the program needs. */
function Ranges({ plan }: { plan: Plan }) {
  const { status } = useLink("status");
  const inch = status?.inch ?? false;
  const shown = (value: number, unit: string) => shownValue(value, unit === "rad", inch).toFixed(inch && unit === "mm" ? 2 : 0);
  return (
    <ul class="bars ranges" data-test="ranges">
      {plan.head.joints.map((joint) => {
        const way = joint.max - joint.min;
        const outside = joint.from < joint.min - 1e-9 || joint.to > joint.max + 1e-9;
        const at = (value: number) => `${Math.max(0, Math.min(100, (100 * (value - joint.min)) / way))}%`;
        return (
          <li key={joint.name} class={outside ? "outside" : ""}>
            <span>{joint.name}</span>
            <b><i style={{ left: at(joint.from), width: `max(3px, calc(${at(joint.to)} - ${at(joint.from)}))` }} /></b>
            <em>{shown(joint.from, joint.unit)} … {shown(joint.to, joint.unit)} {unitText(joint.unit === "rad", inch)}</em>
          </li>
        );
      })}
    </ul>
  );
}

function PlanCard({ plan, mode }: { plan: Plan; mode: Colouring }) {
  const { head } = plan;
  const outside = head.joints.filter((joint) => joint.from < joint.min - 1e-9 || joint.to > joint.max + 1e-9);
  return (
    <aside class="card plan-card" aria-label="The plan">
      <div class="facts">
        <div><strong data-test="plan-time">{durationText(head.time_s)}</strong><small>at 100 %</small></div>
        <div><strong>{(head.cut_mm / 1000).toFixed(1)} m</strong><small>cut</small></div>
        <div><strong>{(head.rapid_mm / 1000).toFixed(1)} m</strong><small>rapid</small></div>
      </div>
      {head.message && <p class="warn" data-test="plan-message">{programName(head.message)}</p>}
      <Legend plan={plan} mode={mode} />
      <h2>What limits, of the time</h2>
      <Limits plan={plan} />
      <h2>{outside.length ? `Leaves the range of ${outside.map((joint) => joint.name).join(", ")}` : "Travel of each joint in its range"}</h2>
      <Ranges plan={plan} />
    </aside>
  );
}

const kKinds = ["velocity", "acceleration", "jerk"] as const;

/** What is at a point of the plan; or where the machine is now. */
function Readings({ plan, point }: { plan: Plan | null; point: number }) {
  const { status, motion, program } = useLink("status", "motion", "program");
  const inch = status?.inch ?? false;
  if (!status && !plan) return null;
  if (!plan || point < 0) {
    return (
      <div class="readings">
        {status && <><span>Line <strong data-test="path-line">{status.line || "–"}</strong></span>
        <span><strong>{feedText(motion?.speed_mm_s ?? 0, inch)}</strong></span>
        <code>{status.block}</code></>}
        {plan && <small>Point at the path to see what happens there.</small>}
      </div>
    );
  }
  const line = plan.lines[point];
  const joint = plan.joints[point];
  const uses = kKinds.map((kind) => ({ kind, use: plan[kind][point] / kWhole })).sort((a, b) => b.use - a.use);
  return (
    <div class="readings" data-test="point">
      <span>Line <strong data-test="path-line">{line}</strong></span>
      <code>{program?.line(line) || "–"}</code>
      <span>{plan.rapid[point] ? "rapid" : <>asked <strong>{plan.feeds[point] > 0 ? feedText(plan.feeds[point], inch) : "–"}</strong></>}</span>
      <span>real <strong>{feedText(plan.speeds[point], inch)}</strong></span>
      <span data-test="limit">{joint === kNoJoint ? "no joint limits"
        : <><i class="dot" style={{ background: jointColour(joint) }} /><strong>{plan.head.joints[joint].name}</strong> limits: {percent(Math.min(1, uses[0].use))} of its {uses[0].kind}</>}</span>
      <span data-test="deviation">off <strong>{micrometres(plan.deviations[point])}</strong></span>
      <span>after <strong>{durationText(plan.times[point])}</strong></span>
    </div>
  );
}

const kStands: [Standpoint, string][] = [["iso", "3-D"], ["top", "Top"], ["front", "Front"], ["side", "Side"]];

export function Path() {
  const { plan, planState } = useLink("plan");
  const host = useRef<HTMLDivElement>(null);
  const scene = useRef<Scene | null>(null);
  const [mode, setMode] = useState<Colouring>("speed");
  const [rapids, setRapids] = useState(true);
  const [what, setWhat] = useState<"work" | "machine">("work");
  const [point, setPoint] = useState(-1);
  useEffect(() => {
    scene.current = new Scene(host.current!);
    scene.current.onPoint = setPoint;
    // For the test that measures frames.
    Object.assign(host.current!, { scene: scene.current });
    return () => scene.current?.end();
  }, []);
  useEffect(() => {
    setPoint(-1);
    scene.current?.setPlan(plan ? new PlanLines(plan, mode) : null);
    if (plan && !rapids) scene.current?.showRapids(false);
  }, [plan]);
  useEffect(() => scene.current?.colour(mode), [mode]);
  useEffect(() => scene.current?.showRapids(rapids), [rapids]);
  const look = (at: "work" | "machine", from: Standpoint) => {
    setWhat(at);
    scene.current?.fit(at, from);
  };
  return (
    <div class="path">
      <div class="scene" ref={host} data-test="scene" aria-label="The machine and the way of the tool in three dimensions" role="img" />
      <div class="tools">
        <div class="switch" role="group" aria-label="Colours">
          {kColourings.map((one) => (
            <button key={one.mode} aria-pressed={mode === one.mode} title={`Colours show ${one.hint}`} data-test={`colour-${one.mode}`}
              onClick={() => setMode(one.mode)}>{one.name}</button>
          ))}
        </div>
      </div>
      <div class="tools left">
        <button aria-pressed={what === "work"} data-test="fit-work" onClick={() => look("work", "iso")}>Work</button>
        <button aria-pressed={what === "machine"} data-test="fit-machine" onClick={() => look("machine", "iso")}>Machine</button>
        {kStands.slice(1).map(([from, name]) => <button key={from} onClick={() => look(what, from)}>{name}</button>)}
        <button aria-pressed={rapids} onClick={() => setRapids(!rapids)}>Rapids</button>
        <button onClick={clearTrail}>Clear trail</button>
      </div>
      {plan ? <PlanCard plan={plan} mode={mode} /> : planState.state !== "none" && (
        <aside class="card plan-card" data-test="plan-state">
          <p>{planState.state === "working" ? "The program is being planned." : planState.text || "There is no plan."}</p>
        </aside>
      )}
      <Readings plan={plan} point={point} />
    </div>
  );
}
