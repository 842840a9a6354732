#!/usr/bin/python3
"""usage: import_variants.py TRUNNION

What integrators' INI, HAL and tool files look like in the wild: other line ends, other encodings, comments with marks,
included files, Tcl, macros, a lathe, two motors of one axis, tables of other programs. Each is carried over and runs,
or is told in one sentence with its place.
"""
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
    "a table of words": Case(r"m\.tbl:1:1: 20 more lines of the tool table: they cannot be read either",
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


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
