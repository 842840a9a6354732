#!/usr/bin/env python3
"""From an emergency stop on the daemon's socket to the setpoints: how long, on a quiet socket and beside a flood of
other commands, with an expiry long past. And what the flood costs the daemon.

usage: reaction.py TRUNNION_BINARY SOURCE_DIR

Exit code 77 (skipped) where the kernel allows no network of the test's own. TRN_LONG=COUNT: so many stops of each kind.
The session's log names the period in which the tick heard the stop. The daemon's messages tell when a period was.
"""
import json
import multiprocessing
import os
import statistics
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from daemon_e2e import LONG_PROGRAM, Bench  # noqa: E402
from daemon_socket import DaemonSocket  # noqa: E402
from own_network import enter_own_network  # noqa: E402

OVERRIDE, ESTOP, HOLD = 9, 10, 3
FLOOD_HZ = 50_000
PERIOD_S = 0.001


def flood(machine, path, rate_hz, stop, sent):
    """Overrides at this rate, in packets of a hundred at a time, until told to end."""
    with DaemonSocket(machine, path) as loud:
        packets = [loud.command(OVERRIDE, i, 0.5 + i % 2 * 0.1, client=os.getpid()) for i in range(1, 20001)]
        begun = time.time()
        while not stop.is_set():
            for _ in range(100):
                loud.send(packets[sent.value % len(packets)])
                sent.value += 1
            ahead = sent.value / rate_hz - (time.time() - begun)
            if ahead > 0:
                time.sleep(ahead)


def cpu_s(pid):
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rsplit(") ", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Flood:
    """Commands at 50,000 a second from two processes, where the daemon's socket takes so many."""

    def __init__(self, client, path):
        self.stop = multiprocessing.Event()
        self.sent = [multiprocessing.Value("l", 0, lock=False) for _ in range(2)]
        self.loud = [multiprocessing.Process(target=flood, args=(client.machine, path, FLOOD_HZ / 2, self.stop, sent))
                     for sent in self.sent]

    def __enter__(self):
        self.begun = time.time()
        for process in self.loud:
            process.start()
        time.sleep(1)
        return self

    def __exit__(self, *_):
        self.stop.set()
        self.rate_hz = sum(sent.value for sent in self.sent) / (time.time() - self.begun)
        for process in self.loud:
            process.join(10)
            process.kill()


def clock_of_periods(client):
    """Unix time of period 0: of many messages the one that came soonest behind its period. On a busy host periods are
    late, so it holds for the moment only: what has waited in the socket is too old."""
    begun = time.time()
    heard = [motion for motion in client.hear(0.3, "motion") if motion.time_us / 1e6 > begun]
    return min(motion.time_us / 1e6 - motion.period * PERIOD_S for motion in heard)


def stops(bench, client, count, sequence):
    """Seconds from sending to the period that heard it, of `count` emergency stops in motion."""
    zero, asked = [], []
    for i in range(count):
        bench.ask("reset", "--wait", "--timeout", "60")
        bench.ask("start", "--timeout", "60")
        bench.until(lambda s: s["state"] == "running", 60)
        zero.append(clock_of_periods(client))
        asked.append(time.time())
        client.send(client.command(ESTOP, sequence + i, client=78, expires_us=1))  # expired since an age
        bench.until(lambda s: s["state"] == "estop", 60)
    with open(os.path.join(bench.folder.name, "session.log")) as file:
        entries = [json.loads(line) for line in file]
    heard = [entry["period"] for entry in entries if entry.get("command") == "emergency_stop"][-count:]
    return [begun + period * PERIOD_S - when for begun, period, when in zip(zero, heard, asked)]


def show(what, times_s):
    times_ms = sorted(1000 * t for t in times_s)
    print(f"{what}: {len(times_ms)} stops, from sending to the tick: median {statistics.median(times_ms):.1f} ms, "
          f"worst {times_ms[-1]:.1f} ms", flush=True)


def main():
    daemon_e2e.BINARY, daemon_e2e.SOURCE = (os.path.abspath(path) for path in sys.argv[1:3])
    enter_own_network()
    count = int(os.environ.get("TRN_LONG", "5"))
    with Bench() as bench:
        bench.start_daemon("--log", os.path.join(bench.folder.name, "session.log"))
        bench.ask("home", "--wait")
        bench.ask("load", bench.write("part.ngc", LONG_PROGRAM))
        with DaemonSocket.of(bench) as client:
            bench.ask("estop")
            quiet = stops(bench, client, count, 1)
            show("quiet", quiet)
            before, begun = cpu_s(bench.process.pid), time.time()
            time.sleep(2)
            idle_cpu = (cpu_s(bench.process.pid) - before) / (time.time() - begun)
            path = client.socket.getpeername()
            with Flood(client, path) as loud:
                before, begun = cpu_s(bench.process.pid), time.time()
                flooded = stops(bench, client, count, 1000)
                busy_cpu = (cpu_s(bench.process.pid) - before) / (time.time() - begun)
            show(f"beside {loud.rate_hz:.0f} commands a second", flooded)
            print(f"processor of the daemon: {100 * idle_cpu:.1f} % of one, {100 * busy_cpu:.1f} % beside the flood")
        log = bench.log_text()
        assert min(quiet + flooded) > -0.02, "the clock of the periods is not understood"
        assert max(quiet + flooded) < 0.5, "an emergency stop that waits is none"
        assert log.count("more commands than are heard") <= 2, "a flood is told once for each sender"
        assert bench.end() == 0
    print("passed")


if __name__ == "__main__":
    main()
