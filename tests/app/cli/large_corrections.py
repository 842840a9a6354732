#!/usr/bin/python3
"""usage: large_corrections.py TRUNNION SOURCE_DIR

Corrections with values far beyond those of any machine that is sold: gaps of millimetres, tables that swing, tilts of
degrees, screws that grow by millimetres. On every machine the run keeps each joint within its limits, as `check-trace`
judges its trace to the end, or the config is refused at its line with what would be legal.
"""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

BINARY, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
DRIVES = '[drives]\ntype = "simulated"'
MILL = [(50, 20, -10), (-50, 30, 10), (10, -60, 0), (60, 0, -30), (0, 0, 0), (5, 5, 5), (0, 0, 0), (1, 1, 1), (0, 0, 0)]
FIVE = [(50, 20, 110, 10, 30), (-50, 30, 120, -20, 90), (10, -60, 100, 0, 0), (60, 0, 130, 60, 200), (0, 0, 100, 0, 0)]
PROGRAMS = {
    "mill": "G0 X0 Y0 Z0\n" + 2 * "".join(f"G1 X{x} Y{y} Z{z} F8000\n" for x, y, z in MILL) + "G2 X0 Y0 I20 J0\n",
    "cradle": "G0 X0 Y0 Z100 A0 C0\n" + 2 * "".join(f"G1 X{x} Y{y} Z{z} A{a} C{c} F8000\n" for x, y, z, a, c in FIVE),
    "rail_mill": "G0 Z-300\nG1 X20 Y10 F3000\nX-20\nY-10 Z-305\nX20\nG0 X0 Y0 Z-300\nX10 Y10\nX-10\nX10\n",
}
FIRST = {"mill": "X", "cradle": "X", "rail_mill": "rail1"}


def joint_table(joint, keys, section=""):
    return f'[corrections.joint_table]\n{section}\n[[corrections.joint_table.joint]]\njoint = "{joint}"\n{keys}\n'


def geometric(joint, keys, section="", table=""):
    text = f'[corrections.geometric]\n{section}\n[[corrections.geometric.axis]]\njoint = "{joint}"\n{keys}\n'
    return text + (f"[corrections.geometric.axis.table]\n{table}\n" if table else "")


def run(name, correction):
    """(exit code, errors, last line of check-trace)"""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        text = (SOURCE / f"configs/{name}.toml").read_text()
        assert text.count(DRIVES) == 1, name
        (place / "m.toml").write_text(text.replace(DRIVES, correction + DRIVES))
        (place / "p.ngc").write_text("G21 G90 G94\n" + PROGRAMS[name] + "M2\n")
        done = subprocess.run([BINARY, "run", "p.ngc", "--machine", "m.toml", "--trace", "t.csv"], cwd=place,
                              capture_output=True, text=True)
        if done.returncode != 0:
            return done.returncode, done.stderr, ""
        judged = subprocess.run([BINARY, "check-trace", "t.csv", "--machine", "m.toml"], cwd=place,
                                capture_output=True, text=True)
        return done.returncode, done.stderr, judged.stdout.splitlines()[-1]


class Kept(unittest.TestCase):
    def keep(self, name, correction):
        with self.subTest(machine=name, correction=correction):
            code, err, judged = run(name, correction)
            self.assertEqual(code, 0, err)
            self.assertEqual(judged, "within limits: every ratio <= 1.000001")

    def test_gaps_of_millimetres(self):
        for name, joint in FIRST.items():
            for gap, limit, reserve in ((0.02, 0.1, 0.01), (1.5, 0.75, 0.01), (1.5, 2, 0.05), (5, 10, 0.2)):
                self.keep(name, joint_table(joint, f"backlash_mm = {gap}", f"limit_mm = {limit}\nreserve = {reserve}"))

    def test_gaps_that_change_their_sign_along_the_axis(self):
        for name in ("mill", "cradle"):
            self.keep(name, joint_table("X", "at_mm = [-300, -10, -9, 10, 11, 300]\nforward_mm = [0, 0, 1, -1, 1, 0]\n"
                                        "backward_mm = [0, 0, -1, 1, -1, 0]", "limit_mm = 1"))

    def test_scales_and_steps_of_a_screw(self):
        for name, joint in FIRST.items():
            self.keep(name, joint_table(joint, "slope = 0.02", "table_limit_mm = 50"))
        for name in ("mill", "cradle"):
            self.keep(name, joint_table("X", "at_mm = [-300, -10, -9.9, 10, 10.1, 300]\n"
                                        "forward_mm = [0, 0, 0.0015, -0.001, 0.0005, 0]"))

    def test_axes_that_are_two_degrees_out_of_square(self):
        for name in ("mill", "cradle"):
            self.keep(name, geometric("Y", "ec0_arcsec = 7200\nex0_mm = 10", "limit_mm = 50\nlimit_deg = 10"))
        self.keep("cradle", geometric("A", "eb0_arcsec = 7200\nec0_arcsec = 7200\ney0_mm = 10",
                                      "limit_mm = 50\nlimit_deg = 10"))

    def test_screws_that_grow_by_millimetres(self):
        for name in ("mill", "cradle"):
            self.keep(name, '[corrections.screw]\nlimit_mm = 5\nslope_max = 0.01\nrate_um_s = 100\n'
                      '[[corrections.screw.axis]]\njoint = "X"\nmounting = "fixed-free"\nfixed_bearing_mm = -500\n'
                      'far_bearing_mm = 500\nalpha_per_K = 1e-4\nnut_friction_N = 10000\n')


class Refused(unittest.TestCase):
    def refuse(self, name, correction, told):
        with self.subTest(machine=name, correction=correction):
            code, err, _ = run(name, correction)
            self.assertEqual(code, 3, err)
            self.assertTrue(re.match(rf"m\.toml:\d+:\d+: .*{told}", err), err)

    def test_a_gap_that_would_be_cut_off(self):
        for name, joint in FIRST.items():
            self.refuse(name, joint_table(joint, "backlash_mm = 1.5"),
                        rf"the gap of joint {joint} asks for 0\.75 mm to either side, but 'limit_mm' is 0\.1; the "
                        r"largest gap that it takes is 0\.2 mm")

    def test_steeper_than_any_screw(self):
        self.refuse("mill", joint_table("X", "at_mm = [-10, -9.99, 10]\nforward_mm = [0, 1, 0]"),
                    "the table is steeper")

    def test_a_curve_that_swings(self):
        for name in ("mill", "cradle"):
            self.refuse(name, geometric("X", "", "limit_mm = 50", "at_mm = [-400, -10, -9, 10, 11, 400]\n"
                                        "ey_mm = [0, 0, 1, -1, 1, 0]"), "'ey_mm' is steeper than any real axis")

    def test_an_error_that_is_another_machine(self):
        self.refuse("mill", geometric("X", "", "", "at_mm = [-400, 400]\nex_mm = [11, 11]"),
                    "'ex_mm' has 11; -10 to 10 is legal")

    def test_more_than_the_correction_may_put_right_at_the_start(self):
        for name in ("mill", "cradle"):
            self.refuse(name, geometric("Y", "ec0_arcsec = 7200\nex0_mm = 10"),
                        r"where the machine starts, \[corrections\] would move a joint by more than its limit_mm")


class Elsewhere(unittest.TestCase):
    def test_a_program_that_goes_where_the_correction_may_not(self):
        code, err, _ = run("mill", geometric("Y", "ec0_arcsec = 7200", "limit_mm = 1"))
        self.assertEqual(code, 2, err)
        self.assertIn("[corrections.geometric] would move a joint by more than its limit_mm or limit_deg", err)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[3:]])
