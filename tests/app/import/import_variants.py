#!/usr/bin/python3
"""usage: import_variants.py TRUNNION

What integrators' INI, HAL and tool files look like in the wild: other line ends, other encodings, comments with marks,
included files, Tcl, macros, a lathe, two motors of one axis, tables of other programs. Each is carried over and runs,
or is told in one sentence with its place.
"""
import math
import re
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

BINARY = Path(sys.argv[1]).resolve()
HEAD = """[EMC]
MACHINE = Mill
[DISPLAY]
DISPLAY = axis
[EMCMOT]
SERVO_PERIOD = 1000000
[HAL]
HALFILE = m.hal
[KINS]
JOINTS = @n
KINEMATICS = trivkins coordinates=@letters
[EMCIO]
TOOL_TABLE = m.tbl
[TRAJ]
LINEAR_UNITS = mm
"""
AXIS = """[AXIS_@l]
MIN_LIMIT = -100
MAX_LIMIT = 100
MAX_VELOCITY = 50
MAX_ACCELERATION = 500
"""
JOINT = """[JOINT_@i]
TYPE = @type
MIN_LIMIT = -100
MAX_LIMIT = 100
MAX_VELOCITY = 50
MAX_ACCELERATION = 500
STEP_SCALE = 200
"""
HAL = """loadrt [KINS]KINEMATICS
addf motion-controller servo-thread
net x joint.0.motor-pos-cmd => stepgen.0.position-cmd
"""
TABLE = "T1 P1 Z10.5 D6 ;end mill\n"


def machine(letters, kinds=""):
    text = HEAD.replace("@n", str(len(letters))).replace("@letters", letters + kinds)
    for i, letter in enumerate(letters):
        if letter not in letters[:i]:
            text += AXIS.replace("@l", letter)
        text += JOINT.replace("@i", str(i)).replace("@type", "ANGULAR" if letter in "ABC" else "LINEAR")
    return text


MILL = machine("XYZ")


def of_mill(old, new):
    assert old in MILL, old
    return MILL.replace(old, new, 1)


def with_keys(ini, **sections):
    """The INI with lines at the end of its sections, as JOINT_2="HOME = 0"."""
    for name, lines in sections.items():
        ini = ini.replace(f"[{name}]\n", f"[{name}]\n{lines}\n") if f"[{name}]" in ini else f"{ini}[{name}]\n{lines}\n"
    return ini


class Case:
    def __init__(self, told=None, ini=MILL, hal=HAL, table=TABLE, files=(), code=0, encoding="utf-8", axes="XYZ"):
        self.told, self.ini, self.hal, self.table, self.files = told, ini, hal, table, dict(files)
        self.code, self.encoding, self.axes = code, encoding, axes


