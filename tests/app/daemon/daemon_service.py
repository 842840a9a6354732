#!/usr/bin/python3
"""The daemon under a service manager: this script plays systemd's part (sd_notify(3)).

usage: daemon_service.py TRUNNION SOURCE_DIR

Starts itself again in a network of its own (LCM); exit code 77 (skipped) where the kernel does not allow that.
"""
import ctypes
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
from own_network import enter_own_network  # noqa: E402

WATCHDOG_S = 0.6
PTRACE_SEIZE, PTRACE_INTERRUPT, PTRACE_DETACH = 0x4206, 0x4207, 17


class Service(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        text = (SOURCE / "configs/mill.toml").read_text().replace('name = "mill"', f'name = "service{os.getpid()}"')
        config = pathlib.Path(self.folder.name, "machine.toml")
        config.write_text(text + "\n[realtime]\nlate_periods_max = 0\n", encoding="utf-8")
        path = os.path.join(self.folder.name, "notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(path)
        self.addCleanup(self.socket.close)
        environment = dict(os.environ, NOTIFY_SOCKET=path, WATCHDOG_USEC=str(int(WATCHDOG_S * 1e6)))
        self.daemon = subprocess.Popen([BINARY, "daemon", "--machine", config], env=environment,
                                       stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        self.addCleanup(self.daemon.wait)
        self.addCleanup(self.daemon.kill)

    def hear(self, seconds):
        """(time, message) of everything the daemon says in this time."""
        said, end = [], time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                said.append((time.monotonic(), self.socket.recv(4096).decode()))
            except TimeoutError:
                break
        return said

    def await_message(self, text, seconds=30):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if any(text in message for _, message in self.hear(0.1)):
                return
        self.fail(f"no {text}")

    def tick_thread(self):
        for task in pathlib.Path(f"/proc/{self.daemon.pid}/task").iterdir():
            if (task / "comm").read_text().strip() == "tick":
                return int(task.name)
        self.fail("no thread is called tick")

    def test_ready_then_alive_then_stopping(self):
        self.await_message("READY=1")
        alive = [at for at, message in self.hear(4) if "WATCHDOG=1" in message]
        self.assertGreater(len(alive), 4 / WATCHDOG_S)
        self.daemon.send_signal(signal.SIGTERM)
        self.await_message("STOPPING=1")
        self.assertEqual(self.daemon.wait(20), 0)

    def test_a_dead_tick_is_not_alive(self):
        self.await_message("READY=1")
        libc = ctypes.CDLL(None, use_errno=True)
        tick = self.tick_thread()
        if libc.ptrace(PTRACE_SEIZE, tick, None, None) != 0:
            self.skipTest("no other thread may be held here")
        self.assertEqual(libc.ptrace(PTRACE_INTERRUPT, tick, None, None), 0)
        self.hear(WATCHDOG_S)  # what was on its way
        said = self.hear(3 * WATCHDOG_S)
        libc.ptrace(PTRACE_DETACH, tick, None, None)
        self.assertEqual([message for _, message in said if "WATCHDOG" in message], [],
                         "alive, though the tick stands; the service manager would wait for ever")
        self.await_message("WATCHDOG=1")

    def test_the_units_are_sound(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("systemd-analyze is not here")
        text = (SOURCE / "packaging/trunnion@.service").read_text()
        self.assertIn("Type=notify", text)
        self.assertIn("WatchdogSec=", text)
        self.check_unit("trunnion@.service")
        self.check_unit("trunnion@.service", "serial.conf", threshold=30)  # devices
        self.check_unit("trunnion-gateway@.service")
        self.check_unit("trunnion-mqtt@.service")
        self.check_unit("trunnion-mqtt@.service", "mqtt-broker.conf")
        self.check_unit("trunnion-panel@.service")
        self.check_unit("trunnion-panel@.service", "panel-network.conf")

    def test_a_file_that_root_keeps_is_readable_to_the_service(self):
        """Its user is made up at each start: what root writes into its state folder later stays root's."""
        for name in ("mqtt-broker.conf", "panel-network.conf"):
            text = (SOURCE / "packaging" / name).read_text()
            comment = "\n".join(line for line in text.splitlines() if line.startswith("#"))
            self.assertNotIn("/var/lib/", comment, name)
            loaded = set(re.findall(r"^LoadCredential=([\w.]+):/etc/trunnion/", text, re.M))
            used = set(re.findall(r"CREDENTIALS_DIRECTORY\}?/([\w.]+)", text))
            self.assertEqual(loaded, used, name)
            made = set(re.findall(r'>"\$(\w+_DIRECTORY/\w+)"', text))
            for place in re.findall(r"--(?:users|password-file) \$\{(\w+)\}/(\w+)", text):
                self.assertIn("/".join(place), made, name)

    def check_unit(self, name, drop_in=None, threshold=20):
        """The unit alone, or as it is with a drop-in behind it."""
        unit = pathlib.Path(self.folder.name, name)
        text = (SOURCE / "packaging" / name).read_text()
        if drop_in:
            text += (SOURCE / "packaging" / drop_in).read_text()
        unit.write_text(text.replace("/usr/bin/trunnion", os.path.abspath(BINARY)))
        done = subprocess.run(["systemd-analyze", "verify", "--man=no", unit], capture_output=True, text=True,
                              check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        exposure = subprocess.run(["systemd-analyze", "security", "--offline=true",
                                   f"--threshold={threshold}", unit],
                                  capture_output=True, text=True, check=False)  # in tenths
        self.assertEqual(exposure.returncode, 0, exposure.stdout[-300:])


if __name__ == "__main__":
    BINARY, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
    enter_own_network()
    unittest.main(argv=sys.argv[:1])
