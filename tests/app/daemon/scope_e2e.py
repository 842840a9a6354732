#!/usr/bin/env python3
"""The scope of a running daemon: every signal at every period, triggers, its files, and what is kept of a fault.

usage: scope_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Exit code 77 (skipped) where the kernel allows no network of the test's own. TRN_LONG=SECONDS: records for so long, as
3600.
"""
import csv
import json
import os
import struct
import subprocess
import sys
import threading
import time
import unittest
import xml.etree.ElementTree

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from own_network import enter_own_network  # noqa: E402
from shop import Shop  # noqa: E402

BINARY = SOURCE = ""
PROGRAM = "G21 G90 G61.1\nG1 X0 F6000\nG4 P0.5\nG1 X50\nG1 Y20\nG1 X0 Y0\nM2\n"


def table(path):
    """(remark, rows) of a recording."""
    with open(path) as file:
        remark = file.readline()
        return remark, list(csv.DictReader(file))


def decoder(folder):
    """The type scope_data_t as lcm-gen makes it for Python, which is a decoder of its own."""
    subprocess.run(["lcm-gen", "--python", "--ppath", folder, os.path.join(SOURCE, "hal/lcm/scope_data_t.lcm")],
                   check=True, capture_output=True)
    sys.path.insert(0, folder)
    from trunnion import scope_data_t  # noqa: E402
    return scope_data_t


def events(path):
    """(number, channel, payload) of every event in a log of LCM."""
    with open(path, "rb") as file:
        data = file.read()
    at = 0
    while at < len(data):
        mark, number, _, channel, size = struct.unpack_from(">IqqII", data, at)
        assert mark == 0xEDA1DA01, at
        at += 28
        yield number, data[at:at + channel].decode(), data[at + channel:at + channel + size]
        at += channel + size


