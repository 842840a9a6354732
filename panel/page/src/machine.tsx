import { link, useLink } from "./link";
import { fixed, positionText, type Status, unitText } from "./model";

// What the machine tells of itself: joints, timing, bus, corrections, and what the cutter does.

function Joints() {
  const { status, motion, machine } = useLink("status", "motion", "machine");
  if (!status || !motion || !machine) return <section class="card" />;
  return (
    <section class="card wide">
      <h2>Joints</h2>
      <table class="rows joints">
        <thead><tr><th scope="col">Joint</th><th scope="col">Measured</th><th scope="col">Behind the setpoint</th>
          <th scope="col" class="text">Place in its range</th><th scope="col" class="text">State</th></tr></thead>
        <tbody>
          {machine.joints.map((joint, i) => {
            const angle = joint.unit === "rad";
            const q = motion.q_measured[i] ?? 0;
            const behind = (motion.q_setpoint[i] ?? q) - q;
            const at = Math.max(0, Math.min(1, (q - joint.min) / (joint.max - joint.min)));
            const state = status.joints[i];
            return (
              <tr key={joint.name}>
                <th scope="row"><span>{joint.name}</span></th>
                <td class="strong">{positionText(q, angle, status.inch)} {unitText(angle, status.inch)}</td>
                <td>{angle ? `${fixed((behind * 180) / Math.PI, 4)}°` : `${fixed(behind * 1e3, 1)} µm`}</td>
                <td class="text"><b class="track"><i style={{ left: `${100 * at}%` }} /></b></td>
                <td class="text">{state?.limit_switch ? "on its switch" : state?.homed ? "homed" : "not homed"}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </section>
  );
}

/** A lateness or duration against the period. */
function Share({ name, us, period_us }: { name: string; us: number; period_us: number }) {
  const share = us / period_us;
  return (
    <li class={share > 0.5 ? "outside" : ""}>
      <span>{name}</span>
      <b><i style={{ width: `${Math.min(100, Math.max(0.5, 100 * share))}%` }} /></b>
      <em>{us.toFixed(us < 10 ? 1 : 0)} µs</em>
    </li>
  );
}

function Timing() {
  const { status } = useLink("status");
  if (!status) return <section class="card" />;
  const period_us = status.period_s * 1e6;
  return (
    <section class="card" data-test="timing">
      <h2>Timing of the tick <small>period {(status.period_s * 1e3).toFixed(3)} ms</small></h2>
      <h3>Begins late by</h3>
      <ul class="bars">
        <Share name="median" us={status.wake_us_p50} period_us={period_us} />
        <Share name="99.9 %" us={status.wake_us_p999} period_us={period_us} />
        <Share name="worst" us={status.wake_us_max} period_us={period_us} />
      </ul>
      <h3>Takes</h3>
      <ul class="bars">
        <Share name="median" us={status.tick_us_p50} period_us={period_us} />
        <Share name="99.9 %" us={status.tick_us_p999} period_us={period_us} />
        <Share name="worst" us={status.tick_us_max} period_us={period_us} />
      </ul>
      <dl class="pairs-list">
        <div><dt>Ticks</dt><dd>{status.periods.toLocaleString("en")}</dd></div>
        <div><dt>Late or too long</dt><dd>{status.overruns.toLocaleString("en")}</dd></div>
        <div><dt>Planner came too late</dt><dd>{status.starvations}</dd></div>
        <div><dt>Real-time rights</dt><dd>{status.realtime ? "as configured" : "not granted"}</dd></div>
      </dl>
    </section>
  );
}

function Bus() {
  const { status } = useLink("status");
  return (
    <section class="card" data-test="bus">
      <h2>Drives' bus</h2>
      <p class={status?.bus_health ? "health" : "none"}>{status?.bus_health || "The drives of this machine are on no bus."}</p>
    </section>
  );
}

function Corrections() {
  const { status, mine } = useLink("status", "link");
  const list = status?.corrections ?? [];
  return (
    <section class="card" data-test="corrections">
      <h2>Corrections</h2>
      {!list.length && <p class="none">This machine has none.</p>}
      {list.length > 0 && (
        <table class="rows">
          <thead><tr><th scope="col">Correction</th><th scope="col">Adds now, at most</th><th scope="col">On</th></tr></thead>
          <tbody>
            {list.map((one) => (
              <tr key={one.name}>
                <th scope="row"><span>{one.name.replace(/_/g, " ")}</span>{one.warning && <small class="warn">{one.warning}</small>}</th>
                <td>{one.offset ? `${(one.offset * 1e3).toFixed(2)} µm or mrad` : "in the plan"}</td>
                <td><button class="toggle" role="switch" aria-checked={one.on} disabled={!mine} aria-label={`${one.name} on`}
                  onClick={() => void link.command({ verb: "correction", text: one.name, value: one.on ? 0 : 1 })}><i /></button></td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}

function ToolLoad() {
  const { motion } = useLink("motion");
  if (!motion?.tool_load_known) return null;
  const [fx, fy] = motion.tool_force_N, [dx, dy] = motion.tool_deflection_mm;
  return (
    <section class="card" data-test="tool-load">
      <h2>Load of the tool</h2>
      <div class="figures">
        <div class="figure"><span>Force</span><div><strong>{Math.hypot(fx, fy).toFixed(2)}</strong><small>N</small></div></div>
        <div class="figure"><span>Tip bends by</span><div><strong>{(1e3 * Math.hypot(dx, dy)).toFixed(1)}</strong><small>µm</small></div></div>
      </div>
      <p class="none">X {fx.toFixed(2)} N, Y {fy.toFixed(2)} N</p>
      {motion.tool_load_alarm && <p class="warn">The model of the load no longer fits the stage.</p>}
    </section>
  );
}

function Features({ status }: { status: Status }) {
  if (!status.features?.length) return null;
  const um = (value: number) => `${fixed(1e3 * value, 1)} µm`;
  return (
    <section class="card wide" data-test="features">
      <h2>What the bending of the tool made of the last program</h2>
      <table class="rows">
        <thead><tr><th scope="col">Lines</th><th scope="col" class="text">Shape</th><th scope="col">Size</th><th scope="col">Bending</th>
          <th scope="col">Left</th><th scope="col">Made</th></tr></thead>
        <tbody>
          {status.features.map((one) => (
            <tr key={`${one.line}-${one.last_line}`}>
              <th scope="row"><span>{one.line}–{one.last_line}</span></th>
              <td class="text">{one.circle ? "circle" : "straight cut"}</td>
              <td>{one.size_mm.toFixed(3)} mm</td><td>{um(one.bending_mm)}</td><td>{um(one.offset_mm)}</td>
              <td>{one.predicted_mm.toFixed(4)} mm</td>
            </tr>
          ))}
        </tbody>
      </table>
      {status.features_more > 0 && <p class="none">And {status.features_more} more, in the session's log.</p>}
    </section>
  );
}

export function MachineView() {
  const { status, machine } = useLink("status", "machine");
  return (
    <div class="machine">
      <Joints />
      <Timing />
      <Corrections />
      <Bus />
      <ToolLoad />
      {status && <Features status={status} />}
      <section class="card">
        <h2>Config</h2>
        <p class="file">{status?.config_file || machine?.config_path}</p>
        <p class="none">Process {status?.pid}, {machine?.joints.length} joints, axes {status?.axes}</p>
      </section>
    </div>
  );
}
