import * as THREE from "three";
import { type Chain, type Machine, type Motion, type PlatformChain, type SerialChain } from "./model";
import { PartMaterial } from "./shading";

// The machine as its config describes it, in the base frame; mm. The axes, legs and rails stand where they are; the
// castings around them are only drawn so that one knows the machine at once.

export interface MachineModel {
  /** Castings and axes, with the table and the spindle in their places. */
  readonly root: THREE.Group;
  /** The table frame, which carries the work. */
  readonly table: THREE.Object3D;
  /** The spindle's gauge point; the tool points to its -Z. */
  readonly spindle: THREE.Object3D;
  /** A length that fits the machine: a tenth of its way, about. */
  readonly unit: number;
  /** Where the gauge point lies in the table frame with every word at zero: the zero of machine coordinates. */
  readonly zero: THREE.Vector3;
  place(motion: Motion): void;
  /** What a joint of a chain of axes moves; null: none. */
  ofJoint(joint: number): THREE.Object3D | null;
}

type Vec = [number, number, number];
const vector = (v: Vec) => new THREE.Vector3(...v);
const kZ = new THREE.Vector3(0, 0, 1);

const metal = (color: number) => new PartMaterial(color);
const kParts = {
  casting: metal(0x8a9bab), slide: metal(0xc0ccd6), rail: metal(0x46535f), table: metal(0xdbe3ea),
  turning: metal(0x22a396), leg: metal(0xdfe6ec), joint: metal(0x3d4a56), spindle: metal(0xb7c4d0), rod: metal(0xe8b04a),
};
/** Degrees between two faces, from which on their edge is drawn. */
const kEdgeAngle = 35;

/** With its edges, as on a drawing. */
export function edged(mesh: THREE.Mesh<THREE.BufferGeometry, PartMaterial>): THREE.Mesh {
  mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(mesh.geometry, kEdgeAngle), mesh.material.edges));
  return mesh;
}
export type Part = keyof typeof kParts;

function box(part: Part, size: Vec, at: Vec = [0, 0, 0]): THREE.Mesh {
  const mesh = new THREE.Mesh(new THREE.BoxGeometry(...size), kParts[part]);
  mesh.position.set(...at);
  return edged(mesh);
}

/** A cylinder along an axis. */
function round(part: Part, radius: number, length: number, axis: THREE.Vector3, at = new THREE.Vector3()): THREE.Mesh {
  const mesh = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, length, 40), kParts[part]);
  mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), axis.clone().normalize());
  mesh.position.copy(at);
  return edged(mesh);
}

/** A rod between two places that move. */
class Rod {
  readonly mesh: THREE.Mesh;
  constructor(part: Part, radius: number) {
    this.mesh = round(part, radius, 1, new THREE.Vector3(0, 1, 0));
  }
  between(from: THREE.Vector3, to: THREE.Vector3) {
    const way = to.clone().sub(from);
    this.mesh.position.copy(from).addScaledVector(way, 0.5);
    this.mesh.scale.set(1, Math.max(way.length(), 1e-3), 1);
    this.mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.normalize());
  }
}

/** A box from one corner to the other, along a horizontal axis `h` (0: X, 1: Y) and the other one. */
function beam(part: Part, h: number, along: [number, number], across: [number, number], z: [number, number]): THREE.Mesh {
  const size: Vec = [0, 0, z[1] - z[0]], at: Vec = [0, 0, (z[0] + z[1]) / 2];
  size[h] = along[1] - along[0];
  size[1 - h] = across[1] - across[0];
  at[h] = (along[0] + along[1]) / 2;
  at[1 - h] = (across[0] + across[1]) / 2;
  return box(part, size, at);
}

function spindleNose(unit: number): THREE.Mesh {
  const nose = new THREE.Mesh(new THREE.CylinderGeometry(unit * 0.3, unit * 0.17, unit * 0.22, 40), kParts.rail);
  nose.rotation.x = Math.PI / 2;
  nose.position.z = unit * 0.1;
  return nose;
}

function motorSpindle(unit: number): THREE.Group {
  const group = new THREE.Group();
  group.add(round("spindle", unit * 0.36, unit * 1.5, kZ, new THREE.Vector3(0, 0, unit * 0.95)));
  group.add(spindleNose(unit));
  return group;
}

