/**
  Post-processor for Fusion and HSM: G-code for Trunnion, three and five axes. docs/cam.md explains it.

  Written from the public reference of the post-processor interface. Tilted planes are G68.2 and G53.1, five axes at once
  are G43.5 with tool vectors or, where the setup has a machine with rotary axes, G43.4 with A B C. So one program runs on
  every machine that can tilt as far.
*/
description = "Trunnion";
vendor = "Trunnion";
longDescription = "Milling on Trunnion: three axes, tilted planes (G68.2, G53.1), five axes at once with RTCP (G43.5, G43.4).";
extension = "ngc";
setCodePage("ascii");
capabilities = CAPABILITY_MILLING;
tolerance = spatial(0.002, MM);
minimumChordLength = spatial(0.01, MM);
minimumCircularRadius = spatial(0.01, MM);
maximumCircularRadius = spatial(1000, MM);
minimumCircularSweep = toRad(0.01);
maximumCircularSweep = toRad(180);
allowHelicalMoves = true;
allowedCircularPlanes = undefined; // G17, G18 and G19

properties = {
  machine: {
    title: "Machine", group: "general", type: "string", value: "", scope: "post",
    description: "Config of the machine, relative to the program, as ../configs/cradle.toml."
  },
  tools: {
    title: "Tool table", group: "general", type: "string", value: "", scope: "post",
    description: "Tool table, relative to the program, as tools.tbl."
  },
  pathTolerance: {
    title: "Path tolerance", group: "general", type: "number", value: 0.01, scope: "post",
    description: "G64 P in mm: how far the tool's tip may leave the programmed path."
  },
  axisTolerance: {
    title: "Axis tolerance", group: "general", type: "number", value: 0.05, scope: "post",
    description: "G64 R in degrees: how far the tool's axis may leave it in five axes."
  },
  retract: {
    title: "Retract height", group: "general", type: "string", value: "", scope: "post",
    description: "Machine Z in mm (G53) to which the tool goes before it is changed or the plane is tilted. It must be given, " +
      "since every machine has its zero elsewhere."
  },
  toolList: {
    title: "Tool list", group: "general", type: "boolean", value: true, scope: "post",
    description: "List the tools in comments at the program's head."
  }
};

var xyzFormat = createFormat({decimals: unit == MM ? 4 : 5, type: FORMAT_REAL, trim: true});
var vectorFormat = createFormat({decimals: 8, type: FORMAT_REAL, trim: true});
var angleFormat = createFormat({decimals: 6, scale: DEG, type: FORMAT_REAL, trim: true});
var feedFormat = createFormat({decimals: 3, type: FORMAT_REAL, trim: true});
var secondsFormat = createFormat({decimals: 3, type: FORMAT_REAL, trim: true});
var integerFormat = createFormat({decimals: 0});

var xOutput = createVariable({prefix: "X"}, xyzFormat);
var yOutput = createVariable({prefix: "Y"}, xyzFormat);
var zOutput = createVariable({prefix: "Z"}, xyzFormat);
var aOutput = createVariable({prefix: "A"}, angleFormat);
var bOutput = createVariable({prefix: "B"}, angleFormat);
var cOutput = createVariable({prefix: "C"}, angleFormat);
var feedOutput = createVariable({prefix: "F"}, feedFormat);

var lengthMode = ""; // "G43", "G43.4", "G43.5"; empty: no tool length in force
var planeOn = false;
var anyTilt = false; // some section tilts the tool: then X Y Z are the tip in the part in all of them (RTCP)
var retracted = false;
var pendingRadiusCompensation = -1;

function say() {
  writeWords(Array.prototype.slice.call(arguments));
}

function comment(text) {
  writeln("(" + String(text).replace(/[^\x20-\x7e]/g, "?").replace(/\(/g, "[").replace(/\)/g, "]") + ")");
}

function forgetWhere() {
  xOutput.reset();
  yOutput.reset();
  zOutput.reset();
  aOutput.reset();
  bOutput.reset();
  cOutput.reset();
  feedOutput.reset();
}

// Head ----------------------------------------------------------------------------------------------------------------

