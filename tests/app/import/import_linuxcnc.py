#!/usr/bin/python3
"""usage: import_linuxcnc.py TRUNNION SOURCE_DIR

`trunnion import linuxcnc` as people use it: machines are imported, their programs are run, and the setpoints are
compared with the closed form of each kinematics, written here from LinuxCNC's manual. Where linuxcnc-uspace is
installed, its own modules are asked too, and every INI of its examples is tried.
"""
import csv
import ctypes
import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

BINARY, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
MACHINES = SOURCE / "tests/app/import/machines"
MODULES = Path("/usr/lib/linuxcnc/modules")
EXAMPLES = Path("/usr/share/doc/linuxcnc/examples")
PLACE = re.compile(r"^[^:]+:\d+:\d+: \S")
LENGTH_MM, ANGLE_RAD = 1e-6, 1e-9  # what 12 digits in a config and the trace's own rounding may leave


def trunnion(*arguments, cwd=None):
    done = subprocess.run([BINARY, *map(str, arguments)], capture_output=True, cwd=cwd, timeout=120)
    return done.returncode, done.stdout.decode("utf-8", "replace"), done.stderr.decode("utf-8", "replace")


# The closed forms: joints of LinuxCNC for words in mm and degrees. `tool` is the length of the tool in force.
# The numbers are those of machines/*.hal.

def tilting_table(x, y, z, tilt_deg, c_deg, tool, tilts_about_x):
    """Manual, "5-axis kinematics": the tip, seen from the rotation point, is turned by C, seen from the tilting axis,
    turned by the tilt, and the spindle stands a tool's length above it."""
    px, py, pz = 12.5, -7.0, 31.0
    dx, dy, dz = (0.0, 20.0, -9.25) if tilts_about_x else (20.0, 0.0, -9.25)
    t, c = math.radians(tilt_deg), math.radians(c_deg)
    ux = math.cos(c) * (x - px) - math.sin(c) * (y - py) - dx
    uy = math.sin(c) * (x - px) + math.cos(c) * (y - py) - dy
    uz = (z - pz) - dz
    if tilts_about_x:
        vx, vy, vz = ux, math.cos(t) * uy - math.sin(t) * uz, math.sin(t) * uy + math.cos(t) * uz
    else:
        vx, vy, vz = math.cos(t) * ux + math.sin(t) * uz, uy, -math.sin(t) * ux + math.cos(t) * uz
    return [px + dx + vx, py + dy + vy, pz + dz + vz + tool, t, c]


def bridge(x, y, z, b_deg, c_deg, tool):
    """Manual of 5axiskins: the tip hangs at the end of the pivot length, which the tool makes longer."""
    b, c = math.radians(b_deg), math.radians(c_deg)
    length = 175.5 + tool
    return [x - length * math.sin(b) * math.cos(c), y - length * math.sin(b) * math.sin(c),
            z - 175.5 + length * math.cos(b), b, c]


def hexapod_points():
    points = {}
    for line in (MACHINES / "hexapod.hal").read_text().splitlines():
        match = re.match(r"setp genhexkins\.(base|platform)\.(\d)\.([xyz]) (\S+)", line)
        if match:
            points.setdefault((match[1], int(match[2])), {})[match[3]] = float(match[4])
    return points


def legs(x, y, z, a_deg, b_deg, tool):
    """Manual of genhexkins: each leg is as long as its two joints are apart. The platform's origin, upright, is where
    the words say, and it tilts about the point of the tool below it."""
    a, b = math.radians(a_deg), math.radians(b_deg)
    below = 35.0 + tool
    points, out = hexapod_points(), []
    for i in range(6):
        p, q = points["platform", i], points["base", i]
        px, py, pz = p["x"], p["y"], p["z"] + below
        px, py, pz = px, math.cos(a) * py - math.sin(a) * pz, math.sin(a) * py + math.cos(a) * pz  # Rx(A)
        px, py, pz = math.cos(b) * px + math.sin(b) * pz, py, -math.sin(b) * px + math.cos(b) * pz  # Ry(B)
        # A word of the program is the tip; LinuxCNC adds the tool's length to Z before it asks its kinematics.
        out.append(math.dist((x + px, y + py, z + tool - below + pz), (q["x"], q["y"], q["z"])))
    return out


FIVE = [(10, 20, 30, 0, 0), (-20, 10, 40, 30, 50), (15, -25, 35, -40, -80), (60, 40, 90, 75, 200)]
TILTS = [(10, 20, 480, 0, 0), (-15, 5, 500, 12, 0), (20, -10, 470, 0, 0), (5, 5, 490, 0, -14), (0, 0, 480, 0, 0)]


