"""Runs in freecadcmd: makes small jobs and posts them by cam/trunnion_post.py, with what the tool must do beside each.

Reads from the environment: TRN_POST, the folder of the post; TRN_OUT, where PROGRAM.ngc and PROGRAM.json go.
"""
import json
import os
import sys

import FreeCAD
import Part
import Path
import PathScripts.PathDrilling as PathDrilling
import PathScripts.PathJob as PathJob
import PathScripts.PathPostProcessor as PathPostProcessor
import PathScripts.PathProfile as PathProfile

sys.path.insert(0, os.environ["TRN_POST"])
import trunnion_post  # noqa: E402

POST = PathPostProcessor.PostProcessor.load("trunnion")  # as FreeCAD itself finds it
OUT = os.environ["TRN_OUT"]
MILL = "--machine ../configs/mill.toml --tools ../examples/tools.tbl --retract 200"
CRADLE = "--machine ../configs/cradle.toml --tools ../examples/tools.tbl --retract 450 --rtcp --axis-tolerance 0.05"


def write(name, things, arguments, expected, tool_mm=None):
    POST.export(things, os.path.join(OUT, name + ".ngc"), arguments)
    with open(os.path.join(OUT, name + ".json"), "w", encoding="ascii") as file:
        json.dump({"places": expected, "tool_mm": tool_mm}, file)


def places(commands, placement=FreeCAD.Placement()):
    """(tip, tool axis) at the end of every feed move, in the job's coordinates, as FreeCAD itself computes them."""
    at, found = {"X": 0.0, "Y": 0.0, "Z": 0.0}, []
    for command in commands:
        at.update({letter: value for letter, value in command.Parameters.items() if letter in "XYZABC"})
        if command.Name in ("G1", "G2", "G3") and "Z" in at:
            tip = placement.multVec(FreeCAD.Vector(at["X"], at["Y"], at["Z"]))
            axis = placement.Rotation.multVec(FreeCAD.Vector(0, 0, 1))
            if "A" in at or "C" in at:
                turn = FreeCAD.Rotation(FreeCAD.Vector(0, 0, 1), -at.get("C", 0)).multiply(
                    FreeCAD.Rotation(FreeCAD.Vector(1, 0, 0), -at.get("A", 0)))
                axis = turn.multVec(FreeCAD.Vector(0, 0, 1))
            found.append([list(tip), list(axis)])
    return found


def feature(document, name, commands, placement=None):
    made = document.addObject("Path::Feature", name)
    made.Path = Path.Path(commands)
    if placement is not None:
        made.Placement = placement
    return made


def plate(document):
    shape = Part.makeBox(60, 40, 10)
    for x, y in ((10, 10), (50, 30)):
        shape = shape.cut(Part.makeCylinder(2.5, 10, FreeCAD.Vector(x, y, 0)))
    made = document.addObject("Part::Feature", "Plate")
    made.Shape = shape
    return made


def three_axes():
    """A real job: an outline and a hole, by FreeCAD's own operations, and a second tool."""
    document = FreeCAD.newDocument("three")
    part = plate(document)
    document.recompute()
    job = PathJob.Create("Job", [part])
    control = job.Tools.Group[0]
    control.ToolNumber, control.HorizFeed, control.VertFeed, control.SpindleSpeed = 2, "800 mm/min", "300 mm/min", 6000
    outline = PathProfile.Create("Outline")
    hole = PathDrilling.Create("Holes")
    document.recompute()
    change = feature(document, "Drill", [Path.Command("M6", {"T": 3}), Path.Command("M3", {"S": 2500})])
    engrave = feature(document, "Slot", [
        Path.Command("G0", {"Z": 20}), Path.Command("G0", {"X": 5, "Y": 5}), Path.Command("G0", {"Z": 12}),
        Path.Command("G1", {"Z": 9, "F": 4}), Path.Command("G1", {"X": 25, "F": 10}),
        Path.Command("G3", {"X": 25, "Y": 15, "I": 0, "J": 5, "K": 0, "F": 10}), Path.Command("G0", {"Z": 20})])
    things = [control, outline, hole, change, engrave]
    drilled = [command for command in hole.Path.Commands if command.Name == "G81"]
    bottoms = [[[c.Parameters["X"], c.Parameters["Y"], c.Parameters["Z"]], None] for c in drilled]
    write("three_axes", things, MILL, places(outline.Path.Commands) + bottoms + places(engrave.Path.Commands))


def five_axes():
    document = FreeCAD.newDocument("five")
    change = feature(document, "Ball", [Path.Command("M6", {"T": 1}), Path.Command("M3", {"S": 9000})])
    moves = [Path.Command("G0", {"X": 0, "Y": 0, "Z": 40, "A": 0, "C": 0})]
    for step in range(8):
        moves.append(Path.Command("G1", {"X": 5 * step, "Y": 10 - step, "Z": 20, "A": 4 * step, "C": 10 * step,
                                         "F": 15}))
    moves.append(Path.Command("G0", {"Z": 60}))
    sweep = feature(document, "Sweep", moves)
    write("five_axes", [change, sweep], CRADLE, places(moves), 100)


def tilted():
    """Operations in planes that lean: about two axes, and about one."""
    document = FreeCAD.newDocument("tilted")
    change = feature(document, "Mill", [Path.Command("M6", {"T": 2}), Path.Command("M3", {"S": 6000})])
    moves = [Path.Command("G0", {"X": 0, "Y": 0, "Z": 30}), Path.Command("G1", {"Z": -1, "F": 5}),
             Path.Command("G1", {"X": 12, "F": 15}), Path.Command("G1", {"Y": 7, "F": 15}),
             Path.Command("G0", {"Z": 30})]
    things, expected = [change], []
    planes = (((3, -12, -2), (1, 0.3, 0.2), 18), ((10, 5, 0), (0, 1, 0), 12), ((0, 0, 0), (0, 0, 1), 0))
    for base, axis, angle in planes:
        placement = FreeCAD.Placement(FreeCAD.Vector(*base), FreeCAD.Rotation(FreeCAD.Vector(*axis), angle))
        things.append(feature(document, "Face", moves, placement))
        expected += places(moves, placement)
    write("tilted", things, CRADLE, expected, 80)


def refused():
    document = FreeCAD.newDocument("refused")
    leaning = feature(document, "Face", [Path.Command("G1", {"X": 1})],
                      FreeCAD.Placement(FreeCAD.Vector(), FreeCAD.Rotation(FreeCAD.Vector(1, 0, 0), 10)))
    for arguments, needed in ((MILL, "--rtcp"), ("--rtcp", "--retract"), ("--retrakt 3", "the arguments are")):
        try:
            trunnion_post.export([leaning], "-", arguments)
        except ValueError as error:
            assert needed in str(error), error
        else:
            raise AssertionError(f"not refused: {arguments}")


three_axes()
five_axes()
tilted()
refused()
print("jobs posted")