interface Moved {
  group: THREE.Group;
  joint: number;
  rotary: boolean;
  direction: THREE.Vector3;
}

/** Spindle and table on chains of axes. */
class SerialModel implements MachineModel {
  readonly root = new THREE.Group();
  readonly table: THREE.Object3D;
  readonly spindle: THREE.Object3D;
  readonly unit: number;
  readonly zero = new THREE.Vector3();
  private readonly moved: Moved[] = [];
  /** The ram ends in its guide: what is above that is not drawn. */
  private ram: { mesh: THREE.Mesh; group: THREE.Object3D; from: number; top: number } | null = null;

  constructor(private readonly machine: Machine, private readonly chain: SerialChain) {
    const ways = [...chain.tool, ...chain.work].filter((axis) => axis.kind === "linear" && Math.abs(axis.direction![2]) < 0.5)
      .map((axis) => this.range(axis.joint)[1] - this.range(axis.joint)[0]);
    this.unit = ways.length ? Math.min(...ways) / 6.4 : 50;
    for (const axis of chain.tool) this.zero.add(vector(axis.offset_mm));
    for (const axis of chain.work) this.zero.sub(vector(axis.offset_mm));
    this.spindle = this.walk(chain.tool, this.root);
    const turn = vector(chain.spindle_turn_rad);
    this.spindle.quaternion.setFromAxisAngle(turn.clone().normalize(), turn.length());
    this.table = this.walk(chain.work, this.root);
    this.build();
  }

  place(motion: Motion) {
    for (const { group, joint, rotary, direction } of this.moved) {
      const q = motion.q_measured[joint] ?? 0;
      if (rotary) group.quaternion.setFromAxisAngle(direction, q);
      else group.position.copy(direction).multiplyScalar(q);
    }
    if (!this.ram) return;
    const { mesh, group, from, top } = this.ram;
    const length = Math.max(top - group.position.z - from, this.unit * 0.2);
    mesh.scale.z = length;
    mesh.position.z = from + length / 2;
  }

  ofJoint(joint: number) {
    return this.moved.find((one) => one.joint === joint)?.group ?? null;
  }

  private range(joint: number): [number, number] {
    const { min, max } = this.machine.joints[joint];
    return [Math.max(min, -2000), Math.min(max, 2000)];
  }

  /** Groups within groups, from the base outwards; the last one is what the branch carries. */
  private walk(branch: SerialChain["tool"], base: THREE.Object3D): THREE.Group {
    let at: THREE.Object3D = base;
    for (const axis of branch) {
      const offset = new THREE.Group();
      offset.position.set(...axis.offset_mm);
      at.add(offset);
      at = offset;
      if (axis.joint < 0) continue;
      const group = new THREE.Group();
      at.add(group);
      this.moved.push({ group, joint: axis.joint, rotary: axis.kind === "rotary", direction: vector(axis.direction!).normalize() });
      at = group;
    }
    const end = new THREE.Group();
    at.add(end);
    return end;
  }

  private find(branch: SerialChain["tool"], test: (d: Vec, rotary: boolean) => boolean) {
    return branch.filter((axis) => axis.joint >= 0 && test(axis.direction!, axis.kind === "rotary"))
      .map((axis) => ({ axis, group: this.moved.find((one) => one.joint === axis.joint)!.group }));
  }

  private build() {
    const u = this.unit;
    const { tool, work } = this.chain;
    const level = (d: Vec, rotary: boolean) => !rotary && Math.abs(d[2]) < 0.5;
    const upright = (d: Vec, rotary: boolean) => !rotary && Math.abs(d[2]) >= 0.5;
    const across = this.find(tool, level), up = this.find(tool, upright), turns = this.find(tool, (_, rotary) => rotary);
    const below = this.find(work, level), tables = this.find(work, (_, rotary) => rotary);
    const zRange: [number, number] = up.length ? this.range(up[0].axis.joint) : [-u, u];
    const tableZ = work.reduce((z, axis) => z + axis.offset_mm[2], 0);
    const bed = tables.length > 1 ? -u * 2.9 : tables.length ? tableZ - u * 0.9 : work.length ? -u * 1.2 : zRange[0] - u * 0.6;
    const head = turns.length ? u * 2.4 : u * 1.7;
    const top = zRange[1] + head;
    this.buildTool(across, up, turns, bed, top, head);
    this.buildWork(below, tables, bed);
  }