function onOpen() {
  if (!/^-?[0-9.]+$/.test(getProperty("retract"))) {
    error("Give the property 'Retract height': the machine Z in mm (G53) at which tools are changed, for example 200.");
    return;
  }
  if (machineConfiguration.isMultiAxisConfiguration()) {
    optimizeMachineAngles2(0); // X Y Z stay the tip in the part
    var outputs = [aOutput, bOutput, cOutput];
    for (var axis = 0; axis < 3; ++axis) {
      if (!machineConfiguration.isMachineCoordinate(axis)) {
        outputs[axis].disable();
      }
    }
  }
  for (var i = 0; i < getNumberOfSections(); ++i) {
    anyTilt = anyTilt || getSection(i).isMultiAxis() || isTilted(getSection(i));
  }
  if (getProperty("machine")) {
    comment("machine: " + getProperty("machine") + (getProperty("tools") ? "; tools: " + getProperty("tools") : ""));
  }
  comment(programName + (programComment ? ": " + programComment : ""));
  comment("made by trunnion.cps");
  if (getProperty("toolList")) {
    listTools();
  }
  say(unit == MM ? "G21" : "G20", "G17", "G40", "G49", "G80", "G90", "G91.1", "G94");
  say("G64", "P" + xyzFormat.format(inUnits(getProperty("pathTolerance"))),
    "R" + feedFormat.format(getProperty("axisTolerance")));
}

function listTools() {
  var tools = getToolTable();
  for (var i = 0; i < tools.getNumberOfTools(); ++i) {
    var listed = tools.getTool(i);
    comment("T" + integerFormat.format(listed.number) + " " + listed.description + ", diameter " +
      xyzFormat.format(listed.diameter) + ", length " + xyzFormat.format(listed.bodyLength));
  }
}

function inUnits(mm) {
  return unit == MM ? mm : mm / 25.4;
}

// Sections ------------------------------------------------------------------------------------------------------------

function isTilted(section) {
  return !section.isMultiAxis() && !isSameDirection(section.workPlane.forward, new Vector(0, 0, 1));
}

function onSection() {
  if (hasParameter("operation-comment")) {
    comment(getParameter("operation-comment"));
  }
  var first = isFirstSection();
  var changes = first || tool.number != getPreviousSection().getTool().number;
  var tilted = isTilted(currentSection);
  if (changes || anyTilt) {
    retract();
  }
  if (changes) {
    say("T" + integerFormat.format(tool.number), "M6");
  }
  writeOffset();
  writeSpindle();
  writeCoolant();
  forgetWhere();
  if (tilted) {
    tiltPlane(currentSection.workOrigin, currentSection.workPlane.getEuler2(EULER_ZXZ_R));
    planeOn = true;
  } else if (anyTilt && !currentSection.isMultiAxis()) {
    tiltPlane(new Vector(0, 0, 0), new Vector(0, 0, 0)); // upright, wherever the rotary axes stood
    say("G69");
  }
  goToStart();
}

/** RTCP by tool vectors or rotary words, or the tool's length alone. */
function lengthWords() {
  if (currentSection.isMultiAxis()) {
    lengthMode = machineConfiguration.isMultiAxisConfiguration() ? "G43.4" : "G43.5";
  } else {
    lengthMode = anyTilt ? "G43.4" : "G43";
  }
  return [lengthMode, "H" + integerFormat.format(tool.lengthOffset)];
}

function writeOffset() {
  var offset = currentSection.workOffset;
  if (offset > 9) {
    error("Trunnion has the work offsets 1 to 9 (G54 to G59.3), not " + offset + ".");
    return;
  }
  say(["G54", "G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"][offset]);
}

function writeSpindle() {
  say("S" + integerFormat.format(spindleSpeed), tool.clockwise ? "M3" : "M4");
}

function writeCoolant() {
  if (tool.coolant == COOLANT_MIST) {
    say("M7");
  } else if (tool.coolant == COOLANT_FLOOD) {
    say("M8");
  } else if (tool.coolant == COOLANT_OFF) {
    say("M9");
  } else {
    warning("This coolant is not known: M8 stands for it.");
    say("M8");
  }
}

