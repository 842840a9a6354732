#!/usr/bin/env python3
"""A program that is held, jogged away from and led back to, also with another tool. With the daemon's own clients
over its real socket.

usage: pause_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Exit code 77 (skipped) where the kernel allows no network of the test's own.
"""
import os
import re
import subprocess
import sys
import time
import unittest

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from daemon_e2e import rows  # noqa: E402
from own_network import enter_own_network  # noqa: E402
from shop import Shop, assert_replays  # noqa: E402

BINARY = ""
PASSES = """G21 G90 G64 P0.001 G17
M3 S2000 (then #1 counts)
#1 = 0
o100 repeat [3]
#1 = [#1-1]
G1 Z#1 F1000
G1 X40 Y0 F2000
G1 X40 Y20
G2 X20 Y40 I-20
G1 X0 Y0
o100 endrepeat
G0 Z10
M2
"""


def run_undisturbed(test, shop, program, trace):
    run = subprocess.run([BINARY, "run", program, "--machine", shop.config, "--trace", trace], text=True,
                         capture_output=True)
    test.assertEqual(run.returncode, 0, run.stderr)


class PauseTest(unittest.TestCase):
    def test_a_hold_is_jogged_away_from_and_led_back_to(self):
        with Shop() as shop:
            record, log, plain = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log", "plain.csv"))
            program = shop.write("part.ngc", PASSES)
            run_undisturbed(self, shop, program, plain)
            shop.start("--record", record, "--log", log)
            shop.ask("load", program)
            shop.ask("start")
            shop.until(lambda s: s["line"] == 7)
            shop.ask("hold")
            code, _, err = until_accepted(shop, "jog", "Z", "30", "--wait")
            self.assertEqual(code, 0, err)
            held = shop.joints()
            shop.ask("jog", "X", "-25", "--speed", "100")
            shop.ask("jog", "Y", "10", "--wait")
            self.assertAlmostEqual(shop.joints()[0], held[0] - 25, places=6)
            self.assertAlmostEqual(shop.joints()[1], held[1] - 10, places=6)  # the table's way
            status = shop.status()
            self.assertEqual((status["state"], status["detour"]), ("holding", "away"))
            self.assertIn("'resume' goes on; first it leads back", status["waits_for"])
            self.assertEqual(status["spindle_rpm"], 2000)
            shop.ask("mdi", "M5 M9")
            shop.until(lambda s: s["spindle_rpm"] == 0)
            for line, why in (("G0 X0", "an axis is moved with 'jog'"), ("G54", "would change what the held program")):
                code, _, err = shop.client("mdi", line)
                self.assertEqual(code, 5, err)
                self.assertIn(why, err)
            held = shop.joints()
            shop.ask("jog", "Z", "4", "--along", "tool", "--wait")
            shop.ask("jog", "Y", "-3", "--along", "work", "--wait")
            self.assertAlmostEqual(shop.joints()[2], held[2] + 4, places=5)
            self.assertAlmostEqual(shop.joints()[1], held[1] + 3, places=5)  # the table's way
            shop.ask("resume")
            self.assertEqual(shop.status()["spindle_rpm"], 2000)
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            truth = places(plain, 5)
            way = places(record, 4)
            off = [i for i, q in enumerate(way) if distance_from(q, truth) > 0.002]
            self.assertLess(max(abs(way[off[-1] + 1][k] - way[off[0] - 1][k]) for k in range(3)), 0.01,
                            "it comes back to where it left")

    def test_several_joints_lead_away_along_a_line_and_back(self):
        """Six legs move for one axis; the tip stays on the line, and the way back leads to the place of the hold."""
        with Shop(machine="hexapod") as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("load", shop.write("part.ngc", "G21 G90\nG91 G1 X40 F1200\nX-40 Y10\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 2 and s["state"] == "running")
            shop.ask("hold")
            code, _, err = until_accepted(shop, "jog", "Z", "25", "--along", "machine", "--wait")
            self.assertEqual(code, 0, err)
            at = shop.motion()[0]["machine"]
            code, out, err = shop.client("jog", "X", "0.5", "--along", "tool", "--speed", "5", "--wait")
            self.assertEqual(code, 0, err)
            self.assertAlmostEqual(shop.motion()[0]["machine"][0], at[0] + 0.5, places=3)
            code, _, err = shop.client("jog", "A", "1", "--along", "work")
            self.assertIn("no direction of its own", err)
            jog = [BINARY, "jog", "Y", "-", "--along", "machine", "--speed", "20", "--machine", shop.config]
            with subprocess.Popen(jog, stdout=subprocess.DEVNULL) as held:
                time.sleep(1)
                held.kill()  # nobody says any more that it is held
            shop.until(lambda s: s["detour"] == "away", 5)
            stands = shop.motion()[0]["machine"]
            self.assertLess(stands[1], at[1] - 1)
            time.sleep(0.3)
            self.assertEqual(shop.motion()[0]["machine"], stands)
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            tips = [[float(row[name]) for name in ("p_x", "p_y", "p_z")] for row in rows(record)]
            up = [tip for tip in tips if tip[2] > tips[0][2] + 1]
            self.assertGreater(max(tip[2] for tip in tips) - tips[0][2], 24.9)
            # Up along Z at the place of the hold, and back the same way but for the last corners.
            first = up[:next(i for i, tip in enumerate(up) if tip[2] > tips[0][2] + 24)]
            self.assertLess(max(abs(tip[k] - first[0][k]) for tip in first for k in (0, 1)), 0.1)
            self.assertLess(max(abs(a - b) for a, b in zip(tips[-1], [tips[0][0], tips[0][1] + 10, tips[0][2]])), 0.001)

    def test_at_a_stop_offsets_and_tools_are_set_and_count_from_there_on(self):
        program = "G21 G90 G61\nT1 M6\nG43\nG0 Z10\nG1 X10 F6000\nM0 (measure)\nG1 X20 Z5\nM0\nG43.1 Z7\nG1 X21\nM2\n"
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: "tool 1" in s["waits_for"])
            # The control does not know the tool that is put in, but its length by its number.
            self.assertIn("before 'resume' confirms it", shop.client("mdi", "G10 L10 P1 Z0")[2])
            self.assertIn("before 'resume' confirms it", shop.client("touch-off", "Z", "0")[2])
            shop.ask("tool", "1", "Z", "101")
            shop.ask("resume")
            shop.until(lambda s: "measure" in s["waits_for"])
            self.assertEqual([round(q, 6) for q in shop.joints()[::2]], [10, 111])
            shop.ask("jog", "Z", "30", "--wait")
            shop.ask("jog", "X", "5", "--wait")
            shop.ask("touch-off", "X", "25")
            self.assertAlmostEqual(shop.status()["work_offset_value"][0], -10, places=6)
            self.assertAlmostEqual(shop.motion()[0]["work"][0], 25, places=6)
            self.assertAlmostEqual(shop.parameter(5221), -10, places=6, msg="on disk before the answer")
            # From here a longer tool would come deeper on the way back, and it is too long for what follows.
            code, out, err = shop.client("tool", "1", "Z", "140")
            self.assertEqual(code, 0, err)
            self.assertIn("39.000 mm longer", out + err)
            self.assertIn("'resume' leads over the safe height", out + err)
            shop.ask("touch-off", "Z", "46", "--tool")  # the spindle stands at 141
            self.assertEqual(shop.length(1), 95)
            self.assertAlmostEqual(shop.status()["tool_offset"][2], 95, places=6)
            # What would lead out of the machine is refused, with the line, and nothing changes.
            code, _, err = shop.client("offset", "G54", "X", "900")
            self.assertNotEqual(code, 0)
            self.assertIn("part.ngc:7", err)
            self.assertAlmostEqual(shop.parameter(5221), -10, places=6)
            self.assertEqual(shop.client("tool", "9", "--in-spindle")[0], 2, "there is no tool 9")
            shop.ask("resume")
            shop.until(lambda s: s["line"] == 8 and s["state"] == "holding")
            self.assertEqual([round(q, 6) for q in shop.joints()[::2]], [10, 100])
            # Another tool in the spindle: its length is in force, as the one before was.
            shop.ask("tool", "2", "--in-spindle")
            self.assertAlmostEqual(shop.status()["tool_offset"][2], shop.length(2), places=6)
            self.assertEqual(shop.parameter(5400), 2)
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(shop.joints()[0], 11, places=6)
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)

    def test_behind_a_stop_a_longer_tool_goes_over_the_safe_height_to_where_the_tip_was(self):
        """The rest is planned anew with its length; and refused, with line and joint, where it would not fit."""
        program = ("G21 G90 G61\nM61 Q1\nG10 L1 P1 Z50\nG43\nG0 X0 Y0 Z10\nG1 X10 Z5 F6000\nM0 (measure)\n"
                   "G1 X20\nG1 Z120\nG0 Z130\nM2\n")
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: "measure" in s["waits_for"])
            self.assertEqual([round(q, 6) for q in shop.joints()[::2]], [10, 55])
            shop.ask("jog", "Z", "60", "--wait")
            shop.ask("jog", "X", "-40", "--wait")
            away = shop.joints()
            # Too long for a line that follows (Z goes to 250): it says which, and the program goes on waiting.
            code, _, err = shop.client("tool", "1", "Z", "125")
            self.assertEqual(code, 2, err)
            self.assertIn("part.ngc:10", err)
            self.assertIn("joint Z would go to 255", err)
            self.assertEqual(shop.length(1), 50)
            self.assertEqual(shop.joints(), away)
            shop.ask("tool", "1", "Z", "90")
            code, out, err = shop.client("resume")
            self.assertEqual(code, 0, err)
            self.assertIn("40.000 mm longer", out + err)
            self.assertIn("stops there again, in line 7", out + err)
            shop.until(lambda s: s["state"] == "holding" and "measure" in s["waits_for"])
            self.assertEqual([round(q, 6) for q in shop.joints()[::2]], [10, 95], "its tip is where it was")
            self.assertAlmostEqual(shop.motion()[0]["work"][2], 5, places=6)
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(shop.joints()[2], 130 + 90, places=6)
            self.assertEqual(shop.length(1), 90, "and not what the program gives")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            way = [(float(row["X"]), float(row["Z"])) for row in rows(record)]
            at = next(i for i, (x, z) in enumerate(way) if x < -29.9)
            back = way[at:]
            arrived = next(i for i, (x, z) in enumerate(back) if abs(x - 10) < 1e-6 and abs(z - 95) < 1e-6)
            self.assertGreater(min(z for _, z in back[:arrived]), 94.999, "no deeper than to that place")

    def test_where_the_tip_has_no_room_to_go_back_to_resume_is_refused(self):
        """At the stop there was room for the old tool alone; what follows is lower."""
        program = "G21 G90 G61\nM61 Q1\nG10 L1 P1 Z50\nG43\nG0 X0 Y0 Z120\nM0\nG1 X20 F6000\nG0 Z10\nM2\n"
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: s["waits_for"].startswith("program stop"))
            shop.ask("jog", "X", "-40", "--wait")
            away = shop.joints()
            shop.ask("tool", "1", "Z", "140")
            code, _, err = shop.client("resume")
            self.assertEqual(code, 2, err)
            self.assertIn("part.ngc:6", err)
            self.assertIn("on the way to this line, joint Z would go to 260", err)
            shop.until(lambda s: s["state"] == "holding" and s["waits_for"].startswith("program stop"))
            self.assertEqual(shop.joints(), away)
            shop.ask("tool", "1", "Z", "100")  # a shorter one
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "holding" and abs(shop.joints()[2] - 220) < 1e-6)
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(shop.joints()[2], 110, places=6)

    def test_while_m6_waits_a_longer_tool_goes_over_the_safe_height(self):
        program = "G21 G90 G61\nM61 Q1 G43\nG0 X0 Y0 Z20\nG1 X10 F6000\nT2 M6\nG43\nG1 X20\nG0 Z50\nM2\n"
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: "tool 2" in s["waits_for"])
            stood, length = shop.joints(), shop.length(1)
            shop.ask("jog", "Z", "40", "--wait")
            shop.ask("tool", "1", "Z", str(length + 15))  # the one that is in force still
            code, out, err = shop.client("resume")
            self.assertEqual(code, 0, err)
            self.assertIn("15.000 mm longer", out + err)
            shop.until(lambda s: s["state"] == "holding" and "tool 2" in s["waits_for"])
            self.assertAlmostEqual(shop.joints()[2], stood[2] + 15, places=6)
            self.assertNotEqual(shop.parameter(5400), 2)
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.parameter(5400), 2)
            self.assertAlmostEqual(shop.joints()[2], 50 + shop.length(2), places=6)

    def test_a_longer_tool_that_comes_in_goes_over_the_safe_height(self):
        program = "G21 G90 G61\nM61 Q1 G43\nG0 X8 Y0 Z60\nG1 X10 F60\nT2 M6\nG43\nG1 X20 F6000\nG0 Z90\nM2\n"
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("tool", "2", "Z", str(shop.length(1) + 12))
            for jogs in (False, True):
                shop.ask("start")
                shop.until(lambda s: "tool 2" in s["waits_for"])
                stood = shop.joints()
                if jogs:
                    shop.ask("jog", "X", "30", "--wait")
                    highest = shop.joints()[2]
                    code, out, err = shop.client("resume")
                    self.assertEqual(code, 0, err)
                    self.assertIn("12.000 mm longer than the tool before it", out + err)
                    self.assertNotEqual(shop.parameter(5400), 2)
                    while not shop.status()["state"] == "holding":
                        x, _, z = shop.joints()[:3]
                        highest = max(highest, z)
                        if highest > stood[2] + 20 and z < stood[2] + 1e-6:
                            self.assertAlmostEqual(x, stood[0], places=6, msg="it cuts nothing again")
                    self.assertGreater(highest, stood[2] + 20, "it goes over the safe height")
                    shop.until(lambda s: s["state"] == "holding" and "tool 2" in s["waits_for"])
                    for at, then in zip(shop.joints(), stood):
                        self.assertAlmostEqual(at, then, places=6)
                shop.ask("resume")  # nobody has jogged: the program goes on as it is written
                shop.until(lambda s: s["state"] == "idle")
                self.assertEqual(shop.parameter(5400), 2)
                self.assertAlmostEqual(shop.joints()[2], 90 + shop.length(2), places=6)

    def test_a_tool_that_was_typed_is_confirmed_behind_a_jog(self):
        with Shop() as shop:
            shop.start()
            for before in (0, 2):  # none, and another one
                shop.ask("tool", str(before), "--in-spindle")
                shop.ask("mdi", "T1 M6")
                shop.until(lambda s: "tool 1" in s["waits_for"])
                stood = shop.joints()
                shop.ask("jog", "Z", "40", "--wait")
                shop.ask("resume")
                shop.until(lambda s: s["state"] == "idle")
                self.assertEqual(shop.parameter(5400), 1)
                self.assertAlmostEqual(shop.joints()[2], stood[2], places=6)

    def test_where_the_path_is_planned_offsets_are_refused_at_once(self):
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", "G21 G90\nT1 M61 Q1 G43\nG1 X10 F600\nX100\nX10\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 4)
            shop.ask("hold")
            shop.ask("step", "on")
            for _ in range(2):  # in the hold, and held by single block
                for line in (("touch-off", "X", "0"), ("touch-off", "Z", "0", "--tool"), ("tool", "1", "Z", "5"),
                             ("offset", "G54", "X", "1")):
                    begun = time.time()
                    code, _, err = until_accepted(shop, *line)
                    self.assertEqual(code, 5, err)
                    self.assertIn("set them at a program stop (M0), or 'stop' the program", err)
                    self.assertLess(time.time() - begun, 60, "it waits for nothing")
                shop.ask("resume")
                shop.until(lambda s: s["state"] == "holding")
            shop.ask("stop", "--wait")
            shop.ask("touch-off", "X", "0")

    def test_a_held_program_goes_back_along_its_path_and_on_from_there(self):
        with Shop() as shop:
            record, log, plain = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log", "plain.csv"))
            program = shop.write("part.ngc", PASSES)
            run_undisturbed(self, shop, program, plain)
            truth = places(plain, 5)
            shop.start("--record", record, "--log", log)
            self.assertIn("'hold' it first", shop.client("reverse", "5")[2])
            shop.ask("load", program)
            shop.ask("start")
            shop.until(lambda s: s["line"] == 9 and shop.motion()[0]["work"][1] > 30)
            shop.ask("hold")
            # In the arc, or behind it where the hold came late.
            stood = shop.until(lambda s: s["state"] == "holding" and s["override_now"] == 0)
            code, _, err = until_accepted(shop, "reverse", "12", "--wait")
            self.assertEqual(code, 0, err)
            self.assertIn("goes on from here, 12.0 mm behind the place of the hold", shop.status()["waits_for"])
            self.assertLess(distance_from(shop.joints(), truth), 0.002)
            back = shop.joints()
            shop.ask("forward", "--wait")
            status = shop.status()
            self.assertIn("there is no more path that way", status["waits_for"])
            self.assertEqual((status["line"], status["block"]), (stood["line"], stood["block"]))
            held = shop.joints()
            self.assertGreater(max(abs(a - b) for a, b in zip(held, back)), 5)
            shop.ask("reverse")
            shop.until(lambda s: s["detour"] == "retraces" and s["override_now"] < -0.1)
            self.assertIn("moves along its path already", shop.client("reverse", "1")[2])
            shop.ask("hold")
            shop.until(lambda s: s["detour"] == "")
            shop.ask("jog", "Z", "5", "--wait")
            self.assertIn("away from the path", shop.client("reverse", "1")[2])
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            off = [q for q in places(record, 4) if distance_from(q, truth) > 0.002]
            self.assertLess(max(abs(q[0] - off[0][0]) + abs(q[1] - off[0][1]) for q in off), 0.01, "the jog of Z alone")

    def test_block_delete_acts_on_what_is_not_read_yet(self):
        """At a program stop that is the next line; in motion, what the answer says."""
        way = "".join(f"G1 X{20 + 40 * (i % 2)} F3000\n/G1 Y{i % 2}\n" for i in range(30))
        program = "G21 G90 G61\nG1 X1 F6000\nM0\n/G1 X9\nG1 X3\nM0\n/G1 X12\nG1 X4\n" + way + "G1 Y9\nM2\n"
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: s["waits_for"].startswith("program stop"))
            told = shop.client("switch", "block-delete", "on")
            self.assertEqual(told[0], 0, told)
            self.assertIn("lines with / are skipped behind line 3 of part.ngc", told[1] + told[2])
            self.assertIn("behind line 3 of part.ngc", shop.ask("status"))
            shop.until(lambda s: s["block_delete"] and s["time_about"])
            shop.ask("resume")
            shop.until(lambda s: s["line"] == 6 and s["waits_for"].startswith("program stop"))
            self.assertAlmostEqual(shop.joints()[0], 3, places=6)
            shop.ask("switch", "block-delete", "off")
            shop.ask("resume")
            shop.until(lambda s: s["line"] >= 11 and s["state"] == "running")
            told = shop.client("switch", "block-delete", "on")
            line = int(re.search(r"skipped behind line (\d+) of part.ngc", told[1] + told[2]).group(1))
            self.assertGreater(line, 11)
            self.assertLess(line, 60, "as far as is planned ahead, and no further")
            shop.until(lambda s: s["state"] == "idle", 60)
            # A line that would leave the machine is refused, and the program goes on as it was.
            shop.ask("load", shop.write("far.ngc", "G21 G90\nG1 X1 F6000\nM0\n/G1 X900\nG1 X3\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: s["waits_for"].startswith("program stop"))
            code, _, err = shop.client("switch", "block-delete", "off")
            self.assertNotEqual(code, 0)
            self.assertIn("far.ngc:4", err)
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(shop.joints()[0], 3, places=6)
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            driven = {int(row["line"]) for row in rows(record)}
            slashed = {n for n in driven if 10 <= n < 69 and n % 2 == 0}
            self.assertGreater(len(slashed), 1, "they were run")
            self.assertLessEqual(max(slashed), line, "and behind the line that was told they were not")
            self.assertTrue({n for n in range(9, 69, 2)} <= driven)
            self.assertNotIn(4, driven)
            self.assertIn(7, driven)


def until_accepted(shop, *arguments):
    """A hold slows down first: what is asked of the standing machine is refused until it stands."""
    for _ in range(100):
        code, out, err = shop.client(*arguments)
        if "does not stand yet" not in err:
            break
        time.sleep(0.02)
    return code, out, err


def places(path, every):
    """Where the machine was, each once in a row; of those one in so many, and the last."""
    out = []
    for row in rows(path):
        place = tuple(float(row[name]) for name in "XYZ")
        if not out or place != out[-1]:
            out.append(place)
    return out[::every] + [out[-1]]


def distance_from(q, line):
    """Of a place from the nearest chord of a polyline, mm."""
    points = np.array(line)
    a, way = points[:-1], np.diff(points, axis=0)
    length = np.maximum((way * way).sum(axis=1), 1e-30)
    t = np.clip(((np.array(q) - a) * way).sum(axis=1) / length, 0, 1)
    return float(np.sqrt(((a + t[:, None] * way - np.array(q))**2).sum(axis=1).min()))


if __name__ == "__main__":
    BINARY = os.path.abspath(sys.argv[1])
    daemon_e2e.BINARY, daemon_e2e.SOURCE = BINARY, os.path.abspath(sys.argv[2])
    enter_own_network()
    names = [f"PauseTest.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