  // The way to the spindle: a gantry where two axes carry it, a portal where one does, a column where none does.
  private buildTool(across: ReturnType<SerialModel["find"]>, up: ReturnType<SerialModel["find"]>,
    turns: ReturnType<SerialModel["find"]>, bed: number, top: number, head: number) {
    const u = this.unit, thick = u * 0.9;
    const ram = up.length ? up[0].group : this.root;
    const h = (one: { axis: SerialChain["tool"][0] }) => (Math.abs(one.axis.direction![0]) > 0.5 ? 0 : 1);
    if (across.length >= 2) {
      const [first, second] = across;
      const far = this.range(first.axis.joint), near = this.range(second.axis.joint);
      const along: [number, number] = [far[0] - u, far[1] + u];
      for (const side of [near[0] - u * 1.3, near[1] + u * 1.3]) {
        const broad: [number, number] = [side - thick * 0.32, side + thick * 0.32];
        for (const end of along) {
          const inwards = end < 0 ? end + thick * 0.7 : end - thick * 0.7;
          this.root.add(beam("casting", h(first), [Math.min(end, inwards), Math.max(end, inwards)], broad, [bed - u * 0.5, top - thick * 0.25]));
        }
        this.root.add(beam("casting", h(first), along, broad, [top - thick * 0.8, top - thick * 0.2]));
        this.root.add(beam("rail", h(first), along, [side - u * 0.12, side + u * 0.12], [top - thick * 0.2, top]));
      }
      first.group.add(beam("slide", 1 - h(first), [near[0] - u * 1.7, near[1] + u * 1.7], [-thick * 0.7, thick * 0.1], [top, top + thick * 1.1]));
      first.group.add(beam("rail", 1 - h(first), [near[0] - u * 1.2, near[1] + u * 1.2], [thick * 0.1, thick * 0.2], [top + thick * 0.3, top + thick * 0.8]));
      second.group.add(beam("casting", 1 - h(first), [-u * 0.75, u * 0.75], [thick * 0.2, thick * 0.85], [top - u * 0.25, top + thick * 1.3]));
      this.addRam(ram, head, top);
      return this.addHead(turns);
    }
    if (across.length === 1) {
      const [first] = across;
      const way = this.range(first.axis.joint);
      for (const side of [way[0] - u * 1.3, way[1] + u * 1.3])
        this.root.add(beam("casting", h(first), [side - thick * 0.4, side + thick * 0.4], [u * 0.6, u * 1.7], [bed - u * 0.6, top + u * 1.2]));
      this.root.add(beam("casting", h(first), [way[0] - u * 1.7, way[1] + u * 1.7], [u * 0.7, u * 1.6], [top - u * 0.2, top + u * 1.2]));
      this.root.add(beam("rail", h(first), [way[0] - u, way[1] + u], [u * 0.6, u * 0.7], [top + u * 0.1, top + u * 0.9]));
      first.group.add(beam("slide", h(first), [-u * 0.7, u * 0.7], [u * 0.3, u * 0.6], [top - u * 0.4, top + u * 1.2]));
      this.addRam(ram, head, top);
      return this.addHead(turns);
    }
    // A column behind the work.
    this.root.add(beam("casting", 0, [-u * 1.3, u * 1.3], [u * 4.4, u * 6], [bed - u * 0.6, top + u * 1.5]));
    this.root.add(beam("casting", 0, [-u * 0.9, u * 0.9], [u * 0.6, u * 4.6], [top - u * 0.1, top + u * 1.3]));
    this.addRam(ram, head, top);
    this.addHead(turns);
  }

  private addRam(ram: THREE.Object3D, head: number, top: number) {
    const u = this.unit;
    const mesh = box("slide", [u * 0.85, u * 0.85, 1]);
    ram.add(mesh);
    this.ram = { mesh, group: ram, from: head - u * 0.3, top: top + u * 1.35 };
  }

