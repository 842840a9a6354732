#!/usr/bin/env python3
"""A part from the switched-off machine to its last line, with clients alone: home, touch off, tools, M0, hold, jogs, a
tool change, a kill and the way back. And a daemon that is killed at random moments: nothing acknowledged is lost, no
file is torn, and a program goes on upon its contour.

usage: journey_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Exit code 77 (skipped) where the kernel allows no network of the test's own. TRN_KILLS=COUNT: that many kills instead
of 12; TRN_SEED=NUMBER: other ones.
"""
import json
import os
import random
import re
import shutil
import subprocess
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
from pause_e2e import until_accepted  # noqa: E402
from shop import Shop  # noqa: E402

BINARY = ""
PART = """G21 G90 G64 P0.001 G17
T1 M6
G43 H1
M3 S2000
G0 Z5
G0 X0 Y0
G1 Z-1 F600
G1 X40 F1500
M0 (turn the part)
G1 Y30
G2 X20 Y50 I-20 J0 F900
G1 X0 Y0
G0 Z20
T2 M6
G43 H2
M3 S2000
G0 X10 Y10
G1 Z-2 F600
G1 X110 F900
G1 Y40
G0 Z20
M5
M2
"""
CUTS = 7  # the first line that cuts
ROUND = """G21 G90 G64 P0.001 G17
M3 S1000
G0 Z5
G0 X0 Y0
#1 = 0
o100 repeat [40]
#1 = [#1 - 0.05]
G1 Z#1 F300
G1 X30 F1200
G1 Y20
G2 X10 Y40 I-20 J0
G1 X0 Y0
o100 endrepeat
G0 Z20
M2
"""


def driven(path, first_line=0):
    """Joints of every fourth period from the first row of that line on, standing periods once. A kill may have cut the
    last row."""
    out = []
    for row in rows(path)[:-1]:
        place = tuple(float(row[name]) for name in "XYZ")
        if out or int(row["line"]) >= first_line:
            if not out or place != out[-1]:
                out.append(place)
    return out[::4] + out[-1:]


class Polyline:
    """A way as a line of straights."""

    def __init__(self, places):
        points = np.array(places)
        self.start, self.way = points[:-1], np.diff(points, axis=0)
        self.length = np.maximum((self.way * self.way).sum(axis=1), 1e-30)

    def distance(self, q):
        """Of a place from it, mm."""
        t = np.clip(((np.array(q) - self.start) * self.way).sum(axis=1) / self.length, 0, 1)
        return float(np.sqrt(((self.start + t[:, None] * self.way - np.array(q))**2).sum(axis=1).min()))


def excursions(way, truth, tolerance_mm):
    """How often the way leaves the truth by more than this, and which of its places are off it."""
    off = [truth.distance(q) > tolerance_mm for q in way]
    return sum(b and not a for a, b in zip([False] + off, off)), off


