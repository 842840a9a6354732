#!/usr/bin/python3
"""`trunnion workspace` against closed forms: boxes of joint ranges, a hexapod's own Jacobian, a pole.

usage: workspace_command.py TRUNNION SOURCE_DIR
"""
import csv
import json
import math
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree
from pathlib import Path

import numpy as np

TRUNNION, SOURCE = sys.argv[1:3]


def workspace(machine, *options):
    """Exit code, output and CSV rows of a survey of a shipped machine or of a config."""
    if isinstance(machine, str):
        machine = f"{SOURCE}/configs/{machine}.toml"
    with tempfile.TemporaryDirectory() as folder:
        table, picture = Path(folder) / "w.csv", Path(folder) / "w.svg"
        done = subprocess.run([TRUNNION, "workspace", "--machine", str(machine), "--json",
                               "--csv", str(table), "--svg", str(picture), *options],
                              capture_output=True, text=True, timeout=120, check=False)
        if done.returncode != 0:
            return done.returncode, done.stderr, []
        xml.etree.ElementTree.parse(picture)  # well-formed
        with table.open(encoding="ascii") as file:
            return 0, json.loads(done.stdout), list(csv.DictReader(file))


def place(row):
    return np.array([float(row[key]) for key in ("x_mm", "y_mm", "z_mm")])


def hexapod():
    with open(f"{SOURCE}/tests/data/vectors/hexapod.json", encoding="ascii") as file:
        geometry = json.load(file)
    return np.array(geometry["base_joints"]), np.array(geometry["platform_joints"])


def hexapod_row(tip):
    """Legs upright with the tip there, and their speeds per speed of the tip over the table (6 x 3)."""
    base, platform = hexapod()
    legs = np.array([0, 0, 700]) - tip + platform - base
    lengths = np.linalg.norm(legs, axis=1)
    return lengths, -legs / lengths[:, None]