  // Rotary axes above the spindle: a turret, and a fork that swivels the spindle.
  private addHead(turns: ReturnType<SerialModel["find"]>) {
    const u = this.unit;
    if (!turns.length && vector(this.chain.spindle_turn_rad).length() > 0) {
      this.addAngleHead();
      return;
    }
    if (!turns.length) {
      this.spindle.add(motorSpindle(u));
      return;
    }
    for (const { axis, group } of turns) {
      const direction = vector(axis.direction!);
      if (Math.abs(direction.z) > 0.5) {
        group.add(round("turning", u * 0.62, u * 0.5, kZ, new THREE.Vector3(0, 0, u * 1.95)));
        continue;
      }
      // The cheeks of the fork hang on what carries the axis; the bearing turns with it.
      const carrier = group.parent!;
      for (const side of [-1, 1]) {
        const at = direction.clone().multiplyScalar(side * u * 0.62);
        const cheek = box("casting", Math.abs(direction.x) > 0.5 ? [u * 0.3, u * 0.8, u * 2] : [u * 0.8, u * 0.3, u * 2]);
        cheek.position.copy(at).add(new THREE.Vector3(0, 0, u * 0.75));
        carrier.add(cheek);
        group.add(round("turning", u * 0.34, u * 0.14, direction, direction.clone().multiplyScalar(side * u * 0.84)));
      }
      carrier.add(box("casting", [u * 1.5, u * 1.5, u * 0.3], [0, 0, u * 1.7]));
      group.add(round("spindle", u * 0.44, u * 1, direction));
    }
    this.spindle.add(motorSpindle(u));
  }

  // A head that bends: from the ram's end along its fixed ways to the nose.
  private addAngleHead() {
    const u = this.unit, { tool } = this.chain;
    const last = tool.map((axis) => axis.joint >= 0).lastIndexOf(true);
    const carrier = this.moved.find((one) => one.joint === tool[last]?.joint)?.group ?? this.root;
    let from = new THREE.Vector3(0, 0, u * 1.4);
    const to = new THREE.Vector3();
    for (const axis of tool.slice(last + 1)) {
      to.add(vector(axis.offset_mm));
      const way = to.clone().sub(from);
      if (way.length() === 0) continue;
      carrier.add(round("spindle", u * 0.34, way.length(), way, from.clone().addScaledVector(way, 0.5)));
      const knee = new THREE.Mesh(new THREE.SphereGeometry(u * 0.34, 32, 16), kParts.spindle);
      knee.position.copy(from);
      carrier.add(knee);
      from = to.clone();
    }
    this.spindle.add(spindleNose(u));
  }

  private buildWork(below: ReturnType<SerialModel["find"]>, tables: ReturnType<SerialModel["find"]>, bed: number) {
    const u = this.unit;
    const h = (axis: SerialChain["tool"][0]) => (Math.abs(axis.direction![0]) > 0.5 ? 0 : 1);
    let z = bed;
    let carrier: THREE.Object3D = this.root;
    const half = below.length ? u * 2.6 : u * 3.4;
    this.root.add(box("casting", [half * 2.3, half * 2.3, u * 0.6], [0, 0, bed - u * 0.3]));
    const step = below.length ? (-bed - u * 0.25) / Math.max(below.length, 1) : 0;
    for (const { axis, group } of below) {
      const way = this.range(axis.joint);
      for (const side of [-half * 0.55, half * 0.55])
        carrier.add(beam("rail", h(axis), [-half * 0.5 + way[0], half * 0.5 + way[1]], [side - u * 0.14, side + u * 0.14], [z, z + step * 0.3]));
      group.add(box("slide", [half * 1.5, half * 1.5, step * 0.66], [0, 0, z + step * 0.65]));
      carrier = group;
      z += step;
    }
    if (!tables.length) {
      const size = below.length ? half * 1.4 : half * 2;
      this.table.add(box("table", [size, size, u * 0.25], [0, 0, (below.length ? 0 : bed) - u * 0.125]));
      for (let i = -2; i <= 2; ++i)
        this.table.add(box("rail", [size * 0.99, u * 0.1, u * 0.02], [0, (i * size) / 5.5, below.length ? 0 : bed]));
      return;
    }
    const last = tables[tables.length - 1];
    const lastAxis = vector(last.axis.direction!);
    const radius = u * 1.45;
    const plate = this.diskHeight();
    this.table.add(round("turning", radius * 1.02, u * 0.16, lastAxis, new THREE.Vector3(0, 0, plate - u * 0.3)));
    this.table.add(round("table", radius, u * 0.24, lastAxis, new THREE.Vector3(0, 0, plate - u * 0.12)));
    for (const turn of [0, Math.PI / 2]) {
      const slot = box("rail", [radius * 1.9, u * 0.12, u * 0.02], [0, 0, plate]);
      slot.rotation.z = turn;
      this.table.add(slot);
    }
    if (tables.length === 1) {
      this.root.add(round("casting", radius * 1.1, Math.max(u * 0.4, -bed - u), lastAxis, new THREE.Vector3(0, 0, bed * 0.5 - u * 0.4)));
      return;
    }
    this.addCradle(tables[0], last, radius, plate, bed);
  }

