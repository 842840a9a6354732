// Runs cam/trunnion.cps in node on small jobs: a stand-in for as much of the post-processor interface as it uses, for tests only.
//
//   node tests/cam/run_cps.js POST.cps FOLDER      writes NAME.ngc and NAME.json (what the tool must do) for every job
"use strict";
const fs = require("fs");
const path = require("path");
const vm = require("vm");

const [post, folder] = process.argv.slice(2);

class Vector {
  constructor(x, y, z) { this.x = x; this.y = y; this.z = z; }
}

/** A rotation, by its columns: right, up, forward. */
class Matrix {
  constructor(right, up, forward) { this.right = right; this.up = up; this.forward = forward; }
  static axisAngle(axis, angle) {
    const n = Math.hypot(...axis), [x, y, z] = axis.map((v) => v / n), c = Math.cos(angle), s = Math.sin(angle), t = 1 - c;
    return new Matrix(new Vector(t * x * x + c, t * x * y + s * z, t * x * z - s * y),
      new Vector(t * x * y - s * z, t * y * y + c, t * y * z + s * x),
      new Vector(t * x * z + s * y, t * y * z - s * x, t * z * z + c));
  }
  /** Angles about Z, X' and Z'', as the interface has them for EULER_ZXZ_R. */
  getEuler2() {
    const f = this.forward, tilt = Math.acos(Math.max(-1, Math.min(1, f.z)));
    if (Math.sin(tilt) < 1e-9) return new Vector(0, tilt, Math.atan2(this.right.y, this.right.x));
    return new Vector(Math.atan2(f.x, -f.y), tilt, Math.atan2(this.right.z, this.up.z));
  }
  times(v) {
    return [this.right, this.up, this.forward].reduce((sum, column, n) => [sum[0] + column.x * v[n], sum[1] + column.y * v[n],
      sum[2] + column.z * v[n]], [0, 0, 0]);
  }
}

function createFormat({decimals = 6, scale = 1, prefix = ""}) {
  return {format: (value) => {
    const text = (value * scale).toFixed(decimals);
    const trimmed = text.includes(".") ? text.replace(/0+$/, "").replace(/\.$/, "") : text;
    return prefix + (trimmed === "-0" ? "0" : trimmed);
  }};
}

function createVariable({prefix}, format) {
  let last, off = false;
  return {
    format: (value) => {
      if (off) return "";
      const text = format.format(value);
      if (text === last) return "";
      last = text;
      return prefix + text;
    },
    reset: () => { last = undefined; },
    disable: () => { off = true; },
  };
}

const TOOLS = {
  1: {number: 1, description: "ball nose (6 mm)", diameter: 6, bodyLength: 60, lengthOffset: 1, diameterOffset: 1, clockwise: true, coolant: 1, threadPitch: 1},
  2: {number: 2, description: "end mill", diameter: 8, bodyLength: 40, lengthOffset: 2, diameterOffset: 2, clockwise: true, coolant: 1, threadPitch: 1},
  3: {number: 3, description: "drill", diameter: 5, bodyLength: 60, lengthOffset: 3, diameterOffset: 3, clockwise: true, coolant: 0, threadPitch: 1},
};
const UPRIGHT = Matrix.axisAngle([0, 0, 1], 0);