CASES = {
    "plain": Case(),
    "no HALFILE": Case(ini=of_mill("HALFILE = m.hal\n", "")),
    "HALFILE that is not there": Case(r"m\.ini:8:11: m\.hal: this HAL file cannot be read", hal=None),
    "HALFILE in Tcl": Case(r"m\.ini:8:11: m\.tcl: a HAL file in Tcl is a program and is not read",
                           ini=of_mill("m.hal", "m.tcl"), files={"m.tcl": "source [file join x]\n"}),
    "HALFILE of the library": Case(r"m\.ini:8:11: LIB:nowhere\.hal: this HAL file cannot be read",
                                   ini=of_mill("m.hal", "LIB:nowhere.hal")),
    "inches": Case(ini=of_mill("= mm", "= inch")),
    "a negative scale": Case(ini=of_mill("STEP_SCALE = 200", "STEP_SCALE = -200")),
    "a scale of 0": Case(r"m\.ini:27:14: \[JOINT_0\]STEP_SCALE = 0: this is no number of counts",
                         ini=of_mill("STEP_SCALE = 200", "STEP_SCALE = 0")),
    "two joints for an axis": Case(r"m\.ini:\d+:1: \[JOINT_2\], a second motor of axis Y",
                                   ini=machine("XYYZ", " kinstype=BOTH")),
    "small letters": Case(ini=machine("XYZ", " kinstype=b").replace("coordinates=XYZ", "coordinates=xyz")),
    "a lathe": Case(r"\[DISPLAY\] LATHE = 1: diameters \(G7\)", axes="XZ",
                    ini=machine("XZ").replace("DISPLAY = axis", "DISPLAY = axis\nLATHE = 1")),
    "comments with marks": Case(ini=of_mill("[KINS]", "; = [x] # \"'\t§\n#[[[ %s\n[KINS]")),
    "comments behind values": Case(ini=of_mill("JOINTS = 3", "JOINTS = 3   # three; \"3\"")),
    "CRLF": Case(ini=MILL.replace("\n", "\r\n"), hal=HAL.replace("\n", "\r\n"), table=TABLE.replace("\n", "\r\n")),
    "Latin-1": Case(ini=of_mill("= Mill", "= Fräse für Ö"), hal=HAL + "# über\n", table="T1 P1 Z10.5 D6 ;Fräser\n",
                    encoding="latin-1"),
    "a mark of UTF-8 first": Case(ini="\ufeff" + MILL),
    "an included file": Case(r"sub/own\.inc:2:1: \[PROBE\] X = 1: a section that LinuxCNC itself does not read",
                             ini=of_mill("[HAL]", "#INCLUDE sub/own.inc\n[HAL]"),
                             files={"sub/own.inc": "[PROBE]\nX = 1\n"}),
    "an included file that is not there": Case(r"m\.ini:7:1: the file 'no\.inc' cannot be read", code=3,
                                               ini=of_mill("[HAL]", "#INCLUDE no.inc\n[HAL]")),
    "a file that includes itself": Case(r"#INCLUDE m\.ini: a file that is included itself includes no other",
                                        ini=of_mill("[HAL]", "#INCLUDE m.ini\n[HAL]")),
    "TWOPASS": Case(r"\[HAL\] TWOPASS = ON: there is no HAL",
                    ini=of_mill("HALFILE = m.hal", "TWOPASS = ON\nHALFILE = m.hal\nHALFILE = n.hal"),
                    files={"n.hal": "loadrt and2 count=1\nloadrt and2 count=2\n"}),
    "macros of loadrt": Case(r"m\.hal:6:10: \[NIX\]NADA: the INI has no such key",
                             hal=HAL + "loadrt $HM2(CARD)\nloadrt hm2_pci config=\"num_stepgens=4\"\n"
                             "setp a.b [NIX]NADA\n"),
    "a line that goes on into nothing": Case(r"m\.hal:4:1: words are missing behind 'setp'; 'setp PIN VALUE'", code=3,
                                             hal=HAL + "setp x.y \\\n"),
    "a command that HAL does not have": Case(r"m\.hal:4:1: 'frobnicate' is no command of HAL; setp, net", code=3,
                                             hal=HAL + "frobnicate all\n"),
    "a tool table of other columns": Case(r"m\.tbl:2:1: 1 1 10\.5 6\.0 mill: unexpected character .1.; a tool is",
                                          table="Pocket Tool Length\n1 1 10.5 6.0 mill\n"),
    "a comma in a length": Case(r"m\.tbl:1:10: T1 P1 Z10,5 D6: unexpected character .,.; a tool is a line as",
                                table="T1 P1 Z10,5 D6\n"),
    "a tool twice": Case(r"m\.tbl:2:1: T1 P2 Z11: the word T1 is given twice; this tool was left out",
                         table="T1 P1 Z10\nT1 P2 Z11\n"),
    "a table of words": Case(r"m\.tbl:1:1: 20 more lines of the file: they cannot be read either",
                             table="T1 P1 Z10\n" + 30 * "1 1 10.5 6.0 mill\n"),
    "another file as the tool table": Case(r"m\.ini:\d+:\d+: .*; this tool was left out",
                                           ini=of_mill("TOOL_TABLE = m.tbl", "TOOL_TABLE = m.ini")),
    "words in any order": Case(table=";head\n\nP4 T4 D+2. Z-.5 ;x\nT5 P5 I1 J2 Q9\nT1 P1 Z1\n"),
    "no tool table": Case(r"m\.ini:13:14: TOOL_TABLE = m\.tbl: this file cannot be read", table=None),
    "no ends": Case(r"\[JOINT_0\] has no MIN_LIMIT: LinuxCNC then knows no end",
                    ini=MILL.replace("MIN_LIMIT = -100\n", "")),
    "a decimal comma": Case(r"m\.ini:\d+:16: \[JOINT_0\]MAX_VELOCITY = '50,5' is no number; one as 12\.5", code=3,
                            ini=MILL.replace("MAX_VELOCITY = 50", "MAX_VELOCITY = 50,5")),
    "an INI of 2.7": Case(r"there is no section \[JOINT_0\]; this INI is of a LinuxCNC before 2\.8", code=3,
                          ini=MILL.replace("[JOINT_", "[OLD_").replace("[AXIS_X", "[AXIS_0")),
    "a joint too many": Case(r"m\.ini:9:1: \[JOINT_3\]: an extra joint that no axis moves",
                             ini=of_mill("JOINTS = 3", "JOINTS = 4")),
    "a key twice": Case(r"the key is there before with 50, and the first one counts",
                        ini=MILL.replace("MAX_VELOCITY = 50", "MAX_VELOCITY = 50\nMAX_VELOCITY = 60")),
    "no equals sign": Case(r"m\.ini:10:1: JOINTS 3: this line is neither KEY = VALUE nor \[SECTION\] nor a comment",
                           ini=of_mill("JOINTS = 3", "JOINTS 3")),
    "axis W": Case(r"\[JOINT_3\], axis W: no machine here has axes U, V and W", ini=machine("XYZW")),
    "belts": Case(r"kinematics 'corexykins' \(belts .*\) has no counterpart here", code=4,
                  ini=of_mill("trivkins coordinates=XYZ", "corexykins")),
    "a period with its unit": Case(r"\[EMCMOT\]SERVO_PERIOD = '1ms' is no number", code=3,
                                   ini=of_mill("1000000", "1ms")),
    "two scales": Case(r"\[JOINT_0\]STEP_SCALE = 200: the counts of ENCODER_SCALE were taken",
                       ini=of_mill("STEP_SCALE = 200", "STEP_SCALE = 200\nENCODER_SCALE = 4000")),
    "the scale of an analog output": Case(r"m\.ini:27:16: \[JOINT_0\]OUTPUT_SCALE = 10: this is the scale of an analog",
                                          ini=of_mill("STEP_SCALE = 200", "OUTPUT_SCALE = 10")),
    "a backlash of 12 mm": Case(
        r"m\.ini:28:12: \[JOINT_0\]BACKLASH = 12: 12 mm are more than the correction takes, 5; no backlash was carried",
        ini=of_mill("STEP_SCALE = 200", "STEP_SCALE = 2\nBACKLASH = 12")),
    "HOME beyond the range": Case(
        r"m\.ini:28:8: \[JOINT_0\]HOME = 300: it lies beyond the range of X, -100 to 100 mm; the simulated drive "
        r"stands at 100 instead", ini=of_mill("STEP_SCALE = 200", "STEP_SCALE = 2\nHOME = 300")),
    "HOME_OFFSET beyond the range": Case(
        r"m\.ini:28:15: \[JOINT_0\]HOME_OFFSET = -100\.5: the switch lies beyond the range of X, -100 to 100 mm",
        ini=of_mill("STEP_SCALE = 200", "STEP_SCALE = 2\nHOME_OFFSET = -100.5\nHOME_SEARCH_VEL = -5")),
    "no HOME in a range without 0": Case(
        r"\[JOINT_2\] has no HOME, which is 0: it lies beyond the range of Z, 5 to 100 mm",
        ini="MIN_LIMIT = 5".join(MILL.rsplit("MIN_LIMIT = -100", 1))),
    "an end that the axis alone has": Case(
        r"\[JOINT_0\] has no MIN_LIMIT: LinuxCNC bounds the axis alone; that of \[AXIS_X\] was written: -100 mm",
        ini=MILL.replace("TYPE = LINEAR\nMIN_LIMIT = -100\n", "TYPE = LINEAR\n", 1)),
    "an axis without velocity": Case(
        r"m\.ini:16:1: \[AXIS_X\] has no MAX_VELOCITY: LinuxCNC takes 1 of its units for it, and is that slow",
        ini=of_mill("MAX_VELOCITY = 50\n", "")),
    "a key in small letters": Case(
        r"m\.ini:19:1: \[AXIS_X\]max_velocity = 50: small letters are others than capital ones in an INI: LinuxCNC "
        r"looks for \[AXIS_X\]MAX_VELOCITY and passes over this line", ini=of_mill("MAX_VELOCITY", "max_velocity")),
    "a section in small letters": Case(r"there is no section \[JOINT_0\]; \[Joint_0\] is there, but small letters",
                                       code=3, ini=of_mill("[JOINT_0]", "[Joint_0]")),
    "words U, V and W of a tool": Case(r"m\.tbl:1:15: T2 P2 D10 Z60 U6 v-7 W0: no machine here has axes U, V and W; U6 "
                                       r"v-7 was left out of this tool", table="T2 P2 D10 Z60 U6 v-7 W0 ;U9\n"),
    "a unit that no program has": Case(
        r"m\.ini:15:16: \[TRAJ\]LINEAR_UNITS = cm: LinuxCNC starts programs and MDI in this unit, and here they start "
        r"in mm \(G21\): without G20 or G21 in a program X1 and F1 mean 1 mm and 1 mm/min, and no longer 10 mm and "
        r"10 mm/min; to do: convert", ini=of_mill("= mm", "= cm")),
    "an empty file": Case(r"m\.ini:1:1: no kinematics: \[KINS\] needs KINEMATICS = trivkins", code=3, ini=""),
    "no text": Case(r"m\.ini:1:2: a byte of 0: this file is no text", code=3, ini="x\0y\n"),
}


