#!/usr/bin/env python3
"""A program that goes on after a power cut, a stop or a fault, or not at all where something has changed. With the
daemon's own clients over its real socket.

usage: resume_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Exit code 77 (skipped) where the kernel allows no network of the test's own.
"""
import json
import os
import re
import sys
import time
import unittest

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
import pause_e2e  # noqa: E402
from daemon_e2e import rows  # noqa: E402
from own_network import enter_own_network  # noqa: E402
from pause_e2e import PASSES, distance_from, places, run_undisturbed  # noqa: E402
from shop import Shop, assert_replays  # noqa: E402


def place_file(shop):
    """Where the last program was, as the next start of the daemon finds it."""
    with open(os.path.join(shop.folder.name, "m.place")) as file:
        return json.load(file)


def settled_place(shop):
    """The same, once nothing has been written for longer than the daemon waits with a place."""
    place, since = place_file(shop), time.monotonic()
    while time.monotonic() < since + 1.5:
        time.sleep(0.05)
        if (now := place_file(shop)) != place:
            place, since = now, time.monotonic()
    return place


class ResumeTest(unittest.TestCase):
    def test_after_a_power_cut_the_program_goes_on_where_it_was(self):
        with Shop() as shop:
            record, log, plain = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log", "plain.csv"))
            program = shop.write("part.ngc", PASSES)
            run_undisturbed(self, shop, program, plain)
            truth = places(plain, 5)
            shop.start()
            code, _, err = shop.client("start", "--resume", "--yes")
            self.assertNotEqual(code, 0)
            self.assertIn("no program was under way", err)
            shop.ask("load", program)
            shop.ask("start")
            shop.until(lambda s: shop.joints()[2] < -1.9 and s["line"] == 8)  # the second of three passes
            time.sleep(0.3)
            shop.kill()
            place = place_file(shop)
            on_the_way = {8: ("G1 X40 Y20", [40, 20, -2]), 9: ("G2 X20 Y40 I-20", [20, 40, -2])}  # a busy host is late
            self.assertEqual((place["text"], place["to"][:3]), on_the_way[place["line"]])
            shop.start("--record", record, "--log", log)
            code, out, err = shop.client("start", "--resume")  # nobody says yes
            self.assertEqual(code, 5, err)
            self.assertIn(f"it was in line {place['line']}", out + err)
            self.assertIn("spindle 2000 rpm", out + err)
            shop.ask("start", "--resume", "--yes", "--before", "2")
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            way = places(record, 4)
            off = [i for i, q in enumerate(way) if distance_from(q, truth) > 0.002]
            back = way[off[-1] + 1:]
            self.assertLess(min(q[2] for q in back), -2.99, "the third pass was cut")
            again = {(round(q[0], 1), round(q[1], 1)) for q in way if abs(q[2] + 1) < 0.1 and q[0] > 1}
            self.assertLessEqual(len(again), 1, "the first was not cut again; the way down passes its depth")
            for q in truth[-40:]:
                self.assertLess(distance_from(q, back), 0.01, "to the end")

    def test_a_power_cut_away_from_a_held_program_finds_the_place_of_the_hold(self):
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", "G21 G90 G61\nG1 X5 F6000\nG1 X50 Z-5 F300\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 3 and shop.joints()[0] > 20)
            shop.ask("hold")
            held = settled_place(shop)
            self.assertAlmostEqual(held["at"][0], shop.joints()[0], places=6)
            for joint, way in (("Z", "30"), ("X", "-7")):
                shop.ask("jog", joint, way, "--wait")
                self.assertEqual(settled_place(shop), held)
            shop.kill()
            shop.start()
            shop.ask("start", "--resume", "--yes")
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(shop.joints()[0], 50, places=6)

    def test_a_long_line_is_entered_a_little_before_the_place(self):
        with Shop() as shop:
            record, ends_record, log, ends_log = (os.path.join(shop.folder.name, name)
                                                  for name in ("record.csv", "ends.csv", "log", "ends.log"))
            program = shop.write("long.ngc", "G21 G91 G94\nG0 Z5\nG1 Z-7 F600\nG1 X200 F1200\nG1 Y20\nM2\n")
            shop.start("--record", ends_record, "--log", ends_log)
            for ends in (("stop", "--wait"), ("estop",), ("stop", "--wait")):  # each time from within the line
                fresh = shop.status()["program"] == ""
                if fresh:
                    shop.ask("load", program)
                    shop.ask("start")
                else:
                    shop.ask("start", "--resume", "--yes", "--before", "3")
                first = shop.joints()[0]
                shop.until(lambda s: s["line"] == 4 and shop.joints()[2] < -1.99 and
                           shop.joints()[0] > (20 if fresh else first + 10))
                shop.ask(*ends)
                shop.until(lambda s: s["state"] in ("idle", "estop"))
                if ends[0] == "estop":
                    shop.ask("reset", "--wait")
            stood = shop.joints()[0]
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, ends_record, ends_log, 1000)
            shop.start("--record", record, "--log", log)
            code, out, err = shop.client("start", "--resume", "--yes", "--before", "3")
            self.assertEqual(code, 0, err)
            self.assertIn("it goes on in line 4, ", out + err)
            self.assertIn("cuts 3.0 mm before that place again", out + err)
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            cut = [q for q in places(record, 1) if abs(q[2] + 2) < 1e-3 and q[0] > 1]
            self.assertAlmostEqual(cut[0][0], stood - 3, delta=0.05)
            self.assertAlmostEqual(cut[-1][0], 200, delta=0.01)
            self.assertAlmostEqual(abs(cut[-1][1]), 20, delta=0.01)

    def test_an_arc_is_entered_a_little_before_the_place(self):
        """A helix of two turns and a bit about X0 Y0, radius 40; the place is in its second turn."""
        program = "G21 G90 G64 P0.005\nG0 X40 Y0 Z20\nG1 Z0 F3000\nG3 X0 Y40 Z-9 I-40 P3 F3000\nG1 Y60\nM2\n"
        with Shop() as shop:
            record, log, ends, ends_log = (os.path.join(shop.folder.name, name)
                                           for name in ("record.csv", "log", "ends.csv", "ends.log"))
            shop.start("--record", ends, "--log", ends_log)
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            for least in (-4.4, -5.5):  # the second time it was begun within the helix
                shop.until(lambda s: s["line"] == 4 and shop.joints()[2] < least)
                shop.ask("stop", "--wait")
                stood = places_of(shop)
                shop.ask("jog", "Z", "30", "--wait")
                if least == -4.4:
                    shop.ask("start", "--resume", "--yes", "--before", "2")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, ends, ends_log, 1000)
            shop.start("--record", record, "--log", log)
            code, out, err = shop.client("start", "--resume", "--yes", "--before", "2")
            self.assertEqual(code, 0, err)
            self.assertIn("it goes on in line 4, ", out + err)
            self.assertIn("cuts 2.0 mm before that place again", out + err)
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            cut = np.array([[float(row["X"]), -float(row["Y"]), float(row["Z"])] for row in rows(record)
                            if int(row["line"]) == 4])
            # The helix in closed form: Z falls by 9 mm in two and a quarter turns.
            about = -cut[:, 2] / 9 * 4.5 * np.pi
            angle = np.arctan2(cut[:, 1], cut[:, 0])
            turned = angle + 2 * np.pi * np.round((about - angle) / (2 * np.pi))
            inner = turned < 4.5 * np.pi - 0.01  # its end is rounded into the next line
            off = np.hypot(np.hypot(cut[:, 0], cut[:, 1]) - 40, cut[:, 2] + 9 * turned / (4.5 * np.pi))
            self.assertLess(off[inner].max(), 0.005)
            stood_at = np.arctan2(stood[1], stood[0]) + 2 * np.pi * np.round(
                (-stood[2] / 9 * 4.5 * np.pi - np.arctan2(stood[1], stood[0])) / (2 * np.pi))
            self.assertAlmostEqual(40 * (stood_at - turned[0]), 2, delta=0.05)
            self.assertAlmostEqual(cut[-1][2], -9, delta=0.01)

    def test_a_session_of_stops_and_resumes_replays_to_the_bit(self):
        """Mid-line, mid-arc, after stop, emergency stop and a jog; with block delete switched and a touch-off at M0."""
        program = ("G21 G90 G64 P0.01\nG10 L2 P1 X0 Y0\nM3 S500\nG0 X0 Y0 Z5\nG1 Z-1 F1500\nM0\n" + "".join(
            f"G1 X60 Y{i} F2000\n/G1 X55 Y{i + 2}\nG3 X0 Y{i} R40\n" for i in range(6)) + "G0 Z5\nM2\n")
        with Shop() as shop:
            record, log, again = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log", "again.csv"))
            shop.start("--record", record, "--log", log)
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: s["waits_for"].startswith("program stop"))
            shop.ask("touch-off", "X", "-12", "Y", "3")
            shop.ask("resume")
            shop.until(lambda s: s["line"] == 9 and s["state"] == "running")
            time.sleep(0.4)  # in the arc
            shop.ask("switch", "block-delete", "on")
            shop.ask("stop", "--wait")
            shop.ask("jog", "X", "-3", "--wait")
            shop.ask("start", "--resume", "--yes", "--before", "1.5")
            shop.until(lambda s: s["line"] in (13, 16) and s["state"] == "running")
            time.sleep(0.4)  # in a line
            shop.ask("estop")
            shop.ask("reset", "--wait")
            shop.ask("start", "--resume", "--yes")
            shop.until(lambda s: s["line"] in (18, 21) and s["state"] == "running")
            shop.ask("switch", "block-delete", "off")
            shop.ask("stop", "--wait")
            shop.ask("mdi", "G10 L2 P1 Y-2", "--wait")
            code, out, err = shop.client("start", "--resume", "--yes")
            self.assertEqual(code, 0, err)
            self.assertIn("Y of G54 (line 2)", out + err)
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 10000)
            first, second = (len(places(path, 1)) for path in (record, again))
            self.assertLess(abs(first - second), 3, "the whole of it")

    def test_what_was_read_ahead_and_not_driven_has_set_nothing(self):
        """Behind a stop and an emergency stop; in a typed line and on disk; and the session replays to the bit."""
        program = ("o7 sub\n#100=[#100+1]\n#<_n>=#100\nG10 L2 P2 X[#100]\nG10 L1 P1 Z[50+#100]\n"
                   "G1 X[#100] Y[#1] F600\no7 endsub\nG21 G90 G64 P0.01\n#1=9\no8 repeat [200]\n"
                   "o7 call [#100 MOD 2]\no8 endrepeat\n#101=1\nM2\n")
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            part = shop.write("part.ngc", program)
            for stop in (("stop", "--wait"), ("estop",), ("stop", "--wait")):
                shop.ask("load", part)
                before = shop.parameter(100)
                shop.ask("mdi", f"G0 X{before} Y0", "--wait")
                shop.ask("start")
                shop.until(lambda s: shop.joints()[0] > before + 4.5)
                shop.ask(*stop)
                if "estop" in stop:
                    shop.ask("reset", "--wait")
                reached = shop.joints()[0]
                shop.ask("mdi", "G0 X[#100 + #<_n> / 1000] Y#1", "--wait")
                count = shop.parameter(100)
                self.assertLess(abs(count - 0.5 - reached), 0.55, "the last move that was begun")
                self.assertEqual((shop.parameter(5241), shop.length(1), shop.parameter(101)), (count, 50 + count, 0))
                x, y = shop.joints()[:2]
                self.assertAlmostEqual(x, count + count / 1000, places=6)
                self.assertAlmostEqual(abs(y), 9, places=6)
            shop.ask("load", shop.write("sets.ngc", "G21 G90\nG10 L2 P1 X33\n#100=999\nG1 X1 F900\nM2\n"))
            shop.ask("load", shop.write("other.ngc", "G21 G90\nG1 X[#100 / 10] F900\nM2\n"))
            shop.ask("start", "--wait")
            self.assertAlmostEqual(shop.joints()[0], count / 10, places=6)
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 2000)

    def test_what_a_program_that_ended_has_set_stays(self):
        """Also where it is ended by the daemon's end; then without what was not driven."""
        with Shop() as shop:
            shop.start()
            lines = "G21 G90\nG1 X5 F900\n#100=[#100+1]\n#101=5\nM2\n"
            shop.ask("load", shop.write("part.ngc", lines))
            shop.ask("start", "--wait")
            shop.ask("jog", "X", "1")
            shop.ask("stop", "--wait")
            self.assertEqual((shop.parameter(100), shop.parameter(101)), (1, 5))
            shop.ask("load", shop.write("long.ngc", "G21 G90\n#100=8\nG1 X200 F600\n#100=9\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 3)
            self.assertEqual(shop.end(), 0)
            self.assertEqual(shop.parameter(100), 8)

    def test_time_left_counts_from_where_the_program_was_entered(self):
        program = "G21 G90 G64 P0.01\nM3 S1000\nG0 Z5\nG1 Z-1 F600\n" + "".join(
            f"G1 X{100 * (1 - i % 2)} Y{i} F2500\n" for i in range(8)) + "M2\n"
        with Shop() as shop:
            record = os.path.join(shop.folder.name, "record.csv")
            shop.start("--record", record)
            path = shop.write("part.ngc", program)
            shop.ask("load", path)
            shop.ask("start")
            whole = shop.until(lambda s: s["time_total_s"] > 0)["time_total_s"]
            shop.until(lambda s: s["line"] == 8)
            shop.ask("stop", "--wait")
            seen = []
            for how in (("--resume",), ("--from", "10")):
                shop.ask("start", *how, "--yes")
                while True:
                    before, status, behind = shop.joints(), shop.status(), shop.joints()
                    if status["state"] == "idle":
                        break
                    seen.append((how[0], before, behind, status["time_done_s"], status["time_left_s"],
                                 status["time_total_s"]))
                    time.sleep(0.1)
            self.assertEqual(shop.end(), 0)
            stream = np.array([[float(row[name]) for name in "XYZ"] for row in rows(record)])
            moves = np.flatnonzero(np.abs(np.diff(stream, axis=0)).max(axis=1) > 0) + 1
            z = stream[:, 2]
            ups = list(np.flatnonzero((z[1:] > 100) & (z[:-1] <= 100))) + [len(z)]
            self.assertEqual(len(ups), 3, "twice over the safe height")
            low = np.flatnonzero(z < -1 + 1e-9)
            ends = [moves[moves <= low[low < up][-1]][-1] for up in ups]  # of the three motions
            for number, how in ((1, "--resume"), (2, "--from")):
                rest, judged = stream[ends[number - 1] + 1:ends[number] + 1], 0
                for _, before, behind, done, left, total in (s for s in seen if s[0] == how):
                    self.assertLess(total, 0.8 * whole, f"{how}: never that of the whole program")
                    at = [np.flatnonzero(np.abs(rest - np.array(q[:3])).max(axis=1) < 1e-9)
                          for q in (before, behind)]
                    if min(len(rows) for rows in at) == 0 or left < 0:
                        continue
                    most, real = ((len(rest) - 1 - row) / 1000 for row in (at[0][0], at[1][-1]))
                    if real < 3:
                        break
                    # The status was published up to 0.1 s before it came. What the spindle needs to come to
                    # speed above the place, where the machine stands, no plan knows.
                    waits = np.count_nonzero(np.abs(np.diff(rest[at[1][-1]:], axis=0)).max(axis=1) == 0) / 1000
                    self.assertLess(left, 1.02 * most + 0.1, f"{how}: {left} s left, really {real} to {most}")
                    self.assertGreater(left, 0.98 * (real - waits),
                                       f"{how}: {left} s left, really {real} to {most}, {waits} of them waiting")
                    self.assertAlmostEqual(done + left, total, delta=0.001 * total)
                    judged += 1
                self.assertGreater(judged, 10, how)

    def test_what_was_measured_since_counts_and_not_what_the_program_sets_before(self):
        """Also behind a power cut; and where a line behind the place, read ahead, has set it otherwise meanwhile."""
        program = ("G21 G90 G61 G10 L2 P1 X0 Y0 Z0\nM61 Q1\nG10 L1 P1 Z100\nG43\nG0 X0 Y0 Z10\nG1 X10 F6000\n"
                   "M0 (measure)\nG1 X20 Z5\nG1 X60 F600\nG10 L2 P1 X7\nG1 X61\nM2\n")
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start()
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: "measure" in s["waits_for"])
            shop.ask("touch-off", "X", "25")  # the spindle stands at 10
            shop.ask("tool", "1", "Z", "95")
            shop.ask("tool", "2", "--in-spindle")
            shop.ask("resume")
            shop.until(lambda s: s["line"] == 9 and shop.joints()[0] > 15)
            shop.kill()
            shop.start("--record", record, "--log", log)
            self.assertAlmostEqual(shop.parameter(5221), 7, places=6, msg="read ahead, and kept")
            shop.ask("mdi", "G10 L2 P1 Y3", "--wait")
            code, out, err = shop.client("start", "--resume")  # nobody says yes
            self.assertEqual(code, 5, err)
            self.assertIn("as you have set it since, though a line of the program sets it: X of G54 (line 1), "
                          "Y of G54 (line 1), the tool in the spindle (line 2), tool 1 (line 3)", out + err)
            shop.ask("start", "--resume", "--yes")
            shop.until(lambda s: s["line"] == 9 and s["state"] == "running" and shop.joints()[0] > 20)
            status = shop.status()
            self.assertEqual([round(x, 6) for x in status["work_offset_value"][:3]], [-15, 3, 0])
            self.assertEqual(shop.parameter(5400), 2)
            self.assertAlmostEqual(status["tool_offset"][2], shop.length(2), places=6)
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.length(1), 95)
            at = shop.motion()[0]["machine"]
            self.assertAlmostEqual(at[0], 61 + 7, places=6, msg="what lies behind the place sets it as ever")
            self.assertAlmostEqual(at[1], 3, places=6)
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            x = [float(row["X"]) for row in rows(record) if int(row["line"]) == 9]
            self.assertAlmostEqual(max(x), 60 - 15, places=6)

    def test_the_work_offset_and_g92_are_as_the_program_found_them(self):
        """What it sets behind the place was read ahead, and is taken back when it is given up."""
        program = "G21 G90 G61\nG1 X5 F6000\nG1 X50 F300\nG92 X0\nG55\nM0\nG1 X10 F6000\nG92.1\nM2\n"
        with Shop() as shop:
            shop.start()
            shop.ask("mdi", "G10 L2 P2 X100", "--wait")
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 3 and shop.joints()[0] > 40)
            shop.ask("stop", "--wait")
            self.assertEqual((shop.parameter(5220), shop.parameter(5210), shop.parameter(5211)), (1, 0, 0))
            stood = shop.joints()[0]
            shop.ask("jog", "X", "-20", "--wait")
            shop.ask("start", "--resume", "--yes")
            shop.until(lambda s: s["line"] == 3 and s["state"] == "running")
            self.assertGreater(shop.joints()[0], stood - 25)
            self.assertLess(shop.joints()[0], 50.001, "in G54, not in G55, 100 mm away")
            shop.until(lambda s: s["state"] == "holding")
            self.assertAlmostEqual(shop.joints()[0], 50, places=6)
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            # G92 makes X0 of X50 in G54, which lies at 100 + 50 in G55.
            self.assertAlmostEqual(shop.joints()[0], 160, places=6)

    def test_from_the_start_on_a_power_cut_finds_this_program_and_no_other(self):
        with Shop() as shop:
            old = shop.write("old.ngc", "G21 G90 G1 X5 F600\nX100\nM2\n")
            new = shop.write("new.ngc", "G21 G90\nG1 X3 F600\nX4\nX200\nM2\n")
            shop.start()
            shop.ask("load", old)
            shop.ask("start")
            shop.until(lambda s: s["line"] == 2)
            shop.ask("stop", "--wait")
            stopped = settled_place(shop)
            shop.ask("load", new)
            self.assertEqual(settled_place(shop), stopped, "as long as another one is only loaded")
            seen = set()
            for pause_s in (0, 0, 0.02, 0.1, 0.8):
                shop.ask("load", new)
                shop.ask("start")
                time.sleep(pause_s)
                shop.kill()
                shop.start()
                code, out, err = shop.client("start", "--resume")  # nobody says yes
                self.assertNotEqual(code, 0)
                self.assertNotIn("old.ngc", out + err)
                self.assertIn("new.ngc", out + err)
                seen.add("had not begun its first line" in err)
                shop.ask("mdi", "G0 X0", "--wait")
            self.assertIn(False, seen, "behind 0.8 s it is in a line")
            self.assertEqual(shop.end(), 0)

    def test_a_stop_before_the_first_move_is_no_end_of_the_program(self):
        """The machine rests again before anybody has seen it move; the line shown is none of the run before."""
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", PASSES))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 8)
            shop.ask("stop", "--wait")
            for pause_s in [0, 0, *np.random.default_rng(7).uniform(0, 0.3, 6)]:
                shop.ask("start")
                time.sleep(pause_s)
                shop.ask("stop", "--wait")
                code, _, err = shop.client("start", "--resume")  # nobody says yes
                self.assertNotEqual(code, 0)
                self.assertNotIn("has come to its end", err)
            self.assertEqual(shop.status()["parts"], 0)
            waits = re.findall(r"line (\d+): waits for the spindle", shop.log_text())
            self.assertIn("2", waits)
            self.assertEqual(set(waits) - {"0", "2"}, set(), shop.log_text())

    def test_what_has_changed_is_no_place_to_go_on(self):
        with Shop() as shop:
            program = shop.write("part.ngc", PASSES)
            shop.start()

            def until_stopped():
                shop.ask("load", program)
                shop.ask("start")
                shop.until(lambda s: s["line"] == 8)
                shop.ask("stop", "--wait")

            def refused(why):
                code, out, err = shop.client("start", "--resume", "--yes")
                self.assertNotEqual(code, 0)
                self.assertIn(why, err)

            until_stopped()
            shop.ask("mdi", "M61 Q2", "--wait")
            refused("tool 2 is in the spindle, and the program was given up with tool 0")
            shop.ask("mdi", "M61 Q0", "--wait")
            shop.write("part.ngc", PASSES + "(more)\n")
            refused("is not the file any more")
            shop.write("part.ngc", PASSES.replace("#1 = 0", "").replace("#1", "#31"))
            until_stopped()
            refused("comes to another place")  # it counts on from what a variable was before
            shop.write("part.ngc", PASSES)
            until_stopped()
            shop.ask("start", "--resume", "--yes")
            shop.until(lambda s: s["state"] == "idle", 60)
            refused("has come to its end")


def places_of(shop):
    """X, Y of the work, Z."""
    q = shop.joints()
    return [q[0], -q[1], q[2]]


if __name__ == "__main__":
    for module in (daemon_e2e, pause_e2e):
        module.BINARY, module.SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    enter_own_network()
    names = [f"ResumeTest.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
