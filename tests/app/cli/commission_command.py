#!/usr/bin/python3
"""`trunnion commission`, rehearsed end to end: a config that is wrong about three axes of an emulated machine.

usage: commission_command.py TRUNNION SOURCE_DIR
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

TRUNNION, SOURCE = sys.argv[1:3]
CONFIG = (pathlib.Path(SOURCE) / "configs/cradle_can.toml").read_text(encoding="ascii").replace(
    "eds/servo.eds", f"{SOURCE}/configs/eds/servo.eds")


def node(text, joint, changes):
    """The config with changes in the drive of this joint: old text, new text."""
    head, table = text.split(f'[[drives.node]]\njoint = "{joint}"\n')
    for old, new in changes:
        assert old in table, old
        table = table.replace(old, new, 1)
    return f'{head}[[drives.node]]\njoint = "{joint}"\n{table}'


def keys_of(text, joint):
    table = re.search(rf'\[\[drives.node\]\]\njoint = "{joint}"\n(.*?)(?:\n\n|\Z)', text, re.S).group(1)
    return dict(re.findall(r"^(\w+) = ([^#\n]*?)\s*(?:#.*)?$", table, re.M))


class Rehearsal(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        place = pathlib.Path(self.folder.name)
        self.wrong, self.truth = place / "machine.toml", place / "truth.toml"
        self.record, self.protocol = place / "machine.toml.commission.json", place / "protocol.md"
        # What is built: X turns the other way, Y has a screw of another pitch, C has both and a worm of 1:90.
        truth = node(CONFIG, "X", [("counts_per_mm = 10000", "counts_per_mm = 10000\nreverse = true"),
                                   ("homing_method = 5", "homing_method = 3")])
        truth = node(truth, "Y", [("counts_per_mm = 10000", "counts_per_mm = 8000")])
        truth = node(truth, "C", [("counts_per_deg = 10000", "counts_per_deg = 9000\nreverse = true"),
                                  ("homing_method = 5", "homing_method = 3")])
        self.truth.write_text(truth, encoding="ascii")
        # The config's homing methods are right; it is the wiring that nobody has checked.
        wrong = node(CONFIG, "X", [("homing_method = 5", "homing_method = 3")])
        self.wrong.write_text(node(wrong, "C", [("homing_method = 5", "homing_method = 3")]), encoding="ascii")

    def commission(self, *options, answers=""):
        return subprocess.run([TRUNNION, "commission", "--machine", str(self.wrong), "--protocol", str(self.protocol),
                               *options], input=answers, capture_output=True, text=True, timeout=170, check=False)

    def test_three_axes_wired_wrong(self):
        before = self.wrong.read_text(encoding="ascii")
        done = self.commission("--rehearse", str(self.truth))
        print(done.stdout[done.stdout.find("# Commissioning"):], file=sys.stderr)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        text = self.wrong.read_text(encoding="ascii")
        for joint, counts, reverse in (("X", 10000, "true"), ("Y", 8000, None), ("Z", 10000, None),
                                       ("A", 10000, None), ("C", 9000, "true")):
            keys = keys_of(text, joint)
            unit = "deg" if joint in "AC" else "mm"
            self.assertAlmostEqual(float(keys[f"counts_per_{unit}"]) / counts, 1, delta=0.001, msg=joint)
            self.assertEqual(keys.get("reverse"), reverse, joint)
        items = {item["name"]: item["result"] for item in json.loads(self.record.read_text())["items"]}
        self.assertEqual([name for name, result in items.items() if result == "changed"],
                         ["scale Y", "scale C", "direction X", "direction C"])
        self.assertEqual(items["tuning X"], "skipped", "its drive tells no torque")
        self.assertNotIn("failed", items.values())
        self.assertEqual((self.wrong.parent / "machine.toml.before").read_text(encoding="ascii"), before)
        self.assertIn("| direction X | changed | the motor of X is reversed |", self.protocol.read_text())
        # Comments stay, and the list is done: a second call has nothing to do.
        self.assertIn("# of master and drives", text)
        again = self.commission("--rehearse", str(self.truth))
        self.assertEqual(again.returncode, 0)
        self.assertNotIn("will move", again.stdout)

    def test_every_step(self):
        """A machine with feed-forward, switches, a brake, spindle and probe: wiring, counts and a mass are wrong."""
        servo = (pathlib.Path(SOURCE) / "configs/cradle_servo.toml").read_text(encoding="ascii").replace(
            "eds/servo.eds", f"{SOURCE}/configs/eds/servo.eds")
        servo = servo.replace("period_s = 0.001", "period_s = 0.002")
        more = """
