import { useEffect, useRef } from "preact/hooks";
import * as THREE from "three";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { link, useLink } from "./link";
import { kWords, type Machine } from "./model";

// Where the tool has been since the page was opened, in the work's coordinates, coloured by its speed.

const kTrailMax = 20000;
/** Pixels. */
const kTrailWidth = 2.5;
/** The trail is made anew at most that often; the tip moves with every frame. */
const kRedrawMs = 200;
/** mm; a nearer place adds nothing to see. */
const kTrailStep = 0.02;

const trail = { count: 0, points: new Float32Array(kTrailMax * 3), speeds: new Float32Array(kTrailMax), drawn: 0 };

function trailBox(): THREE.Box3 {
  const box = new THREE.Box3();
  const point = new THREE.Vector3();
  for (let i = 0; i < trail.count; ++i) box.expandByPoint(point.fromArray(trail.points, i * 3));
  return box;
}

function clearTrail() {
  trail.count = 0;
  trail.drawn++;
}

link.on("motion", () => {
  const motion = link.motion!;
  const [x, y, z] = motion.work;
  const at = trail.count * 3;
  const last = trail.points.subarray(at - 3, at);
  if (trail.count && Math.hypot(x - last[0], y - last[1], z - last[2]) < kTrailStep) return;
  if (trail.count === kTrailMax) {
    // The older half goes, so that this happens seldom.
    trail.points.copyWithin(0, (kTrailMax / 2) * 3);
    trail.speeds.copyWithin(0, kTrailMax / 2);
    trail.count = kTrailMax / 2;
  }
  trail.points.set([x, y, z], trail.count * 3);
  trail.speeds[trail.count++] = motion.speed_mm_s;
  trail.drawn++;
});

/** Range of the linear axes X, Y, Z in machine coordinates, where the joints bear their names. */
function rangeOf(machine: Machine): THREE.Box3 | null {
  const joints = [0, 1, 2].map((word) => machine.joints.find((one) => one.name === kWords[word] && one.unit === "mm"));
  if (joints.some((joint) => !joint)) return null;
  const corner = (key: "min" | "max") => new THREE.Vector3(...joints.map((joint) => joint![key]) as [number, number, number]);
  return new THREE.Box3(corner("min"), corner("max"));
}

/** The tip. The tool's direction in the work's coordinates takes the machine's kinematics, which the page has not. */
function tipMark(): THREE.Group {
  const group = new THREE.Group();
  const ball = new THREE.Mesh(new THREE.SphereGeometry(0.45, 32, 16), new THREE.MeshStandardMaterial({ color: 0xff8a3c, roughness: 0.4 }));
  const halo = new THREE.Mesh(new THREE.SphereGeometry(0.95, 32, 16), new THREE.MeshBasicMaterial({ color: 0xff8a3c, transparent: true, opacity: 0.22, depthWrite: false }));
  group.add(ball, halo);
  return group;
}

class View {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(38, 1, 0.1, 20000);
  private readonly orbit: OrbitControls;
  private readonly line: Line2;
  /** Until the operator turns the view, it follows what is cut. */
  private follows = true;
  private seen = new THREE.Box3();
  private readonly tip = tipMark();
  private readonly grid = new THREE.GridHelper(1, 20, 0x7d8b99, 0x7d8b99);
  private range: THREE.LineSegments | null = null;
  private drawn = -1;
  private drawnAt = 0;
  private frame = 0;
  private readonly sizes: ResizeObserver;

