#!/usr/bin/python3
"""trunnion modbus against pymodbus as the server, over TCP and over a serial line (a pair of pseudo-terminals).

usage: modbus_peers.py TRUNNION
"""
import json
import os
import pty
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import tty
import unittest

try:
    from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
    from pymodbus.server.async_io import StartSerialServer, StartTcpServer
    from pymodbus.transaction import ModbusRtuFramer
except ImportError:
    print("skipped: pymodbus is not here")
    sys.exit(77)

BINARY = sys.argv.pop(1)


def device():
    block = ModbusSequentialDataBlock(1, list(range(100, 200)))
    bits = ModbusSequentialDataBlock(1, [True, False] * 20)
    return ModbusServerContext(slaves={3: ModbusSlaveContext(di=bits, co=bits, hr=block, ir=block)}, single=False)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Wire:
    """Two terminals that are joined, and what went over: bytes of one direction without a pause are a frame."""
    PAUSE_S = 0.05

    def __init__(self):
        ends = [pty.openpty() for _ in range(2)]
        for _, slave in ends:
            tty.setraw(slave)
        self.names = [os.ttyname(slave) for _, slave in ends]
        self.lock, self.frames, self.last = threading.Lock(), [], (None, 0.0)
        for a, b in ((0, 1), (1, 0)):
            threading.Thread(target=self.relay, args=(ends[a][0], ends[b][0]), daemon=True).start()

    def relay(self, one, other):
        while True:
            try:
                chunk = os.read(one, 256)
                self.record(one, chunk)
                os.write(other, chunk)
            except OSError:
                return

    def record(self, direction, chunk):
        with self.lock:
            before, at = self.last
            now = time.monotonic()
            if before == direction and now - at < self.PAUSE_S:
                self.frames[-1] += chunk
            else:
                self.frames.append(chunk)
            self.last = (direction, now)

    def save(self, path):
        """As a capture file of link type USER0."""
        with open(path, "wb") as file, self.lock:
            file.write(struct.pack("<IHHiIII", 0xa1b2c3d4, 2, 4, 0, 0, 65535, 147))
            for number, frame in enumerate(self.frames):
                file.write(struct.pack("<IIII", number, 0, len(frame), len(frame)) + frame)


def trunnion(*arguments):
    done = subprocess.run([BINARY, "modbus", *arguments], capture_output=True, text=True, timeout=60, check=False)
    return done.returncode, done.stdout, done.stderr


class Peers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        port = free_port()
        cls.wire = Wire()
        here, there = cls.wire.names
        # no parity: a pseudo-terminal has none
        threading.Thread(target=StartTcpServer, kwargs={"context": device(), "address": ("127.0.0.1", port)},
                         daemon=True).start()
        threading.Thread(target=StartSerialServer, daemon=True, kwargs={
            "context": device(), "port": there, "framer": ModbusRtuFramer, "baudrate": 19200,
            "ignore_missing_slaves": True}).start()
        cls.addresses = [f"tcp:127.0.0.1:{port}", f"rtu:{here}:19200:N"]
        for _ in range(100):
            if trunnion("read", cls.addresses[0], "--unit", "3")[0] == 0:
                break
            time.sleep(0.1)

    def test_reads_every_table(self):
        for address in self.addresses:
            for table, wanted in (("holding", [104, 105]), ("input", [104, 105]), ("coil", [1, 0]),
                                  ("discrete", [1, 0])):
                code, out, err = trunnion("read", address, "--unit", "3", "--table", table, "--first", "4", "--count",
                                          "2", "--json")
                self.assertEqual((code, err), (0, ""))
                self.assertEqual(json.loads(out), wanted)

    def test_writes_what_it_reads_back(self):
        for address in self.addresses:
            self.assertEqual(trunnion("write", address, "--unit", "3", "--first", "20", "7", "65535")[0], 0)
            _, out, _ = trunnion("read", address, "--unit", "3", "--first", "19", "--count", "4", "--json")
            self.assertEqual(json.loads(out), [119, 7, 65535, 122])

    def test_refusal_and_silence_are_told_apart(self):
        code, _, err = trunnion("read", self.addresses[0], "--unit", "3", "--first", "5000")
        self.assertEqual(code, 4)
        self.assertIn("Illegal data address", err)
        code, _, err = trunnion("read", self.addresses[1], "--unit", "9", "--timeout", "0.2")
        self.assertEqual(code, 4)
        self.assertIn("timed out", err)

    def test_scan_finds_the_unit(self):
        code, out, _ = trunnion("scan", self.addresses[1], "--last", "5", "--timeout", "0.2", "--json")
        self.assertEqual((code, json.loads(out)), (0, [3]))

    def test_what_went_over_the_serial_line_is_sound_to_tshark(self):
        if not shutil.which("tshark"):
            self.skipTest("tshark is not here")
        for table in ("holding", "input", "coil", "discrete"):
            trunnion("read", self.addresses[1], "--unit", "3", "--table", table, "--first", "0", "--count", "7")
        trunnion("write", self.addresses[1], "--unit", "3", "--first", "30", "1", "2", "3")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "wire.pcap")
            self.wire.save(path)
            done = subprocess.run(["tshark", "-r", path, "-o", 'uat:user_dlts:"User 0 (DLT=147)","mbrtu","0","","0",""',
                                   "-o", "mbrtu.crc_verification:TRUE", "-T", "fields", "-e", "frame.protocols", "-e",
                                   "modbus.func_code", "-e", "_ws.malformed", "-e", "mbrtu.crc16.status"],
                                  capture_output=True, text=True, check=False)
        rows = [line.split("\t") for line in done.stdout.splitlines()]
        print(f"tshark: {len(rows)} Modbus RTU frames")
        self.assertGreaterEqual(len(rows), 10, done.stderr)
        self.assertEqual([row for row in rows if "modbus" not in row[0] or row[2] or row[3] != "1"], [])

    def test_bad_address_says_what_is_legal(self):
        code, _, err = trunnion("read", "udp:1.2.3.4")
        self.assertEqual(code, 4)
        self.assertIn("legal: tcp:HOST[:PORT]", err)


if __name__ == "__main__":
    unittest.main()
