#!/usr/bin/env python3
"""Real daemon, real panel, and a page made of the standard library: key, REST, WebSocket, Host and Origin, controls.

usage: server_e2e.py TRUNNION_BINARY SOURCE_DIR
"""
import json
import os
import signal
import subprocess
import sys
import unittest

from page_client import Page, get
from panel_bench import PanelBench

BINARY, SOURCE = "", ""
NO_KEY = 4401
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
        self.assertEqual(page.closed, (NO_KEY, NO_KEY_TEXT))

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
        self.assertEqual(two.ask(1, "jog", joint=0, value=5, speed=1, press=2, part=0)["outcome"], "refused")
        # 60 s of jog; the page says nothing more, and the machine stands long before.
        self.assertEqual(one.ask(3, "jog", joint=0, value=60, speed=1, press=1, part=0)["outcome"], "accepted")
        begin = one.until(lambda m: m["type"] == "motion")["q_setpoint"][0]
        one.until(lambda m: m["type"] == "message" and m["kind"] == "dead_man")
        one.state("idle")
        end = one.until(lambda m: m["type"] == "motion")["q_setpoint"][0]
        self.assertLess(end - begin, 10)

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