/** Lays the plane and turns the tool square to it, far from the part; RTCP comes behind it, so that only rotary axes move. */
function tiltPlane(origin, angles) {
  say("G68.2", "X" + xyzFormat.format(origin.x), "Y" + xyzFormat.format(origin.y), "Z" + xyzFormat.format(origin.z),
    "I" + angleFormat.format(angles.x), "J" + angleFormat.format(angles.y), "K" + angleFormat.format(angles.z));
  say("G53.1");
}

function goToStart() {
  var start = getFramePosition(currentSection.getInitialPosition());
  if (currentSection.isMultiAxis()) {
    writeWords(lengthWords());
    var axis = lengthMode == "G43.4" ? currentSection.getInitialToolAxisABC() : currentSection.getGlobalInitialToolAxis();
    writeWords(["G0"].concat(place(start.x, start.y, start.z), direction(axis.x, axis.y, axis.z)));
    retracted = false;
    return;
  }
  if (!retracted && getCurrentPosition().z < start.z) {
    say("G0", zOutput.format(start.z)); // up before across
  }
  if (anyTilt) {
    writeWords(lengthWords());
  }
  say("G0", xOutput.format(start.x), yOutput.format(start.y));
  retracted = false;
  if (lengthMode == "") {
    writeWords(lengthWords().concat(["G0", zOutput.format(start.z)]));
  } else {
    say("G0", zOutput.format(start.z));
  }
}

function retract() {
  if (planeOn) {
    say("G69");
    planeOn = false;
  }
  if (lengthMode != "") {
    say("G49");
    lengthMode = "";
  }
  say("G53", "G0", "Z" + xyzFormat.format(inUnits(parseFloat(getProperty("retract")))));
  retracted = true;
  forgetWhere();
}

function onSectionEnd() {
  forgetWhere();
}

// Motion --------------------------------------------------------------------------------------------------------------

function place(x, y, z) {
  return [xOutput.format(x), yOutput.format(y), zOutput.format(z)];
}

/** Rotary words, or the vector from the tip to the spindle. */
function direction(a, b, c) {
  if (lengthMode == "G43.5") {
    return ["I" + vectorFormat.format(a), "J" + vectorFormat.format(b), "K" + vectorFormat.format(c)];
  }
  return [aOutput.format(a), bOutput.format(b), cOutput.format(c)];
}

function anyWord(words) {
  return words.join("") != "";
}

function compensationWords() {
  if (pendingRadiusCompensation < 0) {
    return [];
  }
  pendingRadiusCompensation = -1;
  switch (radiusCompensation) {
  case RADIUS_COMPENSATION_LEFT:
    return ["G41", "D" + integerFormat.format(tool.diameterOffset)];
  case RADIUS_COMPENSATION_RIGHT:
    return ["G42", "D" + integerFormat.format(tool.diameterOffset)];
  default:
    return ["G40"];
  }
}

function onRadiusCompensation() {
  pendingRadiusCompensation = radiusCompensation;
}

function onRapid(x, y, z) {
  var words = place(x, y, z);
  if (!anyWord(words)) {
    return;
  }
  if (pendingRadiusCompensation >= 0) {
    error("Cutter radius compensation cannot begin or end with a rapid move.");
    return;
  }
  writeWords(["G0"].concat(words));
  feedOutput.reset();
}

function onLinear(x, y, z, feed) {
  var begins = compensationWords();
  var words = place(x, y, z);
  if (anyWord(words) || begins.length) {
    writeWords(begins.concat(["G1"], words, [feedOutput.format(feed)]));
  }
}

function onRapid5D(x, y, z, a, b, c) {
  writeWords(["G0"].concat(place(x, y, z), direction(a, b, c)));
  feedOutput.reset();
}

function onLinear5D(x, y, z, a, b, c, feed) {
  writeWords(["G1"].concat(place(x, y, z), direction(a, b, c), [feedOutput.format(feed)]));
}