class ScopeTest(unittest.TestCase):
    def beside(self, work):
        """Runs `work` while the test goes on; join the thread for its end."""
        thread = threading.Thread(target=work)
        thread.start()
        return thread

    def test_signals_are_listed_with_units(self):
        with Shop() as shop:
            shop.start()
            listed = {s["name"]: s for s in json.loads(shop.ask("scope", "--list", "--json"))}
            self.assertEqual(listed["X.measured"]["unit"], "mm")
            self.assertEqual(listed["X.velocity"]["unit"], "mm/s")
            self.assertEqual(listed["tick"]["unit"], "us")
            for name in ("line", "rate", "fault", "input.3", "Z.statusword"):
                self.assertIn(name, listed)
            self.assertIn("X.following_error", shop.ask("scope", "--list"))

    def test_no_period_is_missing(self):
        seconds = float(os.environ.get("TRN_LONG", 4))
        with Shop() as shop:
            shop.start()
            told = json.loads(shop.ask("scope", "X.setpoint", "X.measured", "*.following_error", "line", "tick", "wake",
                                       "--seconds", str(seconds), "--json")
                              if seconds < 60 else self.long_run(shop, seconds))
            self.assertEqual(told["lost"], 0)
            self.assertEqual(told["rows"], round(seconds / told["period_s"]))
            print(f"    {told['rows']} periods of {told['period_s']} s, {told['lost']} lost", flush=True)

    def long_run(self, shop, seconds):
        """An hour is more than a client waits for by itself."""
        done = subprocess.run([BINARY, "scope", "X.setpoint", "X.measured", "line", "tick", "--seconds", str(seconds),
                               "--patience", str(2 * seconds), "--json", "--machine", shop.config], text=True,
                              capture_output=True, timeout=3 * seconds)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_a_line_triggers_and_what_was_before_is_there(self):
        with Shop() as shop:
            shop.start()
            files = {name: os.path.join(shop.folder.name, "cut." + name) for name in ("csv", "svg", "lcm")}
            told = []
            thread = self.beside(lambda: told.append(shop.client(
                "scope", "X.setpoint", "X.velocity", "line", "--trigger", "line 4", "--before", "0.2", "--seconds",
                "0.3", "--json", "--csv", files["csv"], "--svg", files["svg"], "--lcm", files["lcm"])))
            time.sleep(0.5)
            shop.ask("load", shop.write("part.ngc", PROGRAM))
            shop.ask("start")
            thread.join(60)
            code, out, err = told[0]
            self.assertEqual(code, 0, err)
            summary = json.loads(out)
            self.assertEqual((summary["lost"], summary["rows"]), (0, round(0.5 / summary["period_s"])))
            remark, rows = table(files["csv"])
            self.assertIn(f"; trigger {summary['trigger_period']}", remark)
            self.assertAlmostEqual(float(rows[0]["t_s"]), -0.2, places=6)
            at = [float(row["t_s"]) for row in rows].index(0.0)
            self.assertEqual([rows[at - 1]["line"] == "4", rows[at]["line"]], [False, "4"])
            # The velocity is that of the setpoints in the same table.
            period = summary["period_s"]
            for before, row in zip(rows, rows[1:]):
                step = (float(row["X.setpoint [mm]"]) - float(before["X.setpoint [mm]"])) / period
                self.assertAlmostEqual(float(row["X.velocity [mm/s]"]), step, places=4)
            self.assertGreater(max(float(row["X.velocity [mm/s]"]) for row in rows), 20)
            xml.etree.ElementTree.parse(files["svg"])
            logged = list(events(files["lcm"]))
            self.assertEqual([number for number, _, _ in logged], list(range(len(logged))))
            self.assertTrue(logged[0][1].endswith(".scope_signals"))
            data = [decoder(shop.folder.name).decode(payload) for _, channel, payload in logged
                    if channel.endswith(".scope_data")]
            self.assertEqual(len(data), -(-summary["rows"] // 100))
            places = [value for message in data for value in message.value[0::3]]
            self.assertEqual([f"{value:.12g}" for value in places], [row["X.setpoint [mm]"] for row in rows])
            self.assertEqual([period for message in data for period in message.period],
                             [int(row["period"]) for row in rows])

    def test_a_fault_is_kept_by_itself(self):
        with Shop() as shop:
            log = os.path.join(shop.folder.name, "session.log")
            shop.start("--log", log)
            shop.ask("load", shop.write("part.ngc", PROGRAM))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 4)
            shop.ask("estop")
            kept = log + ".fault1.csv"
            end = time.time() + 20
            while not os.path.exists(kept) and time.time() < end:
                time.sleep(0.05)
            remark, rows = table(kept)
            self.assertIn("; trigger ", remark)
            at = [float(row["t_s"]) for row in rows].index(0.0)
            self.assertEqual((float(rows[at - 1]["fault"]), float(rows[at]["fault"]) > 0), (0, True))
            self.assertGreater(len(rows) - at, 500, "and a while behind it")
            told = json.loads(shop.ask("status", "--json"))["alarms"]
            stopped = [alarm["line"] for alarm in told if alarm["name"] == "emergency_stop"]
            self.assertEqual([int(rows[at]["line"])], stopped)
            self.assertGreaterEqual(stopped[0], 4)
            self.assertIn("the last seconds before the fault are in " + kept, shop.log_text())
            # The same file again: fewer signals, a picture.
            picture = os.path.join(shop.folder.name, "fault.svg")
            told = json.loads(shop.ask("scope", "--read", kept, "X.setpoint", "fault", "--svg", picture, "--json"))
            self.assertEqual([s["signal"] for s in told["signals"]], ["X.setpoint", "fault"])
            xml.etree.ElementTree.parse(picture)

    def test_rolls_until_it_is_told_to_end(self):
        with Shop() as shop:
            shop.start()
            path = os.path.join(shop.folder.name, "roll.csv")
            told = []
            thread = self.beside(lambda: told.append(shop.client(
                "scope", "X.measured", "--rolling", "--seconds", "0.5", "--csv", path, "--patience", "4", "--json")))
            time.sleep(2.5)
            first = table(path)[1][-1]["period"]
            thread.join(30)
            self.assertEqual(told[0][0], 0, told[0][2])
            rows = table(path)[1]
            self.assertEqual(len(rows), round(0.5 / json.loads(told[0][1])["period_s"]))
            self.assertGreater(int(rows[-1]["period"]), int(first))

    def test_says_what_is_wrong(self):
        with Shop() as shop:
            shop.start()
            for arguments, code, words in (
                    (("X.nothing",), 5, "there is no signal 'X.nothing'"),
                    (("X.measured", "--trigger", "sometimes"), 5, "'sometimes' is no trigger; legal: 'rising SIGNAL"),
                    ((), 5, "--list"),
                    (("--read", shop.config), 2, "this is no recording of a scope"),
                    (("X.measured", "--trigger", "above X.measured 1e9", "--patience", "0.5"), 4,
                     "nothing triggered: 'above X.measured 1e9' did not come")):
                got, _, err = shop.client("scope", *arguments)
                self.assertEqual((got, words in err), (code, True), err)
            self.assertEqual(shop.end(), 0)
            code, _, err = shop.client("scope", "X.measured")
            self.assertEqual((code, "no daemon answers" in err), (4, True), err)


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    daemon_e2e.BINARY, daemon_e2e.SOURCE = BINARY, SOURCE
    enter_own_network()
    names = [f"ScopeTest.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
