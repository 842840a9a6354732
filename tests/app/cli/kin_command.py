#!/usr/bin/python3
"""`trunnion kin` on every machine against the worked numbers and against formulas of its own.

usage: kin_command.py TRUNNION SOURCE_DIR
"""
import json
import math
import subprocess
import sys
import tempfile
import unittest

TRUNNION, SOURCE = sys.argv[1:3]
MM, RAD = 1e-9, 1e-12


def kin(machine, direction, *requests):
    """Exit code, answers and stderr; requests are objects or raw lines."""
    lines = "".join((r if isinstance(r, str) else json.dumps(r)) + "\n" for r in requests)
    path = machine if machine.endswith(".toml") else f"{SOURCE}/configs/{machine}.toml"
    done = subprocess.run([TRUNNION, "kin", direction, "--machine", path], input=lines, capture_output=True,
                          text=True, timeout=60, check=False)
    return done.returncode, [json.loads(line) for line in done.stdout.splitlines()], done.stderr


def rows(name):
    with open(f"{SOURCE}/tests/data/vectors/{name}.json", encoding="ascii") as file:
        return json.load(file)["rows"]


def off(a, b):
    return max(abs(x - y) for x, y in zip(a, b, strict=True))


def tilted(a, b):
    """Third column of Rx(a) Ry(b)."""
    return [math.sin(b), -math.sin(a) * math.cos(b), math.cos(a) * math.cos(b)]


def words(machine, direction, *lines, flag=("--words",)):
    done = subprocess.run([TRUNNION, "kin", direction, "--machine", f"{SOURCE}/configs/{machine}.toml", *flag],
                          input="".join(line + "\n" for line in lines), capture_output=True, text=True, timeout=60,
                          check=False)
    return done.returncode, done.stdout.splitlines(), done.stderr


class Words(unittest.TestCase):
    """Program words, joint names and degrees."""

    def test_there_and_back(self):
        code, lines, _ = words("cradle", "inverse", "X10 y-20 A30 C-90")
        self.assertEqual((code, lines[0].split(";")[0]), (0, "joints X=10 Y=-20 Z=0 A=30 C=-90"))
        code, lines, _ = words("cradle", "forward", lines[0].split(";")[0].removeprefix("joints "))
        self.assertEqual((code, lines[0].split(";")[0]), (0, "words X10 Y-20 Z0 A30 C-90"))

    def test_sense(self):
        """The mill's table carries Y: its joint goes the other way, and the tool the word's way."""
        _, lines, _ = words("mill", "inverse", "Y10")
        self.assertEqual(lines[0], "joints X=0 Y=-10 Z=0; tool at X0 Y10 Z0, points along I0 J0 K1, seen from the work")
        code, lines, _ = words("mill", "words", flag=())
        self.assertEqual(code, 0)
        self.assertEqual(lines, [f"{w}+  the tool goes towards +{w} of the work (joint {j})"
                                 for w, j in (("X", "+X"), ("Y", "-Y"), ("Z", "+Z"))])

    def test_a_platform_that_cannot_stand_at_zero_is_asked_at_its_home(self):
        """The rail mill's four rails carry the spindle, which cannot come up to Z0."""
        code, lines, _ = words("rail_mill", "words", flag=())
        self.assertEqual((code, lines[0]), (0, "From the platform's home, X0 Y0 Z-300 A0:"))
        self.assertEqual(lines[1], "X+  the tool goes towards +X of the work (joint +rail1, +rail2, +rail3, +rail4)")
        self.assertEqual([line[0] for line in lines[1:]], list("XYZA"))
        self.assertFalse([line for line in lines if "cannot" in line])
        code, lines, _ = words("rail_mill", "inverse", "X1", "X0", "Z0")
        self.assertEqual(code, 0)
        places = [[float(item.partition("=")[2]) for item in line.partition(";")[0].split()[1:]] for line in lines[:2]]
        self.assertLess(off(places[0], [place + 1 for place in places[1]]), 1e-6, "the rails lie along X")
        self.assertEqual(lines[2], "the machine cannot go to X0 Y0 Z0 A0")
        code, lines, _ = words("rail_mill", "forward", "", "rail1=417.013189 rail3=417.013189")
        self.assertEqual((code, lines[0].partition(";")[0]), (0, "words X0 Y0 Z-300 A0"))

    def test_only_what_turns_against_its_word_is_remarked(self):
        """The axis of a nutating head leans by 45 deg and turns the tool by its word; a cradle's tables do not."""
        def remarks(path):
            done = subprocess.run([TRUNNION, "kin", "words", "--machine", path], capture_output=True, text=True,
                                  timeout=60, check=True)
            return {line[0]: line.partition("  <- ")[2] for line in done.stdout.splitlines()}
        nutating = f"{SOURCE}/tests/data/machines/nutating.toml"
        self.assertEqual(remarks(nutating), dict.fromkeys("XYZCB", ""))
        table = "the table turns by the word; ISO 841 has the tool do so"
        self.assertEqual(remarks(f"{SOURCE}/configs/cradle.toml"), {"X": "", "Y": "", "Z": "", "A": table, "C": table})
        against = 'joint = "B"\nsense = -1\n'
        with open(nutating, encoding="ascii") as file:
            text = file.read()
        with tempfile.TemporaryDirectory() as folder:
            config = f"{folder}/nutating.toml"
            with open(config, "w", encoding="ascii") as file:
                file.write(text.replace('joint = "B"\n', against))
            self.assertEqual(remarks(config)["B"], "the tool turns against the word; ISO 841 has it turn by the word")

    def test_beyond(self):
        _, lines, _ = words("mill", "inverse", "X5000")
        self.assertTrue(lines[0].endswith("beyond the range of X"), lines)

    def test_mistakes(self):
        for direction, line, told in (("inverse", "A10", "'A10' is no word of this machine"),
                                      ("inverse", "Xten", "no number behind it"), ("forward", "Q=1", "is no joint"),
                                      ("forward", "X", "is no joint with its place")):
            code, lines, err = words("mill", direction, line)
            self.assertEqual((code, lines), (5, []))
            self.assertIn(told, err)
        self.assertEqual(words("mill", "setpoint", "X1")[0], 5)