  private diskHeight(): number {
    return 0;
  }

  // A yoke that turns about a level axis and carries the disk.
  private addCradle(first: ReturnType<SerialModel["find"]>[0], last: ReturnType<SerialModel["find"]>[0], radius: number, plate: number, bed: number) {
    const u = this.unit;
    const axis = vector(first.axis.direction!);
    const along = Math.abs(axis.x) > 0.5 ? 0 : 1;
    const depth = last.axis.offset_mm[2] + plate;
    const side = radius + u * 0.45;
    const floor = depth - u * 0.75;
    first.group.add(beam("slide", along, [-side, side], [-u * 0.85, u * 0.85], [floor - u * 0.2, floor + u * 0.32]));
    for (const sign of [-1, 1]) {
      const at = sign * side;
      first.group.add(beam("slide", along, [at - u * 0.2, at + u * 0.2], [-u * 0.75, u * 0.75], [floor - u * 0.2, u * 0.1]));
      first.group.add(round("slide", u * 0.75, u * 0.4, axis, axis.clone().multiplyScalar(at).add(new THREE.Vector3(0, 0, u * 0.1))));
      first.group.add(round("turning", u * 0.5, u * 0.5, axis, axis.clone().multiplyScalar(at + sign * u * 0.35)));
      const stand = at + sign * u * 0.85;
      this.root.add(beam("casting", along, [stand - u * 0.35, stand + u * 0.35], [-u * 1.1, u * 1.1], [bed, u * 0.15]));
      this.root.add(round("casting", u * 1.1, u * 0.7, axis, axis.clone().multiplyScalar(stand).add(new THREE.Vector3(0, 0, u * 0.15))));
    }
  }
}

/** A platform on six legs, or on four links that slide on rails. */
class PlatformModel implements MachineModel {
  readonly root = new THREE.Group();
  readonly table: THREE.Object3D;
  readonly spindle: THREE.Object3D;
  readonly unit: number;
  readonly zero = new THREE.Vector3();
  private readonly platform = new THREE.Group();
  private readonly rods: Rod[] = [];
  private readonly cylinders: Rod[] = [];
  private readonly sliders: THREE.Mesh[] = [];
  private readonly carriesWork: boolean;
  private readonly spindleAt: THREE.Vector3;

  constructor(private readonly machine: Machine, private readonly chain: PlatformChain) {
    this.carriesWork = chain.carries === "work";
    this.spindleAt = vector(chain.spindle_mm);
    const ends = chain.actuators.map((one) => vector(one.platform_mm).length());
    this.unit = Math.max(...ends) / 2;
    this.root.add(this.platform);
    this.spindle = new THREE.Group();
    this.spindle.position.copy(this.spindleAt);
    this.spindle.add(motorSpindle(this.unit));
    (this.carriesWork ? this.root : this.platform).add(this.spindle);
    this.table = this.carriesWork ? this.platform : this.root;
    if (chain.type === "hexapod") this.buildHexapod();
    else this.buildRails();
  }

