#!/usr/bin/env python3
"""The described interface is the one that is spoken: the files made of it are up to date, and every message and
answer of a real panel before a real daemon is as openapi.json says.

usage: interface_test.py TRUNNION_BINARY SOURCE_DIR
"""
import json
import os
import subprocess
import sys
import unittest

import jsonschema

from page_client import Page, get
from panel_bench import PanelBench

BINARY, SOURCE = "", ""
DRAWING = '\n[[drawing]]\npart = "base"\nstl = "bed.stl"\n'
PROGRAM = "G21 G90 G94\nF600\nG1 X5\nG1 X0\nM2\n"


class Interface(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(os.path.join(SOURCE, "panel/interface/openapi.json"), encoding="utf-8") as file:
            cls.described = json.load(file)

    def check(self, value, name):
        """As this type of the description."""
        kind = {"$ref": f"#/components/schemas/{name}"} if isinstance(name, str) else name
        jsonschema.Draft202012Validator(self.described | kind).validate(value)

    def refused(self, value, name):
        with self.assertRaises(jsonschema.ValidationError, msg=value):
            self.check(value, name)

    def test_the_made_files_are_up_to_date(self):
        done = subprocess.run([sys.executable, os.path.join(SOURCE, "panel/interface/make_interface.py"), "--check"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_the_description_refuses_what_is_none(self):
        self.check({"type": "alive"}, "PageMessage")
        self.refused({"type": "alive", "more": 1}, "PageMessage")
        self.refused({"type": "command", "id": 1, "verb": "fly"}, "PageMessage")
        self.refused({"type": "hold_when_lost"}, "PageMessage")
        self.refused({"type": "gone"}, "ServerMessage")


class Spoken(Interface):
    def setUp(self):
        self.bench = PanelBench(BINARY, SOURCE, extra=DRAWING)
        self.addCleanup(self.bench.close)
        self.bench.write("programs/part.ngc", PROGRAM)
        self.bench.write("bed.stl", "solid bed\nendsolid bed\n")
        self.bench.start_panel()
        self.heard = {}

    def open(self):
        page = Page(self.bench)
        self.addCleanup(page.close)
        page.next = self.checking(page.next, "ServerMessage")
        page.send = self.sending(page.send)
        return page

    def checking(self, following, kind):
        def checked():
            message = following()
            if message is not None:
                self.heard[message["type"]] = self.heard.get(message["type"], 0) + 1
                self.check(message, kind)
            return message
        return checked

    def sending(self, send):
        def checked(message):
            if isinstance(message, dict):
                self.check(message, "PageMessage")
            send(message)
        return checked

    def work(self, page, other):
        """All kinds of messages both ways."""
        page.state("idle")
        page.take_controls()
        page.send({"type": "hold_when_lost", "on": False})
        self.assertEqual(page.ask("home", "home", joint=-1)["outcome"], "accepted")
        page.state("homing")
        page.state("idle")
        jogged = page.ask(2, "jog", joint=0, value=1.0, speed_share=0.1, press=1)
        self.assertEqual(jogged["outcome"], "accepted")
        page.send({"type": "alive"})
        page.until(lambda m: m["type"] == "status" and m["count"] >= jogged["status_count"] and m["state"] == "idle")
        self.assertEqual(page.ask(3, "load", text="part.ngc")["outcome"], "accepted")
        page.until(lambda m: m["type"] == "plan" and m["state"] == "ready")
        other.send({"type": "take_controls"})
        page.until(lambda m: m["type"] == "controls" and m["asker"])
        page.send({"type": "keep_controls"})
        page.send({"type": "scope", "id": "list", "signals": []})
        names = [one["name"] for one in page.until(lambda m: m["type"] == "scope_signals")["signals"]]
        page.send({"type": "scope", "id": 9, "signals": names[:16], "from": -50, "rows": 50})
        data = page.until(lambda m: m["type"] == "scope_data" and m["id"] == 9)
        self.assertEqual((len(data["periods"]), len(data["values"])), (50, 16))
        self.assertEqual({len(column) for column in data["values"]}, {50})
        page.send({"type": "scope", "id": 10, "signals": ["nothing"]})
        self.assertIn("no signal 'nothing'", page.until(lambda m: m["type"] == "scope_data" and m["id"] == 10)["text"])
        page.send("[]")
        page.until(lambda m: m["type"] == "error")
        page.ask(4, "estop")
        page.until(lambda m: m["type"] == "alarms" and m["alarms"])

    def test_every_message_is_as_described(self):
        page, other = self.open(), self.open()
        self.work(page, other)
        self.answers()
        self.bench.daemon.kill()
        self.bench.daemon.wait()
        page.until(lambda m: m["type"] == "gone")
        told = {"hello", "status", "motion", "tables", "alarms", "message", "controls", "plan", "answer", "error",
                "gone", "fleet", "scope_signals", "scope_data"}
        self.assertEqual(set(self.heard), told)

    def answers(self):
        """Those of GET."""
        paths = self.described["paths"]
        asked = 0
        for path, request in paths.items():
            if "get" not in request:
                continue
            name = "0" if "drawings" in path else "part.ngc"
            answer, body = get(self.bench, path.replace("{name}", name))
            self.assertEqual(answer.status, 200, path)
            (kind, described), = request["get"]["responses"]["200"]["content"].items()
            self.assertEqual(answer.getheader("content-type").split(";")[0], kind, path)
            if kind == "application/json":
                self.check(json.loads(body), described["schema"])
            asked += 1
        self.assertEqual(asked, len(paths) - 2)  # those that log in and out
        head = get(self.bench, "/api/v1/plan")[1]
        self.check(json.loads(head[12:12 + int.from_bytes(head[8:12], "little")]), "PlanHead")


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
