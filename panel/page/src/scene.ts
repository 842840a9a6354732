import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { link } from "./link";
import { kHolder, type MachineModel, makeModel, makeTool } from "./machine_model";
import { dress } from "./machine_drawings";
import type { Colouring } from "./plan";
import { PlanLines } from "./plan_lines";

// The machine, the plan and the way of the tip in three dimensions. The work lies in the table frame: plan and trail stand
// on the table and move with it.

const kTrailMax = 12000;
/** Pixels. */
const kTrailWidth = 2;
/** mm; a nearer place adds nothing to see. */
const kTrailStep = 0.05;
/** The trail is made anew at most that often; the tip moves with every frame. */
const kRedrawMs = 250;
/** Pixels around the pointer in which a point of the plan is found. */
const kReach = 16;
const kTrailColour = 0xff8a3c;

let model: MachineModel | null = null;
const tool = new THREE.Group();
let toolOf = "";

/** The machine is one, whether a view shows it or not: its trail goes on. */
function currentModel(): MachineModel | null {
  if (!model && link.machine?.kinematics) {
    model = makeModel(link.machine);
    void dress(model, link.machine);
    model.spindle.add(tool);
  }
  return model;
}

function tipInTable(): THREE.Vector3 | null {
  const { motion, status } = link;
  const machine = currentModel();
  if (!motion || !status || !machine) return null;
  machine.place(motion);
  machine.root.updateMatrixWorld(true);
  const tip = machine.spindle.localToWorld(new THREE.Vector3(...status.tool_offset.slice(0, 3)).negate());
  return machine.table.worldToLocal(tip);
}

const trail = { count: 0, points: new Float32Array(kTrailMax * 3), version: 0, tool: "" };

export function clearTrail() {
  trail.count = 0;
  trail.version++;
}

link.on("motion", () => {
  const tip = tipInTable();
  if (!tip) return;
  // Another tool length moves the tip on paper only.
  const length = link.status!.tool_offset.slice(0, 3).join(" ");
  if (length !== trail.tool) clearTrail();
  trail.tool = length;
  const last = trail.count ? new THREE.Vector3().fromArray(trail.points, 3 * (trail.count - 1)) : null;
  if (last && tip.distanceTo(last) < kTrailStep) return;
  if (trail.count === kTrailMax) {
    // The older half goes, so that this happens seldom.
    trail.points.copyWithin(0, (kTrailMax / 2) * 3);
    trail.count = kTrailMax / 2;
  }
  tip.toArray(trail.points, 3 * trail.count++);
  trail.version++;
});

function updateTool(unit: number) {
  const { status } = link;
  if (!status) return;
  const wanted = `${status.tool_offset[2]} ${status.tool_radius_mm}`;
  if (wanted === toolOf) return;
  toolOf = wanted;
  tool.clear();
  tool.add(makeTool(unit, status.tool_offset[2], status.tool_radius_mm));
}