  place(motion: Motion) {
    // The words of the machine's own axes tell where the platform stands (RTCP off: it turns about its own origin).
    const [x, y, z, a, b] = motion.machine;
    const tilt = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(1, 0, 0), a)
      .multiply(new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 1, 0), this.chain.type === "hexapod" ? b : 0));
    const away = new THREE.Vector3(x, y, z).sub(this.spindleAt);
    this.platform.position.copy(this.carriesWork ? away.negate() : away);
    this.platform.quaternion.copy(this.carriesWork ? tilt.invert() : tilt);
    this.platform.updateMatrix();
    this.chain.actuators.forEach((one, i) => {
      const to = vector(one.platform_mm).applyMatrix4(this.platform.matrix);
      if (one.base_mm) this.placeLeg(i, vector(one.base_mm), to);
      else this.placeLink(i, one, to, motion.q_measured[i] ?? 0);
    });
  }

  ofJoint() {
    return null;
  }

  private placeLeg(i: number, from: THREE.Vector3, to: THREE.Vector3) {
    this.rods[i].between(from, to);
    // The screw comes out of its cylinder.
    const part = to.clone().sub(from).setLength(this.machine.joints[i].min * 0.78).add(from);
    this.cylinders[i].between(from, part);
  }

  private placeLink(i: number, rail: PlatformChain["actuators"][0], to: THREE.Vector3, q: number) {
    const direction = vector(rail.direction!).normalize();
    const slider = vector(rail.rail_mm!).addScaledVector(direction, q);
    this.sliders[i].position.copy(slider);
    // A parallelogram: two rods side by side.
    const aside = direction.clone().cross(to.clone().sub(slider)).normalize().multiplyScalar(this.unit * 0.34);
    this.rods[2 * i].between(slider.clone().add(aside), to.clone().add(aside));
    this.rods[2 * i + 1].between(slider.clone().sub(aside), to.clone().sub(aside));
  }

  private buildHexapod() {
    const u = this.unit;
    const bases = this.chain.actuators.map((one) => vector(one.base_mm!));
    const radius = Math.max(...bases.map((base) => Math.hypot(base.x, base.y)));
    this.root.add(round("casting", radius * 1.18, u * 0.5, kZ, new THREE.Vector3(0, 0, bases[0].z - u * 0.55)));
    for (const base of bases) this.root.add(this.ball(base));
    const disk = Math.max(...this.chain.actuators.map((one) => Math.hypot(one.platform_mm[0], one.platform_mm[1])));
    const under = this.carriesWork ? -u * 0.3 : u * 0.3;
    this.platform.add(round("turning", disk * 1.12, u * 0.22, kZ, new THREE.Vector3(0, 0, under * 0.6)));
    this.platform.add(round("table", disk * 1.06, u * 0.12, kZ, new THREE.Vector3(0, 0, under * 0.1)));
    for (const one of this.chain.actuators) this.platform.add(this.ball(vector(one.platform_mm)));
    for (let i = 0; i < this.chain.actuators.length; ++i) {
      this.rods.push(new Rod("leg", u * 0.1));
      this.cylinders.push(new Rod("joint", u * 0.17));
      this.root.add(this.rods[i].mesh, this.cylinders[i].mesh);
    }
    if (this.carriesWork) this.buildArch(radius, bases[0].z);
  }

  // A frame over the platform that holds the spindle.
  private buildArch(radius: number, floor: number) {
    const u = this.unit, top = this.spindleAt.z + u * 2.1, side = radius * 1.3;
    for (const sign of [-1, 1])
      this.root.add(box("casting", [u * 0.7, u * 0.7, top - floor + u], [sign * side, radius * 0.9, (top + floor) / 2]));
    this.root.add(box("casting", [2 * side + u * 0.7, u * 0.7, u * 0.8], [0, radius * 0.9, top]));
    this.root.add(box("casting", [u * 0.8, radius * 0.9 + u * 0.8, u * 0.7], [this.spindleAt.x, radius * 0.45, top]));
    this.root.add(box("slide", [u * 0.9, u * 0.9, u * 1.2], [this.spindleAt.x, this.spindleAt.y, this.spindleAt.z + u * 1.6]));
  }

  private buildRails() {
    const u = this.unit;
    const floor = -(Math.abs(this.chain.home_mm[2]) + 3.4 * u);
    this.chain.actuators.forEach((one, i) => {
      const joint = this.machine.joints[i];
      const direction = vector(one.direction!).normalize();
      const from = vector(one.rail_mm!).addScaledVector(direction, joint.min - u);
      const to = vector(one.rail_mm!).addScaledVector(direction, joint.max + u);
      const middle = from.clone().add(to).multiplyScalar(0.5);
      const out = Math.sign(middle.y) || 1;
      this.root.add(round("leg", u * 0.2, to.distanceTo(from), direction, middle));
      const guide = box("rail", [to.distanceTo(from), u * 0.35, u * 0.9], [middle.x, middle.y + out * u * 0.5, middle.z]);
      this.root.add(guide);
      this.sliders.push(box("turning", [u * 1.5, u * 0.8, u * 0.85]));
      this.root.add(this.sliders[i]);
      const ball = this.ball(vector(one.platform_mm));
      ball.scale.setScalar(1.5);
      this.platform.add(ball);
      for (let k = 0; k < 2; ++k) {
        this.rods.push(new Rod("rod", u * 0.13));
        this.root.add(this.rods[this.rods.length - 1].mesh);
      }
      // The posts at both ends carry the rails of their side.
      if (i % 2 === 0)
        for (const end of [from, to]) {
          const top = end.z + u * 1.1;
          this.root.add(box("casting", [u * 1.1, u * 1.3, top - floor], [end.x, end.y + out * u * 1.2, (top + floor) / 2]));
        }
    });
    const ends = this.chain.actuators.map((one) => vector(one.platform_mm));
    const size = new THREE.Box3().setFromPoints(ends).getSize(new THREE.Vector3());
    this.platform.add(box("slide", [Math.max(size.x, u * 2.2), Math.max(size.y * 0.84, u), Math.max(size.z * 0.8, u * 0.6)], [0, 0, this.carriesWork ? -u * 0.6 : u * 0.2]));
    const way = Math.max(...this.machine.joints.map((joint) => joint.max - joint.min)) * 0.32;
    if (!this.carriesWork) {
      this.root.add(box("table", [way, u * 9, u * 0.4], [0, 0, floor + u * 0.6]));
      this.root.add(box("casting", [way * 1.1, u * 10, u * 0.5], [0, 0, floor + u * 0.15]));
    }
  }

  private ball(at: THREE.Vector3): THREE.Mesh {
    const mesh = new THREE.Mesh(new THREE.SphereGeometry(this.unit * 0.17, 24, 16), kParts.joint);
    mesh.position.copy(at);
    return mesh;
  }
}

