#!/usr/bin/env python3
"""The state of a real daemon over a real broker (mosquitto) with TLS and a log-in, heard by mosquitto's own client.

usage: mqtt_test.py TRUNNION_BINARY SOURCE_DIR

Exit code 77 (skipped) where there is no mosquitto.
"""
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest

from panel_bench import PanelBench

BINARY, SOURCE = "", ""
PATIENCE_S = 30
PASSWORD = "a broker's password"


def free_port():
    with socket.socket() as line:
        line.bind(("127.0.0.1", 0))
        return line.getsockname()[1]


class Broker(unittest.TestCase):
    def setUp(self):
        self.bench = PanelBench(BINARY, SOURCE)
        self.addCleanup(self.bench.close)
        self.bench.make_certificate()
        os.chmod(self.bench.path("tls.key"), 0o644)  # the broker is another user where root starts it
        os.chmod(self.bench.folder, 0o755)
        self.port = free_port()
        passwords = self.bench.write("passwords", "")
        subprocess.run(["mosquitto_passwd", "-b", passwords, "mill", PASSWORD], check=True, capture_output=True)
        os.chmod(passwords, 0o644)
        self.bench.write("mosquitto.conf", f"""
listener {self.port} 127.0.0.1
cafile {self.bench.path("tls.crt")}
certfile {self.bench.path("tls.crt")}
keyfile {self.bench.path("tls.key")}
allow_anonymous false
password_file {passwords}
""")
        self.bench.write("password", PASSWORD + "\n", 0o600)
        self.broker = self.publisher = None
        self.start_broker()
        self.addCleanup(lambda: self.end(self.broker))
        self.addCleanup(lambda: self.end(self.publisher))

    def end(self, process):
        if process and process.poll() is None:
            process.kill()
        if process:
            process.wait()
            for stream in (process.stdout, process.stderr):
                if stream:
                    stream.close()

    def start_broker(self):
        self.broker = subprocess.Popen(["mosquitto", "-c", self.bench.path("mosquitto.conf")],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port), timeout=1).close()
                return
            except OSError:
                self.assertLess(time.monotonic(), deadline, "the broker does not listen")
                time.sleep(0.05)

    def options(self, broker=None):
        return ["--machine", self.bench.config, "--broker", broker or f"localhost:{self.port}", "--ca",
                self.bench.path("tls.crt"), "--user", "mill", "--password-file", self.bench.path("password")]

    def start_publisher(self):
        self.publisher = subprocess.Popen([BINARY, "mqtt", *self.options(), "--motion-hz", "5"],
                                          stderr=subprocess.PIPE, text=True, env=self.bench.environment)
        return self.publisher

    def heard(self, topic, count=1):
        """What the broker has of a topic: (1: kept, text)."""
        done = subprocess.run(["mosquitto_sub", "-h", "localhost", "-p", str(self.port), "--cafile",
                               self.bench.path("tls.crt"), "-u", "mill", "-P", PASSWORD, "-t", topic, "-C", str(count),
                               "-W", "3", "-F", "%r %p"], capture_output=True, text=True, check=False)
        return [line.split(" ", 1) for line in done.stdout.splitlines()]

    def kept(self, name):
        """The text of a topic that the broker keeps; None where it keeps none."""
        heard = self.heard(f"trunnion/panel_test/{name}")
        return heard[0][1] if heard and heard[0][0] == "1" else None

    def until_kept(self, name, wanted):
        deadline = time.monotonic() + PATIENCE_S
        while (text := self.kept(name)) != wanted:
            self.assertLess(time.monotonic(), deadline, f"{name} is '{text}' and never '{wanted}'")
            time.sleep(0.1)


class State(Broker):
    def setUp(self):
        super().setUp()
        self.start_publisher()
        self.until_kept("online", "1")
        self.until_kept("state", "idle")

    def test_who_comes_later_knows_all(self):
        names = ("fault", "waits_for", "tool", "parts", "feed_override", "alarms")
        self.assertEqual([self.kept(name) for name in names], ["ok", "none", "0", "0", "1", "[]"])
        deadline = time.monotonic() + PATIENCE_S
        unheard = '{"state": "unheard"}'
        while (status := json.loads(self.kept("status") or unheard))["state"] != "idle":  # told once a second
            self.assertLess(time.monotonic(), deadline)
        self.assertEqual((status["machine"], status["state"], [joint["name"] for joint in status["joints"]]),
                         ("panel_test", "idle", ["X", "Y", "Z", "A", "C"]))

    def test_what_changes_is_told(self):
        subprocess.run([BINARY, "estop", "--machine", self.bench.config], check=True, capture_output=True,
                       env=self.bench.environment)
        self.until_kept("state", "estop")
        alarm, = json.loads(self.kept("alarms"))
        self.assertEqual(alarm["name"], "emergency_stop")

    def test_positions_are_told_and_not_kept(self):
        told = self.heard("trunnion/panel_test/motion", count=3)
        self.assertEqual([kept for kept, _ in told], ["0"] * 3)
        self.assertEqual(len(json.loads(told[0][1])["q_measured"]), 5)

    def test_who_is_killed_is_told_by_the_broker(self):
        self.publisher.send_signal(signal.SIGKILL)
        self.until_kept("online", "0")

    def test_who_ends_says_so(self):
        self.publisher.terminate()
        self.assertEqual(self.publisher.wait(PATIENCE_S), 0)
        self.assertEqual(self.kept("online"), "0")

    def test_a_daemon_that_is_gone_is_told(self):
        self.bench.daemon.kill()
        self.bench.daemon.wait()
        self.until_kept("state", "unreachable")
        self.assertEqual(self.kept("online"), "0")

    def test_a_broker_that_comes_again_is_told_all_again(self):
        self.broker.terminate()
        self.broker.wait()
        self.start_broker()
        self.until_kept("online", "1")
        self.until_kept("state", "idle")
        self.until_kept("alarms", "[]")


class Refusals(Broker):
    def test_a_wrong_password_is_told(self):
        self.bench.write("password", "another\n", 0o600)
        self.assertIn("refuses", self.start_publisher().stderr.readline())
        self.assertIsNone(self.kept("online"))

    def test_a_password_does_not_cross_a_network_in_the_clear(self):
        options = self.options("192.0.2.1:1883")
        del options[4:6]
        done = subprocess.run([BINARY, "mqtt", *options], capture_output=True, text=True, check=False,
                              timeout=PATIENCE_S, env=self.bench.environment)
        self.assertEqual(done.returncode, 4)
        self.assertIn("without TLS", done.stderr)

    def test_a_broker_whose_certificate_is_somebody_elses_is_told_nothing(self):
        self.bench.make_certificate()  # of the same names, and not the broker's
        publisher = self.start_publisher()
        time.sleep(2)
        self.assertIsNone(publisher.poll())
        publisher.terminate()
        self.assertNotIn("connected", publisher.stderr.read())


if __name__ == "__main__":
    if not shutil.which("mosquitto", path=os.environ["PATH"] + ":/usr/sbin") or not shutil.which("mosquitto_sub"):
        sys.exit(77)
    os.environ["PATH"] += ":/usr/sbin"
    BINARY, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
