#!/usr/bin/env python3
"""What a hostile or careless process on the host can do to the daemon and its clients, over its real socket.

usage: daemon_doors.py TRUNNION_BINARY SOURCE_DIR [test name ...]

Starts itself again in a network of its own; exit code 77 (skipped) where the kernel does not allow that.
TRN_LONG=COUNT: so many hostile packets.
"""
import contextlib
import os
import random
import re
import resource
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
from daemon_e2e import LONG_PROGRAM, Bench  # noqa: E402
from daemon_socket import DaemonSocket, packet_of, sensor_t  # noqa: E402
from own_network import enter_own_network  # noqa: E402

OVERRIDE, ESTOP, RESET = 9, 10, 11
ACCEPTED = 2


def udp_sender():
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    return made


def malformed(client):
    """What ends a decoder that believes lengths and counts, and fragments."""
    for length in (b"\0\0\0\0", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\x80\0\0\0"):
        yield client.command(RESET, 1)[:-5] + length + b"\0"
        sensor = sensor_t()
        yield packet_of(client.machine, "sensor", sensor.encode()[:-4] + length)
        for channel in ("status", "acknowledge", "motion"):
            yield packet_of(client.machine, channel, bytes(20) + length)
    for offset in (0xffffffff, 0x7fffffff, 1 << 20):
        head = b"LC03" + struct.pack(">III", 9, 100, offset)
        yield head + struct.pack(">HH", 0, 2) + f"{client.machine}.command".encode() + b"\0" + bytes(60)
        yield head + struct.pack(">HH", 1, 2) + bytes(90)


def hostile(client, rng):
    data = bytearray(rng.choice([client.command(rng.randrange(-128, 128), rng.randrange(1 << 31), rng.uniform(-9, 9)),
                                 *malformed(client)]))
    for _ in range(rng.randrange(4)):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data[:rng.randrange(1, len(data))] if rng.random() < 0.2 else data)