class Workspace(unittest.TestCase):
    def test_a_mill_reaches_the_box_of_its_joints(self):
        code, summary, rows = workspace("mill", "--points", "9", "--tilts", "0", "10")
        self.assertEqual(code, 0)
        with open(f"{SOURCE}/configs/mill.toml", encoding="ascii") as file:
            joints = file.read().split("[[joint]]")[1:]
        ranges = [
            float(re.search(rf"^{end}_\w+ = (\S+)", joint, re.M)[1]) for joint in joints for end in ("min", "max")]
        low, high = np.array(ranges[0::2]), np.array(ranges[1::2])
        low[1], high[1] = -high[1], -low[1]  # the table carries Y
        upright = [row for row in rows if row["tilt_deg"] == "0"]
        for row in upright:
            inside = bool(np.all(place(row) > low - 1e-3) and np.all(place(row) < high + 1e-3))
            self.assertEqual(row["reach"], "ok" if inside else "joint_range")
        self.assertTrue(any(row["reach"] == "ok" for row in upright))
        self.assertEqual({row["reach"] for row in rows if row["tilt_deg"] == "10"}, {"no_tilt"})
        self.assertAlmostEqual(summary["tilts"][0]["conditioning_min"], 1, places=6)

    def test_the_box_is_that_of_grid_points(self):
        told = subprocess.run([TRUNNION, "workspace", "--machine", f"{SOURCE}/configs/mill.toml", "--points", "5"],
                              check=True, capture_output=True, text=True).stdout
        self.assertIn("the space ends less than a step beyond", told)

    def test_a_joint_may_stand_at_the_ends_of_its_range(self):
        with open(f"{SOURCE}/configs/mill.toml", encoding="ascii") as file:
            mill = file.read()
        home_at_the_end = {"min": r"(?m)^min_mm = -\S+", "max": r"(?m)^max_mm = \d\S*"}
        for end, pattern in home_at_the_end.items():
            with self.subTest(end=end), tempfile.TemporaryDirectory() as folder:
                config = Path(folder) / "mill.toml"
                config.write_text(re.sub(pattern, f"{end}_mm = 0.0", mill), encoding="ascii")
                code, summary, rows = workspace(config, "--points", "5", "--tilts", "0")
                self.assertEqual(code, 0, summary)
                at_home = [row for row in rows if np.abs(place(row)).max() < 1e-9]
                self.assertEqual([row["reach"] for row in at_home], ["ok"])

    def test_a_hexapod_is_as_fast_as_its_jacobian_says(self):
        _, _, rows = workspace("hexapod", "--points", "9", "--tilts", "0")
        reached = [row for row in rows if row["reach"] == "ok"]
        self.assertGreater(len(reached), 20)
        for row in reached:
            lengths, J = hexapod_row(place(row))
            self.assertTrue(np.all(lengths > 480 - 1e-3) and np.all(lengths < 920 + 1e-3))
            gain = np.linalg.norm(J, axis=1).max()  # 1: a leg's speed is at most the tip's
            self.assertAlmostEqual(float(row["speed_gain"]), gain, places=5)
            self.assertAlmostEqual(float(row["feed_mm_s_max"]), 300 / gain, places=2)
        for row in rows:
            if row["reach"] == "joint_range":
                lengths, _ = hexapod_row(place(row))
                self.assertTrue(np.any(lengths < 480 + 1e-3) or np.any(lengths > 920 - 1e-3))

    def test_a_longer_tool_moves_the_space(self):
        _, short, _ = workspace("hexapod", "--points", "5", "--tilts", "0")
        _, long, _ = workspace("hexapod", "--points", "5", "--tilts", "0", "--tool-length", "50")
        shift = np.array(long["tilts"][0]["max_mm"]) - np.array(short["tilts"][0]["max_mm"])
        np.testing.assert_allclose(shift, [0, 0, -50], atol=1e-9)

    def test_a_head_is_singular_upright_and_turns_well_tilted(self):
        _, summary, _ = workspace("head", "--points", "5", "--tilts", "0", "20", "--tool-length", "100")
        upright, tilted = summary["tilts"]
        self.assertLess(upright["conditioning_min"], 1e-3)
        # across the tilt only C turns the tool: 240 deg/s times sin 20
        self.assertAlmostEqual(tilted["turn_deg_s_min"], min(240 * math.sin(math.radians(20)), 120), delta=1)
        self.assertAlmostEqual(tilted["speed_gain_max"], 1, places=6)

    def test_a_machine_of_rotary_axes_alone_has_no_box(self):
        joint = ('[[joint]]\nname = "{0}"\ntype = "rotary"\n{1}\nvelocity_deg_s = 720.0\n'
                 'acceleration_deg_s2 = 7200.0\njerk_deg_s3 = 144000.0\n')
        branch = '[[kinematics.work_branch]]\njoint = "{0}"\ndirection = {1}\nsense = -1\n'
        drives = '[drives]\ntype = "simulated"\n'
        head = '[machine]\nname = "rotary"\nperiod_s = 0.001\n'
        endless, limited = "endless = true", "min_deg = -120.0\nmax_deg = 120.0"
        one = (head + joint.format("A", endless) + '[kinematics]\ntype = "serial"\n' +
               branch.format("A", [1.0, 0.0, 0.0]) + drives)
        two = (head + joint.format("B", limited) + joint.format("C", endless) +
               '[kinematics]\ntype = "serial"\n' + branch.format("B", [0.0, 1.0, 0.0]) +
               branch.format("C", [0.0, 0.0, 1.0]) + drives)
        for name, text in {"one": one, "two": two}.items():
            with self.subTest(axes=name), tempfile.TemporaryDirectory() as folder:
                config = Path(folder) / "rotary.toml"
                config.write_text(text, encoding="ascii")
                code, told, _ = workspace(config, "--points", "5")
                self.assertEqual(code, 3, told)
                self.assertIn("every joint is rotary", told)

    def test_errors(self):
        self.assertEqual(workspace("no_such")[0], 3)
        self.assertEqual(workspace("mill", "--points", "1")[0], 5)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
