#!/usr/bin/python3
"""usage: library.py TRUNNION SOURCE_DIR BUILD_DIR

The library as another project uses it: installed, found by CMake, and from Python. Its setpoints are held against the
trace of the whole kernel, its kinematics against the program `trunnion kin`, its fit against errors that are known.
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

TEXT = "G21 G90 G94 G64 P0.02\nG0 X2 Y1\nG1 X22 Y14 F4000\nG4 P0.2\nX-8 Y6\nG2 X4 Y6 I6 J0\nG0 X0 Y0\nM2\n"
ROTARY = "G21 G90 G94 G64 P0.02 Q0.1\nG1 X20 A20 C30 F3000\nY10 A-10 C50\nG0 X0 Y0 A0 C0\nM2\n"


def run(*command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, timeout=300, **options)
    return done.returncode, done.stdout, done.stderr


def config(name):
    return str(SOURCE / f"configs/{name}.toml")


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        for component in ("library", "dev", "python"):
            code, _, err = run("cmake", "--install", BUILD, "--prefix", cls.path / "usr", "--component", component)
            assert code == 0, err

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_cmake_finds_it_and_the_examples_run(self):
        build = self.path / "build"
        prefix = f"-DCMAKE_PREFIX_PATH={self.path}/usr"
        for command in (("cmake", "-S", SOURCE / "examples/library", "-B", build, prefix), ("cmake", "--build", build)):
            code, out, err = run(*command)
            self.assertEqual(code, 0, out + err)
        code, out, err = run(build / "setpoints", config("mill"))
        self.assertEqual((code, err), (0, ""))
        rows = out.splitlines()
        self.assertGreater(len(rows), 500)
        self.assertRegex(rows[0], r"^0\.000 s: X -?0\.0000 mm, 0\.000 mm/s$")
        self.assertRegex(rows[-1], r"X -?0\.0000 mm, -?0\.000 mm/s$")
        code, out, err = run(build / "moves", SOURCE / "examples/first_part.ngc", SOURCE / "examples/tools.tbl")
        self.assertEqual((code, err), (0, ""))
        self.assertGreater(len(out.splitlines()), 10)
        bad = self.path / "bad.ngc"
        bad.write_text("G1 X1 F100\nG1 X[2\n")
        code, out, err = run(build / "moves", bad)
        self.assertEqual(code, 1)
        self.assertIn("bad.ngc:2:", err)
        code, out, err = run(build / "setpoints", bad)
        self.assertEqual(code, 1)
        self.assertIn("bad.ngc", err)

    def test_the_installed_module_is_found(self):
        program = "import trunnion; print(trunnion.read_gcode_text('G1 X2 F60').end[0, 0])"
        code, out, err = run(sys.executable, "-c", program,
                             env={"PYTHONPATH": str(self.path / "usr/lib/python3/dist-packages"),
                                  "LD_LIBRARY_PATH": str(next((self.path / "usr").rglob("libtrunnion.so")).parent)})
        self.assertEqual((code, out), (0, "2.0\n"), err)


class Python(unittest.TestCase):
    def check_limits(self, machine, motion, period):
        for i, joint in enumerate(machine.joints):
            place = motion.position[:, i]
            self.assertGreaterEqual(place.min(), joint.min)
            self.assertLessEqual(place.max(), joint.max)
            for order, most in enumerate((joint.velocity_max, joint.acceleration_max, joint.jerk_max), 1):
                used = abs(numpy.diff(place, order)).max() / period**order
                noise = 1e-13 / period**order  # of the last digit
                self.assertLessEqual(used, most * (1 + 1e-6) + noise, f"{machine.name} {joint.name} {order}")

    def test_every_joint_stays_in_its_limits_on_every_machine(self):
        for path in sorted((SOURCE / "configs").glob("*.toml")):
            machine = trunnion.Machine(str(path))
            text = ROTARY if {"A", "C"} <= set(machine.words) else TEXT if "Y" in machine.words else None
            self.assertIsNotNone(text)
            if machine.name.startswith("hexapod"):
                text = text.replace("G1 X20", "G1 Z-60 F3000\nG1 X20")
            for period in (0, machine.period / 3):
                motion = machine.plan_text(text, period=period)
                self.check_limits(machine, motion, period or machine.period)

    def test_its_setpoints_are_those_of_the_kernel(self):
        with tempfile.TemporaryDirectory() as folder:
            program, trace = pathlib.Path(folder, "part.ngc"), pathlib.Path(folder, "trace.csv")
            program.write_text(ROTARY)
            code, _, err = run(BINARY, "run", program, "--machine", config("cradle"), "--trace", trace)
            self.assertEqual(code, 0, err)
            lines = [line for line in trace.read_text().splitlines() if not line.startswith("#")]
            names = lines[0].split(",")
            rows = numpy.loadtxt(lines[1:], delimiter=",", usecols=[names.index(f"{j}") for j in self.columns(names)])
        motion = trunnion.Machine(config("cradle")).plan_text(ROTARY)
        moving = numpy.flatnonzero(abs(numpy.diff(rows, axis=0)).max(axis=1) > 0)
        begin = numpy.flatnonzero(abs(numpy.diff(motion.position, axis=0)).max(axis=1) > 0)[0]
        length = moving[-1] - moving[0]
        kernel, own = rows[moving[0]:moving[0] + length], motion.position[begin:begin + length]
        self.assertGreater(length, 500)
        self.assertLess(abs(kernel - own).max(), 1e-6)

    @staticmethod
    def columns(names):
        return [name for name in names if name.split("_")[0] in ("X", "Y", "Z", "A", "C")
                and (name.endswith("_mm") or name.endswith("_rad") or "_" not in name)][:5]

    def test_velocity_and_acceleration_belong_to_the_places(self):
        machine = trunnion.Machine(config("cradle"))
        period = machine.period / 4
        motion = machine.plan_text(ROTARY, period=period)
        speed = numpy.gradient(motion.position, period, axis=0)
        pull = numpy.gradient(speed, period, axis=0)
        for i, joint in enumerate(machine.joints):
            self.assertLess(abs(speed - motion.velocity)[2:-2, i].max(), 1e-3 * joint.velocity_max)
            self.assertLess(abs(pull - motion.acceleration)[3:-3, i].max(), 0.02 * joint.acceleration_max)

    def test_kinematics_agree_with_the_program_kin(self):
        rng = numpy.random.default_rng(1)
        for name in ("cradle", "head", "head_table", "hexapod", "rail_mill", "mill"):
            machine = trunnion.Machine(config(name))
            low, high = (numpy.array([getattr(joint, end) for joint in machine.joints]) for end in ("min", "max"))
            middle = machine.plan_text("G4 P0\nM2\n").position[0]
            share = 0.01 if name in ("hexapod", "rail_mill") else 0.1  # where joints reach few places together
            q = middle + rng.uniform(-share, share, (20, len(middle))) * (high - low)
            tip, axis = machine.forward(q, 50)
            asked = "\n".join(json.dumps({"q": list(row), "tool_length_mm": 50}) for row in q)
            code, out, err = run(BINARY, "kin", "forward", "--machine", config(name), input=asked)
            self.assertEqual(code, 0, err)
            told = [json.loads(line) for line in out.splitlines()]
            self.assertLess(abs(tip - [row["p"] for row in told]).max(), 1e-9, name)
            self.assertLess(abs(axis - [row["u"] for row in told]).max(), 1e-9, name)
            again = numpy.array([machine.inverse(t, u, 50, near=list(near)) for t, u, near in zip(tip, axis, q)])
            back, turned = machine.forward(again, 50)
            self.assertLess(abs(back - tip).max(), 1e-8, name)
            self.assertLess(abs(turned - axis).max(), 1e-8, name)

    def test_a_ball_bar_finds_the_errors_that_the_machine_has(self):
        with tempfile.TemporaryDirectory() as folder:
            code, _, err = run(BINARY, "ballbar", "run", "--machine", config("cradle_measured"), "--noise-um", "0.1",
                               "--out", folder)
            self.assertEqual(code, 0, err)
            files = sorted(pathlib.Path(folder).glob("*_off.csv"))
            example = SOURCE / "examples/library/ballbar.py"
            code, out, err = run(sys.executable, example, config("cradle_measured"), *files,
                                 env={"PYTHONPATH": str(BUILD / "python")})
            self.assertEqual(code, 0, err)
        rows = re.findall(r"^(\S.*?) +(-?[\d.]+) \+- ([\d.]+)$", out, re.M)
        found = {name: (float(value), float(deviation)) for name, value, deviation in rows}
        for name, true in (("A.ey0", 0.0335), ("A.ez0", -0.0356), ("C.ex0", 0.0014), ("C.ey0", -0.0513)):
            value, deviation = found[name]
            self.assertLess(abs(value - true), 5 * deviation, name)
            self.assertLess(deviation, 0.0005, name)

    def test_what_is_wrong_is_told(self):
        machine = trunnion.Machine(config("mill"))
        for text, part in (("G1 X99999 F100\nM2\n", "text:1"), ("G1 X1\nG99.9\n", "text:")):
            with self.assertRaisesRegex(trunnion.Error, part):
                machine.plan_text(text)
        with self.assertRaisesRegex(trunnion.Error, "has 3"):
            machine.inverse([0, 0, 0], [0, 0, 1], near=[1.0])
        with self.assertRaisesRegex(ValueError, "3 columns"):
            machine.forward([[0.0, 1.0]])
        with self.assertRaisesRegex(trunnion.Error, "no_such.toml"):
            trunnion.Machine("no_such.toml")
        for period in (-1, 1e-12, 0.99e-5, 0.11, float("nan")):
            with self.assertRaisesRegex(trunnion.Error, "period_s = .* is out of range: 1e-05 to 0.1 is legal"):
                machine.plan_text("M2\n", period=period)
        with self.assertRaisesRegex(trunnion.Error, "text: the motion goes on behind 1000 setpoints"):
            machine.plan_text("G4 P999999999\nM2\n", rows_max=1000)
        rows = len(machine.plan_text("G4 P1\nM2\n").time)
        self.assertEqual(len(machine.plan_text("G4 P1\nM2\n", rows_max=rows).time), rows)
        with self.assertRaisesRegex(trunnion.Error, "which is rows_max"):
            machine.plan_text("G4 P1\nM2\n", rows_max=rows - 1)
        with self.assertRaisesRegex(trunnion.Error, "/tmp:1:1: this is a folder"):
            machine.plan_text("M2\n", tools="/tmp")
        with self.assertRaisesRegex(trunnion.Error, "/dev/zero:1:1: this is no regular file"):
            machine.plan_text("M2\n", variables="/dev/zero")
        with self.assertRaisesRegex(trunnion.Error, "/tmp:1:1: this is a folder"):
            trunnion.Machine("/tmp")

    def test_ctrl_c_ends_a_long_motion(self):
        """As a person presses it: the signal comes while the call computes without Python."""
        machine = trunnion.Machine(config("mill"))
        timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        try:
            with self.assertRaises(KeyboardInterrupt):
                machine.plan_text("G4 P999999999\nM2\n", period=1e-5, rows_max=2**60)
        finally:
            timer.cancel()

    def test_a_place_out_of_range_is_told_as_the_program_run_tells_it(self):
        text = "G21 G90\nG0 X1 Y9999\nM2\n"
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder, "far.ngc")
            program.write_text(text)
            code, _, err = run(BINARY, "run", program, "--machine", config("mill"))
            self.assertNotEqual(code, 0)
            machine = trunnion.Machine(config("mill"))
            with self.assertRaises(trunnion.Error) as raised:
                machine.plan(str(program))
            self.assertEqual(str(raised.exception), err.splitlines()[0])
        with self.assertRaisesRegex(trunnion.Error, "^far:2:7: joint Y would go to -9999.0000 mm"):
            machine.plan_text(text, name="far")

    def test_arguments_that_are_no_numbers_are_named(self):
        machine = trunnion.Machine(config("cradle"))
        nan, zeros = float("nan"), [0.0] * len(machine.joints)
        refused = (("tool_length", lambda: machine.forward(zeros, nan)),
                   ("tool_length", lambda: machine.forward(zeros, 1e300)),
                   ("tool_length", lambda: machine.inverse([0, 0, 0], [0, 0, 1], float("inf"))),
                   ("joints: the place of joint Y", lambda: machine.forward([0, nan, 0, 0, 0])),
                   ("near: the place of joint X", lambda: machine.inverse([0, 0, 0], [0, 0, 1], near=[nan] * 5)),
                   ("start: the place of joint X", lambda: machine.plan_text("M2\n", start=[nan] * 5)),
                   ("tip: the component z", lambda: machine.inverse([0, 0, nan], [0, 0, 1])),
                   ("axis", lambda: machine.inverse([0, 0, 0], [0, 0, 0])))
        for part, call in refused:
            with self.assertRaisesRegex(trunnion.Error, part):
                call()
        imaginary = numpy.zeros(len(zeros)) + 1j
        for part, call in (("joints", lambda: machine.forward(imaginary)),
                           ("joints", lambda: machine.forward(list(imaginary))),
                           ("joints", lambda: machine.forward(zeros[:-1] + ["0"])),
                           ("near", lambda: machine.inverse([0, 0, 0], [0, 0, 1], near=imaginary)),
                           ("start", lambda: machine.plan_text("M2\n", start=imaginary)),
                           ("tip", lambda: machine.inverse(imaginary[:3], [0, 0, 1]))):
            with self.assertRaisesRegex(TypeError, f"{part}: real numbers are needed, not"):
                call()
        tip, _ = machine.forward(numpy.zeros(len(zeros), dtype=numpy.int32))
        self.assertEqual(tip.shape, (3,))

    def test_ball_bar_readings_that_cannot_be_are_refused(self):
        machine = trunnion.Machine(config("cradle"))
        angles = numpy.linspace(-1.7, 0.1, 60)
        readings = 0.01 * numpy.cos(angles)
        bad = readings.copy()
        bad[6] = numpy.nan
        refused = (("a reading of test 'a' is not a finite number: number 7 of 60", {"a": (angles, bad)}, 0),
                   ("a reading of test 'a' is not a finite number", {"a": (angles, readings * numpy.inf)}, 0),
                   ("an angle of test 'a' is not a finite number", {"a": (angles * numpy.nan, readings)}, 0),
                   ("test 'a': an angle is -97.4028 rad.*are these degrees", {"a": (numpy.degrees(angles), readings)},
                    0),
                   ("noise_mm = nan", {"a": (angles, readings)}, float("nan")),
                   ("noise_mm = -1", {"a": (angles, readings)}, -1))
        for part, traces, noise in refused:
            with self.assertRaisesRegex(trunnion.Error, part):
                machine.fit_ballbar(traces, noise)
        with self.assertRaisesRegex(TypeError, "the readings of test 'a': real numbers are needed"):
            machine.fit_ballbar({"a": (angles, readings + 1j)})

    def test_the_example_of_limits_runs(self):
        code, out, err = run(sys.executable, SOURCE / "examples/library/limits.py", config("cradle"),
                             SOURCE / "examples/tilted_pocket.ngc", SOURCE / "examples/tools.tbl",
                             env={"PYTHONPATH": str(BUILD / "python")})
        self.assertEqual(code, 0, err)
        self.assertEqual(len(out.splitlines()), 6)


if __name__ == "__main__":
    BINARY, SOURCE, BUILD = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    sys.path.insert(0, str(BUILD / "python"))
    try:
        import numpy
        import trunnion
    except ImportError as missing:
        print(missing)
        sys.exit(77 if "numpy" in str(missing) else 1)
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[4:]])
