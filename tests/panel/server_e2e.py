#!/usr/bin/env python3
"""Real daemon, real panel, and a page made of the standard library: key, REST, WebSocket, Host and Origin, controls.

usage: server_e2e.py TRUNNION_BINARY SOURCE_DIR
"""
import json
import os
import re
import signal
import struct
import subprocess
import sys
import time
import unittest

from page_client import Page, get, post
from panel_bench import PanelBench

BINARY, SOURCE = "", ""
NO_KEY, TOO_LATE = 4401, 4408
NO_KEY_TEXT = "This page has no key, or not this panel's: open the address that 'trunnion panel' printed."


class PanelTest(unittest.TestCase):
    def setUp(self):
        self.bench = PanelBench(BINARY, SOURCE)
        self.addCleanup(self.bench.close)

    def page(self, **values):
        page = Page(self.bench, **values)
        self.addCleanup(page.close)
        return page

    def page_at_rest(self):
        page = self.page()
        page.state("idle")
        return page

    def homed_page(self):
        page = self.page_at_rest()
        page.take_controls()
        self.assertEqual(page.ask("home", "home", joint=-1)["outcome"], "accepted")
        page.state("homing")
        page.state("idle")
        return page


class WholePanel(PanelTest):
    def setUp(self):
        super().setUp()
        self.bench.start_panel()

    def test_files_and_state(self):
        self.page_at_rest()
        answer, body = get(self.bench, "/", key=None)
        self.assertEqual((answer.status, body), (200, b"<p>the page</p>"))
        self.assertIn("default-src 'self'", answer.getheader("content-security-policy"))
        joints = json.loads(get(self.bench, "/api/v1/machine")[1])["joints"]
        self.assertEqual([joint["name"] for joint in joints], ["X", "Y", "Z", "A", "C"])
        state = json.loads(get(self.bench, "/api/v1/state")[1])
        self.assertTrue(state["connected"])
        self.assertEqual(state["status"]["state"], "idle")
        for path in ("/../machine.toml", "/%2e%2e/x", "/api/v1/nothing", "/nothing"):
            self.assertEqual(get(self.bench, path)[0].status, 404, path)

    def test_strangers_are_refused(self):
        self.assertEqual(get(self.bench, "/", host="evil.example")[0].status, 403)
        self.assertEqual(get(self.bench, "/api/v1/state", host="localhost.evil.example:80")[0].status, 403)
        for origin, host in (("http://evil.example", None), ("http://evil.example", "evil.example"), ("null", None)):
            self.assertIn(" 403 ", self.page(origin=origin, host=host).status_line)

    def test_without_the_right_key_there_are_files_only(self):
        wrong = "0" * len(self.bench.key)
        for key in (None, wrong, "", self.bench.key[:-1], self.bench.key + "0", "\u00e9"):
            for name in ("machine", "state", "history", "nothing"):
                answer, body = get(self.bench, f"/api/v1/{name}", key=key)
                self.assertEqual((answer.status, answer.getheader("www-authenticate")), (401, "Bearer"))
                self.assertEqual(body.decode(), NO_KEY_TEXT + "\n")
        self.assertEqual(get(self.bench, "/api/v1/state", scheme="Basic")[0].status, 401)
        self.assertEqual(get(self.bench, "/", key=None)[0].status, 200)

    def test_without_the_right_key_no_stream(self):
        begins = ({"type": "key", "key": "0" * len(self.bench.key)}, {"type": "key"}, {"type": "take_controls"}, "{",
                  {"type": "command", "id": 1, "verb": "estop"}, {"type": "key", "key": self.bench.key[:-1]})
        for begin in begins:
            page = self.page(key=None)
            page.send(begin)
            self.assertEqual(page.until_closed(), [], begin)
            self.assertEqual(page.closed, (NO_KEY, NO_KEY_TEXT), begin)
        self.assertEqual(self.page_at_rest().ask(1, "hold")["id"], 1)  # nothing of that has stopped the machine

    def test_who_says_no_key_is_not_waited_for(self):
        page = self.page(key=None)
        self.assertEqual(page.until_closed(), [])
        self.assertEqual(page.closed, (TOO_LATE, "The page said its key too late: try again."))

    def test_many_who_say_no_key_are_not_let_in(self):
        lines = [self.page(key=None).status_line for _ in range(20)]
        self.assertIn(" 101 ", lines[0])
        self.assertIn(" 503 ", lines[-1])

    def test_a_key_in_a_query_is_refused(self):
        for path in ("/", "/api/v1/state", "/index.html"):
            for key in ("right", None):
                answer, body = get(self.bench, f"{path}?key={self.bench.key}", key=key)
                self.assertEqual(answer.status, 400, path)
                self.assertIn(b"no key belongs in one", body)
        self.assertIn(" 400 ", self.page(path=f"/api/v1/stream?key={self.bench.key}").status_line)

    def test_controls_and_dead_man(self):
        one, two = self.homed_page(), self.page_at_rest()
        self.assertEqual(two.ask(1, "jog", joint=0, value=5, speed=1, press=2)["outcome"], "refused")
        # 60 s of jog; the page says nothing more, and the machine stands long before.
        self.assertEqual(one.ask(3, "jog", joint=0, value=60, speed=1, press=1)["outcome"], "accepted")
        begin = one.until(lambda m: m["type"] == "motion")["q_setpoint"][0]
        one.until(lambda m: m["type"] == "message" and m["kind"] == "dead_man")
        one.state("idle")
        end = one.until(lambda m: m["type"] == "motion")["q_setpoint"][0]
        self.assertLess(end - begin, 10)

    def joints(self, page):
        return page.until(lambda m: m["type"] == "motion")["q_setpoint"]

    def joints_at_rest(self, page):
        """A status may overtake the motion from before it: where two motions agree."""
        last = None
        while (now := self.joints(page)) != last:
            last = now
        return now

    def hold(self, page, seconds, **jog):
        """Jogs as a page does while a button is held, and this long behind the answer, which comes when the way is
        planned; returns the states of the machine meanwhile."""
        states, end = set(), None
        page.send({"type": "command", "id": 5, "verb": "jog", "alive_ms": 250, **jog})
        while end is None or time.monotonic() < end:
            page.send({"type": "alive"})
            message = page.next()
            states |= {message["state"]} if message["type"] == "status" else set()
            if message["type"] == "answer" and message["id"] == 5:
                self.assertEqual(message["outcome"], "accepted")
                end = time.monotonic() + seconds
        return states

    def test_a_held_jog_goes_on_evenly_and_ends_with_the_button(self):
        page = self.homed_page()
        begin = self.joints_at_rest(page)[0]
        self.hold(page, 1.5, text="X", value=1, speed=10, press=1)
        self.assertEqual(page.ask(6, "jog", text="X", value=0)["outcome"], "accepted")
        page.state("idle")
        end = self.joints_at_rest(page)[0]
        self.assertGreater(end - begin, 8)  # one jog of a quarter of a second would be 2.5 mm
        self.assertAlmostEqual(self.joints_at_rest(page)[0], end, places=6)

    def test_a_held_jog_ends_with_its_page(self):
        page, other = self.homed_page(), self.page()
        self.hold(page, 0.5, text="X", value=1, speed=10, press=1)
        page.close()
        other.state("jogging")
        other.state("idle")
        stands = self.joints_at_rest(other)[0]
        time.sleep(0.5)
        self.assertLess(abs(self.joints_at_rest(other)[0] - stands), 1e-6)

    def test_a_held_jog_of_a_page_that_stops_saying_so_ends(self):
        page = self.homed_page()
        self.hold(page, 0.5, text="X", value=1, speed=10, press=1)
        page.until(lambda m: m["type"] == "message" and m["kind"] == "dead_man")
        page.state("idle")
        # Signs of life that come later begin nothing again.
        stands = self.joints_at_rest(page)[0]
        for _ in range(10):
            page.send({"type": "alive"})
            time.sleep(0.05)
        self.assertLess(abs(self.joints_at_rest(page)[0] - stands), 1e-6)

    def test_a_jog_along_a_direction(self):
        page = self.homed_page()
        begin = self.joints_at_rest(page)
        for press in range(1, 11):  # on a busy host the dead man may let go of one at once
            self.hold(page, 1.0, text="Z", value=1, speed=10, frame=3, press=press)
            self.assertEqual(page.ask(6, "jog", text="Z", value=0, frame=3)["outcome"], "accepted")
            page.state("idle")
            way = [b - a for a, b in zip(begin, self.joints_at_rest(page))]
            if way[2] > 1:
                break
        self.assertGreater(way[2], 1)  # the tool is upright after homing
        self.assertLess(max(abs(one) for i, one in enumerate(way) if i != 2), 1e-6)

    def test_switches(self):
        page = self.page_at_rest()
        page.take_controls()
        for verb in ("single_block", "optional_stop", "block_delete"):
            for value in (0, 1):
                self.assertEqual(page.ask(verb, verb, value=value)["outcome"], "accepted", verb)
                page.until(lambda m, on=bool(value), name=verb: m["type"] == "status" and m[name] == on)

    def long_program(self):
        self.bench.write("programs/part.ngc", "G21 G90 G94\nF60\nG1 X50\nG1 X0\nM2\n")
        page = self.homed_page()
        self.assertEqual(page.ask(2, "load", text="part.ngc")["outcome"], "accepted")
        return page

    def start(self, page):
        self.assertEqual(page.ask(3, "start")["outcome"], "accepted")
        page.state("running")

    def test_a_program_holds_when_its_page_is_lost_and_wants_that(self):
        page, other = self.long_program(), self.page()
        page.send({"type": "hold_when_lost", "on": True})
        self.start(page)
        page.close()
        other.until(lambda m: m["type"] == "message" and m["kind"] == "dead_man" and "holds" in m["text"])
        other.state("holding")

    def test_a_program_holds_when_its_page_falls_silent_and_wants_that(self):
        page, other = self.long_program(), self.page()
        page.send({"type": "hold_when_lost", "on": True})
        self.start(page)
        other.state("holding")

    def test_the_stop_of_a_jog_stops_no_program(self):
        page = self.long_program()
        self.start(page)
        for frame in range(4):
            page.ask(4, "jog", text="X", value=0, frame=frame)
        time.sleep(0.5)
        self.assertEqual(json.loads(get(self.bench, "/api/v1/state")[1])["status"]["state"], "running")

    def test_a_program_goes_on_when_its_page_is_lost_and_wants_nothing(self):
        page, other = self.long_program(), self.page()
        self.start(page)
        page.close()
        other.until(lambda m: m["type"] == "controls" and m["holder"] == 0)
        time.sleep(4)
        self.assertEqual(json.loads(get(self.bench, "/api/v1/state")[1])["status"]["state"], "running")

    def kept(self, name):
        with open(self.bench.path("programs/" + name), "rb") as file:
            return file.read()

    def test_a_program_that_a_page_sends_is_kept(self):
        for text in (b"G0 X1\nM2\n", b"(" + b"x" * 3_000_000 + b")\nM2\n"):
            self.assertEqual(post(self.bench, "/api/v1/programs/new%20part.ngc", text)[0].status, 200)
            self.assertEqual(self.kept("new part.ngc"), text)
        self.assertIn("new part.ngc", get(self.bench, "/api/v1/programs")[1].decode())
        self.assertEqual(os.stat(self.bench.path("programs/new part.ngc")).st_mode & 0o777, 0o644)

    def test_what_is_sent_and_may_not_be_is_not_kept(self):
        before = sorted(os.listdir(self.bench.folder) + os.listdir(self.bench.path("programs")))
        os.symlink("../outside.ngc", self.bench.path("programs/link.ngc"))
        for path, code, extra in (("programs/part.ngc", 401, {"key": None}),
                                  ("programs/part.ngc", 401, {"key": "0" * 32}),
                                  ("programs/part.ngc", 403, {"origin": "http://evil.example"}),
                                  ("programs/part.ngc", 403, {"origin": None}),
                                  ("programs/part.ngc", 403, {"host": "evil.example"}),
                                  ("programs/part.ngc", 413, {"size": 1 << 30}),
                                  ("programs/part.ngc?x=1", 400, {}), ("programs/part.txt", 409, {}),
                                  ("programs/.part.ngc", 409, {}), ("programs/sub%2Fpart.ngc", 409, {}),
                                  ("programs/link.ngc", 409, {}), ("programs/" + "x" * 200 + ".ngc", 409, {}),
                                  ("part.ngc", 404, {})):
            self.assertEqual(post(self.bench, "/api/v1/" + path, b"M2\n", **extra)[0].status, code, (path, extra))
        os.remove(self.bench.path("programs/link.ngc"))
        self.assertEqual(sorted(os.listdir(self.bench.folder) + os.listdir(self.bench.path("programs"))), before)

    def test_a_program_at_work_is_not_replaced(self):
        page = self.long_program()
        self.start(page)
        before = self.kept("part.ngc")
        answer, why = post(self.bench, "/api/v1/programs/part.ngc", b"M2\n")
        self.assertEqual((answer.status, self.kept("part.ngc")), (409, before))
        self.assertIn(b"at work", why)

    def test_metrics(self):
        self.page_at_rest().until(lambda m: m["type"] == "motion")
        self.assertEqual(get(self.bench, "/metrics", key=None)[0].status, 401)
        answer, body = get(self.bench, "/metrics")
        self.assertIn("version=0.0.4", answer.getheader("content-type"))
        samples = {}
        for line in body.decode().splitlines():
            if line.startswith("#"):
                self.assertRegex(line, r"^# (HELP|TYPE) trunnion_\w+ ")
                continue
            name, value = re.fullmatch(r'(trunnion_\w+\{machine="panel_test"(?:,\w+="[^"]*")?\}) (\S+)', line).groups()
            self.assertNotIn(name, samples)
            samples[name] = float(value)
        self.assertEqual(samples['trunnion_up{machine="panel_test"}'], 1)
        self.assertEqual(samples['trunnion_state{machine="panel_test",state="idle"}'], 1)
        self.assertEqual(samples['trunnion_state{machine="panel_test",state="running"}'], 0)
        self.assertGreater(samples['trunnion_ticks_total{machine="panel_test"}'], 0)
        self.assertEqual(samples['trunnion_joint_position{machine="panel_test",joint="X"}'], 0)

    def test_the_plan_of_the_loaded_program(self):
        page = self.long_program()
        self.assertEqual(get(self.bench, "/api/v1/plan", key=None)[0].status, 401)
        ready = page.until(lambda m: m["type"] == "plan" and m["state"] == "ready")
        self.assertTrue(ready["program"].endswith("/programs/part.ngc"))

        def plan():
            body = get(self.bench, "/api/v1/plan")[1]
            self.assertEqual(body[:8], b"TRNPLAN2")
            size, = struct.unpack("<I", body[8:12])
            head = json.loads(body[12:12 + size])
            begin = (12 + size + 3) // 4 * 4
            return head, struct.unpack(f"<{head['count']}f", body[begin:begin + 4 * head["count"]])
        head, x = plan()
        self.assertAlmostEqual(head["time_s"], 100, delta=1)  # 100 mm at 60 mm/min
        self.assertAlmostEqual(max(x), 50, places=3)
        self.assertEqual(head["message"], "")
        # Another offset is another plan.
        self.assertEqual(page.ask(4, "mdi", text="G10 L2 P1 X-20")["outcome"], "accepted")
        page.until(lambda m: m["type"] == "plan" and m["state"] == "ready" and m["number"] > ready["number"])
        self.assertAlmostEqual(max(plan()[1]), 30, places=3)

    def test_the_plan_of_a_bad_program_goes_up_to_its_error(self):
        page = self.long_program()
        page.until(lambda m: m["type"] == "plan" and m["state"] == "ready")
        self.bench.write("programs/part.ngc", "G21 G90 G94\nG1 X5 F600\nG1 X9999\nM2\n")
        page.ask(5, "mdi", text="G4 P0.01")
        bad = page.until(lambda m: m["type"] == "plan" and m["state"] == "ready" and m["text"])
        self.assertIn("part.ngc:3", bad["text"])

    def test_the_text_of_programs(self):
        page = self.long_program()
        text = b"G21 G90 G94\nF60\nG1 X50\nG1 X0\nM2\n"
        for path in ("/api/v1/program", "/api/v1/programs/part.ngc"):
            answer, body = get(self.bench, path)
            self.assertEqual((answer.status, body), (200, text), path)
            self.assertEqual(get(self.bench, path, key=None)[0].status, 401)
        # It stays that of the program while a line is typed.
        self.assertEqual(page.ask(4, "mdi", text="G4 P0.01")["outcome"], "accepted")
        self.assertEqual(get(self.bench, "/api/v1/program")[1], text)
        self.bench.write("outside.ngc", "M2\n")
        for path in ("programs/none.ngc", "programs/../outside.ngc", "programs/%2e%2e/outside.ngc", "programs/",
                     "programs/" + self.bench.path("outside.ngc")):
            self.assertNotEqual(get(self.bench, "/api/v1/" + path)[0].status, 200, path)

    def test_lost_panel_leaves_the_program_alone(self):
        self.bench.write("programs/part.ngc", "G21 G90 G94\nF60\nG1 X50\nG1 X0\nM2\n")
        page = self.homed_page()
        self.assertEqual(page.ask(2, "load", text="part.ngc")["outcome"], "accepted")
        self.assertEqual(page.ask(3, "start")["outcome"], "accepted")
        page.state("running")
        self.bench.panel.send_signal(signal.SIGKILL)
        self.bench.panel.wait()
        out = subprocess.run([BINARY, "status", "--json", "--machine", self.bench.config], capture_output=True,
                             text=True, timeout=60, check=True, env=self.bench.environment).stdout
        self.assertEqual(json.loads(out)["state"], "running")

    def test_alarms_are_told_and_acknowledged(self):
        page = self.page_at_rest()
        self.assertEqual(page.until(lambda m: m["type"] == "alarms")["alarms"], [])
        page.ask(1, "estop")
        alarm, = page.until(lambda m: m["type"] == "alarms" and m["alarms"])["alarms"]
        self.assertEqual((alarm["name"], alarm["active"], alarm["acknowledged"]), ("emergency_stop", True, False))
        self.assertIn("estop, by ", alarm["cause"])
        self.assertLess(abs(alarm["since_us"] / 1e6 - time.time()), 60)
        state = json.loads(get(self.bench, "/api/v1/state")[1])
        self.assertEqual(state["alarms"]["alarms"], [alarm])
        self.assertEqual(page.ask(2, "acknowledge", value=alarm["number"])["outcome"], "refused")  # it only looks
        page.take_controls()
        self.assertEqual(page.ask(3, "acknowledge", value=alarm["number"] + 1)["outcome"], "refused")
        self.assertEqual(page.ask(4, "acknowledge", value=alarm["number"])["outcome"], "accepted")
        seen, = page.until(lambda m: m["type"] == "alarms" and m["alarms"][0]["acknowledged"])["alarms"]
        self.assertEqual(seen, alarm | {"acknowledged": True})
        self.assertEqual(page.ask(5, "reset")["outcome"], "accepted")
        page.until(lambda m: m["type"] == "alarms" and not m["alarms"])

    def test_garbage(self):
        page = self.page_at_rest()
        for text in ("{", '{"type":"command","id":1,"verb":"fly"}', '[]'):
            page.send(text)
        page.until_closed()
        self.page_at_rest()