class Variants(unittest.TestCase):
    def judge(self, case, folder):
        for name, text in {"m.ini": case.ini, "m.hal": case.hal, "m.tbl": case.table, **case.files}.items():
            if text is not None:
                (folder / name).parent.mkdir(exist_ok=True)
                (folder / name).write_bytes(text.encode(case.encoding))
        done = subprocess.run([BINARY, "import", "linuxcnc", "m.ini", "--to", "new"], cwd=folder, capture_output=True)
        err = done.stderr.decode("utf-8", "replace")
        self.assertEqual(done.returncode, case.code, err)
        for line in err.splitlines():
            self.assertRegex(line, r"^[^:]+:\d+:\d+: \S")
        if case.told:
            self.assertTrue(any(re.search(case.told, line) for line in err.splitlines()), err)
        if case.code:
            self.assertEqual(len(err.splitlines()), 1, err)
            self.assertEqual(list(folder.glob("new/*")), [])
            return
        config = tomllib.loads((folder / "new/m.toml").read_text())
        self.assertEqual("".join(joint["name"] for joint in config["joint"]), case.axes)
        (folder / "p.ngc").write_text("G21 G90 G94\nG1 X1 F100\nG0 X0\nM2\n")
        run = subprocess.run([BINARY, "run", "p.ngc", "--machine", "new/m.toml", "--tools", "new/m.tbl"], cwd=folder,
                             capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)

    def test_each_is_carried_over_or_told(self):
        for name, case in CASES.items():
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                self.judge(case, Path(folder))

    def test_a_range_in_inches_is_one_in_mm(self):
        with tempfile.TemporaryDirectory() as folder:
            self.judge(CASES["inches"], Path(folder))
            joint = tomllib.loads((Path(folder) / "new/m.toml").read_text())["joint"][0]
            self.assertEqual((joint["max_mm"], joint["velocity_mm_s"]), (2540.0, 1270.0))


