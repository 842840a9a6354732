import * as THREE from "three";

// The machine's light. It is worked out at the corners of the faces and not at every pixel, and no part shines through
// another: without a graphics card that makes half the cost of a picture.

const kSun = { from: new THREE.Vector3(0.6, -1.4, 2.2), strength: 1.9 };
const kBack = { from: new THREE.Vector3(-1.5, 1, 0.6), strength: 0.7, color: 0xbfd4ff };
/** From all around: white from where the back of the machine is, the ground's colour from its front. */
const kSky = { strength: 1.5, color: 0xffffff, ground: 0x8a97a5 };
/** Of the colour of edges, the part's own, which no light makes darker; the rest is this. */
const kOwnShare = 0.2, kEdge = 0x14202b;

const kVertex = `
uniform vec3 tint, sun, back, backColor, ground;
varying vec3 shade;
#ifdef BOTH_SIDES
varying vec3 inside;
#endif
vec3 lit(vec3 n) {
  vec3 light = vec3(max(0.0, dot(n, sun)) * ${kSun.strength.toFixed(2)}) +
    max(0.0, dot(n, back)) * backColor * ${kBack.strength.toFixed(2)} +
    mix(ground, vec3(1.0), 0.5 * n.y + 0.5) * ${kSky.strength.toFixed(2)};
  vec3 c = tint * light * ${(1 / Math.PI).toFixed(6)};
  // As screens want it (IEC 61966-2-1).
  return mix(12.92 * c, 1.055 * pow(max(c, vec3(0.0)), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
void main() {
  vec3 n = normalize(mat3(modelMatrix) * normal);
  shade = lit(n);
#ifdef BOTH_SIDES
  inside = lit(-n);
#endif
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const kFragment = `
varying vec3 shade;
#ifdef BOTH_SIDES
varying vec3 inside;
#endif
void main() {
#ifdef BOTH_SIDES
  gl_FragColor = vec4(gl_FrontFacing ? shade : inside, 1.0);
#else
  gl_FragColor = vec4(shade, 1.0);
#endif
}`;

/** A part of the machine; with its edges' colour. */
export class PartMaterial extends THREE.ShaderMaterial {
  readonly edges: THREE.LineBasicMaterial;

  constructor(color: number, bothSides = false) {
    const own = new THREE.Color(color);
    super({
      vertexShader: kVertex, fragmentShader: kFragment, side: bothSides ? THREE.DoubleSide : THREE.FrontSide,
      defines: bothSides ? { BOTH_SIDES: "" } : {},
      uniforms: {
        tint: { value: own }, sun: { value: kSun.from.clone().normalize() }, back: { value: kBack.from.clone().normalize() },
        backColor: { value: new THREE.Color(kBack.color) }, ground: { value: new THREE.Color(kSky.ground) },
      },
    });
    this.edges = new THREE.LineBasicMaterial({ color: new THREE.Color(kEdge).lerp(own, kOwnShare) });
  }
}
