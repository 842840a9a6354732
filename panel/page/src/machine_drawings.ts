import * as THREE from "three";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import { link } from "./link";
import { edged, type MachineModel } from "./machine_model";
import type { Machine } from "./model";
import { PartMaterial } from "./shading";

// The bodies of a machine as its maker drew them, in place of our own castings.

const kColours: Record<string, number> = { base: 0x8a9bab, table: 0xdbe3ea, spindle: 0xb7c4d0 };
const kJointColour = 0xc0ccd6;
/** Corners of triangles; the edges of more would take seconds to find. */
const kEdgedMax = 300000;

async function body(machine: Machine, index: number): Promise<THREE.Mesh | null> {
  const bytes = await (await link.fetch(`drawings/${index}`))?.arrayBuffer().catch(() => undefined);
  if (!bytes) return null;
  try {
    const geometry = new STLLoader().parse(bytes);
    if (!geometry.getAttribute("position")?.count) return null;
    // The normals of such files are often zeros.
    geometry.computeVertexNormals();
    const color = kColours[machine.drawings[index]] ?? kJointColour;
    const mesh = new THREE.Mesh(geometry, new PartMaterial(color, true));
    return geometry.getAttribute("position").count < kEdgedMax ? edged(mesh) : mesh;
  } catch {
    return null;
  }
}

/** What a part of the machine hangs in. */
function frameOf(model: MachineModel, machine: Machine, part: string): THREE.Object3D {
  if (part === "table") return model.table;
  if (part === "spindle") return model.spindle;
  return model.ofJoint(machine.joints.findIndex((joint) => joint.name === part)) ?? model.root;
}

/** Asks for the drawings of a model that still stands at zero and carries no tool; draws all of them, or none. */
export async function dress(model: MachineModel, machine: Machine): Promise<void> {
  if (!machine.drawings.length) return;
  // Drawings lie in the base frame, as the machine stands at zero.
  model.root.updateMatrixWorld(true);
  const frames = machine.drawings.map((part) => frameOf(model, machine, part));
  const toFrames = frames.map((frame) => frame.matrixWorld.clone().invert());
  const castings: THREE.Object3D[] = [];
  model.root.traverse((one) => one instanceof THREE.Mesh && castings.push(one));
  const bodies = await Promise.all(machine.drawings.map((_, index) => body(machine, index)));
  const bad = bodies.findIndex((one) => !one);
  if (bad >= 0) {
    link.say(`The drawing of '${machine.drawings[bad]}' is no STL file: the machine is drawn by its axes.`);
    return;
  }
  for (const casting of castings) casting.removeFromParent();
  bodies.forEach((one, index) => {
    one!.applyMatrix4(toFrames[index]);
    frames[index].add(one!);
  });
}