/** Posts a job; returns the program. */
function runPost(job) {
  const lines = [];
  let at = new Vector(0, 0, 0), section = 0, plane = 0, point = 0;
  const sections = job.sections.map((made) => ({
    isMultiAxis: () => !!made.multiAxis, workPlane: made.workPlane || UPRIGHT, workOrigin: new Vector(...(made.workOrigin || [0, 0, 0])),
    workOffset: made.workOffset || 1, getTool: () => TOOLS[made.tool], getInitialPosition: () => new Vector(...made.start),
    getInitialToolAxisABC: () => new Vector(...(made.startAxis || [0, 0, 0])),
    getGlobalInitialToolAxis: () => new Vector(...(made.startAxis || [0, 0, 1])),
  }));
  const world = {
    Vector, Matrix, createFormat, createVariable, console,
    MM: "mm", IN: "in", unit: job.unit || "mm", DEG: 180 / Math.PI, FORMAT_REAL: 0, CAPABILITY_MILLING: 1, EULER_ZXZ_R: 0,
    PLANE_XY: 0, PLANE_ZX: 1, PLANE_YZ: 2, COOLANT_OFF: 0, COOLANT_FLOOD: 1, COOLANT_MIST: 2,
    RADIUS_COMPENSATION_OFF: 0, RADIUS_COMPENSATION_LEFT: 1, RADIUS_COMPENSATION_RIGHT: 2, radiusCompensation: 0,
    COMMAND_STOP: 1, COMMAND_OPTIONAL_STOP: 2, COMMAND_SPINDLE_CLOCKWISE: 3, COMMAND_SPINDLE_COUNTERCLOCKWISE: 4,
    COMMAND_STOP_SPINDLE: 5, COMMAND_COOLANT_ON: 6, COMMAND_COOLANT_OFF: 7, COMMAND_LOCK_MULTI_AXIS: 8,
    COMMAND_UNLOCK_MULTI_AXIS: 9, COMMAND_BREAK_CONTROL: 10, COMMAND_TOOL_MEASURE: 11,
    spatial: (value) => value, toRad: (value) => value * Math.PI / 180, setCodePage: () => {},
    programName: job.name, programComment: "", spindleSpeed: 6000, cycleExpanded: false, cycleType: "", cycle: {},
    machineConfiguration: {isMultiAxisConfiguration: () => !!job.rotaryWords,
      isMachineCoordinate: (axis) => axis !== 1}, optimizeMachineAngles2: () => {},
    getNumberOfSections: () => sections.length, getSection: (n) => sections[n],
    getProperty: (name) => name in job.properties ? job.properties[name] : world.properties[name].value,
    getToolTable: () => ({getNumberOfTools: () => 3, getTool: (n) => TOOLS[n + 1]}),
    hasParameter: (name) => name === "operation-comment", getParameter: () => "operation " + (section + 1) + " (adaptive)",
    isFirstSection: () => section === 0, getPreviousSection: () => sections[section - 1],
    isSameDirection: (a, b) => Math.hypot(a.x - b.x, a.y - b.y, a.z - b.z) < 1e-9,
    getFramePosition: (v) => v, getCurrentPosition: () => at, getCircularPlane: () => plane, isFirstCyclePoint: () => point === 0,
    expandCyclePoint: () => { throw new Error("expanded"); },
    repositionToCycleClearance: (cycle, x, y) => {
      world.onRapid(x, y, cycle.clearance);
      at = new Vector(x, y, cycle.clearance);
    },
    onUnsupportedCommand: (command) => { throw new Error("unsupported command " + command); },
    writeln: (text) => lines.push(text),
    writeWords: (...words) => {
      const line = words.flat().filter((word) => word !== "" && word !== undefined).join(" ");
      if (line) lines.push(line);
    },
    error: (text) => { throw new Error(text); }, warning: (text) => lines.push("(warning: " + text + ")"),
  };
  vm.createContext(world);
  vm.runInContext(fs.readFileSync(post, "utf8"), world, {filename: post});

  const actions = {
    rapid: (x, y, z) => world.onRapid(x, y, z),
    line: (x, y, z, feed) => world.onLinear(x, y, z, feed),
    line5: (x, y, z, a, b, c, feed) => world.onLinear5D(x, y, z, a, b, c, feed),
    rapid5: (x, y, z, a, b, c) => world.onRapid5D(x, y, z, a, b, c),
    arc: (clockwise, inPlane, cx, cy, cz, x, y, z, feed) => {
      plane = inPlane;
      world.onCircular(clockwise, cx, cy, cz, x, y, z, feed);
    },
    compensate: (side) => {
      world.radiusCompensation = side;
      world.onRadiusCompensation();
    },
    dwell: (seconds) => world.onDwell(seconds),
    command: (number) => world.onCommand(number),
    holes: (type, cycle, ...places) => {
      world.cycleType = type;
      world.cycle = cycle;
      places.forEach((place, n) => {
        point = n;
        world.onCyclePoint(...place);
        at = new Vector(place[0], place[1], cycle.clearance);
      });
      world.onCycleEnd();
    },
  };
  const ends = {rapid: (a) => a.slice(0, 3), line: (a) => a.slice(0, 3), line5: (a) => a.slice(0, 3), rapid5: (a) => a.slice(0, 3),
    arc: (a) => a.slice(5, 8)};
  world.onOpen();
  job.sections.forEach((made, n) => {
    section = n;
    world.currentSection = sections[n];
    world.tool = TOOLS[made.tool];
    world.onSection();
    at = new Vector(...made.start);
    for (const [name, ...values] of made.moves) {
      actions[name](...values);
      if (ends[name]) at = new Vector(...ends[name](values));
    }
    world.onSectionEnd();
  });
  world.onClose();
  return lines.join("\n") + "\n";
}

/** Where the tool must come, in the part. */
function placesOf(job) {
  const places = [];
  for (const made of job.sections) {
    if (made.notJudged) continue;
    const turn = made.workPlane || UPRIGHT, origin = made.workOrigin || [0, 0, 0], f = turn.forward;
    const put = (tip, axis) => places.push([turn.times(tip).map((v, n) => v + origin[n]), axis || [f.x, f.y, f.z]]);
    for (const [name, ...v] of made.moves) {
      if (name === "line") put(v.slice(0, 3));
      if (name === "arc") put(v.slice(5, 8));
      if (name === "line5") put(v.slice(0, 3), job.rotaryWords ? axisOf(v[3], v[5]) : v.slice(3, 6));
      if (name === "holes") v.slice(2).forEach((place) => put(place));
    }
  }
  return places;
}

