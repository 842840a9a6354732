#!/usr/bin/env python3
"""Jogs as people ask for them: by axis word or along a direction, in steps or held, by a client that dies, is stopped
or lets go early.

usage: jog_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Exit code 77 (skipped) where the kernel allows no network of the test's own.
"""
import json
import math
import os
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from daemon_socket import DaemonSocket, acknowledge_t, command_t  # noqa: E402
from own_network import enter_own_network  # noqa: E402
from shop import Shop, held_jog  # noqa: E402


class JogTest(unittest.TestCase):
    def comes_to_rest(self, shop, joint):
        """At 5 mm/s, within a third of a second."""
        after = shop.joints()[joint]
        shop.until(lambda s: s["state"] == "idle")
        self.assertLess(abs(shop.joints()[joint] - after), 5 * 0.35)

    def test_jog_moves_in_the_words_sense(self):
        with Shop() as shop:
            shop.start()
            for axis in "XYZ":
                shop.ask("mdi", f"G21 G90 G0 {axis}10", "--wait")
                there = shop.joints()
                shop.ask("mdi", f"G0 {axis}0", "--wait")
                shop.ask("jog", axis, "10", "--wait")
                for q, expected in zip(shop.joints(), there):
                    self.assertAlmostEqual(q, expected, places=6)
                shop.ask("mdi", f"G0 {axis}0", "--wait")
            shop.ask("jog", "x", "250", "--speed", "50")
            shop.until(lambda s: s["state"] == "jogging")
            shop.ask("hold")
            shop.until(lambda s: s["state"] == "idle")
            self.assertLess(shop.joints()[0], 200)
            code, _, err = shop.client("jog", "X", "1000", "--speed", "9999")
            self.assertEqual(code, 0)
            self.assertIn("X stops at its limit, 300.0000 mm", err)
            self.assertIn("limit of 400 mm/s instead of 9999", err)
            shop.until(lambda s: s["state"] == "idle")
            code, _, err = shop.client("jog", "X", "1")
            self.assertEqual(code, 5)
            self.assertIn("stands at its limit, 300.0000 mm", err)

    def test_a_held_jog_ends_when_it_is_let_go_and_when_its_client_dies(self):
        with Shop() as shop:
            shop.start()
            for end in (signal.SIGINT, signal.SIGKILL, signal.SIGSTOP):
                with self.subTest(end=end):
                    client = held_jog(shop, 1, "Y", "-")
                    try:
                        self.assertIn("until Ctrl-C, or its limit", client.stderr.readline())
                        client.send_signal(end)
                        if end == signal.SIGINT:
                            self.assertEqual(client.wait(20), 0)
                            self.assertEqual(json.loads(shop.ask("status", "--json"))["state"], "idle")
                        self.comes_to_rest(shop, 1)
                    finally:
                        client.kill()
                        client.communicate()
            self.assertGreaterEqual(shop.log_text().count("the jog of Y is ended: its client went silent"), 2)

    def test_jogs_add_up_and_several_joints_move_at_once(self):
        with Shop() as shop:
            shop.start()
            for _ in range(5):
                shop.ask("jog", "X", "1", "--speed", "2")
            shop.ask("jog", "Z", "-4", "--percent", "1")
            shop.until(lambda s: s["state"] == "jogging")
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.joints()[0], 5)
            self.assertEqual(shop.joints()[2], -4)
            code, _, err = shop.client("jog", "X", "ten")
            self.assertEqual(code, 5)
            self.assertIn("'ten' is no number", err)

    def test_a_jog_along_the_tool_and_along_the_work(self):
        with Shop(machine="head") as shop:
            shop.start()
            shop.ask("mdi", "G21 G90 G0 A30 C0", "--wait")
            shop.ask("mdi", "G20 G91 G93", "--wait")
            codes = json.loads(shop.ask("status", "--json"))["codes"]
            x, y, z = shop.joints()[:3]
            shop.ask("jog", "z", "0.5", "--along", "tool", "--wait")  # inch, as the program
            moved = [b - a for a, b in zip((x, y, z), shop.joints())]
            # A turns about X: the spindle's own Z leans over in Y.
            self.assertAlmostEqual(moved[0], 0, places=5)
            self.assertAlmostEqual(abs(moved[1]), 12.7 * math.sin(math.radians(30)), places=5)
            self.assertAlmostEqual(abs(moved[2]), 12.7 * math.cos(math.radians(30)), places=5)
            self.assertEqual(json.loads(shop.ask("status", "--json"))["codes"], codes, "inches, G91 and G93 as before")
            shop.ask("mdi", "G90 G94 G21 G10 L2 P1 R90", "--wait")
            x, y, z = shop.joints()[:3]
            shop.ask("jog", "X", "4", "--along", "work", "--wait")
            moved = [b - a for a, b in zip((x, y, z), shop.joints())]
            self.assertAlmostEqual(moved[0], 0, places=5)
            self.assertAlmostEqual(abs(moved[1]), 4, places=5, msg="the work lies turned by 90 degrees")
            for end in (signal.SIGINT, signal.SIGKILL):
                with self.subTest(end=end):
                    client = held_jog(shop, 2, "Z", "+", "--along", "tool")
                    try:
                        client.send_signal(end)
                        if end == signal.SIGINT:
                            self.assertEqual(client.wait(20), 0)
                        self.comes_to_rest(shop, 2)
                    finally:
                        client.kill()
                        client.communicate()
            self.assertIn("went silent", shop.log_text())
            code, _, err = shop.client("jog", "A", "1", "--along", "tool")
            self.assertEqual(code, 5)
            self.assertIn("X, Y and Z have", err)
        with Shop(machine="hexapod") as shop:
            shop.start()
            shop.ask("mdi", "G21 G90 G0 Z5", "--wait")
            self.assertIn("--along machine", shop.client("jog", "X", "1")[2])
            shop.ask("jog", "X", "1", "--along", "machine", "--wait")
            shop.ask("mdi", "G0 X1 Z5", "--wait")  # it stands there already
            self.assertEqual(json.loads(shop.ask("status", "--json"))["state"], "idle")

    def test_a_held_jog_goes_on_though_its_way_was_planned_for_long(self):
        """As on a slow computer: here the process that plans is stopped for a while."""
        with Shop(machine="head") as shop:
            shop.start()
            shop.ask("jog", "X", "1", "--along", "tool", "--wait")
            planner = shop.process_for_programs()
            for _ in range(5):
                os.kill(planner, signal.SIGSTOP)
                before = shop.joints()[0]
                client = subprocess.Popen([daemon_e2e.BINARY, "jog", "X", "+", "--along", "tool", "--speed", "5",
                                           "--machine", shop.config], stderr=subprocess.PIPE, text=True)
                time.sleep(1)
                os.kill(planner, signal.SIGCONT)
                shop.until(lambda s: s["state"] != "idle")
                ended = shop.until(lambda s: s["state"] == "idle" or shop.joints()[0] - before > 2)["state"] == "idle"
                client.send_signal(signal.SIGINT)
                err = client.communicate(timeout=20)[1]
                shop.until(lambda s: s["state"] == "idle")
                if not ended:
                    break
            self.assertFalse(ended, f"{err}\n{shop.log_text()}")
            self.assertEqual(client.returncode, 0, err)

    def test_a_button_that_is_let_go_before_the_jog_is_planned_moves_nothing(self):
        with Shop(machine="head") as shop:
            shop.start()
            shop.ask("jog", "X", "1", "--along", "tool", "--wait")
            stands, planner = shop.joints(), shop.process_for_programs()
            with DaemonSocket.of(shop) as page:
                until_us = next(page.messages(60, "status")).clock_us + 60_000_000
                jog = {"text": "X", "frame": command_t.TOOL, "speed": 5, "expires_us": until_us}
                os.kill(planner, signal.SIGSTOP)
                page.send(page.command(command_t.JOG, 1, 1, alive_ms=1000, **jog))
                page.send(page.command(command_t.JOG, 2, 0, **jog))
                answers = (answer for answer in page.messages(60, "acknowledge")
                           if answer.client == 77 and answer.outcome != acknowledge_t.WORKING)
                first = next(answers)
                os.kill(planner, signal.SIGCONT)
                second = next(answers)
            self.assertEqual([(one.sequence, one.outcome) for one in (first, second)],
                             [(2, acknowledge_t.ACCEPTED), (1, acknowledge_t.ACCEPTED)])
            shop.until(lambda s: s["state"] == "idle")
            self.assertEqual(shop.joints(), stands)
            shop.ask("jog", "X", "1", "--along", "tool", "--wait")
            self.assertAlmostEqual(shop.joints()[0] - stands[0], 1, places=6)

    def test_a_client_that_dies_before_its_jog_is_planned_moves_nothing(self):
        with Shop(machine="head") as shop:
            shop.start()
            shop.ask("jog", "X", "1", "--along", "tool", "--wait")
            stands, planner = shop.joints(), shop.process_for_programs()
            os.kill(planner, signal.SIGSTOP)
            client = subprocess.Popen([daemon_e2e.BINARY, "jog", "X", "+", "--along", "tool", "--speed", "5",
                                       "--machine", shop.config], stderr=subprocess.PIPE, text=True)
            time.sleep(1)
            client.kill()
            client.communicate()
            shop.until(lambda s: "its client has gone" in shop.log_text())
            os.kill(planner, signal.SIGCONT)
            shop.until(lambda s: s["state"] == "idle")
            shop.ask("jog", "Y", "1", "--along", "tool", "--wait")
            self.assertEqual(shop.joints()[0], stands[0])
            self.assertAlmostEqual(shop.joints()[1] - stands[1], 1, places=6)

    def test_a_suspended_jog_does_not_begin_again(self):
        with Shop() as shop:
            shop.start()
            client = held_jog(shop, 0, "X", "+")
            client.send_signal(signal.SIGSTOP)
            shop.until(lambda s: s["state"] == "idle")
            stands = shop.joints()[0]
            time.sleep(0.5)
            client.send_signal(signal.SIGCONT)
            _, err = client.communicate(timeout=120)
            self.assertEqual(client.returncode, 4, err)
            self.assertIn("this command stood still for", err)
            self.assertEqual(shop.joints()[0], stands)

    def test_a_step_takes_no_dead_man_from_a_held_jog(self):
        with Shop() as shop:
            shop.start()
            client = held_jog(shop, 0, "X", "+")
            for step in ("0.1", "-0.1"):
                code, out, err = shop.client("jog", "X", step)
                self.assertNotEqual(code, 0)
                self.assertIn("somebody else holds X", out + err)
            client.kill()
            shop.client("jog", "X", "0.1")
            client.communicate()
            shop.until(lambda s: s["state"] == "idle")
            stands = shop.joints()[0]
            time.sleep(0.5)
            self.assertEqual(shop.joints()[0], stands)


if __name__ == "__main__":
    daemon_e2e.BINARY, daemon_e2e.SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    enter_own_network()
    names = [f"JogTest.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
