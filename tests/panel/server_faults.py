#!/usr/bin/env python3
"""What goes wrong around a page that moves a real daemon's machine: the panel dies or hangs, the network is cut, the
daemon starts again, and others send what is no message. Nothing moves that should not.

usage: server_faults.py TRUNNION_BINARY SOURCE_DIR
"""
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import time
import unittest

from cut_line import CutLine
from page_client import Page, get
from panel_bench import PanelBench

BINARY, SOURCE = "", ""
STAND_S = 3  # by then a move by hand has ended


class Faults(unittest.TestCase):
    def setUp(self):
        self.presses = 0
        self.bench = PanelBench(BINARY, SOURCE)
        self.addCleanup(self.bench.close)
        self.bench.start_panel()
        self.page = self.open()
        self.page.state("idle")
        self.page.take_controls()
        self.assertEqual(self.page.ask("home", "home", joint=-1)["outcome"], "accepted")
        self.page.state("homing")
        self.page.state("idle")

    def open(self, **values):
        page = Page(self.bench, **values)
        self.addCleanup(page.close)
        return page

    def line(self, verb, *options):
        """What a client of the daemon prints, which knows nothing of the panel."""
        done = subprocess.run([BINARY, verb, *options, "--machine", self.bench.config], capture_output=True, text=True,
                              timeout=60, env=self.bench.environment, check=True)
        return done.stdout

    def x(self):
        """Where joint X is told to be."""
        while True:  # the first line may be a status
            lines = self.line("monitor", "--json", "--count", "8").splitlines()
            for text in lines:
                message = json.loads(text)
                if "q_setpoint" in message:
                    return message["q_setpoint"][0]

    def daemon_state(self):
        return json.loads(self.line("status", "--json"))["state"]

    def hold_button(self, page):
        """Holds a button of X, 10 mm/s, until it has moved by 1 mm; on a busy host the dead man may let go before."""
        begin, deadline, pressed_at = self.x(), time.monotonic() + 60, None
        while True:
            self.assertLess(time.monotonic(), deadline, "it does not move")
            if pressed_at is None:
                self.presses += 1
                answer = page.ask(5, "jog", text="X", value=1, speed=10, alive_ms=250, press=self.presses)
                self.assertEqual(answer["outcome"], "accepted")
                pressed_at = answer["status_count"]
            page.send({"type": "alive"})
            message = page.next()
            if message["type"] == "motion" and message["q_setpoint"][0] > begin + 1:
                return
            if message["type"] == "status" and message["state"] == "idle" and message["count"] > pressed_at:
                pressed_at = None

    def assert_stands(self, before=STAND_S):
        """The machine is at rest soon, and stays where it is."""
        deadline = time.monotonic() + before
        while self.daemon_state() != "idle":
            self.assertLess(time.monotonic(), deadline, "it moves on")
        place = self.x()
        self.assertGreater(place, 1)  # it did move
        time.sleep(0.5)
        self.assertAlmostEqual(self.x(), place, places=9)
        return place


class Panel(Faults):
    def test_killed_while_a_button_is_held(self):
        self.hold_button(self.page)
        self.bench.panel.kill()
        self.assert_stands()

    def test_hangs_while_a_button_is_held(self):
        self.hold_button(self.page)
        self.bench.panel.send_signal(signal.SIGSTOP)
        place = self.assert_stands()
        # What pages said meanwhile moves nothing when the panel goes on, in whatever order it finds that.
        for _ in range(20):
            self.page.send({"type": "alive"})
        self.page.send({"type": "command", "id": 8, "verb": "jog", "text": "X", "value": 1, "speed": 10,
                        "alive_ms": 250, "press": 1000})
        self.page.send({"type": "command", "id": 9, "verb": "home", "joint": -1})
        self.page.send({"type": "alive"})
        self.bench.panel.send_signal(signal.SIGCONT)
        for number in (8, 9):
            answer = self.page.until(lambda m, id=number: m["type"] == "answer" and m["id"] == id)
            self.assertEqual(answer["outcome"], "refused")
            self.assertIn("may be old", answer["text"])
        time.sleep(1)
        self.assertAlmostEqual(self.x(), place, places=9)
        # Then it is obeyed as before.
        self.hold_button(self.page)


class Cut(Faults):
    def setUp(self):
        super().setUp()
        self.wire = CutLine(self.bench.port)
        self.addCleanup(self.wire.close)
        self.bench.origin = f"http://127.0.0.1:{self.wire.port}"
        self.far = self.open()
        self.far.state("idle")
        self.far.take_controls(giver=self.page)

    def test_network_while_a_button_is_held(self):
        self.hold_button(self.far)
        self.wire.cut()
        for _ in range(5):
            self.far.send({"type": "alive"})
        self.assert_stands()

    def test_network_while_a_program_runs_that_shall_hold(self):
        self.bench.write("programs/part.ngc", "G21 G90 G94\nF60\nG1 X50\nG1 X0\nM2\n")
        self.far.send({"type": "hold_when_lost", "on": True})
        self.assertEqual(self.far.ask(2, "load", text="part.ngc")["outcome"], "accepted")
        self.assertEqual(self.far.ask(3, "start")["outcome"], "accepted")
        self.far.state("running")
        self.wire.cut()
        deadline = time.monotonic() + 10
        while self.daemon_state() != "holding":
            self.assertLess(time.monotonic(), deadline, "the program goes on")

    def test_who_comes_back_begins_nothing(self):
        self.hold_button(self.far)
        self.wire.cut()
        place = self.assert_stands()
        self.wire.mend()
        again = self.open()
        again.state("idle")
        for _ in range(20):
            again.send({"type": "alive"})
        time.sleep(0.5)
        self.assertAlmostEqual(self.x(), place, places=9)
        again.send({"type": "command", "id": 9, "verb": "jog", "text": "X", "value": 1, "speed": 10, "press": 1})
        self.assertEqual(again.until(lambda m: m["type"] == "answer")["outcome"], "refused")