class Serial(unittest.TestCase):
    def check(self, machine, table):
        """table: rows of joints, tool length, tip, axis; both ways, and the setpoint with corrections off."""
        code, there, _ = kin(machine, "forward", *({"q": q, "tool_length_mm": L} for q, L, _, _ in table))
        self.assertEqual(code, 0)
        self.assertEqual(len(there), len(table))
        for answer, (_, _, tip, axis) in zip(there, table, strict=True):
            self.assertLess(off(answer["p"], tip), MM)
            self.assertLess(off(answer["u"], axis), RAD)
        for direction in ("inverse", "setpoint"):
            asked = [{"p": tip, "u": axis, "tool_length_mm": L, "seed": [x + 0.03 for x in q]}
                     for q, L, tip, axis in table]
            code, back, _ = kin(machine, direction, *asked)
            self.assertEqual(code, 0)
            for answer, (q, _, _, _) in zip(back, table, strict=True):
                self.assertLess(off(answer["q"][:3], q[:3]), MM)
                self.assertLess(off(answer["q"], q), MM)

    def test_cradle(self):
        self.check("cradle", [(r["joints"], r["tool_length"], r["tip_nominal"], r["axis_nominal"])
                              for r in rows("cradle_pige")])

    def test_head(self):
        self.check("head", [(r["joints"], r["pivot_to_tip"], r["tip"], r["axis"]) for r in rows("head")])

    def test_head_table(self):
        # B on the spindle, pivot 120 above the nose; C' under the work, whose table lies 40 below
        table = []
        for x, y, z, b, c, length in ((10, 20, 30, 0.4, -0.7, 55), (-5, 3, 1, -0.6, 2.0, 0)):
            u_m = (math.sin(b), 0, math.cos(b))
            p_m = [x - (120 + length) * u_m[0], y, z - (120 + length) * u_m[2]]
            turned = [[math.cos(c) * v[0] + math.sin(c) * v[1], -math.sin(c) * v[0] + math.cos(c) * v[1], v[2]]
                      for v in (p_m, u_m)]
            table.append(([x, y, z, b, c], length, [turned[0][0], turned[0][1], turned[0][2] + 40], turned[1]))
        self.check("head_table", table)

    def test_three_axes(self):
        self.check("mill", [([1, -2, 3], 7, [1, 2, -4], [0, 0, 1])])  # the table carries Y
        self.check("micro_stage", [([1.5, -2, 3], 0, [1.5, -2, 3], [0, 0, 1])])

    def test_the_seed_chooses_the_branch(self):
        u = [math.sin(0.5) * math.sin(0.3), math.sin(0.5) * math.cos(0.3), math.cos(0.5)]
        _, answers, _ = kin("cradle", "inverse", {"p": [0, 0, 0], "u": u, "seed": [0, 0, 0, 0.4, 0.2]},
                            {"p": [0, 0, 0], "u": u, "seed": [0, 0, 0, -0.4, 3.3]},
                            {"p": [0, 0, 0], "u": u, "seed": [0, 0, 0, 0.4, 6.5]})
        self.assertLess(off(answers[0]["q"][3:], [0.5, 0.3]), RAD)
        self.assertLess(off(answers[1]["q"][3:], [-0.5, 0.3 + math.pi]), RAD)
        self.assertLess(off(answers[2]["q"][3:], [0.5, 0.3 + 2 * math.pi]), 1e-11)


