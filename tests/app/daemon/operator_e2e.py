#!/usr/bin/env python3
"""What an operator relies on, with the daemon's own clients over its real socket: tool changes, commands that must get
through, what is kept through kills, and a first daemon without real-time rights.

usage: operator_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Exit code 77 (skipped) where the kernel allows no network of the test's own. TRN_LONG=COUNT: that many kills.
"""
import json
import math
import os
import random
import signal
import stat
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from daemon_socket import DaemonSocket  # noqa: E402
from own_network import enter_own_network  # noqa: E402
from shop import TABLE, Shop, assert_replays  # noqa: E402

BINARY = SOURCE = ""
TWO_TOOLS = "G21 G90\nT1 M6\nG43 H1\nG0 Z10\nG1 X50 F6000\nT2 M6\nG43 H2\nG0 Z10\nG1 X0\nM2\n"


class OperatorTest(unittest.TestCase):
    def test_m6_waits_for_the_operator(self):
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("load", shop.write("part.ngc", TWO_TOOLS))
            shop.ask("start")
            for tool, name, at in ((1, "tool 1 (end mill)", 0), (2, "tool 2 (8 mm ball)", 50)):
                status = shop.until(lambda s: name in s["waits_for"])
                self.assertEqual(status["state"], "holding")
                self.assertIn("'resume'", status["waits_for"])
                self.assertIn(name, shop.ask("status"))
                first = shop.joints()
                self.assertAlmostEqual(first[0], at, places=6)
                time.sleep(0.3)
                self.assertEqual(shop.joints(), first, "it stands until it is told")
                self.assertEqual(shop.parameter(5400), tool - 1, "the tool before is in the spindle")
                code, _, err = shop.client("start")  # twice, as by a double click: no tool is in for that
                self.assertEqual(code, 5)
                self.assertIn(f"waits for {name}; 'resume' says that it is in", err)
                self.assertEqual(shop.status()["state"], "holding")
                shop.ask("resume")
                self.assertEqual(shop.parameter(5400), tool, "on disk before the answer")
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(shop.joints()[2], 90, places=6)
            shop.ask("mdi", "T1 M6")
            shop.until(lambda s: "tool 1" in s["waits_for"])
            shop.ask("stop", "--wait")
            self.assertEqual(shop.parameter(5400), 2, "nobody has put tool 1 in")
            shop.ask("mdi", "T1 M6")
            shop.until(lambda s: "tool 1" in s["waits_for"])
            shop.ask("estop")
            shop.until(lambda s: s["state"] == "estop" and s["waits_for"] == "")
            shop.ask("reset", "--wait")
            shop.ask("mdi", "G0 X#5400", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 2, places=6)
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)
            self.assertIn("waits for tool 2", shop.log_text())

    def test_run_passes_and_says_so(self):
        with Shop() as shop:
            program = shop.write("part.ngc", TWO_TOOLS)
            done = subprocess.run([BINARY, "run", program, "--machine", shop.config, "--tools", shop.tools], text=True,
                                  capture_output=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("part.ngc:2: M6: tool 1 (end mill) counts as put in", done.stderr)
            self.assertIn("part.ngc:6: M6: tool 2 (8 mm ball) counts as put in", done.stderr)

    def test_a_sub_program_changes_the_tool(self):
        with Shop("[tool_change]\nconfirm = \"sub-program\"\ncall = \"change\"\n") as shop:
            shop.write("change.ngc", "o<change> sub\nG53 G0 Z100\nG0 X[100+#1] Y[10*#3+#4]\nM6\no<change> endsub\n")
            shop.tools = shop.write("tools.tbl", TABLE.replace("T2 P2", "T2 P7"))
            shop.start()
            shop.ask("load", shop.write("part.ngc", "G21 G90\nT2 M6 G43\nG0 X[#5400] Z0\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: "tool 2" in s["waits_for"])
            at = shop.motion()[0]["machine"]
            self.assertEqual([round(q, 6) for q in at[:2]], [102, 70], "tool 2 of pocket 7, from none")
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(shop.joints()[0], 2, places=6)
            self.assertAlmostEqual(shop.joints()[2], 80, places=6)
            self.assertEqual(shop.parameter(5400), 2)

    def test_a_clients_clock_stops_no_command(self):
        shifted = [["unshare", "-T", "--monotonic", shift] for shift in ("-1000", "1000000")]
        shifted = [p for p in shifted if subprocess.run([*p, "true"], capture_output=True).returncode == 0]
        with Shop() as shop:
            shop.start()
            for prefix in [[], *shifted]:
                for arguments in (("mdi", "G91 G1 X100 F600"), ("override", "0"), ("override", "100"), ("hold",),
                                  ("resume",), ("stop",)):
                    done = subprocess.run([*prefix, BINARY, *arguments, "--machine", shop.config], text=True,
                                          capture_output=True, timeout=120)
                    self.assertEqual(done.returncode, 0, f"{prefix} {arguments}: {done.stderr}")
                shop.until(lambda s: s["state"] == "idle")

    def test_what_makes_it_safer_is_obeyed_however_late(self):
        with Shop() as shop:
            shop.start()
            with DaemonSocket.of(shop) as client:
                for sequence, (verb, state) in enumerate(((3, "holding"), (9, "running"), (5, "idle"), (10, "estop"))):
                    if verb != 10:  # hold, override 0, stop, estop
                        shop.ask("mdi", "G91 G1 X100 F600")
                        shop.until(lambda s: s["state"] == "running")
                    client.send(client.command(verb, 1000 + sequence, expires_us=1))
                    shop.until(lambda s: s["state"] == state and (state != "running" or s["override_now"] == 0), 5)
                    if verb != 10:
                        shop.ask("override", "100")
                        shop.ask("stop", "--wait")
                client.send(client.command(11, 2000, expires_us=1))
                time.sleep(0.5)
            self.assertEqual(shop.status()["state"], "estop", "a reset that is late is none")

    def test_acknowledged_means_kept_through_kills(self):
        kills = max(10, int(os.environ.get("TRN_LONG", 10)))
        chance = random.Random(7)
        with Shop() as shop:
            for round_ in range(1, kills + 1):
                shop.start()
                offset, length, own = (round(chance.uniform(-20, 20), 6) for _ in range(3))
                line = chance.choice([f"G10 L2 P1 X{offset}", f"G92.1\\nG10 L20 P1 X{offset}", f"#100={own}",
                                      f"G10 L1 P1 Z{length}", f"G10 L10 P2 Z{length}", "T1 M6",
                                      f"G10 L2 P1 X{offset}\\nG4 P5"])
                moves = chance.random() < 0.5
                if "L2" in line and moves:
                    line += "\\nG91 G1 X1 F60"
                shop.ask("mdi", line.replace("\\n", "\n"))
                if line == "T1 M6":
                    shop.until(lambda s: s["waits_for"] != "")
                    shop.ask("resume")
                self.assertIsNotNone(shop.process)
                x = shop.process and line.startswith("G92.1") and shop.joints()[0]
                shop.kill()
                told = f"kill {round_}: {line}"
                if line.startswith("G10 L2 "):
                    self.assertEqual(shop.parameter(5221), offset, told)
                elif line.startswith("G92.1") and not moves:
                    self.assertAlmostEqual(shop.parameter(5221), x - offset, places=6, msg=told)
                elif line.startswith("#100"):
                    self.assertEqual(shop.parameter(100), own, told)
                elif line.startswith("G10 L1 "):
                    self.assertEqual(shop.length(1), length, told)
                elif line.startswith("G10 L10"):
                    self.assertNotEqual(shop.length(2), 80, told)
                elif line == "T1 M6":
                    self.assertEqual(shop.parameter(5400), 1, told)
                with open(shop.tools) as file:
                    self.assertTrue(file.read().startswith("; the workshop's tools\n"), "the file's own lines stay")
                self.assertFalse([n for n in os.listdir(shop.folder.name) if n.endswith(".new")], told)

    def test_m2_switches_off_what_a_typed_line_has_switched_on(self):
        """And a file that just ends leaves it on."""
        with Shop() as shop:
            shop.start()
            for end, rpm in (("", 3000), ("M2\n", 0), ("M30\n", 0)):
                shop.ask("mdi", "S3000 M3 M7\nM8", "--wait")
                shop.ask("load", shop.write("part.ngc", "G21 G91\nG1 X1 F600\n" + end))
                shop.ask("start", "--wait")
                now = shop.until(lambda s: s["state"] == "idle" and s["spindle_rpm"] == rpm)
                self.assertEqual((now["mist"], now["flood"]), (rpm > 0, rpm > 0), end)
                self.assertEqual("M9" in now["codes"].split(), rpm == 0, end)

    def test_what_cannot_be_kept_is_refused(self):
        with Shop() as shop:
            shop.start()
            shop.ask("mdi", "G21 G90 G10 L2 P1 X5\nG0 X10 Z3", "--wait")
            for path in (shop.vars, shop.tools):
                os.chmod(path, stat.S_IRUSR)
            for line in ("G10 L2 P1 X7", "G10 L1 P1 Z60", "G10 L20 P1 X0", "G28.1", "#31=4"):
                code, _, err = shop.client("mdi", line)
                self.assertEqual(code, 2, f"{line}: {err}")
                self.assertIn("read-only", err)
                self.assertRegex(err, r"mdi:\d: ")
            self.assertEqual((shop.parameter(5221), shop.length(1)), (5, 50))
            shop.ask("mdi", "G21 G90 G0 X0 Z10", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 5, places=6, msg="in memory as on disk")
            shop.ask("mdi", "T2 M6")
            shop.until(lambda s: s["waits_for"] != "")
            code, _, err = shop.client("resume")
            self.assertNotEqual(code, 0)
            self.assertIn("read-only", err)
            shop.until(lambda s: s["state"] == "holding" and "tool 2" in s["waits_for"])
            os.chmod(shop.vars, stat.S_IRUSR | stat.S_IWUSR)
            shop.ask("resume")
            self.assertEqual(shop.parameter(5400), 2)
            shop.until(lambda s: s["state"] == "idle" and s["message"] == "")

    def test_how_long_clients_wait_is_said_once_for_all(self):
        def client(line, patience, *options):
            return subprocess.run([BINARY, *line.split(), "--machine", shop.config, *options], text=True, timeout=120,
                                  capture_output=True, env=dict(os.environ, TRUNNION_TIMEOUT=patience))

        with Shop() as shop:
            for line in ("status", "override 50", "scope X.measured"):
                done = client(line, "0.25")
                self.assertEqual((done.returncode, "within 0.25 s" in done.stderr), (4, True), done.stderr)
            for value, why in (("soon", "'soon' is no number; more than 0 is legal"),
                               ("0", "0 is out of range; more than 0 is legal")):
                told = [f"--timeout: {why}", "The environment variable TRUNNION_TIMEOUT gives this value"]
                done = client("status", value)
                self.assertEqual((done.returncode, done.stderr.splitlines()[:2]), (5, told))
                done = client("status", "60", "--timeout", value)
                self.assertEqual((done.returncode, done.stderr.splitlines()[0]), (5, told[0]))
                self.assertNotIn("environment", done.stderr)
                self.assertIn("within 0.25 s", client("status", value, "--timeout", "0.25").stderr)

    def test_a_client_finds_its_daemon_and_tells_another_config(self):
        def client(*arguments, **environment):
            done = subprocess.run([BINARY, *arguments], capture_output=True, text=True, timeout=120,
                                  env={**os.environ, "TRUNNION_MACHINE": "", **environment})
            return done.returncode, done.stdout, done.stderr

        with Shop() as shop:
            shop.start()
            self.assertEqual(client("jog", "X", "1", "--wait", "--machine", shop.name), (0, "", ""))
            self.assertAlmostEqual(shop.joints()[0], 1, places=6)
            code, out, err = client("status", "--json", TRUNNION_MACHINE=shop.name)
            self.assertEqual(code, 0, err)
            self.assertEqual(json.loads(out)["config_file"], shop.config)
            code, out, err = client("status")
            if code == 0:
                self.assertIn(shop.name, out)
            else:  # other daemons run on this host
                self.assertRegex(err, rf"daemons of \d+ machines run here.*{shop.name}")
            code, _, err = client("status", "--machine", "nobody")
            self.assertEqual(code, 4)
            self.assertIn("'nobody' is neither a file nor a machine", err)
            self.assertIn(shop.name, err)
            with open(shop.config) as file:
                copy = shop.write("copy.toml", file.read() + "# another\n")
            code, _, err = client("jog", "X", "1", "--machine", copy)
            self.assertEqual(code, 0)
            self.assertIn(f"runs with {shop.config}, which is not the same as {copy}", err)
            with open(shop.config, "a") as file:
                file.write("# later\n")
            self.assertIn("has changed since the daemon was started", client("stop", "--machine", shop.config)[2])

    def test_optional_stop_and_block_delete(self):
        program = "G21 G90\nG1 X1 F6000\nM1\n/G1 X9\nG1 X3\nM1\nG1 X4\nM2\n"
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("load", shop.write("part.ngc", program))
            shop.ask("start")
            shop.until(lambda s: s["state"] == "holding")
            self.assertAlmostEqual(shop.joints()[0], 1, places=6)
            shop.ask("switch", "optional-stop", "off")  # what is planned already obeys it
            self.assertIn("M1 does not stop", shop.ask("status"))
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(shop.joints()[0], 4, places=6)
            shop.ask("switch", "block-delete", "on")
            shop.until(lambda s: s["block_delete"] and not s["optional_stop"])
            shop.ask("start", "--wait")
            shop.ask("mdi", "G1 X[10 + #<_block_delete> + 2 * #<_optional_stop>] F6000\n/G1 X0", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 11, places=6)
            shop.ask("switch", "optional-stop", "on")
            shop.ask("start")
            shop.until(lambda s: s["state"] == "holding" and s["line"] == 3)
            shop.ask("stop", "--wait")
            self.assertEqual(shop.end(), 0)
            first = assert_replays(self, shop, record, log, 300)
            far = [float(row[0]) > 8 and float(row[0]) < 9.5 for row in first]
            passes = sum(not a and b for a, b in zip(far, far[1:]))
            self.assertEqual(passes, 1 + 2, "in the first run alone, and to X11 and back")

    def test_late_periods_are_no_fault_in_simulation(self):
        with Shop() as shop:
            with open(shop.config) as file:
                text = file.read()
            for late, state in (("", "idle"), ("late_periods_max = 5", "fault")):
                shop.write("machine.toml", text.replace("late_periods_max = 0", late))
                shop.start(idle=False)  # on a busy host it may be late, and in fault, from the first moment on
                shop.until(lambda s: s["state"] in ("idle", "fault"))
                shop.process.send_signal(signal.SIGSTOP)
                time.sleep(0.5)
                shop.process.send_signal(signal.SIGCONT)
                time.sleep(0.3)
                status = shop.status()
                self.assertEqual(status["state"], state, shop.log_text())
                self.assertGreater(status["overruns"], 100)
                if not status["realtime"]:
                    self.assertIn("NOT REAL TIME", shop.log_text())
                if state == "fault":
                    told = shop.ask("status")
                    self.assertIn("cycle_overrun", told)
                    self.assertRegex(told, r"cure +give the process real-time rights")
                    self.assertIn("real-time", json.loads(shop.ask("status", "--json"))["fault_remedy"])
                shop.kill()

    def test_single_block_does_not_hold_what_is_typed_in(self):
        with Shop() as shop:
            shop.start()
            shop.ask("step", "on")
            shop.ask("mdi", "G91 G1 X1 F600\nG1 X2\nG10 L20 P1 Y0\nG90", "--wait", "--patience", "20")
            shop.ask("touch-off", "X", "5")
            self.assertEqual(shop.status()["state"], "idle")
            self.assertTrue(shop.status()["single_block"])

    def test_what_is_told_is_of_now(self):
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", "G0 X1\nM2\n"))
            self.assertEqual(shop.client("load", shop.write("bad.ngc", "G0 X[1+\nM2\n"))[0], 2)
            status = shop.status()
            self.assertTrue(status["program"].endswith("part.ngc"), "what is refused leaves what was loaded")
            self.assertIn("bad.ngc:1", status["message"])
            shop.ask("mdi", "G0 X2", "--wait")
            self.assertEqual(shop.status()["message"], "")
            shop.ask("mdi", "(MSG, turn the part)", "--wait")
            self.assertIn("turn the part", shop.until(lambda s: s["message"] != "")["message"])
            self.assertIn("turn the part", shop.log_text())
            shop.ask("override", "50")
            self.assertRegex(shop.log_text(), r"idle -> running: mdi, by \w+, process \d+")
            self.assertRegex(shop.log_text(), r"override 0\.5: override, by \w+, process \d+")

    def test_where_the_machine_is_and_what_is_in_force(self):
        with Shop() as shop:
            shop.start()
            self.assertEqual("XYZ", shop.status()["axes"])
            shop.ask("mdi", "--wait", "G21 G90 G10 L2 P2 X100 Y50 Z-20 R90\nG55\nT2 M61 Q2 G43\nG1 X-30 Y10 Z5 F6000")
            shop.until(lambda s: s["work_offset"] == "G55" and s["state"] == "idle")
            status, motion = shop.status(), shop.motion()[0]
            self.assertIn("G1 G17 G21 G90", status["codes"])
            self.assertIn(" G55 G43 ", status["codes"])
            self.assertEqual([100, 50, -20, 0, 0, 0], status["work_offset_value"])
            self.assertAlmostEqual(math.pi / 2, status["rotation_rad"])
            self.assertEqual((2, 80), (status["tool"], status["tool_offset"][2]))
            self.assertIn("8 mm ball", status["tool_name"])
            # The work's X points along the machine's Y: (-30, 10) lies at (100 - 10, 50 - 30); the spindle is
            # the tool's length above the tip.
            for shown, wanted in ((motion["work"], [-30, 10, 5]), (motion["machine"], [90, 20, 65])):
                for a, b in zip(shown, wanted):
                    self.assertAlmostEqual(b, a, delta=0.01)
            # A jog moves on from where the line ended: the machine's X is the work's -Y.
            shop.ask("jog", "X", "2", "--wait")
            for shown, wanted in ((shop.motion()[0]["work"], [-30, 8, 5]), (shop.motion()[0]["machine"], [92, 20, 65])):
                for a, b in zip(shown, wanted):
                    self.assertAlmostEqual(b, a, delta=0.01)
            # While a line is under way: its text, and what is left of it.
            shop.ask("load", shop.write("p.ngc", "G21 G90 G55 G43\n(a remark)\nG1 X120 F600 (slowly)\nM2\n"))
            shop.ask("start")
            status = shop.until(lambda s: s["block"] == "G1 X120 F600 (slowly)")
            self.assertEqual(3, status["line"])
            self.assertTrue(status["file"].endswith("p.ngc"), status["file"])
            motions = shop.motion(20)
            for motion in motions:
                self.assertAlmostEqual(120, motion["work"][0] + motion["to_go"][0], delta=1e-6)
            self.assertLess(motions[-1]["to_go"][0], motions[0]["to_go"][0])
            text = shop.ask("status")
            for words in ("G1 X120 F600 (slowly)", "offset    G55 X100", "tool 2 (8 mm ball), offset Z80.0000",
                          "F600;"):
                self.assertIn(words, text)

    def test_offsets_and_tools_are_shown_and_set(self):
        with Shop() as shop:
            shop.start()
            tables = lambda: json.loads(shop.ask("offset", "--json"))
            shop.ask("mdi", "--wait", "G21 G90 G0 X30 Y20 Z-10")
            # Here shall be X5 of the offset in force, and Y0 of another one: it lies at 30 - 5, and at 20.
            shop.ask("touch-off", "X", "5")
            shop.ask("touch-off", "y0", "--offset", "g56")
            shop.ask("offset", "G55", "X", "10", "Z-2.5", "R", "30")
            rows = {row["name"]: row for row in tables()["offsets"]}
            self.assertAlmostEqual(25, rows["G54"]["x"], delta=0.01)
            self.assertAlmostEqual(20, rows["G56"]["y"], delta=0.01)
            self.assertEqual((10, 0, -2.5), tuple(rows["G55"][axis] for axis in "xyz"))
            self.assertAlmostEqual(math.radians(30), rows["G55"]["rotation"])
            self.assertAlmostEqual(5, shop.motion()[0]["work"][0], delta=1e-6)
            # On disk when it was answered.
            self.assertAlmostEqual(25, shop.parameter(5221), delta=0.01)
            # Tools: the one in the spindle, its length by touching off, a diameter.
            code, _, told = shop.client("touch-off", "Z", "0", "--tool")
            self.assertEqual((5, True), (code, "no tool is in the spindle" in told), told)
            shop.ask("tool", "2", "--in-spindle")
            shop.ask("touch-off", "Z", "0", "--tool")
            self.assertAlmostEqual(-10, shop.length(2), delta=0.01)
            self.assertAlmostEqual(0, shop.motion()[0]["work"][2], delta=1e-6)
            shop.ask("tool", "1", "Z", "51.5", "D", "6.25")
            tool = next(row for row in tables()["tools"] if row["number"] == 1)
            self.assertEqual((51.5, 6.25, "end mill"), (tool["z"], tool["diameter"], tool["remark"]))
            self.assertRegex(shop.ask("tool"), r"> +2 .*8 mm ball")
            self.assertRegex(shop.ask("offset"), r"> G54 +25\.0")
            # What is wrong is told, and changes nothing.
            before = tables()["offsets"]
            for words, code in ((("offset", "G60", "X1"), 5), (("offset", "G55", "Q1"), 5), (("offset", "G55"), 5),
                                (("touch-off", "X", "nan"), 5), (("tool", "77", "--in-spindle"), 2),
                                (("tool", "X"), 5), (("tool", "2", "--pocket", "1"), 2),
                                (("tool", "2", "--remark", "a (b)"), 5), (("mdi", "G10 L10 P77 Z1"), 2)):
                self.assertEqual(code, shop.client(*words)[0], words)
            self.assertEqual(before, tables()["offsets"])
            self.assertEqual([1, 2], [row["number"] for row in tables()["tools"]])

    def test_a_dead_process_for_programs_stops_no_machine(self):
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            part = shop.write("part.ngc", "G21 G90\nG1 F600 G64 P0.01\n" +
                              "".join(f"X{i % 200 / 2} Y{i % 2 / 2}\n" for i in range(20000)) + "M2\n")
            for kill in (signal.SIGKILL, signal.SIGABRT, signal.SIGSTOP):
                shop.ask("load", part)
                shop.ask("start")
                shop.until(lambda s: s["state"] == "running" and s["line"] > 10)
                os.kill(shop.process_for_programs(), kill)
                if kill == signal.SIGSTOP:  # it hangs: motion goes on as far as it is planned, and stops there
                    time.sleep(1.5)
                    self.assertEqual(shop.status()["state"], "running")
                    shop.ask("hold")
                    shop.ask("stop")
                status = shop.until(lambda s: s["state"] == "idle")
                self.assertEqual(status["fault"], "ok")
                if kill != signal.SIGSTOP:
                    self.assertIn("the process that plans programs", status["message"])
                    self.assertTrue(status["program_failed"])
                shop.ask("jog", "X", "1", "--wait")
                shop.ask("mdi", "G0 X1", "--wait")
            self.assertIn("was killed", shop.log_text())
            self.assertIn("signal 6", shop.log_text())
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 500)

    def test_a_number_needs_no_zero_before_its_point(self):
        with Shop() as shop:
            shop.start()
            shop.ask("jog", "X", "-.5", "--wait")
            self.assertAlmostEqual(shop.joints()[0], -0.5, places=6)
            shop.ask("touch-off", "X", "-.25")
            self.assertEqual(shop.parameter(5221), -0.25)

    def test_an_unknown_command_is_explained(self):
        for word, near in (("hlep", "help"), ("statsu", "status"), ("jgo", "jog")):
            done = subprocess.run([BINARY, word], text=True, capture_output=True)
            self.assertEqual(done.returncode, 5)
            self.assertIn(f"did you mean '{near}'?", done.stderr)
        self.assertIn("daemon", subprocess.run([BINARY, "help"], text=True, capture_output=True).stdout)
        self.assertIn("--speed", subprocess.run([BINARY, "help", "jog"], text=True, capture_output=True).stdout)


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    daemon_e2e.BINARY, daemon_e2e.SOURCE = BINARY, SOURCE
    enter_own_network()
    names = [f"OperatorTest.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