[io]
type = "simulated"

[[safety.brake]]
joint = "Z"
output = "drive.Z.output.0"
release_s = 0.08
close_s = 0.06
"""
        servo = servo.replace("[drives]\n", more + "\n[drives]\nprobe = \"drive\"\n", 1)
        servo = node(servo, "X", [("homing_method = 5", "homing_method = 3\nlimit_switches = true")])
        servo = node(servo, "C", [("homing_method = 5", "homing_method = 3")])
        self.wrong.write_text(servo.replace("inertia_kg = 416.0", "inertia_kg = 300.0"), encoding="ascii")
        truth = node(servo, "X", [("counts_per_mm = 10000", "counts_per_mm = 10000\nreverse = true")])
        truth = node(truth, "Y", [("counts_per_mm = 10000", "counts_per_mm = 8000")])
        truth = node(truth, "C", [("counts_per_deg = 10000", "counts_per_deg = 9000\nreverse = true")])
        self.truth.write_text(truth, encoding="ascii")
        done = self.commission("--rehearse", str(self.truth))
        print(done.stdout[done.stdout.find("# Commissioning"):], file=sys.stderr)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        items = {item["name"]: (item["result"], item["note"])
                 for item in json.loads(self.record.read_text())["items"]}
        changed = {"scale Y", "scale C", "direction X", "direction C", "tuning X"}
        self.assertEqual({name for name, (result, _) in items.items() if result == "changed"}, changed)
        for name in ("bus", "identity", "switches", "homing", "brake Z", "following X", "tuning Y", "tuning Z",
                     "tuning A", "tuning C", "spindle", "probe"):
            self.assertEqual(items[name][0], "good", f"{name}: {items[name]}")
        self.assertEqual(items["latency"][0], "rehearsed", items["latency"])
        self.assertEqual({name for name, (result, _) in items.items() if result == "skipped"},
                         {f"brake {joint}" for joint in "XYAC"} | {"range C"})
        self.assertRegex(items["bus"][1], "5 nodes answer on 1 buses")
        self.assertRegex(items["spindle"][1], r"encoder: 2\.00 turns in 2 s at 60 rpm")
        text = self.wrong.read_text(encoding="ascii")
        mass = float(re.search(r'joint = "X"\ninertia_kg = ([\d.]+)', text).group(1))
        self.assertAlmostEqual(mass / 420, 1, delta=0.01)
        for question in ("Press the switch at the negative end of X", "Press the switch at the positive end of X",
                         "Press the probe", "Let go of", "Does the spindle turn clockwise"):
            self.assertIn(question, done.stdout)

    def test_limit_switches_that_are_swapped(self):
        """The switch that is pressed at one end is heard as that of the other; so for a joint that is reversed, too."""
        def place(reverse):
            keys = "homing_method = 3\nlimit_switches = true" + ("\nreverse = true" if reverse else "")
            return node(CONFIG, "X", [("homing_method = 5", keys)])
        # The numbers of the nodes are those of the config, X is the first one.
        motor = '\n[[drives.emulation.motor]]\nnode = "can0:1"\nswitches_swapped = true\n'
        for reverse in (False, True):
            self.record.unlink(missing_ok=True)
            self.wrong.write_text(place(reverse), encoding="ascii")
            self.truth.write_text(place(reverse) + motor, encoding="ascii")
            done = self.commission("--rehearse", str(self.truth))
            self.assertEqual(done.returncode, 4, done.stdout)
            self.assertRegex(done.stdout, r"switches: failed, the switch at the negative end of X is heard as that of "
                                          r"the positive end: the two are swapped.*swap the two wires")
            self.assertNotIn("homing:", done.stdout, "it would search at the wrong end")
            # The wires are swapped back, and the list goes on there.
            self.truth.write_text(place(reverse), encoding="ascii")
            again = self.commission("--rehearse", str(self.truth))
            self.assertEqual(again.returncode, 0, again.stdout)
            self.assertIn("switches: good, both heard, at the right ends", again.stdout)
            self.assertNotIn("Joint X will move", again.stdout.split("switches: good")[0])

    def test_a_truth_that_words_or_places_an_axis_otherwise(self):
        """`sense` alone is a matter of words and moves nothing; a `direction` that is turned round is the machine's."""
        branch = '[[kinematics.tool_branch]]\njoint = "X"\ndirection = [1.0, 0.0, 0.0]'
        self.assertIn(branch, CONFIG)
        config = node(CONFIG, "X", [("homing_method = 5", "homing_method = 3")])
        for change, reverse in ((branch + "\nsense = -1", None), (branch.replace("[1.0", "[-1.0"), "true")):
            self.record.unlink(missing_ok=True)
            self.wrong.write_text(config, encoding="ascii")
            self.truth.write_text(config.replace(branch, change), encoding="ascii")
            done = self.commission("--rehearse", str(self.truth))
            items = {item["name"]: item["result"] for item in json.loads(self.record.read_text())["items"]}
            self.assertEqual(items["direction X"], "changed" if reverse else "good", done.stdout)
            self.assertEqual(keys_of(self.wrong.read_text(encoding="ascii"), "X").get("reverse"), reverse)
            for word in "YZAC":
                self.assertEqual(items[f"direction {word}"], "good", done.stdout)

    def test_a_spindle_that_turns_the_wrong_way(self):
        config = (pathlib.Path(SOURCE) / "configs/spindle_axis.toml").read_text(encoding="ascii").replace(
            "eds/servo.eds", f"{SOURCE}/configs/eds/servo.eds")
        self.truth.write_text(config, encoding="ascii")
        self.wrong.write_text(config.replace('m3 = "negative"', 'm3 = "positive"'), encoding="ascii")
        done = self.commission("--rehearse", str(self.truth))
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        items = {item["name"]: item["result"] for item in json.loads(self.record.read_text())["items"]}
        self.assertEqual([name for name, result in items.items() if result == "changed"], ["spindle"])
        self.assertIn('m3 = "negative"', self.wrong.read_text(encoding="ascii"))

    def test_a_drive_that_is_not_there(self):
        motor = '\n[[drives.emulation.motor]]\nnode = "can0:3"\nwithout_id = true\n'
        self.truth.write_text(CONFIG + motor, encoding="ascii")
        self.wrong.write_text(CONFIG, encoding="ascii")
        done = self.commission("--rehearse", str(self.truth))
        self.assertEqual(done.returncode, 4)
        self.assertRegex(done.stdout, r"bus: failed, can0 node 3 \(joint Z\) does not answer; on can0 there are: "
                                      r"1, 2, 4, 5\..*trunnion can lss")

    def test_left_and_taken_up_again(self):
        config = (pathlib.Path(SOURCE) / "configs/mill.toml").read_text(encoding="ascii")
        self.wrong.write_text(config, encoding="ascii")
        left = self.commission(answers="\nabc\n100\nq\n")  # X agreed, a number, 100 mm; left at Y
        self.assertEqual(left.returncode, 4, left.stdout + left.stderr)
        self.assertIn("'abc' is none of these", left.stdout)
        self.assertIn("| scale X | good |", left.stdout)
        self.assertIn("| scale Y | not yet |", left.stdout)
        again = self.commission(answers="q\n")
        self.assertIn("Joint Y will move", again.stdout)
        self.assertNotIn("Joint X will move", again.stdout)


if __name__ == "__main__":
    del sys.argv[1:3]
    unittest.main()
