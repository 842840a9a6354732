#!/usr/bin/python3
"""The daemon with a cabinet on Modbus: emulated devices of trunnion-drives, and pymodbus as a client of the same.

usage: modbus_daemon.py TRUNNION SOURCE_DIR

Starts itself again in a network of its own (LCM); exit code 77 (skipped) where the kernel does not allow that, or
without pymodbus.
"""
import collections
import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../support"))
from own_network import enter_own_network  # noqa: E402

try:
    from pymodbus.client import ModbusTcpClient
except ImportError:
    print("skipped: pymodbus is not here")
    sys.exit(77)

PROGRAM = """G21 G90 G94
M3 S12000
M64 P0
M66 P0 L3 Q5
G1 X10 F3000
M8
G1 X0
M9
M65 P0
M5
M2
"""


def until(what, limit_s=20):
    end = time.time() + limit_s
    while time.time() < end:
        found = what()
        if found:
            return found
        time.sleep(0.05)
    raise AssertionError("waited in vain")


class Cabinet(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            cls.port = probe.getsockname()[1]
        cls.tty = os.path.join(cls.folder.name, "ttyModbus")
        text = (SOURCE / "configs/mill_modbus.toml").read_text()
        text = text.replace("127.0.0.1:1502", f"127.0.0.1:{cls.port}")
        text = text.replace("/dev/ttyUSB0:19200:E", f"{cls.tty}:19200:N")  # a pseudo-terminal has no parity
        text = text.replace('name = "mill_modbus"', f'name = "modbus{os.getpid()}"')
        cls.config = cls.write("machine.toml", text + "\n[realtime]\nlate_periods_max = 0\n")
        cls.start_field()
        cls.capture = os.path.join(cls.folder.name, "modbus.pcapng")
        cls.recorder = None
        if shutil.which("dumpcap"):
            cls.recorder = subprocess.Popen(["dumpcap", "-q", "-i", "lo", "-f", f"tcp port {cls.port}",
                                             "-w", cls.capture],
                                            stderr=subprocess.DEVNULL)
        cls.log = open(os.path.join(cls.folder.name, "daemon.log"), "w", encoding="utf-8")
        cls.daemon = subprocess.Popen([BINARY, "daemon", "--machine", cls.config], stderr=cls.log, stdout=cls.log)
        until(lambda: cls.status()["state"] == "idle")
        cls.client("home", "--wait")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.terminate()
        cls.daemon.wait(20)
        if cls.recorder and cls.recorder.poll() is None:
            cls.recorder.terminate()
            cls.recorder.wait(20)
        cls.field.terminate()
        cls.field.wait(20)
        cls.log.close()
        cls.folder.cleanup()

    @classmethod
    def write(cls, name, text):
        path = os.path.join(cls.folder.name, name)
        pathlib.Path(path).write_text(text, encoding="utf-8")
        return path

    @classmethod
    def start_field(cls):
        drives = pathlib.Path(BINARY).with_name("trunnion-drives")
        cls.field = subprocess.Popen([drives, "--machine", cls.config], stdout=subprocess.PIPE)
        cls.field.stdout.readline()
        time.sleep(0.2)

    @classmethod
    def client(cls, *arguments):
        return subprocess.run([BINARY, *arguments, "--machine", cls.config], capture_output=True, text=True, timeout=90,
                              check=False)

    @classmethod
    def status(cls):
        done = cls.client("status", "--json", "--timeout", "2")
        return json.loads(done.stdout) if done.returncode == 0 else {"state": "?"}

    def peer(self):
        client = ModbusTcpClient("127.0.0.1", port=self.port)
        self.assertTrue(client.connect())
        self.addCleanup(client.close)
        return client

    def mdi(self, text):
        done = self.client("mdi", text, "--wait")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_spindle_obeys_and_motion_waits_for_it(self):
        peer = self.peer()
        self.mdi("S6000 M3")
        self.assertEqual(peer.read_coils(0, 2, slave=1).bits[:2], [True, False])
        self.assertEqual(peer.read_holding_registers(0, 1, slave=1).registers, [6000])
        actual = peer.read_input_registers(0, 1, slave=1).registers[0]
        self.assertLess(abs(actual - 6000), 51)
        self.mdi("S3000 M4")
        self.assertEqual(peer.read_coils(0, 2, slave=1).bits[:2], [True, True])
        self.assertEqual(peer.read_holding_registers(0, 1, slave=1).registers, [3000])
        self.mdi("M5")
        until(lambda: not peer.read_coils(0, 1, slave=1).bits[0])

    def test_program_with_inputs_and_outputs(self):
        path = self.write("part.ngc", PROGRAM)
        self.assertEqual(self.client("load", path).returncode, 0)
        done = self.client("start", "--wait")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(self.status()["state"], "idle")
        peer = self.peer()
        until(lambda: peer.read_coils(0, 2, slave=2).bits[:2] == [False, False])

    def test_screws_see_the_thermometer(self):
        def warning():
            return next(c for c in self.status()["corrections"] if c["name"] == "screw")["warning"]
        until(lambda: warning() == "")

    def test_our_server_refuses_as_the_standard_says(self):
        peer = self.peer()
        self.assertEqual(peer.read_input_registers(100, 1, slave=1).exception_code, 2)
        self.assertEqual(peer.read_coils(0, 1, slave=2).bits[0], False)
        self.assertEqual(peer.write_registers(50, [1, 2], slave=1).exception_code, 2)

    def test_every_frame_is_sound_to_tshark(self):
        if not self.recorder or not shutil.which("tshark"):
            self.skipTest("tshark is not here")
        self.mdi("S4000 M3")
        self.mdi("M5")
        time.sleep(1)
        # what was asked for and answered so far, at any order of tests
        done = subprocess.run(["tshark", "-r", self.capture, "-d", f"tcp.port=={self.port},mbtcp", "-T", "fields", "-e",
                               "frame.protocols", "-e", "modbus.func_code", "-e", "_ws.malformed", "-e",
                               "modbus.exception_code"], capture_output=True, text=True, check=False)
        rows = [line.split("\t") for line in done.stdout.splitlines()]
        frames = [row for row in rows if "modbus" in row[0]]
        functions = collections.Counter(code for row in frames for code in row[1].split(","))
        malformed = [row for row in rows if "malformed" in row[0] or row[2]]
        print(f"tshark: {len(frames)} Modbus frames, {len(malformed)} malformed, functions {dict(functions)}")
        self.assertGreater(len(frames), 100, done.stderr)
        self.assertEqual(malformed, [])
        for code in ("1", "2", "4", "5", "6"):  # coils, discrete inputs, input registers; a coil, a register
            self.assertIn(code, functions)

    def test_unplugged_cabinet_is_a_fault_that_reset_clears(self):
        self.field.kill()
        self.field.wait()
        status = until(lambda: (s := self.status())["state"] == "fault" and s)
        self.assertEqual(status["fault"], "device_lost")
        self.start_field()
        time.sleep(1)
        self.assertEqual(self.client("reset").returncode, 0)
        until(lambda: self.status()["state"] == "idle")


if __name__ == "__main__":
    BINARY, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
    enter_own_network()
    unittest.main(argv=sys.argv[:1])
