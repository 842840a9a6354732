#!/usr/bin/python3
"""usage: ball_command.py TRUNNION SOURCE_DIR

`trunnion run --logs`, `ball fit` and `ball plan` as people use them: from the program to the config, and what
wrong input says.
"""
import json
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

BINARY, SOURCE = sys.argv[1], Path(sys.argv[2])
MACHINE = SOURCE / "configs/cradle_ball.toml"


def trunnion(*arguments):
    done = subprocess.run([BINARY, *map(str, arguments)], capture_output=True, text=True, timeout=1000)
    return done.returncode, done.stdout, done.stderr


class Ball(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = Path(cls.folder.name)
        code, out, err = trunnion("run", SOURCE / "examples/probing/ball_calibration.ngc", "--logs", cls.path)
        assert code == 0, err
        assert "boss at X" in err, "what the program says is shown"
        cls.contacts = cls.path / "ball_contacts.csv"

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_fit_writes_the_section_that_it_reports(self):
        section = self.path / "section.toml"
        code, out, err = trunnion("ball", "fit", self.contacts, "--machine", MACHINE, "--json", "--write", section)
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        self.assertEqual(report["contacts"], 65)
        found = tomllib.loads(section.read_text())["corrections"]["geometric"]["axis"]
        axes = {axis["joint"]: axis for axis in found}
        truth = {axis["joint"]: axis for axis in tomllib.loads(MACHINE.read_text())["io"]["errors"]["axis"]}
        seen = 0
        for parameter in report["parameters"]:
            joint, _, name = parameter["name"].partition(".")
            if joint not in axes:
                continue
            tilt = parameter["unit"] == "rad"
            key = f"{name}_{'arcsec' if tilt else 'mm'}"
            unit = 3600 * 57.29577951308232 if tilt else 1
            self.assertAlmostEqual(axes[joint][key], parameter["value"] * unit, places=6)
            self.assertLess(abs(axes[joint][key] - truth[joint][key]), 4 * parameter["standard_error"] * unit)
            seen += 1
        self.assertEqual(seen, 8)
        corrected = self.path / "corrected.toml"
        corrected.write_text(MACHINE.read_text() + section.read_text())
        code, out, err = trunnion("run", SOURCE / "examples/engraving.ngc", "--machine", corrected,
                                  "--tools", SOURCE / "examples/tools.tbl")
        self.assertEqual(code, 0, err)

    def test_the_report_says_what_cannot_be_told(self):
        code, out, err = trunnion("ball", "fit", self.contacts, "--machine", MACHINE)
        self.assertEqual(code, 0, err)
        self.assertIn("stylus.z      kept as it was: acts like -1 A.ez0", out)
        self.assertIn("[[corrections.geometric.axis]]", out)

    def test_plan_goes_on_where_the_contacts_end(self):
        words = ["ball", "plan", "--machine", MACHINE, "--ball", "0.4", "100.3", "-25.2", "--count", "2"]
        code, out, err = trunnion(*words, "--contacts", self.contacts, "--json")
        self.assertEqual(code, 0, err)
        plan = json.loads(out)
        values = [plan["axes_before_mm"]] + [position["axes_mm"] for position in plan["positions"]]
        self.assertEqual(len(values), 3)
        self.assertEqual(values, sorted(values, reverse=True))
        self.assertLess(values[0], 0.001)
        code, out, err = trunnion(*words)
        self.assertEqual(code, 0, err)
        self.assertEqual(out.count("o<probe_ball> call ["), 2)

    def test_what_is_wrong_is_said(self):
        bad = self.path / "bad.csv"
        bad.write_text("x_mm,y_mm,z_mm\n1,2,three\n")
        for arguments, code, said in (
                (("fit", bad, "--machine", MACHINE), 2, "bad.csv:2: 'three' is no number"),
                (("fit", self.path / "none.csv", "--machine", MACHINE), 2, "none.csv: cannot read this file"),
                (("fit", self.contacts, "--machine", SOURCE / "configs/hexapod.toml"), 3, "serial"),
                (("plan", "--machine", SOURCE / "configs/mill.toml", "--ball", 0, 0, 0), 3, "no joint is rotary"),
                (("plan", "--machine", MACHINE, "--ball", 2000, 0, 0), 2, "reaches the ball in no position"),
                (("plan", "--machine", MACHINE), 5, "--ball")):
            got, out, err = trunnion("ball", *arguments)
            self.assertEqual(got, code, err)
            self.assertIn(said, err)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