class Machines(unittest.TestCase):
    """Numbers of the new machine, and where its programs take it."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def imported(self, ini, code=0, **files):
        for name, text in {"m_ini": ini, "m_hal": HAL, "m_tbl": TABLE, **files}.items():
            (self.folder / name.replace("_", ".")).write_text(text)
        done = subprocess.run([BINARY, "import", "linuxcnc", "m.ini", "--to", "new", "--force"], cwd=self.folder,
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        self.err = done.stderr
        if code:
            return None
        self.text = (self.folder / "new/m.toml").read_text()
        return tomllib.loads(self.text)

    def run_program(self, program):
        """Rows of the joints, in mm and degrees; the first one stands where homing ended."""
        (self.folder / "p.ngc").write_text(program)
        run = subprocess.run([BINARY, "run", "p.ngc", "--machine", "new/m.toml", "--trace", "t.csv"], cwd=self.folder,
                             capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        rows = [line.split(",") for line in (self.folder / "t.csv").read_text().splitlines()]
        joints = rows[0].index("p_x")
        turn = [math.degrees(1) if name in "ABC" else 1 for name in rows[0][1:joints]]
        return [[float(v) * t for v, t in zip(row[1:joints], turn)] for row in rows[1:]]

    # A machine, its joint, both ends, HOME, HOME_OFFSET and the two velocities of homing in units of the INI; mm or
    # degrees of a unit.
    ROTARY = machine("XYZA")
    HOMES = ((MILL, 2, -150, 0.001, 0, 0, 5, -1, 1), (MILL, 2, -150, 0, 0, 2, 5, -1, 1),
             (MILL, 2, -150, 0, -5, 0.5, 25, -12, 1), (MILL, 0, -0.001, 300, 0, -2, -10, 1, 1),
             (MILL, 0, 0, 300, 0, 0, -40, 5, 1), (MILL, 1, -100, 200, 200, 201, 50, 50, 1),
             (MILL, 1, -100, 200, 60, 60, 0, 2, 1), (of_mill("= mm", "= inch"), 2, -4, 0, 0, 0.1, 0.2, -0.05, 25.4),
             (ROTARY, 3, -90, 30, 30, 31, 10, -1, 1), (machine("XZ"), 1, -200, 0, 0, 0, 8, 1, 1),
             (ROTARY.replace("= mm", "= mm\nANGULAR_UNITS = radian"), 3, -1.5, 0.5, 0.5, 0.5, 0.2, -0.1,
              math.degrees(1)), (machine("XYYZ"), 3, -150, 0, 0, 1, 15, -1, 1))

    def judge_homing(self, row, backlash):
        """LinuxCNC's last move of homing goes to HOME, and its programs may go to both ends."""
        ini, joint, low, high, home, switch, search, latch, unit = row
        ends = "MIN_LIMIT = -100\nMAX_LIMIT = 100"
        ini = re.sub(rf"(\[JOINT_{joint}\][^[]*?){ends}", rf"\1MIN_LIMIT = {low}\nMAX_LIMIT = {high}", ini)
        ini = re.sub(rf"(\[AXIS[^[]*?){ends}", r"\1MIN_LIMIT = -900\nMAX_LIMIT = 900", ini)
        keys = {"HOME": home, "HOME_OFFSET": switch, "HOME_SEARCH_VEL": search, "HOME_LATCH_VEL": latch,
                "BACKLASH": backlash / unit}
        lines = "\n".join(f"{key} = {value}" for key, value in keys.items())
        config = self.imported(with_keys(ini, **{f"JOINT_{joint}": lines}))
        at = min(joint, len(config["joint"]) - 1)
        letter, low, high = config["joint"][at]["name"], unit * low, unit * high
        moves = "".join(f"G53 G0 {letter}{value:.9f}\n" for value in (low, high, low, high))
        places = [place[at] for place in self.run_program(f"G21 G90 G61.1\n{moves}M2\n")]
        # The motor moves within the gap when its correction begins; at the lower end the drive brakes above HOME.
        gap = backlash / 2 + 1e-5
        self.assertLess(abs(places[0] - unit * home), 0.006 + backlash + (0.1 if unit * home - low < 0.01 else 0))
        self.assertLess(abs(min(places) - low), gap)
        self.assertLess(abs(max(places) - high), gap)

    def test_homing_ends_at_home_inside_the_range(self):
        for row in self.HOMES:
            for backlash in (0, 0.02):
                with self.subTest(joint=row[1], home=row[4], high=row[3], unit=row[8], backlash=backlash):
                    self.judge_homing(row, backlash)

    def test_programs_start_in_the_unit_of_the_machine(self):
        """Its LINEAR_UNITS, or what the startup code says; rows and the file are in mm."""
        inch = of_mill("= mm", "= inch")
        start = "[RS274NGC]\nRS274NGC_STARTUP_CODE = {} G64 P0.01\n"
        for name, ini, unit in (("mm", MILL, 1), ("inch", inch, 25.4), ("G21", inch + start.format("G21"), 1),
                                ("G20", MILL + start.format("G20"), 25.4), ("both", inch + start.format("G20"), 25.4)):
            with self.subTest(name):
                program = self.imported(ini)["program"]
                self.assertEqual(program.get("units", "mm"), "inch" if unit > 1 else "mm")
                self.assertNotIn("G20", self.err.replace("RS274NGC_STARTUP_CODE = G20", ""))
                rows = self.run_program("G90 G61.1\nG1 X1 F40\nM2\n")
                self.assertAlmostEqual(rows[-1][0], unit, delta=1e-4)
                rows = self.run_program("G21 G90 G61.1\nG1 X1 F40\nM2\n")
                self.assertAlmostEqual(rows[-1][0], 1, delta=1e-4)

    def test_the_greatest_speed_of_the_spindle(self):
        for keys, rpm in (("MAX_FORWARD_VELOCITY = 6000", 6000), ("MAX_REVERSE_VELOCITY = -2500", 2500),
                          ("MAX_FORWARD_VELOCITY = 6000\nMAX_REVERSE_VELOCITY = -2500", 6000)):
            with self.subTest(keys):
                config = self.imported(MILL + f"[SPINDLE_0]\n{keys}\n")
                self.assertEqual(config["io"]["spindle"]["rpm_max"], rpm)
                self.assertIn("LinuxCNC cuts a greater S to this speed, and here rpm_max below", self.err)
                self.assertEqual("both directions" in self.err, "\n" in keys)
                self.run_program(f"G21 M3 S{rpm}\nG1 X1 F100\nM2\n")
                (self.folder / "p.ngc").write_text(f"G21\nM3 S{rpm + 1}\nG1 X1 F100\nM2\n")
                run = subprocess.run([BINARY, "run", "p.ngc", "--machine", "new/m.toml"], cwd=self.folder,
                                     capture_output=True, text=True)
                self.assertEqual(run.returncode, 2, run.stderr)
                self.assertIn(f"p.ngc:2:4: S = {rpm + 1} is not legal for the spindle: {rpm} rpm at most", run.stderr)
        config = self.imported(MILL + "[SPINDLE_0]\nMAX_FORWARD_VELOCITY = 0\nMIN_FORWARD_VELOCITY = 300\n")
        self.assertNotIn("rpm_max", config["io"]["spindle"])
        self.assertIn("0 rpm is no greatest speed", self.err)
        self.assertIn("a smaller S is not raised to this speed here", self.err)

    def test_backlash_leaves_the_range_to_programs(self):
        """Half of the largest gap, 0.06 mm, is written to each end of X and Z, which have gaps, and not of Y."""
        config = self.imported(with_keys(MILL, JOINT_0="BACKLASH = 0.02", JOINT_2="BACKLASH = -0.06"))
        self.assertEqual([(j["min_mm"], j["max_mm"]) for j in config["joint"]],
                         [(-100.03, 100.03), (-100, 100), (-100.03, 100.03)])
        self.assertEqual(config["corrections"]["joint_table"]["limit_mm"], 0.03)
        self.assertRegex(self.err, r"m\.ini:\d+:1: \[JOINT_0\]BACKLASH = 0\.02: its correction keeps 0\.03 mm at")
        self.run_program("G21 G90\nG53 G0 X100 Z-100\nG53 G0 X-100 Z100\nM2\n")
        (self.folder / "p.ngc").write_text("G21 G90\nG53 G0 X100.001\nM2\n")
        run = subprocess.run([BINARY, "run", "p.ngc", "--machine", "new/m.toml"], cwd=self.folder, capture_output=True)
        self.assertNotEqual(run.returncode, 0)

    def test_limits_of_the_path(self):
        """[TRAJ] bounds every move of LinuxCNC: here each joint by it, and the diagonal, sqrt(3) times, is told."""
        config = self.imported(with_keys(MILL, TRAJ="MAX_LINEAR_VELOCITY = 10\nMAX_LINEAR_ACCELERATION = 200"))
        for joint in config["joint"]:
            self.assertEqual([joint[k] for k in ("velocity_mm_s", "acceleration_mm_s2", "jerk_mm_s3")], [10, 200, 4000])
        self.assertRegex(self.err, r"\[TRAJ\]MAX_LINEAR_VELOCITY = 10: LinuxCNC keeps the whole path below it; .* may "
                                   r"now move faster along its path than before: up to 17\.32 mm/s .*to do: 5\.774 for")
        self.assertRegex(self.err, r"\[TRAJ\]MAX_LINEAR_ACCELERATION = 200: .*up to 346\.4 mm/s\^2")
        config = self.imported(with_keys(of_mill("= mm", "= inch"), TRAJ="MAX_LINEAR_VELOCITY = 100"))
        self.assertEqual(config["joint"][0]["velocity_mm_s"], 1270)
        self.assertNotIn("MAX_LINEAR_VELOCITY = 100: LinuxCNC keeps", self.err)  # sqrt(3) * 50 is below
        config = self.imported(with_keys(machine("XYZA"), TRAJ="MAX_LINEAR_VELOCITY = 10\nMAX_ANGULAR_VELOCITY = 5"))
        self.assertEqual([j.get("velocity_deg_s") for j in config["joint"]], [None, None, None, 50])

    def test_the_narrower_motor_of_a_gantry(self):
        """Both motors move together: the narrower limits hold, wherever they stand."""
        ini = with_keys(machine("XYYZ"), JOINT_2="MAX_VELOCITY = 30\nMAX_ACCELERATION = 300\nMIN_LIMIT = -90\n"
                                                 "MAX_LIMIT = 95")
        config = self.imported(ini)
        self.assertEqual([config["joint"][1][k] for k in ("min_mm", "max_mm", "velocity_mm_s", "acceleration_mm_s2")],
                         [-90, 95, 30, 300])
        told = r"m\.ini:\d+:\d+: \[JOINT_2\]M\w+: this second motor of axis Y is the narrower one"
        self.assertEqual(len(re.findall(told, self.err)), 4)
        config = self.imported(with_keys(machine("XYYZ"), JOINT_1="MAX_VELOCITY = 30"))
        self.assertEqual(config["joint"][1]["velocity_mm_s"], 30)
        self.assertNotIn("narrower one", self.err)

    def test_scales(self):
        """PNCconf's servo has the encoder's counts, with their sign, and the volts of the output."""
        for lines, counts, back in (("ENCODER_SCALE = -4000\nOUTPUT_SCALE = 1.0", 4000, True),
                                    ("OUTPUT_SCALE = 10\nINPUT_SCALE = 2000 0", 2000, False),
                                    ("SCALE = 320", 320, False)):
            self.imported(of_mill("STEP_SCALE = 200", lines))
            node = self.text.split("# [[drives.node]]")[1].split("[[drives.joint]]")[0]
            self.assertIn(f"# counts_per_mm = {counts}.0", node)
            self.assertEqual("# reverse = true" in node, back)

    def test_start_codes(self):
        """What G64 P says, however it is written; comments say nothing, and what is computed is told."""
        for code, unit, wanted, told in (
                ("G90 (c) G64 P.02", "mm", 0.02, r"G64 with 0\.02 mm was taken from it; to do: nothing"),
                ("G90 (G64 P3) g64p.02 ; G64 P9", "mm", 0.02, "G64 with 0.02 mm"),
                ("P0.3 G64 G21", "inch", 0.3, "0.3 mm"),
                ("G20 G64 P.01", "mm", 0.254, r"G64 with 0\.254 mm was taken from it; to do: nothing"),
                ("G64 P0.001", "inch", 0.0254, r"G64 with 0\.0254 mm"),
                ("G64 P[0.01*2] G18", "mm", None,
                 r"nothing was taken from it; P\[0\.01\*2\] is computed .*not in force here: P\[0\.01\*2\] G18"),
                ("G64 P#<x>", "mm", None, r"P#<X> is computed while LinuxCNC runs"),
                ("G64 P#5[1]", "mm", None, "is computed"), ("G64 P0", "mm", None, "P0 is no tolerance"),
                ("G64.1 P2 G91", "mm", None, r"not in force here: G64\.1 P2 G91")):
            with self.subTest(code):
                config = self.imported(with_keys(of_mill("= mm", f"= {unit}"),
                                                 RS274NGC=f"RS274NGC_STARTUP_CODE = {code}"))
                tolerance = config["program"].get("tolerance_mm")
                self.assertEqual(tolerance and round(tolerance, 9), wanted)
                self.assertRegex(self.err, told)
                # G21 of the start code makes mm of a machine in inches, and G20 inches of one in mm.
                self.assertEqual(config["program"].get("units") == "inch",
                                 "G20" in code or unit == "inch" and "G21" not in code)

    def test_tolerance_of_arcs(self):
        """LinuxCNC takes 0.001 to 0.02 sqrt(2) mm; in inches a tenth of it, which is 2.54 times as much."""
        for lines, unit, wanted in (("_MM = 0.01", "mm", 0.01), ("_INCH = 0.001", "inch", 0.01),
                                    ("_MM = 0.5", "mm", None),
                                    ("_INCH = 0.001", "mm", None), ("_MM = 0.02\n@_INCH = 0.0005", "inch", 0.005)):
            key = "CENTER_ARC_RADIUS_TOLERANCE"
            keys = key + lines.replace("@", key)
            config = self.imported(with_keys(of_mill("= mm", f"= {unit}"), RS274NGC=keys))
            got = config["program"].get("arc_tolerance_mm")
            self.assertEqual(got and round(got, 12), wanted, lines)
            self.assertEqual(f"{key}_MM = 0.5: LinuxCNC takes 0.001 to 0.02828" in self.err, "0.5" in lines)
            self.assertEqual("one key bounds both units here" in self.err,
                             wanted is None and "0.5" not in lines or "@" in lines)

    def test_parameters_as_linuxcnc_reads_them(self):
        """It takes two numbers of each line, passes over every other one, and refuses numbers that do not rise."""
        ini = with_keys(MILL, RS274NGC="PARAMETER_FILE = m.var")
        self.imported(ini, m_var="# mine\n31 5# c\n\n foo\n5221 2.5\r\n5222 +1e1 x\n")
        values = dict(line.split() for line in (self.folder / "new/m.var").read_text().splitlines())
        self.assertEqual([float(values[k]) for k in ("31", "5221", "5222")], [5, 2.5, 10])
        for told in (r"m\.var:1:1: # mine: this line is no parameter", r"m\.var:4:1: foo: this line is no parameter",
                     r"m\.var:2:1: 31 5# c: LinuxCNC reads two numbers of a line", r"m\.var:6:1: 5222 \+1e1 x: "):
            self.assertRegex(self.err, told)
        for text, told in (("5221 1\n31 5\n", "m.var:2:1: parameter 31 stands below 5221; the numbers must rise"),
                           ("# c\n31 1\n31 2\n", "m.var:3:1: parameter 31 is there twice"), ("0 1\n", "m.var:1:1: ")):
            self.imported(ini, 3, m_var=text)
            self.assertTrue(self.err.startswith(told), self.err)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