class KeyFile(PanelTest):
    KEY = "0123456789abcdef" * 2

    def refusal(self, path):
        done = subprocess.run([BINARY, "panel", "--machine", self.bench.config, "--listen", "127.0.0.1:0", "--key-file",
                               path], capture_output=True, text=True, timeout=60, env=self.bench.environment)
        self.assertNotEqual(done.returncode, 0)
        self.assertNotIn("http", done.stdout)
        return done.stderr

    def test_a_key_of_a_file_opens_and_is_not_printed(self):
        line = self.bench.start_panel("--key-file", self.bench.write("key", self.KEY + "\n", 0o600))
        self.assertNotIn(self.KEY, line)
        self.assertIsNone(self.bench.key)
        self.assertEqual(get(self.bench, "/api/v1/machine", key=self.KEY)[0].status, 200)
        self.assertEqual(get(self.bench, "/api/v1/machine", key=self.KEY[::-1])[0].status, 401)

    def test_a_file_that_is_no_secret_is_refused(self):
        for mode in (0o640, 0o604, 0o620, 0o644):
            self.assertIn("chmod 600", self.refusal(self.bench.write(f"key{mode}", self.KEY, mode)))
        key = self.bench.write("key", self.KEY, 0o600)
        os.symlink(key, self.bench.path("link"))
        self.assertIn("is a link", self.refusal(self.bench.path("link")))
        self.assertIn("No such file", self.refusal(self.bench.path("none")))

    def test_a_file_without_a_key_is_refused(self):
        for text in ("", "\n", self.KEY[:-1], "g" * 32, "0" * 129, f"\n{self.KEY}"):
            self.assertIn("is no key", self.refusal(self.bench.write("short", text, 0o600)))


class EveryStart(PanelTest):
    def test_has_a_new_key(self):
        keys = set()
        for _ in range(3):
            self.bench.start_panel()
            keys.add(self.bench.key)
            self.bench.panel.terminate()
            self.bench.panel.wait()
            self.bench.panel.stdout.close()
        self.assertEqual(len(keys), 3)


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
