"""Judges a posted program: it must be read without an error or a warning, run within limits, and bring the tool to
every place of the job, with the tool's axis as the job has it. The places come from the CAM side, not from the
program. On the cradle the tool's place comes from the motors' setpoints by the closed form of docs/sources.md, S1.2."""
import csv
import math
import os
import subprocess

TIP_MM, AXIS_DEG = 0.0101, 0.0501  # G64 of the program
NEAR_MM = 0.03                     # rows of the trace lie apart
TABLE_MM = 75.0                    # the cradle's table below the crossing of A and C


def judge(binary, source, program, expected):
    """Number of places, errors. `expected`: places, as [tip, tool axis or None] in the part; tool_mm, the tool's
    length, of programs for the cradle."""
    read = subprocess.run([binary, "interpret", program, "--machine", machine_of(program), "--tools",
                           os.path.join(source, "examples/tools.tbl")], capture_output=True, text=True)
    errors = [read.stderr] if read.returncode or "warning" in read.stderr else []
    trace = program + ".csv"
    run = subprocess.run([binary, "run", program, "--trace", trace, "--trace-density", "4"], capture_output=True,
                         text=True)
    if run.returncode or "every joint within its limits" not in run.stdout:
        return 0, errors + [f"run ended with {run.returncode}: {run.stderr}{run.stdout}"]
    rows = rows_of(trace, expected.get("tool_mm"))
    places = expected["places"]
    return len(places), errors + [error for tip, axis in places for error in missing(rows, tip, axis)]


def machine_of(program):
    with open(program, encoding="ascii") as file:
        first = file.readline()
    return os.path.join(os.path.dirname(program), first.split("machine: ")[1].split(";")[0].split(")")[0])


def rows_of(trace, tool_mm):
    """(tip, tool axis) in the part, of every row."""
    with open(trace, encoding="ascii") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    if tool_mm is None:
        return [([row[f"p_{a}"] for a in "xyz"], [row[f"u_{a}"] for a in "ijk"]) for row in rows]
    return [cradle(row, tool_mm) for row in rows]


def cradle(row, tool_mm):
    tip = into_part((row["X"], row["Y"], row["Z"] - tool_mm), row["A"], row["C"], TABLE_MM)
    return [tip[0], tip[1], tip[2] - TABLE_MM], into_part((0, 0, 1), row["A"], row["C"], 0)


def into_part(v, a, c, down_mm):
    """Rz(-c) (Rx(-a) v + down)."""
    x, y, z = v[0], v[1] * math.cos(a) + v[2] * math.sin(a), -v[1] * math.sin(a) + v[2] * math.cos(a) + down_mm
    return [x * math.cos(c) + y * math.sin(c), -x * math.sin(c) + y * math.cos(c), z]


def missing(rows, tip, axis):
    near = [(math.dist(tip, p), u) for p, u in rows if math.dist(tip, p) < NEAR_MM]
    if not near:
        nearest = min(rows, key=lambda row: math.dist(tip, row[0]))[0]
        return [f"the tool never came to {tip}; the nearest place is {nearest}"]
    if axis is None:
        return []
    off = min(angle_deg(axis, u) for _, u in near)
    return [] if off < AXIS_DEG * 1.2 else [f"at {tip} the tool's axis is off by {off:.3f} degrees"]


def angle_deg(a, b):
    cross = math.dist((0, 0, 0), (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))
    return math.degrees(math.atan2(cross, sum(x * y for x, y in zip(a, b))))
