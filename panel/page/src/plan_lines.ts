import * as THREE from "three";
import { type Colouring, coloursOf, type Plan } from "./plan";

// The plan as lines. It is cut into pieces; each shows only the points that are seen at its distance, so that millions of
// moves stay fluent.

const kPiece = 2048;
/** Pixels that a line may be off. */
const kOff = 0.6;

interface Piece {
  line: THREE.LineSegments;
  from: number;
  to: number;
  level: number;
  levels: Map<number, THREE.BufferAttribute>;
}

export class PlanLines {
  readonly group = new THREE.Group();
  rapids = true;
  private readonly pieces: Piece[] = [];
  private readonly material = new THREE.LineBasicMaterial({ vertexColors: true });
  private readonly places: THREE.BufferAttribute;
  private readonly colours: THREE.BufferAttribute;

  constructor(readonly plan: Plan, mode: Colouring) {
    this.places = new THREE.BufferAttribute(plan.places, 3);
    this.colours = new THREE.BufferAttribute(coloursOf(plan, mode), 3, true);
    for (let from = 0; from + 1 < plan.count; from += kPiece) {
      const to = Math.min(from + kPiece, plan.count - 1);
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", this.places);
      geometry.setAttribute("color", this.colours);
      const box = new THREE.Box3();
      const point = new THREE.Vector3();
      for (let i = from; i <= to; ++i) box.expandByPoint(point.fromArray(plan.places, 3 * i));
      geometry.boundingBox = box;
      geometry.boundingSphere = box.getBoundingSphere(new THREE.Sphere());
      const line = new THREE.LineSegments(geometry, this.material);
      line.matrixAutoUpdate = false;
      this.group.add(line);
      this.pieces.push({ line, from, to, level: NaN, levels: new Map() });
    }
  }

  colour(mode: Colouring) {
    (this.colours.array as Uint8Array).set(coloursOf(this.plan, mode));
    this.colours.needsUpdate = true;
  }

  showRapids(on: boolean) {
    this.rapids = on;
    for (const piece of this.pieces) {
      piece.levels.clear();
      piece.level = NaN;
    }
  }

  /** The points of each piece that this camera can tell apart. `height`: of the picture, pixels. */
  choose(camera: THREE.PerspectiveCamera, height: number) {
    const eye = this.group.worldToLocal(camera.getWorldPosition(new THREE.Vector3()));
    const perPixel = (2 * Math.tan(THREE.MathUtils.degToRad(camera.fov / 2))) / height;
    for (const piece of this.pieces) {
      const sphere = piece.line.geometry.boundingSphere!;
      const away = Math.max(camera.near, eye.distanceTo(sphere.center) - sphere.radius);
      const level = Math.floor(Math.log2(away * perPixel * kOff));
      if (level === piece.level) continue;
      piece.level = level;
      let index = piece.levels.get(level);
      if (!index) piece.levels.set(level, (index = this.indexOf(piece, 2 ** level)));
      piece.line.geometry.setIndex(index);
    }
  }

  private indexOf(piece: Piece, off: number): THREE.BufferAttribute {
    const { significance, rapid, jump } = this.plan;
    const out: number[] = [];
    let last = piece.from;
    for (let i = piece.from + 1; i <= piece.to; ++i) {
      if (i !== piece.to && significance[i] < off) continue;
      if (!jump[i] && (this.rapids || !rapid[i])) out.push(last, i);
      last = i;
    }
    return new THREE.BufferAttribute(new Uint32Array(out), 1);
  }

  /** How many lines are drawn now. */
  drawn(): number {
    return this.pieces.reduce((sum, { line }) => sum + (line.geometry.index?.count ?? 0) / 2, 0);
  }

  /** The drawn point that is nearest to a place of the picture (-1 to 1 each), at most `reach` pixels away; -1: none. */
  near(camera: THREE.Camera, x: number, y: number, width: number, height: number, reach: number): number {
    const matrix = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)
      .multiply(this.group.matrixWorld);
    const m = matrix.elements, p = this.plan.places;
    let best = -1, least = reach * reach;
    for (const { line } of this.pieces) {
      const index = line.geometry.index;
      if (!index) continue;
      const list = index.array as Uint32Array;
      for (let k = 1; k < list.length; k += 2) {
        const i = list[k], at = 3 * i;
        const w = m[3] * p[at] + m[7] * p[at + 1] + m[11] * p[at + 2] + m[15];
        if (w <= 0) continue;
        const dx = ((m[0] * p[at] + m[4] * p[at + 1] + m[8] * p[at + 2] + m[12]) / w - x) * width / 2;
        const dy = ((m[1] * p[at] + m[5] * p[at + 1] + m[9] * p[at + 2] + m[13]) / w - y) * height / 2;
        const off = dx * dx + dy * dy;
        if (off < least) (least = off), (best = i);
      }
    }
    return best;
  }

  dispose() {
    for (const { line } of this.pieces) line.geometry.dispose();
    this.material.dispose();
  }
}
