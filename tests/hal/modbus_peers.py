#!/usr/bin/python3
"""trunnion modbus against pymodbus as the server, over TCP and over a serial line (a pair of pseudo-terminals).

usage: modbus_peers.py TRUNNION
"""
import json
import os
import pty
import socket
import subprocess
import sys
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


def relay(one, other):
    while True:
        try:
            os.write(other, os.read(one, 256))
        except OSError:
            return


def serial_pair():
    """Names of two terminals that are joined."""
    ends = [pty.openpty() for _ in range(2)]
    for _, slave in ends:
        tty.setraw(slave)
    for a, b in ((0, 1), (1, 0)):
        threading.Thread(target=relay, args=(ends[a][0], ends[b][0]), daemon=True).start()
    return [os.ttyname(slave) for _, slave in ends]


def trunnion(*arguments):
    done = subprocess.run([BINARY, "modbus", *arguments], capture_output=True, text=True, timeout=60, check=False)
    return done.returncode, done.stdout, done.stderr


class Peers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        port = free_port()
        here, there = serial_pair()
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

    def test_bad_address_says_what_is_legal(self):
        code, _, err = trunnion("read", "udp:1.2.3.4")
        self.assertEqual(code, 4)
        self.assertIn("legal: tcp:HOST[:PORT]", err)


if __name__ == "__main__":
    unittest.main()
