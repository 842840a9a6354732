#!/usr/bin/env python3
"""What the daemon tells a person: alarms until they are acknowledged, what a stop is for, how long a program still
takes, what was made; and the switches dry run and machine lock.

usage: state_e2e.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Exit code 77 (skipped) where the kernel allows no network of the test's own.
"""
import json
import os
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from daemon_socket import DaemonSocket  # noqa: E402
from own_network import enter_own_network  # noqa: E402
from shop import Shop, assert_replays, held_jog  # noqa: E402

BINARY = SOURCE = ""
SQUARE = "G21 G90 G61.1\nG1 X10 F600\nY10\nX0\nY0\nG4 P1\nG0 X50\nG0 X0\nM2\n"


class StateTest(unittest.TestCase):
    def alarms(self, shop):
        """But those of a host that is too busy to plan."""
        return [a for a in json.loads(shop.ask("status", "--json"))["alarms"] if a["name"] != "starved"]

    def test_a_tool_is_taken_out_of_the_table(self):
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("tool", "7", "Z", "30", "--remark", "tap")
            part = shop.write("part.ngc", "G21 G90 G61\nM61 Q1\nG43 H7\nG0 Z40\nG1 X300 F300\nM2\n")
            shop.ask("load", part)
            shop.ask("mdi", "M61 Q1", "--wait")

            def table():
                with open(shop.tools) as file:
                    return file.read()

            def refused(number, why):
                before = table()
                code, _, err = shop.client("tool", number, "--delete")
                self.assertNotEqual(code, 0)
                self.assertIn(why, err)
                self.assertEqual(table(), before)

            refused("9", "there is no tool 9 in the table")
            refused("1", "tool 1 is in the spindle")
            refused("7", "the loaded program needs tool 7")
            refused("7", "part.ngc:3")
            shop.ask("start")
            shop.until(lambda s: s["line"] == 5)
            refused("2", "while the machine is idle")
            shop.ask("stop", "--wait")
            code, out, err = shop.client("tool", "2", "--delete")
            self.assertEqual(code, 0, err)
            self.assertIn("tool 2 is out of the table", out + err)
            self.assertNotIn("T2 ", table(), "on disk before the answer")
            self.assertIn("T7 ", table())
            self.assertNotIn("8 mm ball", shop.ask("tool"))
            # The loaded program is as it was, and the next one does not know the tool.
            shop.ask("start")
            shop.until(lambda s: s["line"] == 5 and shop.joints()[0] > 1)
            shop.ask("stop", "--wait")
            self.assertNotEqual(shop.client("mdi", "T2 M6")[0], 0)
            # What comes again under the number has nothing of the old one, in a replay neither.
            shop.ask("tool", "2", "Z", "11")
            shop.ask("mdi", "M61 Q2", "--wait")
            shop.ask("mdi", "G43", "--wait")
            shop.ask("mdi", "G0 Z#5410", "--wait")  # the diameter, which nobody has given
            self.assertAlmostEqual(shop.joints()[2], 11, places=6)
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 100)

    def test_an_alarm_is_shown_until_it_is_acknowledged_and_no_longer(self):
        with Shop() as shop:
            shop.start()
            self.assertEqual(self.alarms(shop), [])
            self.assertEqual(shop.client("load", shop.write("bad.ngc", "G0 X1\nG1 X[1+\nM2\n"))[0], 2)
            for line, why in (("G0 X1 X2", "mdi:1:7: the word X is given twice"), ("M99", "runs once")):
                code, _, err = shop.client("mdi", line, "--wait")
                self.assertEqual((code, why in err), (2, True), err)
            self.assertEqual(self.alarms(shop), [], "what is refused has not happened")
            # What the machine answers is known only while it runs.
            shop.ask("load", shop.write("ask.ngc", "G21 G90\nG1 X1 F600\nM66 P0 L0\nG1 X[1/#5399]\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: s["state"] == "idle" and s["alarms_open"] >= 1)
            shop.ask("mdi", "G0 X1", "--wait")  # what comes later does not wipe it away
            alarm = self.alarms(shop)[0]
            self.assertEqual((alarm["name"], alarm["active"]), ("program", False))
            self.assertIn("ask.ngc:4:7: division by zero", alarm["text"])
            self.assertLess(abs(time.time() - alarm["since_us"] / 1e6), 30)
            shop.ask("load", shop.write("part.ngc", "G21 G90\nG1 X100 F600\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 2)
            shop.ask("estop")
            shop.until(lambda s: s["state"] == "estop" and s["alarms_open"] >= 2)
            self.assertEqual(self.alarms(shop)[1]["times"], 1)
            second = self.alarms(shop)[1]
            self.assertEqual((second["name"], second["active"], second["line"]), ("emergency_stop", True, 2))
            self.assertIn("the program was given up", second["did"])
            self.assertIn("estop, by ", second["cause"])
            self.assertTrue(second["program"].endswith("part.ngc"))
            text = shop.ask("status")
            for words in ("cure: release it, then reset", "cause: estop, by"):
                self.assertIn(words, text)
            shop.ask("acknowledge", str(alarm["number"]))
            shop.ask("acknowledge")
            left = self.alarms(shop)
            self.assertEqual([(a["name"], a["acknowledged"]) for a in left], [("emergency_stop", True)], "it lasts")
            shop.ask("reset", "--wait")
            shop.until(lambda s: s["state"] == "idle" and s["alarms_open"] == 0)
            self.assertEqual(self.alarms(shop), [])
            code, _, err = shop.client("acknowledge", "99")
            self.assertEqual((code, "there is no alarm 99" in err), (5, True), err)

    def test_a_tool_is_added_written_and_asked_for(self):
        with Shop() as shop:
            shop.start()
            # A tool is added; LinuxCNC's form is on disk, and the other lines are as they were.
            self.assertIn("tool 77 is new in the table, which also has 1, 2", shop.ask("tool", "77", "Z1.5", "D", "3",
                                                                                     "--remark", "engraver"))
            shop.ask("tool", "77", "--pocket", "12")
            with open(shop.tools) as file:
                text = file.read()
            self.assertTrue(text.startswith("; the workshop's tools\nT1 P1 "), text)
            self.assertIn("\nT77 P12 Z+1.500000 D+3.000000 ;engraver\n", text)
            shop.ask("mdi", "T77 M6")
            shop.until(lambda s: "tool 77 (engraver)" in s["waits_for"])
            shop.ask("stop", "--wait")
            shop.end()
            shop.start()  # reads what it wrote
            self.assertRegex(shop.ask("tool"), r"77 +12 +3\.0000 .* 1\.5000 +engraver")

    def test_a_stop_of_the_program_tells_its_words_and_a_probe_its_wait(self):
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", "G21 G90\nG1 X1 F600\nM0 (turn the part)\nG1 X2\nM2\n"))
            shop.ask("start")
            status = shop.until(lambda s: s["state"] == "holding")
            self.assertEqual(status["waits_for"], "program stop (M0): turn the part; 'resume' goes on")
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            shop.ask("mdi", "G38.3 Z-10 F60")
            shop.until(lambda s: s["waits_for"].startswith("contact of the probe (G38.3)"))
            status = shop.until(lambda s: s["state"] == "idle" and s["probe_known"])
            self.assertEqual(status["plane"], "G17")
            self.assertFalse(status["probe_contact"], "the plate's top is at -20")
            shop.ask("mdi", "G0 X10 Y0", "--wait")
            shop.ask("mdi", "G38.3 Z-30 F600")
            status = shop.until(lambda s: s["state"] == "idle" and s["probe_contact"])
            self.assertAlmostEqual(status["probe"][2], -20, delta=0.05)

    def test_the_time_left_is_right_also_behind_an_override(self):
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", SQUARE))
            whole = shop.until(lambda s: s["time_total_s"] > 0)
            self.assertAlmostEqual(whole["time_left_s"], whole["time_total_s"], delta=1e-6)
            for percent in (100, 50):
                seen = []
                shop.ask("start")
                # By the machine's own periods: on a busy host an answer comes when it comes.
                while not seen or seen[-1][1]["state"] == "running":
                    status = shop.status()
                    seen.append((status["periods"] * status["period_s"], status))
                    if percent < 100 and len(seen) == 5:
                        shop.ask("override", str(percent))
                end, unseen = seen[-1][0], seen[-1][0] - seen[-2][0]
                judged = [(at, s) for at, s in seen[12:-1] if s["state"] == "running"]
                self.assertGreater(len(judged), 10)
                for at, status in judged:
                    self.assertAlmostEqual(status["time_left_s"], end - at,
                                           delta=0.02 * whole["time_total_s"] + 0.2 + unseen)
                    self.assertAlmostEqual(status["time_total_s"], whole["time_total_s"], delta=1e-6)
            self.assertRegex(shop.ask("status"), r"time +0:00 of 0:\d\d done \(0 %\), 0:\d\d left")
            shop.ask("override", "0")
            self.assertEqual(shop.until(lambda s: s["override_wanted"] == 0)["time_left_s"], -1)

    def test_parts_and_run_time_outlive_the_daemon(self):
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", "G21 G90\nG1 X10 F6000\nG1 X0\nM2\n"))
            shop.ask("mdi", "G0 Y1", "--wait")
            for made in (1, 2, 3):
                shop.ask("start", "--wait")
                status = shop.until(lambda s, made=made: s["parts"] == made)
            self.assertGreater(status["run_s"], 0.5)
            self.assertGreater(status["program_run_s"], 0.2)
            shop.ask("load", shop.write("long.ngc", "G21 G90\nG1 X100 F600\nM2\n"))
            shop.ask("start")
            shop.until(lambda s: s["line"] == 2)
            shop.ask("stop", "--wait")
            self.assertEqual(shop.status()["parts"], 3, "one that was stopped is no part")
            shop.kill()
            shop.start()
            self.assertEqual(shop.status()["parts"], 3)
            self.assertIn("3 parts", shop.ask("status"))
            shop.ask("parts", "0")
            shop.until(lambda s: s["parts"] == 0)
            shop.kill()
            shop.start()
            self.assertEqual(shop.status()["parts"], 0)
            version = subprocess.run([BINARY, "--version"], text=True, capture_output=True).stdout.strip()
            self.assertIn(f" {shop.status()['version']} ", version)

    def test_with_the_machine_locked_programs_run_and_nothing_moves(self):
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("mdi", "G0 X5 Y6", "--wait")
            before = shop.joints()
            shop.ask("load", shop.write("part.ngc", "G21 G90 S1000 M3\nG1 X60 F3000\nM0\nG1 Y30\nM2\n"))
            shop.ask("switch", "machine-lock", "on")
            shop.until(lambda s: s["machine_lock"])
            self.assertIn("MACHINE LOCK", shop.ask("status"))
            shop.ask("start")
            self.assertIn("while the machine is idle", shop.client("switch", "machine-lock", "off")[2])
            shop.until(lambda s: s["state"] == "holding")
            self.assertAlmostEqual(shop.motion()[0]["work"][0], 60, places=6)
            self.assertEqual(shop.joints(), before)
            shop.ask("resume")
            shop.until(lambda s: s["state"] == "idle")
            self.assertIn("the machine is locked", shop.client("home")[2])
            shop.ask("switch", "machine-lock", "off")
            shop.until(lambda s: not s["machine_lock"])
            self.assertEqual(shop.joints(), before)
            self.assertAlmostEqual(shop.motion()[0]["work"][0], 5, places=6)
            shop.ask("mdi", "G0 X7", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 7, places=6)
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 1000)

    def test_a_hand_wheel_adds_up_in_the_unit_of_the_program(self):
        with Shop() as shop:
            shop.start()
            at = lambda: shop.motion()[0]["machine"]
            turns = "".join("X 1\n" for _ in range(40)) + "Z -2 0.5\nQ 1\nnonsense\n\n" + "X -10 0.001\n"
            done = subprocess.run([BINARY, "wheel", "--step", "0.1", "--machine", shop.config], input=turns, text=True,
                                  capture_output=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("'nonsense' is no turn of a wheel", done.stderr)
            self.assertIn("Q", done.stderr)
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(at()[0], 3.99, places=6)
            self.assertAlmostEqual(at()[2], -1, places=6)
            shop.ask("mdi", "G20", "--wait")
            shop.until(lambda s: s["inch"])
            subprocess.run([BINARY, "wheel", "--machine", shop.config], input="Y 100\n", text=True, timeout=120,
                           check=True)
            shop.until(lambda s: s["state"] == "idle")
            self.assertAlmostEqual(at()[1], 25.4, places=6)
            shop.ask("jog", "Y", "-0.5", "--speed", "2", "--wait")
            self.assertAlmostEqual(at()[1], 12.7, places=6)

    def test_waiting_tells_that_another_client_stopped(self):
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", "G21 G90\nG1 X40 F60\nM2\n"))
            for begins, ends, what in ((["start"], "stop", "program"), (["mdi", "G1 X-20 F60"], "stop", "typed line"),
                                       (["jog", "X", "30", "--speed", "1"], "hold", "motion")):
                client = subprocess.Popen([BINARY, *begins, "--wait", "--machine", shop.config], stderr=subprocess.PIPE,
                                          text=True)
                before = shop.joints()[0]
                shop.until(lambda s: s["state"] != "idle" and abs(shop.joints()[0] - before) > 0.3)
                shop.ask(ends)
                told = client.communicate(timeout=120)[1]
                self.assertEqual(client.returncode, 4, told)
                self.assertIn(f"stopped by another client: the {what} did not come to its end", told)
            shop.ask("stop", "--wait")  # one's own is done as it was told

    def test_what_is_stored_is_told_with_its_unit(self):
        with Shop() as shop:
            shop.start()
            self.assertIn("G55: X 10.0000 mm, R 30 degrees", shop.ask("offset", "G55", "X", "10", "R", "30"))
            self.assertTrue(shop.ask("offset").startswith("in mm and degrees\n"))
            # Two lines of a shell's quotes: the characters \ and n.
            shop.ask("mdi", r"G20\nG0 X1", "--wait")
            self.assertAlmostEqual(shop.motion()[0]["machine"][0], 25.4, places=6)
            self.assertIn("G54: X 76.2000 mm (3 inch)", shop.ask("offset", "g54", "X", "3"))
            self.assertIn("tool 2: Z 50.8000 mm (2 inch), D 12.7000 mm (0.5 inch)",
                          shop.ask("tool", "2", "Z", "2", "D", "0.5"))
            self.assertIn("here, in G54: Y 25.4000 mm (1 inch)", shop.ask("touch-off", "Y", "1"))
            self.assertAlmostEqual(76.2, shop.parameter(5221), places=9)
            self.assertAlmostEqual(50.8, shop.length(2), places=6)
            for table in ("tool", "offset"):
                self.assertIn("values that you type count in inch", shop.ask(table).splitlines()[0])

    def test_a_dry_run_stays_away_from_the_work(self):
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            shop.ask("load", shop.write("part.ngc", "G21 G90 G61.1\nS1000 M3\nG0 Z-10\nG1 Z-50 F60\nG1 X40\nM2\n"))
            shop.ask("switch", "dry-run", "on")
            shop.until(lambda s: s["dry_run"])
            self.assertIn("DRY RUN", shop.ask("status"))
            begun = shop.status()["periods"]
            shop.ask("start", "--wait")
            self.assertLess((shop.status()["periods"] - begun) * shop.status()["period_s"], 20,
                            "40 mm at F60 would take 40 s")
            self.assertAlmostEqual(shop.joints()[0], 40, places=6)
            self.assertAlmostEqual(shop.joints()[2], -30, places=6)
            shop.ask("switch", "dry-run", "off")
            shop.ask("mdi", "G0 Z-50", "--wait")
            self.assertAlmostEqual(shop.joints()[2], -50, places=6)
            self.assertEqual(shop.end(), 0)
            assert_replays(self, shop, record, log, 500)

    def assert_off(self, shop, told):
        status = shop.until(lambda s: s["spindle_rpm"] == 0 and "M5" in s["codes"].split())
        self.assertFalse(status["mist"] or status["flood"], told)
        self.assertIn("M9", status["codes"].split(), told)
        self.assertNotIn("M3", status["codes"].split(), told)

    def stop_hard(self, shop):
        shop.ask("estop")
        shop.until(lambda s: s["state"] == "estop")
        self.assert_off(shop, "behind an emergency stop")
        shop.ask("reset", "--wait")

    def stop_soft(self, shop):
        shop.ask("mdi", "G4 P20")
        shop.until(lambda s: s["state"] == "running")
        shop.ask("stop", "--wait")

    def test_what_a_stop_switched_off_no_later_line_switches_on(self):
        harmless = (("touch-off", "X", "0"), ("tool", "2", "--in-spindle"), ("offset", "G55", "X", "1"),
                    ("tool", "1", "--remark", "new"), ("jog", "Z", "1", "--along", "tool", "--wait"),
                    ("mdi", "(MSG,hi)", "--wait"), ("mdi", "G4 P0.1", "--wait"), ("mdi", "G1 X1 F600", "--wait"))
        with Shop() as shop:
            record, log = (os.path.join(shop.folder.name, name) for name in ("record.csv", "log"))
            shop.start("--record", record, "--log", log)
            for stop in (self.stop_hard, self.stop_soft):
                shop.ask("mdi", "S3000 M3 M8", "--wait")
                on = shop.until(lambda s: s["spindle_rpm"] == 3000 and s["flood"])
                self.assertIn("M3", on["codes"].split())
                self.assertIn("M8", on["codes"].split())
                for line in harmless:  # where it turns, nothing of this ends or changes it
                    shop.ask(*line)
                    now = shop.status()
                    self.assertEqual((now["spindle_rpm"], now["flood"]), (3000, True), line)
                shop.ask("mdi", "S2000", "--wait")
                shop.until(lambda s: s["spindle_rpm"] == 2000)
                stop(shop)
                self.assert_off(shop, stop)
                for line in harmless:
                    shop.ask(*line)
                    self.assert_off(shop, line)
                self.assertEqual(shop.end(), 0) if stop == self.stop_soft else None
            with open(log) as file:
                switched = [line for line in file if '"spindle"' in line]
            self.assertEqual(switched, [], "no hand has switched it either")
            assert_replays(self, shop, record, log, 100)

    def test_the_spindle_and_the_coolant_of_earlier_lines_go_off_by_a_line(self):
        with Shop() as shop:
            shop.start()
            shop.ask("mdi", "S3000 M4 M7\nM8", "--wait")
            shop.until(lambda s: s["spindle_rpm"] == -3000 and s["flood"] and s["mist"])
            shop.ask("mdi", "M5", "--wait")
            now = shop.until(lambda s: s["spindle_rpm"] == 0)
            self.assertTrue(now["flood"] and now["mist"])
            shop.ask("mdi", "M9", "--wait")
            self.assert_off(shop, "M5 and M9")
            shop.ask("mdi", "M3", "--wait")
            shop.until(lambda s: s["spindle_rpm"] == 3000)
            shop.ask("mdi", "M2", "--wait")
            self.assert_off(shop, "M2")

    def test_a_start_that_is_not_wanted_begins_at_the_first_line_again(self):
        with Shop() as shop:
            shop.start()
            part = shop.write("part.ngc", "G21 G90\nG1 X10 F6000\nG1 X20\nG1 X30\nG4 P0.3\nM2\n")
            shop.ask("load", part)

            def prepare(answer):
                done = subprocess.run([BINARY, "start", "--from", "4", "--machine", shop.config], input=answer,
                                      text=True, capture_output=True, timeout=120)
                self.assertEqual(done.returncode, 5)
                return done.stderr

            self.assertIn("begins at its first line again", prepare("n\n"))
            self.assertNotIn("prepared", shop.status()["message"])
            shop.ask("start")
            shop.until(lambda s: s["line"] == 2)
            shop.until(lambda s: s["state"] == "idle")
            # A client that was killed at the question says nothing: the status does, and 'stop' gives it up.
            with subprocess.Popen([BINARY, "start", "--from", "4", "--machine", shop.config], stdin=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True) as client:
                shop.until(lambda s: "prepared from line 4: 'start' begins there" in s["message"])
                client.kill()
            self.assertIn("prepared from line 4", shop.status()["message"])
            shop.ask("stop")
            shop.until(lambda s: s["message"] == "")
            shop.ask("start")
            shop.until(lambda s: s["line"] == 2)
            shop.until(lambda s: s["state"] == "idle")

    def test_what_was_loaded_is_what_is_cut_or_nothing(self):
        with Shop() as shop:
            shop.start()
            shop.write("hole.ngc", "o<hole> sub\nG1 X2 F6000\no<hole> endsub\n")
            part = shop.write("part.ngc", "G21 G90\nG1 X1 F6000\no<hole> call\nM2\n")

            def refused(what):
                before = shop.joints()
                code, _, err = shop.client("start")
                self.assertEqual(code, 2, err)
                self.assertIn(f"{what} has changed on disk since it was loaded; 'load' the program again", err)
                self.assertEqual(shop.joints(), before)

            shop.ask("load", part)
            shop.ask("start", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 2, places=6)
            for name, text in (("part.ngc", "G21 G90\nG1 X50 F6000\no<hole> call\nM2\n"),
                               ("hole.ngc", "o<hole> sub\nG1 X60 F6000\no<hole> endsub\n")):
                shop.write(name, text)
                refused(name)  # as it would be read anew
                shop.ask("load", part)
                shop.write(name, text + "(later)\n")
                refused(name)  # as it was prepared
                shop.write(name, text)  # the same again
                shop.ask("start", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 60, places=6)

    def test_what_is_refused_leaves_the_loaded_program(self):
        with Shop() as shop:
            shop.start()
            shop.ask("load", shop.write("part.ngc", "G21 G90\nG1 X10 F6000\nM2\n"))
            for arguments, code in ((("start", "--from", "999", "--yes"), 2), (("load", "nix.ngc"), 2),
                                    (("start", "--resume", "--yes"), 2), (("load", ""), 5)):
                self.assertEqual(shop.client(*arguments)[0], code, arguments)
                self.assertTrue(shop.status()["program"].endswith("part.ngc"), arguments)
            shop.ask("start", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 10, places=6)

    def test_a_stop_gets_through_where_there_is_no_room(self):
        with Shop() as shop:
            shop.start()
            crowd = [DaemonSocket.of(shop) for _ in range(24)]
            hoard = [DaemonSocket.of(shop, ".safety") for _ in range(30)]
            time.sleep(0.3)
            for command, state in ((("hold",), "holding"), (("stop", "--wait"), "idle"), (("estop",), "estop")):
                if command[0] != "estop":
                    crowd.pop().socket.close()
                    shop.ask("mdi", "G4 P30")
                    crowd.append(DaemonSocket.of(shop))
                    time.sleep(0.3)
                code, _, err = shop.client(*command)
                self.assertEqual(code, 0, f"{command}: {err}")
                crowd.pop().socket.close()
                shop.until(lambda s: s["state"] == state)
                if state == "holding":
                    shop.ask("stop", "--wait")
                crowd.append(DaemonSocket.of(shop))
                time.sleep(0.3)
            for arguments in (("reset",), ("status",)):
                code, _, err = shop.client(*arguments)
                self.assertEqual(code, 4, err)
                self.assertIn("no room for another client", err)
                self.assertNotIn("no daemon", err)
            self.assertIn("no room for", shop.log_text())
            for client in crowd + hoard:
                client.socket.close()

    def test_a_program_that_is_only_loaded_sets_nothing(self):
        with Shop() as shop:
            shop.start()
            shop.ask("offset", "G54", "X", "7")
            lines = "G21 G90\nG10 L2 P1 X[#5221+10]\nG10 L1 P1 Z55\n#100=[#100+1]\nG1 X0 F3000\nM2\n"
            part = shop.write("set.ngc", lines)
            shop.ask("load", part)
            self.assertEqual((shop.parameter(5221), shop.parameter(100), shop.length(1)), (7, 0, 50))
            shop.ask("mdi", "G90 G0 X8", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 15, places=6)
            shop.ask("load", part)
            shop.ask("jog", "Y", "1", "--wait")
            shop.ask("start", "--wait")
            self.assertAlmostEqual(shop.joints()[0], 17, places=6)
            self.assertEqual((shop.parameter(5221), shop.parameter(100), shop.length(1)), (17, 1, 55))

    def test_a_mistake_behind_a_wait_ends_the_motion_in_order(self):
        """What the program asks the machine first keeps anybody from reading on before it starts."""
        with Shop() as shop:
            shop.start()
            for repeat, lines, told in ((8, "G64 P5\nG1 X10", "tolerance_mm_max"), (60, "G1 X10000", "limit"),
                                        (60, "S500 M3\nG33 Z-100 K100", "too slow"), (8, "G1 X10 X20", "X")):
                moves = f"o1 repeat [{repeat}]\nG1 X50\nG1 X49 Y1\nG1 X48 Y0\no1 endrepeat\n"
                shop.ask("load", shop.write("late.ngc", f"G21 G90 F6000 G64 P0.01\nM66 P0 L0\n{moves}{lines}\nM2\n"))
                code, _, err = shop.client("start", "--wait")
                self.assertEqual(code, 2, f"{lines}: {err}")
                self.assertIn(told, err)
                self.assertEqual(shop.until(lambda s: s["state"] != "running")["state"], "idle", err)
                self.assertEqual({alarm["name"] for alarm in self.alarms(shop)}, {"program"})
                if "X10000" not in lines:
                    self.assertAlmostEqual(shop.joints()[0], 48, places=6)

    def test_what_was_mistyped_is_refused_with_words(self):
        with Shop() as shop:
            shop.start()
            before = shop.ask("tool", "--json"), shop.ask("offset", "--json")
            for arguments, why in ((("tool", "1", "D", "-8"), "no diameter"), (("tool", "77"), "no tool 77"),
                                   (("offset", "G54", "R", "-1e9"), "out of range"), (("load", ""), "no name"),
                                   (("touch-off", "X", "1e300"), "out of range"),
                                   (("override", "50x"), "'50x' is no number; write 50"),
                                   (("override", "1,5"), "write 1.5"), (("start", "--from", "3.5"), "whole number"),
                                   (("jog", "A", "1"), "no axis A; it has X, Y, Z"),
                                   (("wheel", "--step", "0"), "more than 0"),
                                   (("sensor", "nix", "20"), "no correction asks for a sensor 'nix'")):
                code, out, err = shop.client(*arguments)
                self.assertEqual((code, why in out + err), (5, True), f"{arguments}: {code} {out} {err}")
            after = shop.ask("tool", "--json"), shop.ask("offset", "--json")
            for one, other in zip(before, after):
                self.assertEqual(json.loads(one) | {"time_us": 0}, json.loads(other) | {"time_us": 0})
            self.assertNotIn("8 mm ball", shop.ask("tool", "1"))
            shop.ask("estop")
            shop.until(lambda s: s["state"] == "estop")
            for name, rest in (("touch-off", ("X", "0")), ("offset", ("G54", "X", "1")), ("tool", ("1", "Z", "3"))):
                err = shop.client(name, *rest)[2]
                self.assertIn(f"'{name}' is legal in", err)

    def test_ctrl_c_ends_the_waiting_and_says_that_the_machine_goes_on(self):
        with Shop() as shop:
            shop.start()
            with subprocess.Popen([BINARY, "mdi", "G4 P20", "--wait", "--machine", shop.config],
                                  stderr=subprocess.PIPE, text=True) as client:
                shop.until(lambda s: s["state"] == "running")
                time.sleep(0.3)
                client.send_signal(signal.SIGINT)
                err = client.communicate(timeout=120)[1]
            self.assertEqual(client.returncode, 4, err)
            self.assertIn("the machine goes on; 'trunnion stop' ends it", err)
            self.assertEqual(shop.status()["state"], "running")
            shop.ask("stop", "--wait")

    def test_an_axis_that_somebody_holds_is_not_jogged_the_other_way(self):
        with Shop() as shop:
            shop.start()
            client = held_jog(shop, 0, "X", "+")
            code, _, err = shop.client("jog", "X", "-")
            self.assertEqual((code, "somebody else holds X" in err), (5, True), err)
            client.send_signal(signal.SIGINT)
            client.communicate(timeout=120)
            shop.until(lambda s: s["state"] == "idle")
            shop.ask("jog", "X", "-1", "--wait")

    def test_parts_that_cannot_be_kept_are_refused(self):
        with Shop() as shop:
            shop.start()
            shop.ask("parts", "12")
            self.assertEqual(shop.ask("parts").strip(), "12")
            counters = shop.vars + ".counters"
            os.remove(counters)
            os.mkdir(counters)  # nothing can be put in its place
            code, _, err = shop.client("parts", "44")
            self.assertEqual((code, "not kept" in err), (5, True), err)


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    daemon_e2e.BINARY, daemon_e2e.SOURCE = BINARY, SOURCE
    enter_own_network()
    names = [f"StateTest.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
