#!/usr/bin/env python3
"""The clients in examples/clients as a stranger builds and runs them, against a daemon.

usage: example_clients.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Starts itself again in a network of its own; exit code 77 (skipped) where the kernel does not allow that.
"""
import glob
import os
import re
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../../support")]
import daemon_e2e  # noqa: E402
from daemon_e2e import Bench  # noqa: E402
from own_network import enter_own_network  # noqa: E402

BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
EXAMPLES = os.path.join(SOURCE, "examples/clients")
TYPES = glob.glob(os.path.join(SOURCE, "hal/lcm/*.lcm"))  # installed in share/trunnion/lcm


class ExampleClients(unittest.TestCase):
    def watch(self, bench, command):
        """The lamp's colours while the machine is made to stop."""
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:
            try:
                self.assertEqual(client.stdout.readline(), "yellow\n")
                bench.client("estop")
                colours = [client.stdout.readline() for _ in range(20)]
            finally:
                client.terminate()
        self.assertEqual(colours[-1], "red\n", colours)
        self.assertEqual(colours, sorted(colours, reverse=True), "yellow first, then red")

    def test_python(self):
        with tempfile.TemporaryDirectory() as folder, Bench(machine="mill") as bench:
            bench.start_daemon()
            subprocess.run(["lcm-gen", "--python", "--ppath", folder, *TYPES], check=True)
            socket = re.search(r" socket (\S+)", bench.log_text()).group(1)
            os.environ["PYTHONPATH"] = folder
            self.watch(bench, [sys.executable, os.path.join(EXAMPLES, "lamp.py"), socket])

    def test_cpp(self):
        with tempfile.TemporaryDirectory() as folder, Bench(machine="mill") as bench:
            bench.start_daemon()
            subprocess.run(["lcm-gen", "--cpp", "--cpp-hpath", folder, *TYPES], check=True)
            lamp = os.path.join(folder, "lamp")
            subprocess.run(["g++", "-std=c++17", "-O0", "-I", folder, os.path.join(EXAMPLES, "lamp.cc"), "-o", lamp,
                            "-llcm"], check=True)
            self.watch(bench, [lamp, bench.name])


if __name__ == "__main__":
    enter_own_network()
    daemon_e2e.BINARY, daemon_e2e.SOURCE = BINARY, SOURCE
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
