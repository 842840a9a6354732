#!/usr/bin/env python3
"""trunnion tune with a running daemon: it asks, jogs the joint, and finds the mechanism of the simulated drive again.

usage: tune_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Exit code 77 (skipped) where the kernel allows no network of the test's own.
"""
import json
import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from own_network import enter_own_network  # noqa: E402
from shop import Shop  # noqa: E402

BINARY = SOURCE = ""
MECHANISM = """
[[drives.joint]]
name = "X"
following_error_mm = 20.0
[drives.joint.mechanism]
inertia_kg = 250.0
viscous_N_s_mm = 0.8
coulomb_N = 140.0
gravity_N = -60.0
"""


class TuneTest(unittest.TestCase):
    def test_finds_the_mechanism_again(self):
        with Shop(extra=MECHANISM) as shop:
            shop.start()
            section = os.path.join(shop.folder.name, "x.toml")
            done = subprocess.run([BINARY, "tune", "X", "--yes", "--json", "--length", "40", "--speed", "30", "--write",
                                   section, "--machine", shop.config], text=True, capture_output=True, timeout=200)
            self.assertEqual(done.returncode, 0, done.stderr)
            found = json.loads(done.stdout)
            for key, truth, share in (("inertia_kg", 250, 0.01),
                                      ("viscous_N_s_mm", 0.8, 0.03), ("coulomb_N", 140, 0.03),
                                      ("gravity_N", -60, 0.05)):
                self.assertAlmostEqual(found[key]["value"], truth, delta=share * abs(truth), msg=f"{key}: {found}")
            status = shop.status()
            self.assertEqual((status["state"], status["fault"]), ("idle", "ok"))
            self.assertAlmostEqual(shop.joints()[0], 0, places=6, msg="it ends where it began")
            # What it wrote is a section of this machine's config.
            with open(shop.config) as file:
                whole = file.read()
            with open(section) as file:
                whole += "\n[feed_forward]\n" + file.read()
            done = subprocess.run([BINARY, "run", shop.write("p.ngc", "G21 G90\nG0 X5\nM2\n"), "--machine",
                                   shop.write("tuned.toml", whole)], text=True, capture_output=True)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_asks_first_and_does_nothing_without_a_yes(self):
        with Shop(extra=MECHANISM) as shop:
            shop.start()
            done = subprocess.run([BINARY, "tune", "X", "--machine", shop.config], input="n\n", text=True,
                                  capture_output=True, timeout=120)
            self.assertEqual(done.returncode, 5, done.stderr)
            self.assertIn("Joint X will move between", done.stderr)
            self.assertIn("Type y to go on", done.stderr)
            code, _, err = shop.client("tune", "X", "--yes", "--length", "100000")
            self.assertEqual((code, "no room" in err), (5, True), err)
            self.assertEqual(shop.joints()[0], 0)

    def test_says_what_is_missing(self):
        with Shop() as shop:
            shop.start()
            code, _, err = shop.client("tune", "X", "--yes", "--length", "5", "--speed", "100")
            self.assertEqual((code, "'torque = true'" in err), (2, True), err)
            code, _, err = shop.client("tune", "Q", "--yes")
            self.assertEqual((code, "has no joint 'Q'" in err), (5, True), err)


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    daemon_e2e.BINARY, daemon_e2e.SOURCE = BINARY, SOURCE
    enter_own_network()
    names = [f"TuneTest.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