/** Without a graphics card smooth edges would cost every third frame. */
function drawsBySoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && names ? String(gl.getParameter(names.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software/i.test(name);
}

export type Standpoint = "iso" | "top" | "front" | "side";
const kStandpoints: Record<Standpoint, [number, number, number]> = {
  iso: [0.42, -1.2, 0.78], top: [0, -0.001, 1], front: [0, -1, 0.06], side: [1, 0, 0.06],
};

/** What a renderer keeps of an object, and a listener there that would keep the renderer: materials outlive a view. */
function free(one: THREE.Object3D) {
  const { geometry, material } = one as Partial<THREE.Mesh>;
  geometry?.dispose();
  for (const each of material ? [material].flat() : []) each.dispose();
}

export class Scene {
  /** Called when the pointer is at a point of the plan; -1: at none. */
  onPoint: (point: number) => void = () => undefined;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(34, 1, 0.1, 20000);
  private readonly orbit: OrbitControls;
  private readonly rootFrame = new THREE.Group();
  private readonly trailLine: Line2;
  private readonly mark: THREE.Mesh;
  private lines: PlanLines | null = null;
  private shown: MachineModel | null = null;
  private showsMachine = false;
  private readonly grid = new THREE.GridHelper(1, 20, 0x7d8b99, 0x7d8b99);
  private readonly zero = new THREE.AxesHelper(1);
  private readonly themes: MutationObserver;
  private dirty = true;
  private drawnTrail = -1;
  private trailAt = 0;
  private frame = 0;
  private pointer: { x: number; y: number } | null = null;
  private readonly sizes: ResizeObserver;
  private readonly ends: (() => void)[];

  constructor(private readonly host: HTMLElement) {
    this.renderer = new THREE.WebGLRenderer({ antialias: !drawsBySoftware(), powerPreference: "high-performance" });
    host.append(this.renderer.domElement);
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, this.renderer.domElement);
    this.orbit.addEventListener("change", () => (this.dirty = true));
    this.trailLine = new Line2(new LineGeometry(), new LineMaterial({ color: kTrailColour, linewidth: kTrailWidth }));
    this.trailLine.frustumCulled = false;
    this.trailLine.visible = false;
    this.mark = new THREE.Mesh(new THREE.SphereGeometry(1, 20, 12), new THREE.MeshBasicMaterial({ color: 0xffffff, depthTest: false, transparent: true }));
    this.mark.visible = false;
    this.mark.renderOrder = 2;
    this.scene.add(this.rootFrame);
    this.grid.rotation.x = Math.PI / 2;
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.28;
    this.grid.visible = this.zero.visible = false;
    this.themes = new MutationObserver(() => this.ground());
    this.themes.observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
    this.ground();
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(host);
    this.ends = [link.on("motion", () => this.moved()), link.on("status", () => this.moved()), link.on("machine", () => this.moved())];
    host.addEventListener("pointermove", (event) => this.point(event));
    host.addEventListener("pointerdown", (event) => this.point(event));
    host.addEventListener("pointerleave", (event) => event.pointerType === "mouse" && this.leave());
    this.resize();
    this.moved();
    this.fit("work", "iso");
    this.draw();
  }

  end() {
    cancelAnimationFrame(this.frame);
    this.ends.forEach((end) => end());
    this.sizes.disconnect();
    this.themes.disconnect();
    this.orbit.dispose();
    this.lines?.dispose();
    this.scene.traverse(free);
    this.shown?.table.remove(...this.onTable());
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }

  setPlan(lines: PlanLines | null) {
    if (this.lines) {
      this.lines.group.removeFromParent();
      this.lines.dispose();
    }
    this.lines = lines;
    this.mark.visible = false;
    if (lines) (this.shown?.table ?? this.rootFrame).add(lines.group);
    this.dirty = true;
    this.fit("work", "iso");
  }

  colour(mode: Colouring) {
    this.lines?.colour(mode);
    this.dirty = true;
  }

  showRapids(on: boolean) {
    this.lines?.showRapids(on);
    this.dirty = true;
  }

  /** An opaque picture is put under the rest of the page at less cost than one that lets the page through. */
  private ground() {
    this.renderer.setClearColor(new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue("--card").trim()));
    this.dirty = true;
  }

  /** The work's zero, and a grid below the work. */
  private placeMarks() {
    const { status } = link;
    const box = this.lines?.plan.head.box;
    this.grid.visible = this.zero.visible = !!box;
    if (!box || !status || !this.shown) return;
    const size = Math.max(box[1][0] - box[0][0], box[1][1] - box[0][1], 1) * 1.5;
    this.grid.position.set((box[0][0] + box[1][0]) / 2, (box[0][1] + box[1][1]) / 2, box[0][2]);
    this.grid.scale.setScalar(size);
    const [x, y, z] = status.work_offset_value.map((value, i) => value + status.g92[i]);
    this.zero.position.copy(this.shown.zero).add(new THREE.Vector3(x, y, z));
    this.zero.rotation.z = status.rotation_rad;
    this.zero.scale.setScalar(size / 8);
  }

  /** Looks at the work, or at the whole machine. */
  fit(what: "work" | "machine", from: Standpoint) {
    this.showsMachine = what === "machine" || !this.lines;
    this.moved();
    const box = new THREE.Box3();
    this.rootFrame.updateMatrixWorld(true);
    const plan = this.lines?.plan.head.box;
    if (what === "work" && plan && this.lines) {
      box.set(new THREE.Vector3(...plan[0]), new THREE.Vector3(...plan[1])).expandByScalar(2);
      box.applyMatrix4(this.lines.group.matrixWorld);
    } else if (this.shown) {
      const visible = this.shown.root.visible;
      box.setFromObject(this.shown.root);
      this.shown.root.visible = visible;
    }
    if (box.isEmpty()) box.set(new THREE.Vector3(-150, -150, -150), new THREE.Vector3(150, 150, 150));
    const centre = box.getCenter(new THREE.Vector3());
    const radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1);
    const narrow = Math.min(1, this.camera.aspect);
    const away = (radius * (what === "work" ? 1.02 : 0.86)) / Math.sin(THREE.MathUtils.degToRad(this.camera.fov / 2)) / narrow;
    this.orbit.target.copy(centre);
    this.camera.position.copy(centre).add(new THREE.Vector3(...kStandpoints[from]).normalize().multiplyScalar(away));
    this.camera.near = radius / 200;
    this.camera.far = away + radius * 60;
    this.camera.updateProjectionMatrix();
    this.orbit.update();
    this.dirty = true;
  }

  /** One turn about the work, as fast as the computer can; frames a second. */
  async measure(seconds: number): Promise<{ frames: number; lines: number }> {
    const begin = performance.now();
    let frames = 0;
    const offset = this.camera.position.clone().sub(this.orbit.target);
    while (performance.now() - begin < seconds * 1000) {
      const turn = ((performance.now() - begin) / (seconds * 1000)) * 2 * Math.PI;
      this.camera.position.copy(this.orbit.target).add(offset.clone().applyAxisAngle(new THREE.Vector3(0, 0, 1), turn));
      this.orbit.update();
      this.dirty = true;
      await new Promise((done) => requestAnimationFrame(done));
      frames += 1;
    }
    return { frames: frames / ((performance.now() - begin) / 1000), lines: this.lines?.drawn() ?? 0 };
  }

  /** How many colours the picture has, on a coarse grid: for tests, which must not take an empty one for good. */
  colours(): number {
    const gl = this.renderer.getContext();
    this.renderer.render(this.scene, this.camera);
    const seen = new Set<number>();
    const pixel = new Uint8Array(4);
    for (let x = 0; x < gl.drawingBufferWidth; x += 16)
      for (let y = 0; y < gl.drawingBufferHeight; y += 16) {
        gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        seen.add((pixel[0] << 16) | (pixel[1] << 8) | pixel[2]);
      }
    return seen.size;
  }

  private onTable(): THREE.Object3D[] {
    return [this.trailLine, this.mark, this.grid, this.zero, ...(this.lines ? [this.lines.group] : [])];
  }

  private moved() {
    const machine = currentModel();
    if (machine && machine !== this.shown) {
      this.shown = machine;
      this.rootFrame.add(machine.root);
      machine.table.add(...this.onTable());
      return this.fit(this.lines ? "work" : "machine", "iso");
    }
    if (!machine) return;
    if (link.motion) machine.place(link.motion);
    this.placeMarks();
    updateTool(machine.unit);
    const own = new Set(this.onTable());
    machine.root.traverse((part) => {
      const mesh = part as THREE.Mesh;
      if (mesh.isMesh && !own.has(mesh)) mesh.visible = this.showsMachine || (tool === mesh.parent?.parent && mesh.name !== kHolder);
    });
    this.dirty = true;
  }

  private resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  private point(event: PointerEvent) {
    const box = this.host.getBoundingClientRect();
    this.pointer = { x: ((event.clientX - box.left) / box.width) * 2 - 1, y: 1 - ((event.clientY - box.top) / box.height) * 2 };
  }

  private leave() {
    this.pointer = null;
    this.mark.visible = false;
    this.dirty = true;
    this.onPoint(-1);
  }

  private find() {
    if (!this.pointer || !this.lines) return;
    const { x, y } = this.pointer;
    this.pointer = null;
    const found = this.lines.near(this.camera, x, y, this.host.clientWidth, this.host.clientHeight, kReach);
    if (found < 0) return;
    this.mark.position.fromArray(this.lines.plan.places, 3 * found);
    this.mark.visible = true;
    this.dirty = true;
    this.onPoint(found);
  }

  private drawTrail() {
    const now = performance.now();
    if (this.drawnTrail === trail.version || now - this.trailAt < kRedrawMs) return;
    this.drawnTrail = trail.version;
    this.trailAt = now;
    this.trailLine.visible = trail.count > 1;
    this.dirty = true;
    if (trail.count < 2) return;
    this.trailLine.geometry.dispose();
    this.trailLine.geometry = new LineGeometry();
    this.trailLine.geometry.setPositions(trail.points.subarray(0, trail.count * 3));
  }

  private draw() {
    this.frame = requestAnimationFrame(() => this.draw());
    this.find();
    this.drawTrail();
    if (!this.dirty) return;
    this.dirty = false;
    this.rootFrame.updateMatrixWorld(true);
    this.camera.updateMatrixWorld(true);
    this.lines?.choose(this.camera, this.host.clientHeight);
    const away = this.camera.position.distanceTo(this.mark.getWorldPosition(new THREE.Vector3()));
    this.mark.scale.setScalar(away / 220);
    this.renderer.render(this.scene, this.camera);
  }
}