def five_axis_program(letters, points, tool, on="M428"):
    lines = ["G21 G90 G61.1", f"T{tool} M6 G43" if tool else "G49", on, "F4000"]
    first = len(lines) + 1
    for point in points:
        lines.append("G1 " + " ".join(f"{letter}{value}" for letter, value in zip(letters, point)))
    return "\n".join(lines + ["M2", ""]), first


class Workshop(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def imported(self, name, *more, to="new"):
        code, out, err = trunnion("import", "linuxcnc", MACHINES / f"{name}.ini", "--to", self.folder / to, *more)
        self.assertEqual(code, 0, err)
        return self.folder / to / name, out, err

    def trace(self, stem, program, tools=True):
        """Rows (line of the source, joints) of a run on the imported machine; `tool_rows` has tip and axis of each."""
        path = self.folder / "program.ngc"
        path.write_text(program)
        more = ["--tools", f"{stem}.tbl"] if tools else []
        code, out, err = trunnion("run", path, "--machine", f"{stem}.toml", *more, "--trace", self.folder / "t.csv")
        self.assertEqual(code, 0, out + err)
        with open(self.folder / "t.csv", newline="") as file:
            rows = list(csv.reader(file))
        joints = rows[0].index("p_x")
        self.tool_rows = [[float(v) for v in row[joints:joints + 6]] for row in rows[1:]]
        return [(int(row[-1]), [float(v) for v in row[1:joints]]) for row in rows[1:]]

    def assert_joints(self, seen, wanted, rotary, where):
        self.assertEqual(len(seen), len(wanted), where)
        for i, (a, b) in enumerate(zip(seen, wanted)):
            self.assertLess(abs(a - b), ANGLE_RAD if i in rotary else LENGTH_MM, f"{where}: joint {i}: {a}, not {b}")

    def run_five(self, name, letters, form, tool, length):
        stem, _, _ = self.imported(name)
        program, first = five_axis_program(letters, FIVE, tool)
        rows = self.trace(stem, program)
        judged = 0
        for line, joints in rows:
            index = line - first
            if not 1 <= index < len(FIVE):
                continue
            # The rotary words turn evenly with X, Y and Z: C tells how far along its line the tip is.
            a, b = FIVE[index - 1], FIVE[index]
            share = (math.degrees(joints[4]) - a[4]) / (b[4] - a[4])
            words = [p + share * (q - p) for p, q in zip(a, b)]
            self.assert_joints(joints, form(*words, length), (3, 4), f"{name}, line {line}, share {share}")
            judged += 1
        self.assertGreater(judged, 1000)
        self.assert_joints(rows[-1][1], form(*FIVE[-1], length), (3, 4), "end")


class Kinematics(Workshop):
    def test_xyzac(self):
        for tool, length in ((0, 0), (1, 50.5)):
            self.run_five("xyzac", "XYZAC", lambda *w: tilting_table(*w, True), tool, length)
            shutil.rmtree(self.folder / "new")

    def test_xyzac_with_conventional_directions(self):
        """With that pin of newer modules both axes turn the other way."""
        for file in list(MACHINES.glob("xyzac.*")) + list(MACHINES.glob("five.*")):
            shutil.copy(file, self.folder)
        with open(self.folder / "xyzac.hal", "a") as hal:
            hal.write("setp xyzac-trt-kins.conventional-directions TRUE\n")
        code, _, err = trunnion("import", "linuxcnc", self.folder / "xyzac.ini", "--to", self.folder / "new")
        self.assertEqual(code, 0, err)
        rows = self.trace(self.folder / "new/xyzac", five_axis_program("XYZAC", FIVE, 0)[0])
        x, y, z, a, c = FIVE[-1]
        wanted = tilting_table(x, y, z, -a, -c, 0, True)[:3] + [math.radians(a), math.radians(c)]
        self.assert_joints(rows[-1][1], wanted, (3, 4), "end")

    def test_xyzbc(self):
        for tool, length in ((0, 0), (2, 80.0)):
            self.run_five("xyzbc", "XYZBC", lambda *w: tilting_table(*w, False), tool, length)
            shutil.rmtree(self.folder / "new")

    def test_bridge(self):
        for tool, length in ((0, 0), (1, 50.5)):
            self.run_five("bridge", "XYZBC", bridge, tool, length)
            shutil.rmtree(self.folder / "new")

    def test_off_is_identity(self):
        """With RTCP off the words are the joints, as in LinuxCNC's identity kinematics."""
        stem, _, _ = self.imported("xyzac")
        rows = self.trace(stem, five_axis_program("XYZAC", FIVE, 0, on="M429")[0])
        x, y, z, a, c = FIVE[-1]
        self.assert_joints(rows[-1][1], [x, y, z, math.radians(a), math.radians(c)], (3, 4), "end")

    def test_hexapod(self):
        stem, _, _ = self.imported("hexapod")
        (self.folder / "new/hexapod.tbl").write_text("T1 P1 Z40 D6\n")
        for tool, length in ((0, 0), (1, 40.0)):
            program, first = five_axis_program("XYZAB", [(x, y, z - length, a, b) for x, y, z, a, b in TILTS], tool)
            rows = self.trace(stem, program)
            ends = dict(rows)  # the last row of each line; G61.1 stops there
            for index, (x, y, z, a, b) in enumerate(TILTS[:-1]):
                # With G61.1 the next line begins where this one ends.
                self.assert_joints(ends[first + index], legs(x, y, z - length, a, b, length), (), f"point {index}")
            self.assert_joints(ends[max(ends)], legs(0, 0, TILTS[-1][2] - length, 0, 0, length), (), "end")
            for (line, joints), (x, y, z, i, j, k) in zip(rows, self.tool_rows):
                if line >= first:  # the axis is Rx(A) Ry(B) of Z
                    a, b = math.degrees(math.atan2(-j, k)), math.degrees(math.asin(i))
                    self.assert_joints(joints, legs(x, y, z, a, b, length), (), f"line {line}, {x} {y} {z}")

    def test_inches(self):
        """trivkins in inches: words of either unit are the joints in mm, offset G55 from the variables included."""
        stem, _, _ = self.imported("mill_inch")
        offset = [1.5, -0.5, 0.25]
        code, out, err = trunnion("run", self.write("p.ngc", "G20 G90 G61.1\nT1 M6 G43\nG1 F60 X1 Y2 Z-1\nM2\n"),
                                  "--machine", f"{stem}.toml", "--tools", f"{stem}.tbl", "--vars", f"{stem}.var",
                                  "--trace", self.folder / "t.csv")
        self.assertEqual(code, 0, out + err)
        last = (self.folder / "t.csv").read_text().strip().splitlines()[-1].split(",")
        wanted = [25.4 * (v + o) for v, o in zip((1, 2, -1 + 2.0), offset)]  # the tool is 2 inches long
        self.assert_joints([float(v) for v in last[1:4]], wanted, (), "end")

    def test_trivkins_of_any_letters(self):
        """The words are the joints, whatever axes there are; a joint between that the machine has not is left out."""
        for letters, more in (("XZ", ""), ("XYZA", ""), ("XYZAC", ""), ("XYZABC", ""),
                              ("XZ", "[TRAJ]\nCOORDINATES = XZ\n")):
            kinematics = "trivkins" if more else f"trivkins coordinates={letters}"
            text = f"[KINS]\nKINEMATICS = {kinematics}\nJOINTS = {3 if more else len(letters)}\n{more}"
            for i, letter in enumerate("XYZ" if more else letters):
                kind = "ANGULAR" if letter in "ABC" else "LINEAR"
                if letter in letters:
                    text += (f"[JOINT_{i}]\nTYPE = {kind}\nMIN_LIMIT = -200\nMAX_LIMIT = 200\nMAX_VELOCITY = 100\n"
                             "MAX_ACCELERATION = 500\n")
            ini = self.write("any.ini", text)
            code, _, err = trunnion("import", "linuxcnc", ini, "--to", self.folder / "any", "--force")
            self.assertEqual(code, 0, err)
            words = [12.5 * (i + 1) for i in range(len(letters))]
            program = "G21 G90 G61.1\nG1 F2000 " + " ".join(f"{a}{w}" for a, w in zip(letters, words)) + "\nM2\n"
            rows = self.trace(self.folder / "any/any", program, tools=False)
            wanted = [math.radians(w) if a in "ABC" else w for a, w in zip(letters, words)]
            self.assert_joints(rows[-1][1], wanted, range(3, 6), letters)

    def test_parameters_in_inches(self):
        """What setp says of the kinematics is in the units of the machine, as its limits are."""
        for file in list(MACHINES.glob("xyzac.*")) + list(MACHINES.glob("five.*")):
            shutil.copy(file, self.folder)
        ini = (self.folder / "xyzac.ini").read_text()
        (self.folder / "xyzac.ini").write_text(ini.replace("LINEAR_UNITS = mm", "LINEAR_UNITS = inch"))
        code, _, err = trunnion("import", "linuxcnc", self.folder / "xyzac.ini", "--to", self.folder / "new")
        self.assertEqual(code, 0, err)
        program, _ = five_axis_program("XYZAC", FIVE, 1)
        rows = self.trace(self.folder / "new/xyzac", program.replace("G21", "G20"))
        x, y, z, a, c = FIVE[-1]
        form = tilting_table(x, y, z, a, c, 50.5, True)
        self.assert_joints(rows[-1][1], [25.4 * v for v in form[:3]] + form[3:], (3, 4), "end")

    def test_gantry(self):
        stem, _, err = self.imported("gantry")
        rows = self.trace(stem, "G21 G90 G61.1 G1 F3000 X30 Y40 Z-5\nX0 Y10 Z-20\nM2\n")  # the INI names no table
        self.assertEqual(len(rows[-1][1]), 3)
        self.assertRegex(err, r"gantry\.ini:\d+:1: \[JOINT_2\], a second motor of axis Y: .*MAX_LIMIT = 900.*"
                              r"\[\[drives\.gantry\]\]")

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return self.folder / name


@unittest.skipUnless((MODULES / "genhexkins.so").exists() and shutil.which("gcc"), "no linuxcnc-uspace, or no gcc")
class ModulesThemselves(unittest.TestCase):
    """The closed forms above are what the modules of the package compute."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        path = Path(cls.folder.name) / "hal_stand_in.so"
        subprocess.run(["gcc", "-shared", "-fPIC", "-o", path, SOURCE / "tests/app/import/hal_stand_in.c"], check=True)
        cls.hal = ctypes.CDLL(path, mode=ctypes.RTLD_GLOBAL)
        cls.hal.stand_in_set.argtypes = [ctypes.c_char_p, ctypes.c_double]

    def inverse(self, name, values):
        module = ctypes.CDLL(MODULES / f"{name}.so")
        self.assertEqual(module.rtapi_app_main(), 0)
        for pin, value in values.items():
            self.assertEqual(self.hal.stand_in_set(f"{name}.{pin}".encode(), value), 0, pin)

        def joints(x, y, z, a=0.0, b=0.0, c=0.0, w=0.0):
            pose, out = (ctypes.c_double * 9)(x, y, z, a, b, c, 0, 0, w), (ctypes.c_double * 16)()
            flags = ctypes.c_ulong(0)
            self.assertEqual(module.kinematicsInverse(pose, out, ctypes.byref(flags), ctypes.byref(flags)), 0)
            return list(out)
        return joints

    def assert_same(self, joints, form, rotary=()):
        for i, value in enumerate(form):
            self.assertAlmostEqual(math.radians(joints[i]) if i in rotary else joints[i], value, places=9)

    def test_tilting_tables(self):
        point = {"x-rot-point": 12.5, "y-rot-point": -7, "z-rot-point": 31, "z-offset": -9.25}
        for about_x, name, values in ((True, "xyzac-trt-kins", point | {"y-offset": 20}),
                                      (False, "xyzbc-trt-kins", point | {"x-offset": 20})):
            for tool in (0.0, 50.5):
                joints = self.inverse(name, values | {"tool-offset": tool})
                for x, y, z, tilt, c in FIVE:  # LinuxCNC adds the tool to Z before the kinematics
                    got = joints(x, y, z + tool, **{"a" if about_x else "b": tilt}, c=c)
                    self.assert_same(got, tilting_table(x, y, z, tilt, c, tool, about_x), (3, 4))

    def test_bridge(self):
        joints = self.inverse("5axiskins", {"pivot-length": 175.5})
        for x, y, z, b, c in FIVE:
            self.assert_same(joints(x, y, z, b=b, c=c), bridge(x, y, z, b, c, 0), (3, 4))
            # W makes the pivot length longer, and moves Z by as much.
            self.assert_same(joints(x, y, z, b=b, c=c, w=50.5), bridge(x, y, z, b, c, 50.5), (3, 4))

    def test_hexapod(self):
        values = {f"{n}.{i}.{k}": v for (n, i), p in hexapod_points().items() for k, v in p.items()}
        for tool in (0.0, 40.0):
            joints = self.inverse("genhexkins", values | {"spindle-offset": 35, "tool-offset": tool, "screw-lead": 0})
            for x, y, z, a, b in TILTS:
                self.assert_same(joints(x, y, z + tool, a=a, b=b), legs(x, y, z, a, b, tool))


class WhatIsTold(Workshop):
    def test_the_config_of_a_mill(self):
        stem, out, err = self.imported("mill_inch", "--json")
        config = tomllib.loads(Path(f"{stem}.toml").read_text())
        x = config["joint"][0]
        # The narrower of joint (-10 to 11, 7, 30) and axis (-9 to 12, 6, 40) inches.
        self.assertEqual([x["min_mm"], x["max_mm"], x["velocity_mm_s"], x["acceleration_mm_s2"], x["jerk_mm_s3"]],
                         [-228.6, 279.4, 152.4, 762.0, 15240.0])
        self.assertEqual(config["machine"], {"name": "mill_in_inches", "period_s": 0.002})
        drive = config["drives"]["joint"][0]
        self.assertEqual([drive["start_mm"], drive["homed"], drive["homing_speed_mm_s"]], [12.7, False, 38.1])
        self.assertAlmostEqual(drive["home_mm"] + drive["index_distance_mm"], 12.7, delta=0.01)
        node = Path(f"{stem}.toml").read_text().split("# [[drives.node]]")[1].split("[[drives.joint]]")[0]
        for line in ("home_mm = -6.35", "home_final_mm = 12.7", "homing_speed_mm_s = 38.1", "index_speed_mm_s = 2.54"):
            self.assertIn(f"# {line}\n", node)
        self.assertNotIn("homed", config["drives"]["joint"][1])
        self.assertEqual(config["program"]["tolerance_mm"], 0.0508)
        self.assertEqual(config["program"]["m_code"], [{"code": "M110", "call": "touch"},
                                                       {"code": "M10", "call": "touch"}])
        self.assertEqual(config["tool_change"], {"confirm": "none"})
        self.assertTrue(config["io"]["spindle"]["encoder"])
        told = json.loads(out)
        self.assertEqual([joint["name"] for joint in told["joints"]], ["X", "Y", "Z"])
        self.assertEqual([Path(p).suffix for p in told["written"]], [".toml", ".tbl", ".var"])
        self.assertEqual(len(told["notes"]), len(err.splitlines()))
        self.assertTrue(all(PLACE.match(line) for line in err.splitlines()), err)

    def test_nothing_is_dropped_without_a_word(self):
        """Each key of the INI and each name of HAL that changes nothing in the config is named, in the comments of the
        config and on stderr."""
        ini = (MACHINES / "mill_inch.ini").read_text()
        ini += "[JOINT_2]\nODD_KEY = 4711\nMAX_VELOCITY = 77\n[ODD]\nOTHER = 4712\n"
        hal = (MACHINES / "mill_inch.hal").read_text()
        hal += "loadrt oddmod\nloadusr -Wn odd oddprogram\nnet odd-signal a b\n"
        for file in MACHINES.glob("mill_*"):
            shutil.copy(file, self.folder)
        (self.folder / "mill_inch.ini").write_text(ini)
        (self.folder / "mill_inch.hal").write_text(hal)
        code, _, err = trunnion("import", "linuxcnc", self.folder / "mill_inch.ini", "--to", self.folder / "new")
        self.assertEqual(code, 0, err)
        comments = " ".join(line.lstrip("# ") for line in (self.folder / "new/mill_inch.toml").read_text().splitlines()
                            if line.startswith("#"))
        for name in ("ODD_KEY = 4711", "MAX_VELOCITY = 77",
                     "OTHER = 4712", "oddmod", "oddprogram", "odd-signal", "MIN_FERROR = 0.01",
                     "G88.6", "nowhere.tcl", "or2.0.in0 = 1", "pwmgen.0.scale = 6000", "spindle-speed", "estop-loop",
                     "probe", "MAX_FORWARD_VELOCITY", "MAX_SPINDLE_OVERRIDE", "RS274NGC_STARTUP_CODE", "DISPLAY = axis",
                     "#31 to #5000", "jerk of Y"):
            self.assertIn(name, comments)
            self.assertIn(name, err)

    def test_sub_programs_are_found(self):
        """An M code that is a REMAP with ngc= calls its sub-program from the INI's folders, wherever a program lies."""
        for file in MACHINES.glob("mill_*"):
            shutil.copy(file, self.folder)
        for name in ("subs", "parts"):
            (self.folder / name).mkdir()
        (self.folder / "subs/touch.ngc").write_text("o<touch> sub\nG1 F100 X[#1]\no<touch> endsub\nM2\n")
        with open(self.folder / "mill_inch.ini", "a") as ini:
            ini.write("[RS274NGC]\nSUBROUTINE_PATH = ~/mine:subs\n")
        code, _, err = trunnion("import", "linuxcnc", "mill_inch.ini", "--to", "new", cwd=self.folder)
        self.assertEqual(code, 0, err)
        self.assertRegex(err, r"mill_inch\.ini:\d+:19: SUBROUTINE_PATH = ~/mine: .*whole path")
        program = self.folder / "parts/p.ngc"
        program.write_text("G21 G90 G61.1 G54\nM110 P17.5\nM2\n")
        code, out, err = trunnion("run", program, "--machine", self.folder / "new/mill_inch.toml", "--trace",
                                  self.folder / "t.csv")
        self.assertEqual(code, 0, out + err)
        last = (self.folder / "t.csv").read_text().strip().splitlines()[-1].split(",")
        self.assertAlmostEqual(float(last[1]), 17.5, places=6)

    def test_tables_in_mm(self):
        stem, _, _ = self.imported("mill_inch")
        self.assertRegex(Path(f"{stem}.tbl").read_text(), r"T1 P1 Z\+50\.80* D\+6\.350* ;quarter inch")
        values = dict(line.split() for line in Path(f"{stem}.var").read_text().splitlines())
        for number, wanted in ((5220, 2), (5241, 38.1), (5242, -12.7), (5243, 6.35), (100, 7)):
            self.assertAlmostEqual(float(values[str(number)]), wanted, places=9)

    def test_limits_of_the_programmed_position(self):
        """[AXIS_X] of a machine whose X is no joint's alone bounds nothing here, and that is told."""
        for file in list(MACHINES.glob("xyzac.*")) + list(MACHINES.glob("five.*")):
            shutil.copy(file, self.folder)
        ini = (self.folder / "xyzac.ini").read_text()
        (self.folder / "xyzac.ini").write_text(ini.replace("MAX_VELOCITY = 200", "MAX_VELOCITY = 150", 1))
        code, _, err = trunnion("import", "linuxcnc", self.folder / "xyzac.ini", "--to", self.folder / "new")
        self.assertEqual(code, 0, err)
        told = r"xyzac\.ini:\d+:1: \[AXIS_X\] from -600 to 600, velocity 150, acceleration 2000: it bounds"
        self.assertRegex(err, told)
        self.assertNotIn("[AXIS_Y]", err)

    def test_a_gantry_with_backlash(self):
        stem, _, _ = self.imported("gantry")
        config = tomllib.loads(Path(f"{stem}.toml").read_text())
        self.assertEqual(config["corrections"]["joint_table"]["joint"], [{"joint": "Z", "backlash_mm": 0.03}])
        self.assertEqual([joint["name"] for joint in config["joint"]], ["X", "Y", "Z"])


class Files(Workshop):
    def test_nothing_is_overwritten_without_force(self):
        stem, _, _ = self.imported("xyzac")
        Path(f"{stem}.tbl").write_text("T9 P9 Z9\n")
        Path(f"{stem}.toml").unlink()
        code, _, err = trunnion("import", "linuxcnc", MACHINES / "xyzac.ini", "--to", self.folder / "new")
        self.assertEqual(code, 5, err)
        self.assertIn("xyzac.tbl: the file is there already; --force", err)
        self.assertFalse(Path(f"{stem}.toml").exists())
        self.assertEqual(Path(f"{stem}.tbl").read_text(), "T9 P9 Z9\n")
        self.imported("xyzac", "--force")
        self.assertIn("T1 P1", Path(f"{stem}.tbl").read_text())

    def test_files_of_linuxcnc_are_never_overwritten(self):
        for file in MACHINES.glob("mill_*"):
            shutil.copy(file, self.folder)
        before = (self.folder / "mill_inch.tbl").read_bytes()
        code, _, err = trunnion("import", "linuxcnc", "mill_inch.ini", "--force", cwd=self.folder)
        self.assertEqual(code, 5, err)
        self.assertIn("this file of LinuxCNC would be overwritten", err)
        self.assertEqual((self.folder / "mill_inch.tbl").read_bytes(), before)
        self.assertFalse((self.folder / "mill_inch.toml").exists())

    def test_help_teaches(self):
        code, out, _ = trunnion("import", "linuxcnc", "--help")
        self.assertEqual(code, 0)
        for word in ("NAME.toml", "--force", "Exit: 0 written, 3", "docs/from_linuxcnc.md"):
            self.assertIn(word, out)


SMALL = """[KINS]
KINEMATICS = trivkins coordinates=XZ
JOINTS = 2
[HAL]
HALFILE = m.hal
[TRAJ]
LINEAR_UNITS = mm
[EMCIO]
TOOL_TABLE = m.tbl
[RS274NGC]
PARAMETER_FILE = m.var
[JOINT_0]
TYPE = LINEAR
MAX_VELOCITY = 100
MAX_ACCELERATION = 1000
MIN_LIMIT = -50
MAX_LIMIT = 50
[JOINT_1]
TYPE = LINEAR
MAX_VELOCITY = 100
MAX_ACCELERATION = 1000
MIN_LIMIT = -50
MAX_LIMIT = 50
"""

# (what is replaced, by what, exit code, how the message begins)
BAD = [
    ("", "", 0, None),
    ("MIN_LIMIT = -50", "MIN_LIMIT = -5o", 3, r"m\.ini:16:13: \[JOINT_0\]MIN_LIMIT = '-5o' is no number; one as 12\.5"),
    ("MIN_LIMIT = -50", "MIN_LIMIT = 60", 3, r"m\.ini:17:13: the range of X is empty: MIN_LIMIT must be below"),
    ("MAX_VELOCITY = 100", "MAX_VELOCITY = 0", 3, r"m\.ini:14:16: \[JOINT_0\]MAX_VELOCITY must be above 0"),
    ("TYPE = LINEAR", "TYPE = ROUND", 3, r"m\.ini:13:8: TYPE = ROUND: LINEAR or ANGULAR would be right"),
    ("TYPE = LINEAR", "TYPE = ANGULAR", 3, r"m\.ini:13:8: \[JOINT_0\] moves axis X and is ANGULAR; LINEAR would"),
    ("= mm", "= furlong", 3, r"m\.ini:7:16: LINEAR_UNITS = 'furlong' is no unit; one of these would be right: mm"),
    ("[JOINT_1]", "[JOINT_7]", 3, r"m\.ini:1:1: axis Z is joint 1, and there is no section \[JOINT_1\]"),
    ("JOINTS = 2", "JOINTS = 1", 3, r"m\.ini:3:10: JOINTS = 1 but trivkins has 2 axes \(XZ\)"),
    ("coordinates=XZ\nJOINTS = 2", "coordinates=" + 9 * "XZ", 3, r"m\.ini:2:23: the number of joints must be a whole"),
    ("JOINTS = 2", "JOINTS = 2.5", 3, r"m\.ini:3:10: the number of joints must be a whole number from 1 to 16"),
    ("coordinates=XZ", "coordinates=XQ", 3, r"m\.ini:2:23: 'Q' in coordinates= is no axis"),
    ("trivkins coordinates=XZ", "xyzac-trt-kins coordinates=XZ", 3,
     r"m\.ini:2:29: xyzac-trt-kins needs the axes XYZAC; Y is missing in coordinates=XZ"),
    ("[TRAJ]", "[TRAJ", 3, r"m\.ini:6:1: a section has its name between"),
    ("trivkins coordinates=XZ", "scarakins", 4, r"m\.ini:2:14: kinematics 'scarakins' \(an arm of the SCARA kind\) has "
     r"no counterpart here; .*docs/new_machine\.md"),
    ("trivkins coordinates=XZ", "ourkins", 4, r"m\.ini:2:14: kinematics 'ourkins' is not known; trivkins, xyzac"),
    ("coordinates=XZ", "coordinates=XA", 4, r"m\.ini:19:8: \[JOINT_1\] moves axis A and is LINEAR"),
    ("trivkins coordinates=XZ", "xyzac-trt-kins coordinates=XYZACB", 4,
     r"m\.ini:2:29: axis B beside those of xyzac-trt-kins"),
    ("coordinates=XZ", "coordinates=UV", 4, r"m\.ini:2:23: of the axes UV none is X"),
    ("PARAMETER_FILE = m.var", "PARAMETER_FILE = bad.var", 3, r"bad\.var:2:1: parameter 31 stands below 5220; the num"),
    ("HALFILE = m.hal", "HALFILE = bad.hal", 3, r"bad\.hal:2:1: 'nett' is no command of HAL; did you mean 'net'\?"),
]


class BadInput(Workshop):
    def test_every_mistake_has_its_place(self):
        (self.folder / "m.hal").write_text("setp a.b 1\n")
        (self.folder / "bad.hal").write_text("setp a.b 1\nnett x y\n")
        (self.folder / "m.tbl").write_text("T1 P1 Z5\n")
        (self.folder / "m.var").write_text("5220\t1\n")
        (self.folder / "bad.var").write_text("5220\t1\n31\t2\n")
        for old, new, wanted, begin in BAD:
            with self.subTest(new=new):
                (self.folder / "m.ini").write_text(SMALL.replace(old, new, 1))
                code, _, err = trunnion("import", "linuxcnc", "m.ini", "--to", "new", "--force", cwd=self.folder)
                self.assertEqual(code, wanted, err)
                if begin:
                    self.assertRegex(err.splitlines()[-1], "^" + begin)
                    self.assertEqual(len(err.splitlines()), 1)

    def test_legs_that_do_not_reach(self):
        for name in ("hexapod.ini", "hexapod.hal"):
            text = (MACHINES / name).read_text().replace("MIN_LIMIT = 300", "MIN_LIMIT = 5")
            (self.folder / name).write_text(text.replace("MAX_LIMIT = 900", "MAX_LIMIT = 20"))
        legs = r"hexapod\.ini:7:14: upright above the middle of its base, this platform has no height"
        self.assert_refused("hexapod.ini", legs)

    def test_lengths_that_nobody_sets(self):
        """A hexapod without its points is refused; a bridge without its pivot length gets the module's, and a note."""
        for file in list(MACHINES.glob("hexapod.*")) + list(MACHINES.glob("bridge.*")) + list(MACHINES.glob("five.*")):
            shutil.copy(file, self.folder)
        hal = (MACHINES / "hexapod.hal").read_text()
        pin = "genhexkins.base.3.y"
        for wrong, message in (("", r"hexapod\.ini:7:14: nothing in the HAL files that were read sets " + pin),
                               (f"net s gui.y => {pin}", rf"hexapod\.hal:\d+:5: {pin} follows gui\.y"),
                               (f"setp {pin} no", rf"hexapod\.hal:\d+:26: 'no' for {pin} is no number")):
            (self.folder / "hexapod.hal").write_text(re.sub(f"setp {pin} .*", wrong, hal))
            code, _, err = trunnion("import", "linuxcnc", "hexapod.ini", "--to", "new", cwd=self.folder)
            self.assertEqual(code, 3)
            self.assertRegex(err, message)
        (self.folder / "bridge.hal").write_text("loadrt [KINS]KINEMATICS\n")
        code, _, err = trunnion("import", "linuxcnc", "bridge.ini", "--to", "new", cwd=self.folder)
        self.assertEqual(code, 0)
        told = "5axiskins.pivot-length: nothing in the HAL files that were read sets it; the module's own 250"
        self.assertIn(told, err)

    def test_what_makes_no_legal_config(self):
        """Whatever the config's own reader refuses is told, and nothing is written."""
        (self.folder / "m.ini").write_text(SMALL.replace("MAX_ACCELERATION = 1000", "MAX_ACCELERATION = 1e308"))
        self.assert_refused("m.ini", r"m\.ini:1:1: no legal config comes of this machine: ")

    def assert_refused(self, ini, begin):
        code, out, err = trunnion("import", "linuxcnc", ini, "--to", "new", cwd=self.folder)
        self.assertEqual((code, out), (4, ""))
        self.assertRegex(err, "^" + begin)
        self.assertFalse((self.folder / "new").exists())

    def test_no_file(self):
        code, _, err = trunnion("import", "linuxcnc", "gone.ini", cwd=self.folder)
        self.assertEqual((code, err), (3, "gone.ini:1:1: the file 'gone.ini' cannot be read\n"))


@unittest.skipUnless(EXAMPLES.is_dir(), "linuxcnc-uspace is not installed")
class Examples(Workshop):
    def test_every_example_is_imported_or_refused(self):
        (self.folder / "empty.ngc").write_text("M2\n")
        inis = sorted(EXAMPLES.rglob("*.ini"))
        imported, axes, codes = [], 0, {}
        for number, ini in enumerate(inis):
            to = self.folder / str(number)
            code, out, err = trunnion("import", "linuxcnc", ini, "--to", to, "--json")
            name, last = ini.relative_to(EXAMPLES), err.strip().splitlines()[-1]
            codes[code] = codes.get(code, 0) + 1
            self.assertIn(code, (0, 3, 4), f"{name}: {err[-300:]}")
            self.assertRegex(last, PLACE, name)
            if code != 0:
                print(f"{name}: refused ({code}): {last.replace(str(EXAMPLES) + '/', '')[:150]}")
                continue
            told = json.loads(out)
            # Another reader of the config than the one that the import asks: the whole assembly, with a program.
            check, _, why = trunnion("interpret", self.folder / "empty.ngc", "--machine", to / f"{ini.stem}.toml")
            self.assertEqual(check, 0, f"{name}: {why}")
            tomllib.loads((to / f"{ini.stem}.toml").read_text())
            imported.append(name)
            axes += len(told["joints"])
            names = " ".join(joint["name"] for joint in told["joints"])
            print(f"{name}: {told['kinematics']}, {names}, {len(told['notes'])} notes")
            shutil.rmtree(to)
        print(f"{len(inis)} INI files tried: {len(imported)} imported with {axes} joints, {codes.get(4, 0)} without "
              f"counterpart, {codes.get(3, 0)} not understood")
        self.assertGreater(len(imported), 0.8 * len(inis))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