export const isSerial = (chain: Chain): chain is SerialChain => chain.type === "serial";

/** Before it is known where the machine stands. */
const kStanding = { q_measured: [], machine: [0, 0, 0, 0, 0, 0] } as unknown as Motion;

export function makeModel(machine: Machine): MachineModel {
  const chain = machine.kinematics;
  const model = isSerial(chain) ? new SerialModel(machine, chain) : new PlatformModel(machine, chain);
  model.place(kStanding);
  return model;
}

/** Of the part of a tool that is seen with the machine only: it would hide the work. */
export const kHolder = "holder";

/** Holder and cutter below the gauge point; mm. */
export function makeTool(unit: number, length: number, radius: number): THREE.Group {
  const group = new THREE.Group();
  const long = length > 0 ? length : unit * 0.9;
  const thin = radius > 0 ? radius : unit * 0.03;
  const holder = Math.min(long * 0.45, unit * 0.7);
  const cone = new THREE.Mesh(new THREE.CylinderGeometry(unit * 0.2, Math.max(thin * 1.6, unit * 0.11), holder, 32), kParts.rail);
  cone.rotation.x = Math.PI / 2;
  cone.position.z = -holder / 2;
  cone.name = kHolder;
  const ball = Math.min(thin, long - holder);
  const shank = new THREE.Mesh(new THREE.CapsuleGeometry(thin, Math.max(long - holder - ball, 0.01), 8, 24), kParts.rod);
  shank.rotation.x = Math.PI / 2;
  shank.position.z = -(holder + (long - holder) / 2) + ball / 2;
  group.add(cone, shank);
  return group;
}