  constructor(private readonly host: HTMLElement) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    host.append(this.renderer.domElement);
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, this.renderer.domElement);
    this.orbit.addEventListener("start", () => (this.follows = false));
    this.line = new Line2(new LineGeometry(), new LineMaterial({ vertexColors: true, linewidth: kTrailWidth }));
    this.grid.rotation.x = Math.PI / 2;
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.22;
    this.line.frustumCulled = false;
    const sun = new THREE.DirectionalLight(0xffffff, 2.2);
    sun.position.set(1, -2, 3);
    this.scene.add(this.line, this.tip, sun, new THREE.AmbientLight(0xffffff, 1.1), new THREE.AxesHelper(25), this.grid);
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(host);
    this.fit();
    this.draw();
  }

  end() {
    cancelAnimationFrame(this.frame);
    this.sizes.disconnect();
    this.orbit.dispose();
    this.line.geometry.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }

  /** Looks at what has been cut; at the machine's range where that is nothing. */
  fit() {
    this.follows = true;
    const box = trailBox();
    const range = link.machine && rangeOf(link.machine);
    const little = box.isEmpty() || box.getSize(new THREE.Vector3()).length() < 1;
    if (little) box.copy(range ?? new THREE.Box3(new THREE.Vector3(-100, -100, -100), new THREE.Vector3(100, 100, 100)));
    this.seen.copy(box);
    const centre = box.getCenter(new THREE.Vector3());
    const extent = box.getSize(new THREE.Vector3());
    const size = Math.max(extent.length(), 20);
    this.orbit.target.copy(centre);
    this.camera.position.copy(centre).add(new THREE.Vector3(0.7, -1.1, 0.75).normalize().multiplyScalar(size * 1.5));
    this.camera.near = size / 500;
    this.camera.far = size * 100;
    this.camera.updateProjectionMatrix();
    this.grid.position.set(centre.x, centre.y, box.min.z);
    this.grid.scale.setScalar(Math.max(extent.x, extent.y, size / 3) * 1.4);
  }

  private resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  private colour() {
    if (trail.count < 2) {
      this.line.visible = false;
      return;
    }
    let top = 1;
    for (let i = 0; i < trail.count; ++i) top = Math.max(top, trail.speeds[i]);
    const colours = new Float32Array(trail.count * 3);
    const colour = new THREE.Color();
    for (let i = 0; i < trail.count; ++i) {
      // Blue stands for slow, yellow for the fastest of the trail.
      colour.setHSL(0.62 - 0.48 * (trail.speeds[i] / top), 0.8, 0.52).toArray(colours, i * 3);
    }
    this.line.geometry.dispose();
    this.line.geometry = new LineGeometry();
    this.line.geometry.setPositions(trail.points.subarray(0, trail.count * 3));
    this.line.geometry.setColors(colours);
    this.line.visible = true;
    if (this.follows && !this.seen.containsBox(trailBox())) this.fit();
  }

  private place() {
    const { status, motion, machine } = link;
    if (motion) this.tip.position.fromArray(motion.work);
    this.tip.scale.setScalar(this.camera.position.distanceTo(this.tip.position) / 60);
    if (!this.range && machine) {
      const box = rangeOf(machine);
      if (box) {
        const size = box.getSize(new THREE.Vector3());
        const edges = new THREE.EdgesGeometry(new THREE.BoxGeometry(size.x, size.y, size.z));
        this.range = new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ color: 0x7d8b99, transparent: true, opacity: 0.55 }));
        this.scene.add(this.range);
        if (!trail.count) this.fit();
      }
    }
    // With the tip followed on a turning table the range is no box in the work's coordinates.
    if (!this.range || !motion || !status) return;
    this.range.visible = !status.rtcp && status.rotation_rad === 0;
    rangeOf(machine!)!.getCenter(this.range.position);
    for (const i of [0, 1, 2]) {
      const offset = motion.machine[i] - motion.work[i];
      this.range.position.setComponent(i, this.range.position.getComponent(i) - offset);
    }
  }

  private draw() {
    this.frame = requestAnimationFrame(() => this.draw());
    const now = performance.now();
    if (this.drawn !== trail.drawn && now - this.drawnAt > kRedrawMs) {
      this.drawn = trail.drawn;
      this.drawnAt = now;
      this.colour();
    }
    this.place();
    this.orbit.update();
    this.renderer.render(this.scene, this.camera);
  }
}

function Readings() {
  const { status, motion } = useLink("status", "motion");
  if (!status || !motion) return null;
  return (
    <div class="readings">
      <span>Line <strong data-test="path-line">{status.line || "–"}</strong></span>
      <span>Speed <strong>{(motion.speed_mm_s * 60).toFixed(0)}</strong> mm/min</span>
      <code>{status.block}</code>
    </div>
  );
}

export function Path() {
  const host = useRef<HTMLDivElement>(null);
  const view = useRef<View | null>(null);
  useEffect(() => {
    view.current = new View(host.current!);
    return () => view.current?.end();
  }, []);
  return (
    <div class="path">
      <div class="scene" ref={host} data-test="scene" aria-label="The way of the tool in three dimensions" role="img" />
      <div class="tools">
        <button onClick={() => view.current?.fit()}>Show all</button>
        <button onClick={clearTrail}>Clear trail</button>
        <span class="scale"><i /> slow to fast</span>
      </div>
      <Readings />
    </div>
  );
}