class Doors(unittest.TestCase):
    def test_no_packet_ends_daemon_or_client(self):
        with Bench() as bench:
            bench.start_daemon()
            rng = random.Random(1)
            bench.ask("load", bench.write("part.ngc", LONG_PROGRAM))
            bench.ask("start")
            watch = subprocess.Popen([daemon_e2e.BINARY, "monitor", "--count", "100", "--machine", bench.config],
                                     stdout=subprocess.DEVNULL)
            with DaemonSocket.of(bench) as client:
                for packet in malformed(client):
                    client.send(packet)
                self.assertEqual(watch.wait(120), 0)
                self.assertIsNone(bench.process.poll(), bench.log_text())
                self.assertIn(bench.status()["state"], ("running", "idle"))
                for _ in range(max(20000, int(os.environ.get("TRN_LONG", "0")))):
                    client.send(hostile(client, rng))
            self.assertIsNone(bench.process.poll(), bench.log_text())
            bench.status()
            self.assertEqual(bench.end(), 0)

    def test_the_daemon_hears_nothing_from_a_network(self):
        """Not even at the port that its own telemetry leaves from: the kernel drops what comes there."""
        with Bench(machine="mill") as bench:
            bench.start_daemon()
            ports = self.udp_ports(bench.process.pid)
            self.assertTrue(ports, "it sends telemetry")
            with DaemonSocket.of(bench) as client, udp_sender() as out:
                for address in ("127.0.0.1", "239.255.76.67"):
                    for port in [7667, *ports]:
                        out.sendto(client.command(ESTOP, 5), (address, port))
            time.sleep(0.3)
            self.assertEqual(bench.status()["state"], "idle")
            self.assertEqual(self.udp_ports(bench.process.pid, waiting=True), [], "nothing waits to be read")
            self.assertNotIn(7667, ports)
            with open(f"/proc/{bench.process.pid}/net/tcp") as file:
                self.assertEqual(len(file.readlines()), 1)
            self.assertEqual(bench.end(), 0)

    @staticmethod
    def udp_ports(pid, waiting=False):
        """Ports of the UDP sockets of a process; `waiting`: of those only with something in the receive queue."""
        inodes = set()
        for fd in os.listdir(f"/proc/{pid}/fd"):
            with contextlib.suppress(FileNotFoundError):  # it has been closed since
                inodes |= set(re.findall(r"^socket:\[(\d+)\]$", os.readlink(f"/proc/{pid}/fd/{fd}")))
        with open(f"/proc/{pid}/net/udp") as file:
            rows = [row.split() for row in file.readlines()[1:]]
        return [int(row[1].split(":")[1], 16) for row in rows
                if row[9] in inodes and (not waiting or int(row[4].split(":")[1], 16) > 0)]

    def test_an_estop_in_a_flood_acts_at_once_and_the_flood_is_told_once(self):
        with Bench() as bench:
            bench.start_daemon()
            bench.ask("load", bench.write("part.ngc", LONG_PROGRAM))
            bench.ask("start")
            bench.until(lambda s: s["line"] >= 3)
            answers, going = [], threading.Event()
            with DaemonSocket.of(bench) as loud, DaemonSocket.of(bench) as quiet:
                reader = threading.Thread(target=lambda: answers.extend(loud.hear(4, "acknowledge")))
                reader.start()

                def flood():
                    for i in range(1, 1000000):
                        loud.send(loud.command(OVERRIDE, i, 0.5 + i % 2 * 0.1))
                        if going.is_set():
                            return
                thread = threading.Thread(target=flood)
                thread.start()
                time.sleep(1)
                asked = time.time()
                quiet.send(quiet.command(ESTOP, 1, client=78))  # once: it must not be lost
                quiet.hear(0.2, "status")
                bench.until(lambda s: s["state"] == "estop", 5)
                self.assertLess(time.time() - asked, 2)
                going.set()
                thread.join()
                reader.join()
            self.assertLess(len([a for a in answers if a.outcome == ACCEPTED]), 2500)
            log = bench.log_text()
            self.assertEqual(log.count("more commands than are heard"), 1)
            self.assertNotIn("takes no commands", log)
            self.assertEqual(bench.end(), 0)

    def test_one_estop_in_a_burst_is_never_lost(self):
        with Bench() as bench:
            bench.start_daemon()
            with DaemonSocket.of(bench) as client:
                for turn in range(10):
                    burst = [client.command(OVERRIDE, 1000 * turn + i, 1.0) for i in range(299)]
                    burst.insert(150 + 14 * turn, client.command(ESTOP, turn + 1, client=78))
                    for packet in burst:
                        client.send(packet)
                    bench.until(lambda s: s["state"] == "estop", 5)
                    bench.ask("reset", "--wait")
            self.assertEqual(bench.end(), 0)

    def test_it_waits_at_no_pipe_when_it_starts(self):
        with Bench() as bench:
            variables = bench.write("m.var", "")
            os.mkfifo(variables + ".counters")
            bench.start_daemon("--vars", variables)
            self.assertIn("m.var.counters: this is no regular file but a pipe", bench.log_text())
            self.assertIn("counters", bench.status()["alarm"])
            self.assertEqual(bench.end(), 0)
            record = os.path.join(bench.folder.name, "record")
            os.mkfifo(record)
            refused = subprocess.run([daemon_e2e.BINARY, "daemon", "--machine", bench.config, "--record", record],
                                     capture_output=True, text=True, timeout=120, check=False)
            self.assertIn(f"{record}: --record cannot write into a pipe", refused.stderr)
            self.assertNotEqual(refused.returncode, 0)

    def test_a_full_disk_is_told_and_leaves_a_mark_in_the_log(self):
        """A limit of the files' size stands for the full disk; the log's head makes its file the longest."""
        with Bench() as bench:
            log = os.path.join(bench.folder.name, "m.log")
            tools = bench.write("tools.tbl", "T1 P1 Z+50\n" + "; nothing but a remark\n" * 10000)
            binary = daemon_e2e.BINARY
            daemon_e2e.BINARY = bench.write("patient.sh", f'#!/bin/sh\ntrap "" XFSZ\nexec {binary} "$@"\n')
            os.chmod(daemon_e2e.BINARY, 0o700)
            try:
                bench.start_daemon("--log", log, "--tools", tools)
            finally:
                daemon_e2e.BINARY = binary
            bench.ask("mdi", "G0 X1", "--wait")
            limits = resource.prlimit(bench.process.pid, resource.RLIMIT_FSIZE)
            resource.prlimit(bench.process.pid, resource.RLIMIT_FSIZE, (os.path.getsize(log) + 10, limits[1]))
            bench.ask("mdi", "G0 X2", "--wait")
            self.assertIn("session_log: ", bench.until(lambda s: s["alarm"])["alarm"])
            resource.prlimit(bench.process.pid, resource.RLIMIT_FSIZE, limits)
            time.sleep(1.2)
            bench.ask("mdi", "G0 X3", "--wait")
            self.assertEqual(bench.end(), 0)
            self.assertEqual(bench.log_text().count("not recorded until there is room"), 1)
            trace = os.path.join(bench.folder.name, "again.csv")
            replay = [binary, "replay", log, "--trace", trace]
            done = subprocess.run(replay, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stderr, r"from period \d+ to \d+, \d+ entries could not be written")
            with open(trace, encoding="ascii") as file:
                self.assertAlmostEqual(1, float(file.readlines()[-1].split(",")[1]), places=6)
            # A power cut, in the middle of the mark.
            with open(log, "rb+") as file:
                text = file.read()
                file.truncate(text.index(b'"gap"') + 3)
            done = subprocess.run(replay, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("the last line is cut off", done.stderr)

    def test_a_load_of_what_is_no_file_fails_at_once(self):
        with Bench() as bench:
            bench.start_daemon()
            fifo = os.path.join(bench.folder.name, "fifo")
            os.mkfifo(fifo)
            for path in (fifo, "/dev/zero", bench.folder.name):
                begun = time.time()
                code, _, err = bench.client("load", path)
                self.assertEqual(code, 2, err)
                self.assertLess(time.time() - begun, 20, "it would read for ever")
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
            self.assertLess(time.time() - begun, 9, "it waits 10 s for what does not end")
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
            done = subprocess.run([daemon_e2e.BINARY, "daemon", "--machine", bench.config], text=True, timeout=120,
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