class JourneyTest(unittest.TestCase):
    def test_a_part_from_start_to_end(self):
        with Shop() as shop:
            records = [os.path.join(shop.folder.name, f"record{i}.csv") for i in (1, 2)]
            program = shop.write("part.ngc", PART)
            shop.start("--record", records[0])
            shop.ask("home", "--wait")
            for axis, way in (("X", "12"), ("Y", "-7"), ("Z", "-30")):
                shop.ask("jog", axis, way, "--wait")
            shop.ask("tool", "1", "--in-spindle")
            shop.ask("touch-off", "Z", "0", "--tool")
            shop.ask("touch-off", "X", "0", "Y", "0")
            shop.ask("tool", "2", "Z", "70")
            shop.ask("jog", "Z", "20", "--wait")

            plain, tools, variables = (os.path.join(shop.folder.name, n) for n in ("plain.csv", "t.tbl", "v.var"))
            shutil.copy(shop.tools, tools)
            shutil.copy(shop.vars, variables)
            run = subprocess.run([BINARY, "run", program, "--machine", shop.config, "--tools", tools, "--vars",
                                  variables, "--trace", plain], text=True, capture_output=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            truth = driven(plain, CUTS)

            shop.ask("load", program)
            shop.ask("start")
            shop.until(lambda s: "tool 1" in s["waits_for"])
            shop.ask("resume")
            status = shop.until(lambda s: s["waits_for"].startswith("program stop"))
            self.assertEqual(status["waits_for"], "program stop (M0): turn the part; 'resume' goes on")
            shop.ask("resume")
            shop.until(lambda s: s["line"] == 11)
            shop.ask("hold")
            self.assertEqual(until_accepted(shop, "jog", "Z", "30", "--wait")[0], 0)
            shop.ask("jog", "X", "-15", "--wait")
            shop.ask("mdi", "M5")
            shop.ask("resume")
            shop.until(lambda s: "tool 2" in s["waits_for"])
            shop.ask("resume")
            shop.until(lambda s: s["line"] == 19 and shop.motion()[0]["work"][0] > 60)
            shop.kill()

            shop.start("--record", records[1])
            self.assertEqual(shop.parameter(5400), 2, "the tool in the spindle")
            shop.ask("home", "--wait")
            told = shop.client("start", "--resume", "--yes")
            self.assertEqual(told[0], 0, told)
            self.assertIn("it was in line 19", told[1] + told[2])
            shop.until(lambda s: s["state"] == "idle" and s["parts"] == 1)
            self.assertEqual(shop.end(), 0)

            first, second = driven(records[0], CUTS), driven(records[1])
            part = Polyline(truth)
            away, _ = excursions(first, part, 0.01)
            self.assertEqual(away, 1, "the jogs in the hold, and the way back")
            approach, off = excursions(second, part, 0.01)
            self.assertEqual(approach, 1, "the approach")
            self.assertLess(len(off) - off[::-1].index(True), len(off) // 2, "then it stays on the part to its end")
            ways = [Polyline(first), Polyline(second)]
            for q in truth:
                self.assertLess(min(way.distance(q) for way in ways), 0.01, f"{q} was not driven")


class Kept:
    """What the daemon has acknowledged, and what an answer that never came may have changed."""

    def __init__(self):
        self.sure, self.open = {}, {}

    def judge(self, name, found):
        legal = [self.sure[name]] + ([self.open[name]] if name in self.open else [])
        ok = any(abs(found - value) < 1e-6 for value in legal)
        self.sure[name] = found
        self.open.pop(name, None)
        return ok


class KillsTest(unittest.TestCase):
    def whole(self, shop):
        """Every file that is kept is one that was written to its end."""
        folder = shop.folder.name
        with open(shop.tools) as file:
            text = file.read()
        self.assertTrue(text.startswith("; the workshop's tools\n") and text.endswith("\n"))
        self.assertEqual(len(re.findall(r"^T\d+ .*$", text, re.M)), 2)
        if os.path.exists(shop.vars):
            with open(shop.vars) as file:
                text = file.read()
            self.assertTrue(text.endswith("\n"))
            for line in text.splitlines():
                number, value = line.split()
                int(number), float(value)
        counters = shop.vars + ".counters"
        if os.path.exists(counters):
            with open(counters) as file:
                self.assertRegex(file.read(), r"^parts \d+\nrun_s [\d.]+\n$")
        place = os.path.join(folder, "m.place")
        if os.path.exists(place):
            with open(place) as file:
                self.assertIn("block_delete_changes", json.load(file))

    def kill_in_an_order(self, shop, kept, chance):
        value = round(chance.uniform(-20, 20), 4)
        orders = {"x": ("offset", "G54", "X", str(value)), "z": ("tool", "1", "Z", str(value)),
                  "d": ("tool", "2", "Z", str(value)), "y": ("offset", "G56", "Y", str(value)),
                  "parts": ("parts", str(abs(int(value * 100))))}
        name = chance.choice(list(orders))
        wanted = float(orders[name][-1])
        kept.open[name] = wanted
        client = subprocess.Popen([BINARY, *orders[name], "--machine", shop.config], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        end = time.monotonic() + chance.uniform(0, 0.12)
        while time.monotonic() < end and client.poll() is None:
            time.sleep(0.001)
        answered = client.poll() == 0
        shop.kill()
        client.kill()
        client.wait()
        # A counter is shown when it is on disk, which is what an answer about it promises.
        if answered and name != "parts":
            kept.sure[name] = wanted
            kept.open.pop(name)
        return answered

    def kill_in_motion(self, shop, program, chance):
        shop.ask("load", program)
        shop.ask("start")
        shop.until(lambda s: s["line"] > 7)
        time.sleep(chance.uniform(0, 3))
        shop.kill()

    def resumed(self, shop, program, record, chance):
        """What it drives, and whether it had a place to go on from: the record is a little behind the motion, and who
        kills it in the first line finds that it was started."""
        shop.start("--record", record)
        code, _, err = shop.client("start", "--resume", "--yes", "--before", str(chance.choice([0, 1, 5])))
        if code != 0:
            self.assertIn("round.ngc was started, but had not begun its first line", err)
            shop.ask("load", program)
            shop.ask("start")
        down = shop.until(lambda s: s["state"] == "running" and s["line"] > 7)
        self.assertEqual(down["state"], "running")
        time.sleep(0.5)
        shop.ask("stop", "--wait")
        self.assertEqual(shop.end(), 0)
        return driven(record), code == 0

    def test_random_kills_lose_nothing(self):
        kills = max(4, int(os.environ.get("TRN_KILLS", 12)))
        chance = random.Random(int(os.environ.get("TRN_SEED", 1)))
        answered = resumes = unbegun = 0
        worst_mm = 0.0
        with Shop() as shop:
            program = shop.write("round.ngc", ROUND)
            plain, record = (os.path.join(shop.folder.name, name) for name in ("plain.csv", "record.csv"))
            run = subprocess.run([BINARY, "run", program, "--machine", shop.config, "--trace", plain], text=True,
                                 capture_output=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            contour = [q for q in driven(plain, 8) if q[2] < 0]
            flat = Polyline([(x, y, 0.0) for x, y, _ in contour[:len(contour) // 8]])
            kept = Kept()
            kept.sure = {"x": 0, "y": 0, "z": 50, "d": 80, "parts": 0}
            for kill in range(1, kills + 1):
                shop.start()
                told = f"kill {kill}"
                if kill % 4 == 0:
                    shop.ask("offset", "G54", "X", "0")
                    kept.sure["x"] = 0
                    self.kill_in_motion(shop, program, chance)
                    self.whole(shop)
                    way, had_place = self.resumed(shop, program, record, chance)
                    low = [(x, y, 0.0) for x, y, z in way if z < 2]
                    self.assertGreater(len(low), 10, told)
                    worst_mm = max(worst_mm, max(flat.distance(q) for q in low[::5]))
                    self.assertLess(worst_mm, 0.01, f"{told}: it came down beside the contour")
                    resumes += 1
                    unbegun += not had_place
                else:
                    answered += self.kill_in_an_order(shop, kept, chance)
                self.whole(shop)
                found = {"x": shop.parameter(5221), "y": shop.parameter(5262), "z": shop.length(1),
                         "d": shop.length(2)}
                for name, value in found.items():
                    self.assertTrue(kept.judge(name, value), f"{told}: {name} is {value}")
                if os.path.exists(shop.vars + ".counters"):
                    with open(shop.vars + ".counters") as file:
                        self.assertTrue(kept.judge("parts", int(file.read().split()[1])), told)
                if kills > 50 and kill % 10 == 0:
                    print(f"{told} of {kills}", file=sys.stderr, flush=True)
        print(f"{kills} kills (seed {os.environ.get('TRN_SEED', 1)}): {answered} behind an answer, nothing "
              f"acknowledged lost, no file torn; {resumes} of {resumes} programs went on upon their contour, "
              f"{unbegun} of them from their start, worst {1000 * worst_mm:.2f} um")
        self.assertLessEqual(unbegun, 1 + resumes // 10)


if __name__ == "__main__":
    BINARY = os.path.abspath(sys.argv[1])
    for module in (daemon_e2e, pause_e2e):
        module.BINARY, module.SOURCE = BINARY, os.path.abspath(sys.argv[2])
    enter_own_network()
    names = [f"{'KillsTest' if 'kills' in name else 'JourneyTest'}.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
