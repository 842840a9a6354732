#!/usr/bin/python3
"""`trunnion io`: what is wired to what, drawn, and what a config may not wire.

usage: io_command.py TRUNNION SOURCE_DIR
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

TRUNNION, SOURCE = sys.argv[1:3]
ROUTER = pathlib.Path(SOURCE) / "configs/gantry_router.toml"


def io(*arguments):
    done = subprocess.run([TRUNNION, "io", *arguments], capture_output=True, text=True, timeout=60, check=False)
    return done.returncode, done.stdout, done.stderr


class Io(unittest.TestCase):
    def test_everything_is_there(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = pathlib.Path(folder) / "wiring.svg"
            code, out, _ = io("--machine", str(ROUTER), "--json", "--svg", str(picture))
            drawn = "".join(xml.parse(picture).getroot().itertext())
        rows = json.loads(out)
        self.assertEqual(code, 0)
        self.assertEqual([row["name"] for row in rows],
                         ["lamp", "vacuum", "emergency stop", "enable", "door", "air", "brake of Z"])
        self.assertEqual(rows[1], {"kind": "signal", "name": "vacuum", "from": "machine.enabled",
                                   "to": "drive.X.output.17", "how": "on after 500 ms"})
        for row in rows:
            for key in ("name", "from", "to", "how"):
                self.assertIn(row[key], drawn)

    def test_names_of_a_field_bus(self):
        _, out, _ = io("--machine", f"{SOURCE}/configs/mill.toml")
        self.assertIn("io.output.0 -> io.input.0", out)

    def refused(self, signal):
        with tempfile.TemporaryDirectory() as folder:
            config = pathlib.Path(folder) / "odd.toml"
            text = ROUTER.read_text(encoding="ascii").replace("eds/servo.eds", f"{SOURCE}/configs/eds/servo.eds")
            config.write_text(text + "\n[[signal]]\n" + signal, encoding="ascii")
            code, out, err = io("--machine", str(config))
        self.assertEqual((code, out), (3, ""))
        self.assertRegex(err, r"odd\.toml:\d+:\d+: ")
        return err

    def test_what_cannot_be(self):
        for signal, told in (
                ('name = "a"\nfrom = "drive.X.inputs.3"\nto = "drive.X.output.3"', "neither input nor output"),
                ('name = "a"\nfrom = "machine.runing"\nto = "drive.X.output.3"', "no state of the machine"),
                ('name = "a"\nfrom = "drive.Q.input.3"\nto = "drive.X.output.3"', "no joint 'Q'"),
                ('name = "a"\nfrom = "drive.X.output.1"\nto = "drive.X.output.3"', "comes from an input"),
                ('name = "a"\nfrom = "drive.X.input.40"\nto = "drive.X.output.3"', "0 to 31"),
                ('name = "a"\nfrom = "drive.X.input.3"\nto = "machine.enabled"', "goes to an output"),
                ('name = "a"\nfrom = "io.input.3"\nto = "drive.X.output.3"', "no section [io]"),
                ('name = "a"\nfrom = "machine.moving"\nto = "drive.X.output.16"', "'lamp' ends there already"),
                ('name = "lamp"\nfrom = "machine.moving"\nto = "drive.X.output.18"', "another signal's already"),
                ('name = "a"\nfrom = "machine.moving"\nto = "drive.Z.output.0"', "releases a brake")):
            with self.subTest(signal=signal):
                self.assertIn(told, self.refused(signal))


if __name__ == "__main__":
    del sys.argv[1:3]
    unittest.main()