class Restart(Faults):
    def new_daemon(self):
        """Its first status at rest."""
        return self.page.until(lambda m: m["type"] == "status" and m["state"] == "idle" and
                               m["pid"] == self.bench.daemon.pid)

    def test_of_the_daemon_while_a_button_is_held(self):
        self.hold_button(self.page)
        self.bench.daemon.kill()
        self.bench.daemon.wait()
        self.page.until(lambda m: m["type"] == "gone")
        self.bench.start_daemon()
        self.new_daemon()
        place = self.x()
        for _ in range(20):
            self.page.send({"type": "alive"})
            time.sleep(0.02)
        self.assertEqual(self.x(), place)
        answer = self.page.ask(7, "start")
        self.assertNotEqual(answer["outcome"], "accepted")

    def test_what_was_heard_last_does_not_come_behind_the_end(self):
        """A page takes a status for the daemon's return."""
        pages = [self.page] + [self.open() for _ in range(8)]
        for page in pages:
            page.state("idle")
        self.bench.daemon.kill()
        self.bench.daemon.wait()
        for page in pages:
            page.until(lambda m: m["type"] == "gone")
        late = self.open()
        late.until(lambda m: m["type"] == "gone")
        for page in [*pages, late]:
            page.send({"type": "take_controls"})  # whose answer is behind all that waited
            page.until(lambda m: self.assertNotIn(m["type"], ("status", "motion")) or m["type"] == "controls")
            page.ask("home", "home", joint=-1)

    def test_commands_while_there_is_no_daemon_are_not_kept(self):
        self.bench.daemon.kill()
        self.bench.daemon.wait()
        self.page.until(lambda m: m["type"] == "gone")
        for verb in ("home", "start"):
            self.assertEqual(self.page.ask(verb, verb, joint=-1)["outcome"], "unreachable")
        self.bench.start_daemon()
        self.new_daemon()
        time.sleep(1)
        self.assertEqual(self.daemon_state(), "idle")


def frame(data, code=1, masked=True, final=True, size=None):
    """A frame of a WebSocket as RFC 6455 has it, or not."""
    size = len(data) if size is None else size
    head = bytes([(0x80 if final else 0) | code])
    mark = 0x80 if masked else 0
    if size < 126:
        head += bytes([mark | size])
    elif size < 65536:
        head += struct.pack(">BH", mark | 126, size)
    else:
        head += struct.pack(">BQ", mark | 127, size)
    return head + (b"\0\0\0\0" if masked else b"") + data


class Hostile(Faults):
    def frames(self):
        """Raw frames, each of which its connection may not survive."""
        yield frame(b"{" * 70000)
        yield frame(b"x", size=1 << 40)
        yield frame(b"\xff\xfe\x00", code=2)
        yield frame(b"\xff\xff\xff")
        yield frame(b"{", masked=False)
        yield frame(b"{", final=False) + frame(b"}", code=1, final=False) * 3
        yield frame(b"a" * 200, code=9)
        yield frame(b"", code=15)
        yield frame(b"[" * 60000)
        yield os.urandom(5000)
        yield b"GET / HTTP/1.1\r\n\r\n" * 100

    def test_frames_that_are_none_move_and_stop_nothing(self):
        answer = self.page.ask(5, "jog", text="X", value=1, speed=2, alive_ms=1000, press=1)
        self.assertEqual(answer["outcome"], "accepted")
        for data in self.frames():
            other = self.open()
            try:
                other.socket.sendall(data)
            except OSError:
                pass
            self.page.send({"type": "alive"})
            self.page.next()
        self.assertEqual(self.daemon_state(), "jogging")
        self.assertIsNone(self.bench.panel.poll())
        self.assertEqual(self.page.ask(6, "jog", text="X", value=0)["outcome"], "accepted")
        self.page.state("idle")

    def test_heads_that_are_none_stop_nothing(self):
        for head in (b"GET " + b"/" * 100000 + b" HTTP/1.1\r\n", b"\0" * 10000,
                     b"POST /api/v1/programs/a.ngc HTTP/1.1\r\nContent-Length: -5\r\n\r\n",
                     b"GET / HTTP/9.9\r\n" + b"A: b\r\n" * 10000,
                     b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n"):
            with socket.create_connection(("127.0.0.1", self.bench.port), timeout=5) as line:
                try:
                    line.sendall(head)
                    line.recv(1000)
                except OSError:
                    pass
        self.assertEqual(get(self.bench, "/api/v1/state")[0].status, 200)

    def test_many_who_say_nothing_shut_out_nobody_that_is_in(self):
        lines = []
        for _ in range(300):
            try:
                lines.append(socket.create_connection(("127.0.0.1", self.bench.port), timeout=5))
            except OSError:
                break
        self.addCleanup(lambda: [line.close() for line in lines])
        self.assertEqual(self.page.ask(8, "estop")["outcome"], "accepted")
        self.page.state("estop")


if __name__ == "__main__":
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