function onCircular(clockwise, cx, cy, cz, x, y, z, feed) {
  if (pendingRadiusCompensation >= 0) {
    error("Cutter radius compensation cannot begin or end with an arc.");
    return;
  }
  var start = getCurrentPosition();
  var planes = {};
  planes[PLANE_XY] = ["G17", "I" + xyzFormat.format(cx - start.x), "J" + xyzFormat.format(cy - start.y)];
  planes[PLANE_ZX] = ["G18", "I" + xyzFormat.format(cx - start.x), "K" + xyzFormat.format(cz - start.z)];
  planes[PLANE_YZ] = ["G19", "J" + xyzFormat.format(cy - start.y), "K" + xyzFormat.format(cz - start.z)];
  var plane = planes[getCircularPlane()];
  if (!plane) {
    linearize(tolerance);
    return;
  }
  xOutput.reset();
  yOutput.reset();
  zOutput.reset();
  writeWords([plane[0], clockwise ? "G2" : "G3"].concat(place(x, y, z), plane.slice(1), [feedOutput.format(feed)]));
  if (plane[0] != "G17") {
    say("G17");
  }
}

function onDwell(seconds) {
  say("G4", "P" + secondsFormat.format(seconds));
}

function onSpindleSpeed(speed) {
  say("S" + integerFormat.format(speed));
}

// Cycles --------------------------------------------------------------------------------------------------------------

/** Code and words of the cycles that the control has; the others are expanded to moves. */
function cycleWords() {
  var dwell = "P" + secondsFormat.format(cycle.dwell || 0);
  var peck = "Q" + xyzFormat.format(cycle.incrementalDepth || 0);
  switch (cycleType) {
  case "drilling":
    return ["G81"];
  case "counter-boring":
    return cycle.dwell > 0 ? ["G82", dwell] : ["G81"];
  case "chip-breaking":
    return ["G73", peck];
  case "deep-drilling":
    return ["G83", peck];
  case "reaming":
  case "boring":
    return cycle.dwell > 0 ? ["G89", dwell] : ["G85"];
  case "stop-boring":
    return ["G86", dwell];
  case "tapping":
  case "right-tapping":
    return ["G84"];
  case "left-tapping":
    return ["G74"];
  default:
    return [];
  }
}

function onCyclePoint(x, y, z) {
  var words = cycleWords();
  if (words.length == 0) {
    expandCyclePoint(x, y, z);
    return;
  }
  if (isFirstCyclePoint()) {
    repositionToCycleClearance(cycle, x, y, z);
    forgetWhere();
    var tap = /tapping/.test(cycleType);
    var feed = tap ? spindleSpeed * tool.threadPitch : cycle.feedrate;
    writeWords(["G98", words[0], "X" + xyzFormat.format(x), "Y" + xyzFormat.format(y), "Z" + xyzFormat.format(z),
      "R" + xyzFormat.format(cycle.retract)].concat(words.slice(1), ["F" + feedFormat.format(feed)]));
  } else {
    writeWords(["X" + xyzFormat.format(x), "Y" + xyzFormat.format(y), "Z" + xyzFormat.format(z),
      "R" + xyzFormat.format(cycle.retract)]);
  }
}

function onCycleEnd() {
  if (!cycleExpanded) {
    say("G80");
    forgetWhere();
  }
}

// Commands and end ----------------------------------------------------------------------------------------------------

function onCommand(command) {
  switch (command) {
  case COMMAND_STOP:
    say("M0");
    return;
  case COMMAND_OPTIONAL_STOP:
    say("M1");
    return;
  case COMMAND_SPINDLE_CLOCKWISE:
    say("M3");
    return;
  case COMMAND_SPINDLE_COUNTERCLOCKWISE:
    say("M4");
    return;
  case COMMAND_STOP_SPINDLE:
    say("M5");
    return;
  case COMMAND_COOLANT_ON:
    writeCoolant();
    return;
  case COMMAND_COOLANT_OFF:
    say("M9");
    return;
  case COMMAND_LOCK_MULTI_AXIS:
  case COMMAND_UNLOCK_MULTI_AXIS:
  case COMMAND_BREAK_CONTROL:
  case COMMAND_TOOL_MEASURE:
    return;
  default:
    onUnsupportedCommand(command);
  }
}

function onComment(text) {
  comment(text);
}

function onPassThrough(text) {
  var lines = String(text).split(",");
  for (var i = 0; i < lines.length; ++i) {
    writeln(lines[i]);
  }
}

function onClose() {
  retract();
  say("M5");
  say("M9");
  say("M30");
}