class Platforms(unittest.TestCase):
    def check(self, machine, name, joints, tips, tilts):
        table = rows(name)
        _, there, _ = kin(machine, "forward", *({"q": r[joints]} for r in table))
        for answer, r in zip(there, table, strict=True):
            self.assertLess(off(answer["p"], r[tips]), MM)
            self.assertLess(off(answer["u"], tilted(*tilts(r))), RAD)
            self.assertGreater(answer["conditioning"], 0)
            self.assertLessEqual(answer["conditioning"], 1)
        asked = [{"p": [a + 25 * b for a, b in zip(r[tips], tilted(*tilts(r)), strict=True)],
                  "u": tilted(*tilts(r)), "tool_length_mm": -25} for r in table]
        platforms = [{"platform": {k: answer["platform"][k] for k in ("p", "R")}} for answer in there]
        for direction, requests in (("inverse", asked), ("setpoint", asked), ("inverse", platforms)):
            code, back, _ = kin(machine, direction, *requests)
            self.assertEqual(code, 0)
            for answer, r in zip(back, table, strict=True):
                self.assertLess(off(answer["q"], r[joints]), MM)

    def test_hexapod(self):
        self.check("hexapod", "hexapod", "legs", "point_on_platform", lambda r: (r["A"], r["B"]))
        _, answers, _ = kin("hexapod", "forward", {"q": rows("hexapod")[0]["legs"]})
        self.assertIn("joint_angle_deg", answers[0])
        self.assertGreater(answers[0]["leg_distance_mm"], 60)

    def test_rail_mill(self):
        self.check("rail_mill", "rail", "rails", "position", lambda r: (r["alpha"], 0))


class Errors(unittest.TestCase):
    def test_poses_that_cannot_be(self):
        _, answers, _ = kin("mill", "inverse", {"p": [0, 0, 0], "u": [0.1, 0, 1]})
        self.assertEqual(answers[0]["error"], "unreachable")
        _, answers, _ = kin("rail_mill", "inverse", {"p": [0, 0, -900], "u": [0, 0, 1]})
        self.assertEqual(answers[0]["error"], "unreachable")
        _, answers, _ = kin("hexapod", "inverse", {"p": [0, 0, 60], "u": tilted(1.0, 0)})
        self.assertEqual(answers[0]["error"], "limit")
        self.assertIn("mechanism", answers[0]["message"])

    def test_bad_requests_are_named_and_the_rest_is_answered(self):
        code, answers, text = kin("cradle", "forward", '{"q":[0,0,0,0,0]', {"q": [0, 0]}, "", {"quu": 1}, "7",
                                  {"q": [0, 0, 0, 0, 0], "tool_length_mm": "long"}, {"q": [0, 0, 0, 0, 0]})
        self.assertEqual(code, 5)
        self.assertEqual([a.get("line") for a in answers], [1, 2, 4, 5, 6, None])
        self.assertIn("line 2:", text)
        self.assertIn("5 numbers", answers[1]["message"])
        self.assertIn('did you mean "q"', answers[2]["message"])
        self.assertIn("p", answers[5])
        code, answers, _ = kin("cradle", "inverse", {"platform": {}}, {"p": [0, 0, 0]})
        self.assertIn("no moving platform", answers[0]["message"])
        self.assertIn('missing "u"', answers[1]["message"])

    def test_exit_codes(self):
        self.assertEqual(kin("no_such.toml", "forward")[0], 3)
        self.assertEqual(kin("cradle", "sideways")[0], 5)
        self.assertEqual(kin("cradle", "forward", {"q": [0, 0, 0, 0, 0]})[0], 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