/** The tool axis in the part at A and C of the cradle, rad. */
function axisOf(a, c) {
  return [Math.sin(a) * Math.sin(c), Math.sin(a) * Math.cos(c), Math.cos(a)];
}

const CRADLE = {machine: "../configs/cradle.toml", tools: "../examples/tools.tbl", retract: "450"};
const MILL = {machine: "../configs/mill.toml", tools: "../examples/tools.tbl", retract: "200"};
const SQUARE = [["line", 0, 0, -1, 300], ["line", 12, 0, -1, 900], ["line", 12, 7, -1, 900], ["rapid", 12, 7, 30]];
const unitVector = (x, y, z) => [x, y, z].map((v) => v / Math.hypot(x, y, z));

const jobs = [
  {name: "three_axes", properties: MILL, sections: [
    {tool: 2, start: [0, 0, 20], moves: [["rapid", 0, 0, 2], ["line", 0, 0, -2, 300], ["line", 20, 0, -2, 800],
      ["arc", false, 0, 20, 10, 0, 20, 20, -2, 800], ["arc", true, 1, 25, 20, -2, 30, 20, -2, 800],
      ["arc", false, 2, 30, 25, -2, 30, 30, -2, 800], ["dwell", 0.5], ["rapid", 30, 30, 20]]},
    {tool: 2, start: [50, 0, 10], moves: [["line", 50, 0, 0, 300], ["line", 60, 0, 0, 800], ["rapid", 60, 0, 20]]},
    {tool: 2, start: [-40, -40, 10], notJudged: true, moves: [["line", -40, -40, -3, 300], ["compensate", 1], ["line", -30, -30, -3, 500],
      ["line", -30, 10, -3, 800], ["compensate", 0], ["line", -40, 10, -3, 800], ["command", 1], ["rapid", -40, 10, 20]]},
    {tool: 3, start: [5, 5, 20], moves: [["holes", "drilling", {clearance: 15, retract: 2, feedrate: 200}, [5, 5, -6], [25, 5, -6]],
      ["holes", "deep-drilling", {clearance: 15, retract: 2, feedrate: 200, incrementalDepth: 3}, [5, 25, -9]],
      ["holes", "boring", {clearance: 15, retract: 2, feedrate: 100, dwell: 0.2}, [25, 25, -4]]]},
  ]},
  {name: "inch", unit: "in", properties: MILL, sections: [
    {tool: 2, start: [0, 0, 1], moves: [["line", 0, 0, -0.1, 10], ["line", 1, 0.5, -0.1, 30], ["rapid", 1, 0.5, 1]]}]},
  {name: "tilted", tool_mm: 80, properties: CRADLE, sections: [
    {tool: 2, start: [0, 0, 30], workPlane: Matrix.axisAngle([1, 0.3, 0.2], 0.3), workOrigin: [3, -12, -2], moves: SQUARE},
    {tool: 2, start: [0, 0, 30], workPlane: Matrix.axisAngle([0, 1, 0], 0.2), workOrigin: [10, 5, 0], moves: SQUARE},
    {tool: 2, start: [0, 0, 30], moves: SQUARE},
  ]},
  {name: "vectors", tool_mm: 100, properties: CRADLE, sections: [
    {tool: 1, start: [0, 0, 40], startAxis: [0, 0, 1], multiAxis: true, moves: [0, 1, 2, 3, 4, 5].map((n) =>
      ["line5", 4 * n, 10 - n, 20, ...unitVector(0.05 * n, 0.04 * n + 0.05, 1), 900])},
    {tool: 1, start: [0, 0, 60], moves: SQUARE},
  ]},
  {name: "rotary_words", tool_mm: 100, rotaryWords: true, properties: CRADLE, sections: [
    {tool: 1, start: [0, 0, 40], startAxis: [0.1, 0, 0.1], multiAxis: true, moves: [1, 2, 3, 4, 5].map((n) =>
      ["line5", 4 * n, 10 - n, 20, 0.05 * n, 0, 0.2 * n, 900])},
  ]},
];

for (const job of jobs) {
  fs.writeFileSync(path.join(folder, job.name + ".ngc"), runPost(job));
  const scale = job.unit === "in" ? 25.4 : 1;
  const places = placesOf(job).map(([tip, axis]) => [tip.map((v) => v * scale), axis]);
  fs.writeFileSync(path.join(folder, job.name + ".json"), JSON.stringify({places, tool_mm: job.tool_mm || null}));
}

let refused = "";
try {
  runPost({...jobs[0], properties: {...MILL, retract: ""}});
} catch (error) {
  refused = error.message;
}
if (!refused.includes("Retract height")) throw new Error("a program without retract height is not refused");
console.log("jobs posted");
