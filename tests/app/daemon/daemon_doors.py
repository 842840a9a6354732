#!/usr/bin/env python3
"""What a hostile or careless process on the host can do to the daemon and its clients, over real sockets.

usage: daemon_doors.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Starts itself again in a network of its own; exit code 77 (skipped) where the kernel does not allow that.
TRN_LONG=COUNT: so many hostile datagrams.
"""
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../../support")]
import daemon_e2e  # noqa: E402
from daemon_e2e import GROUP, LONG_PROGRAM, PORT, Bench, CommandTap  # noqa: E402
from own_network import enter_own_network  # noqa: E402

LOAD, STOP, HOME, OVERRIDE, ESTOP, RESET = 1, 5, 8, 9, 10, 11
ACCEPTED, REFUSED = 2, 3


def sender():
    """A socket that sends as liblcm does, by the host's routes."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    return made


class Forger:
    """Makes datagrams of a machine's channels; the hashes come from messages that were heard."""

    def __init__(self, bench, tap):
        self.name, self.hash = bench.name, {}
        client = threading.Thread(target=lambda: bench.client("override", "100"))
        client.start()
        end = time.time() + 20
        while len(self.hash) < 4 and time.time() < end:
            for data in tap.listen(None, 0.2):
                channel, payload = data[8:].split(b"\0", 1)
                if channel.decode().startswith(self.name + "."):
                    self.hash[channel.decode().split(".")[-1]] = payload[:8]
        client.join()

    def datagram(self, channel, body):
        return b"LC02\0\0\0\1" + f"{self.name}.{channel}".encode() + b"\0" + self.hash[channel] + body

    def command(self, verb, sequence, value=0.0, text=b"\0\0\0\1\0", client=77, joint=0):
        return self.datagram("command", struct.pack(">qiqbidd", client, sequence, 0, verb, joint, value, 0) + text)

    def status(self, pid=4242, name=b"forged"):
        def text(content):
            return struct.pack(">i", len(content) + 1) + content + b"\0"
        body = struct.pack(">qqi", 1, 1, pid) + text(name) + text(b"idle") + text(b"ok") + text(b"") + text(b"")
        body += b"\0" + text(b"") + struct.pack(">idddddbd", 0, 1, 1, 1, 1, 0, 0, 1)
        body += struct.pack(">dqqqddddddb", 0.001, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1)
        return self.datagram("status", body + struct.pack(">i", 0) + text(b"") + struct.pack(">iiii", 0, 0, 0, 0))

    def malformed(self):
        """Snippet by snippet what once ended the daemon or a client."""
        for length in (b"\0\0\0\0", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\x80\0\0\0"):
            yield self.command(RESET, 1, text=length)
            yield self.datagram("status", bytes(20) + length)
            yield self.datagram("acknowledge", bytes(21) + length)
            yield self.datagram("motion", bytes(20) + length)
        for offset in (0xffffffff, 0x7fffffff, 1 << 20):
            head = b"LC03" + struct.pack(">III", 9, 100, offset)
            yield head + struct.pack(">HH", 0, 2) + f"{self.name}.command".encode() + b"\0" + bytes(60)
            yield head + struct.pack(">HH", 1, 2) + bytes(90)

    def hostile(self, rng):
        data = bytearray(rng.choice([self.command(rng.randrange(-128, 128), rng.randrange(1 << 31), rng.uniform(-9, 9)),
                                     self.status(), *self.malformed()]))
        for _ in range(rng.randrange(4)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        return bytes(data[:rng.randrange(len(data))] if rng.random() < 0.2 else data)


class Doors(unittest.TestCase):
    def test_no_datagram_ends_daemon_or_client(self):
        with Bench() as bench, CommandTap() as tap:
            bench.start_daemon()
            forger, rng = Forger(bench, tap), random.Random(1)
            bench.ask("load", bench.write("part.ngc", LONG_PROGRAM))
            bench.ask("start")
            watch = subprocess.Popen([daemon_e2e.BINARY, "monitor", "--count", "100", "--machine", bench.config],
                                     stdout=subprocess.DEVNULL)
            with sender() as out:
                for datagram in forger.malformed():
                    out.sendto(datagram, (GROUP, PORT))
            self.assertEqual(watch.wait(30), 0)
            self.assertIsNone(bench.process.poll(), bench.log_text())
            self.assertIn(bench.status()["state"], ("running", "idle"))
            with sender() as out:
                for i in range(max(20000, int(os.environ.get("TRN_LONG", "0")))):
                    out.sendto(forger.hostile(rng), (GROUP, PORT))
                    if i % 200 == 0:
                        time.sleep(0.002)
            self.assertIsNone(bench.process.poll(), bench.log_text())
            bench.status()
            self.assertEqual(bench.end(), 0)

    def test_malformed_statuses_stop_neither_daemon_nor_client(self):
        with Bench() as bench, CommandTap() as tap:
            bench.start_daemon()
            forger = Forger(bench, tap)
            self.assertEqual(bench.end(), 0)
            bad = [d for d in forger.malformed() if b".status" in d]
            going = threading.Event()

            def publish():
                with sender() as out:
                    while not going.wait(0.005):
                        out.sendto(random.choice(bad), (GROUP, PORT))
            thread = threading.Thread(target=publish)
            thread.start()
            try:
                bench.start_daemon()
                bench.ask("mdi", "G0 X1", "--wait")
                self.assertEqual(bench.end(), 0)
            finally:
                going.set()
                thread.join()

    def test_nothing_but_the_loopback_device_is_heard(self):
        with Bench() as bench, CommandTap() as tap:
            bench.start_daemon()
            forger = Forger(bench, tap)
            with sender() as out:  # what other hosts could reach
                for address in ("127.0.0.1", "127.0.0.2"):
                    out.sendto(forger.command(ESTOP, 5), (address, PORT))
            time.sleep(0.3)
            self.assertEqual(bench.status()["state"], "idle")
            self.assertNotIn("00000000:%04X" % PORT, self.sockets_of(bench.process.pid))
            self.assertEqual(bench.end(), 0)

    @staticmethod
    def sockets_of(pid):
        with open(f"/proc/{pid}/net/udp") as file:
            inodes = {os.readlink(f"/proc/{pid}/fd/{fd}")[8:-1] for fd in os.listdir(f"/proc/{pid}/fd")
                      if os.readlink(f"/proc/{pid}/fd/{fd}").startswith("socket:")}
            return [row.split()[1] for row in file.readlines()[1:] if row.split()[9] in inodes]

    def test_an_estop_in_a_flood_acts_at_once_and_the_flood_is_told_once(self):
        with Bench() as bench, CommandTap() as tap:
            bench.start_daemon()
            forger = Forger(bench, tap)
            bench.ask("load", bench.write("part.ngc", LONG_PROGRAM))
            bench.ask("start")
            bench.until(lambda s: s["line"] >= 3)
            seen, going = [], threading.Event()
            reader = threading.Thread(target=lambda: seen.extend(tap.listen(f"{bench.name}.acknowledge", 4)))
            reader.start()

            def flood():
                with sender() as out:
                    for i in range(1, 40000):
                        out.sendto(forger.command(OVERRIDE, i, 0.5 + i % 2 * 0.1), (GROUP, PORT))
                        if i % 20 == 0:
                            time.sleep(0.001)
                        if going.is_set():
                            return
            thread = threading.Thread(target=flood)
            thread.start()
            time.sleep(1)
            asked = time.time()
            with sender() as out:
                out.sendto(forger.command(ESTOP, 1, client=78), (GROUP, PORT))  # once: it must not be lost
            bench.until(lambda s: s["state"] == "estop", 5)
            self.assertLess(time.time() - asked, 2)
            going.set()
            thread.join()
            reader.join()
            outcomes = [struct.unpack(">qib", d[8:].split(b"\0", 1)[1][8:21]) for d in seen]
            accepted = [o for o in outcomes if o[0] == 77 and o[2] == ACCEPTED]
            self.assertLess(len(accepted), 2500)
            log = bench.log_text()
            self.assertEqual(log.count("more commands than are heard"), 1)
            self.assertNotIn("takes no commands", log)
            self.assertEqual(bench.end(), 0)

    def test_one_estop_in_a_burst_is_never_lost(self):
        with Bench() as bench, CommandTap() as tap:
            bench.start_daemon()
            forger = Forger(bench, tap)
            for turn in range(10):
                burst = [forger.command(OVERRIDE, 1000 * turn + i, 1.0) for i in range(299)]
                burst.insert(150 + 14 * turn, forger.command(ESTOP, turn + 1, client=78))
                with sender() as out:
                    for datagram in burst:
                        out.sendto(datagram, (GROUP, PORT))
                bench.until(lambda s: s["state"] == "estop", 5)
                bench.ask("reset", "--wait")
            self.assertEqual(bench.end(), 0)

    def test_a_load_of_what_is_no_file_fails_at_once(self):
        with Bench() as bench:
            bench.start_daemon()
            fifo = os.path.join(bench.folder.name, "fifo")
            os.mkfifo(fifo)
            for path in (fifo, "/dev/zero", bench.folder.name):
                begun = time.time()
                code, _, err = bench.client("load", path)
                self.assertEqual(code, 2, err)
                self.assertLess(time.time() - begun, 3)
                self.assertRegex(err, "no regular file|folder")
            secret = bench.write("shadow", "root:*:20228:0:99999:7:::\nbin:secret:1:2\n")
            code, _, err = bench.client("load", secret)
            self.assertEqual(code, 2)
            self.assertIn("is no program", err)
            self.assertNotRegex(err, "20228|oot|secret")
            bench.ask("jog", "X", "2", "--wait")
            self.assertEqual(bench.end(), 0)

    def test_a_long_check_keeps_nobody_waiting(self):
        with Bench() as bench:
            bench.start_daemon()
            endless = bench.write("endless.ngc", "#1=0\no1 while [1]\n#1=[#1+1]\no1 endwhile\nM2\n")
            loader = subprocess.Popen([daemon_e2e.BINARY, "load", endless, "--machine", bench.config],
                                      stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            time.sleep(0.3)
            bench.ask("jog", "X", "2", "--wait", "--patience", "10")
            bench.ask("estop")
            bench.ask("reset", "--wait", "--patience", "10")
            loader.kill()
            loader.wait()
            again = subprocess.Popen([daemon_e2e.BINARY, "load", endless, "--machine", bench.config],
                                     stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            time.sleep(0.3)
            begun = time.time()
            self.assertEqual(bench.end(), 0)
            self.assertLess(time.time() - begun, 5)
            again.kill()
            again.wait()
            log = bench.log_text()
            self.assertLess(log.index("drives are off"), log.index("ended in good order"))

    def test_a_session_with_an_estop_is_recorded_judged_and_replayed(self):
        with Bench() as bench:
            record, log, again = (os.path.join(bench.folder.name, name) for name in ("record.csv", "log", "again.csv"))
            bench.start_daemon("--record", record, "--log", log)
            bench.ask("load", bench.write("part.ngc", LONG_PROGRAM))
            for end in ("estop", "stop", "estop"):
                bench.ask("start")
                bench.until(lambda s: s["line"] >= 4)
                bench.ask(end)
                bench.until(lambda s: s["state"] in ("estop", "idle"))
                if end == "estop":
                    bench.ask("reset", "--wait")
                    bench.ask("mdi", "G0 X0 Y0", "--wait")
                    bench.ask("load", bench.write("part.ngc", LONG_PROGRAM))
            bench.ask("start")
            bench.until(lambda s: s["line"] >= 4)
            bench.ask("estop")
            self.assertEqual(bench.end(), 0)
            judged = subprocess.run([daemon_e2e.BINARY, "check-trace", record, "--machine", bench.config], text=True,
                                    capture_output=True)
            self.assertEqual(judged.returncode, 0, judged.stdout + judged.stderr)
            self.assertIn("pieces, each judged by itself", judged.stdout)
            done = subprocess.run([daemon_e2e.BINARY, "replay", log, "--trace", again], text=True, capture_output=True)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_the_log_of_a_killed_session_is_kept_and_replays(self):
        with Bench() as bench:
            log, again = (os.path.join(bench.folder.name, name) for name in ("log", "again.csv"))
            variables = bench.write("machine.var", "5221\t5\n")
            bench.start_daemon("--log", log, "--vars", variables)
            bench.ask("mdi", "G0 X7", "--wait")
            bench.ask("mdi", "G10 L2 P1 X50", "--wait")
            bench.process.kill()
            bench.process.wait()
            with open(log) as file:
                kept = file.read()
            bench.start_daemon("--log", log, "--vars", variables)
            self.assertIn(log + ".1", bench.log_text())
            bench.ask("mdi", "G10 L2 P1 X60", "--wait")
            self.assertEqual(bench.end(), 0)
            with open(log) as file:
                self.assertEqual(file.read(), kept)
            done = subprocess.run([daemon_e2e.BINARY, "replay", log, "--trace", again], text=True, capture_output=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertAlmostEqual(float(daemon_e2e.rows(again)[-1]["X"]), 12, places=9,
                                   msg="with the offset that the session began with")

    def test_a_foreign_lock_file_is_neither_followed_nor_written(self):
        with Bench() as bench, tempfile.TemporaryDirectory() as folder:
            victim = bench.write("victim", "precious")
            os.symlink(victim, os.path.join(folder, f"trunnion-{bench.name}.lock"))
            done = subprocess.run([daemon_e2e.BINARY, "daemon", "--machine", bench.config], text=True, timeout=20,
                                  capture_output=True, env=dict(os.environ, RUNTIME_DIRECTORY=folder))
            self.assertEqual(done.returncode, 4)
            with open(victim) as file:
                self.assertEqual(file.read(), "precious")


if __name__ == "__main__":
    daemon_e2e.BINARY, daemon_e2e.SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    enter_own_network()
    names = [f"Doors.{name}" for name in sys.argv[3:]] or None
    unittest.main(argv=[sys.argv[0], "-v"], defaultTest=names)
