#!/usr/bin/python3
"""`trunnion latency` as a person calls it: what it counts must add up, and its verdicts must follow from it.

usage: latency_command.py TRUNNION SOURCE_DIR
"""
import json
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree
from pathlib import Path

TRUNNION, SOURCE = sys.argv[1:3]


def latency(*options):
    return subprocess.run([TRUNNION, "latency", *options], capture_output=True, text=True, timeout=60, check=False)


class Latency(unittest.TestCase):
    def test_a_machine_at_rest_is_measured(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = Path(folder) / "l.svg"
            done = latency("--machine", f"{SOURCE}/configs/mill.toml", "--seconds", "1", "--period-us", "2000",
                           "--svg", str(picture), "--json")
            self.assertEqual(0, done.returncode, done.stderr)
            xml.etree.ElementTree.parse(picture)
        seen = json.loads(done.stdout)
        self.assertEqual(2000, seen["period_us"])
        # A busy host may skip periods, it cannot add any: 1 s has 500.
        self.assertTrue(0 < seen["periods"] <= 520, seen["periods"])
        for name in ("wake", "tick"):
            counted = sum(count for _, count in seen[name]["edge_us_and_count"])
            self.assertEqual(counted, seen["periods"], name)
            self.assertLessEqual(seen[name]["p50_us"], seen[name]["max_us"])
        # The verdict by its definition in the help: half of a period, the whole, more.
        took = seen["wake"]["max_us"] + seen["tick"]["max_us"]
        for period, verdict in seen["verdict_of_period_us"].items():
            fit = "good" if took <= float(period) / 2 else "tight" if took < float(period) else "no"
            self.assertEqual(fit, verdict, period)

    def test_text_for_people(self):
        done = latency("--seconds", "0.2")
        self.assertEqual(0, done.returncode, done.stderr)
        for words in ("wake-up, late by: median", "tick, takes: median", "periods of 1000 us", "As far as was seen"):
            self.assertIn(words, done.stdout)

    def test_refusals(self):
        self.assertEqual(3, latency("--machine", "/nowhere.toml").returncode)
        self.assertEqual(5, latency("--seconds", "-1").returncode)
        unwritable = latency("--seconds", "0.1", "--svg", "/nowhere/l.svg")
        self.assertNotEqual(0, unwritable.returncode)
        self.assertIn("/nowhere/l.svg", unwritable.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
