#!/usr/bin/env python3
"""From an emergency stop and from a hold on the daemon's socket to the setpoints: how long, on a quiet socket and
beside a flood of other commands, from clients whose clock is an hour before or behind. And what the flood costs.

usage: reaction.py TRUNNION_BINARY SOURCE_DIR

Exit code 77 (skipped) where the kernel allows no network of the test's own. TRN_LONG=COUNT: so many of each kind.
The session's log names the period in which the tick heard an emergency stop; the drives are told in the same one. A
hold is seen in the record: the first setpoint that is slower than those before. The daemon's messages tell when a
period was.
"""
import csv
import json
import multiprocessing
import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from daemon_e2e import LONG_PROGRAM, Bench  # noqa: E402
from daemon_socket import DaemonSocket  # noqa: E402
from own_network import enter_own_network  # noqa: E402

RAPID_OVERRIDE, ESTOP, HOLD = 13, 10, 3
FLOOD_HZ = 50_000
PERIOD_S = 0.001
LAST = 4  # messages: where periods are late, they may be later by the next moment
HOUR_US = 3600 * 10**6
# Long enough at one speed that nothing but a hold slows it down.
STRAIGHT = "G21 G90 G94\no1 while [1]\nG1 X-290 F1800\nG1 X290\no1 endwhile\nM2\n"
SLOWER = 1e-3  # of the speed; the corrections of the cradle change it by a ten-thousandth all the time
TURNS_MM = 280  # behind that it slows down for its end


def flood(machine, path, rate_hz, stop, sent):
    """Overrides of rapid moves, of which the programs have none, at this rate, in packets of a hundred at a time, until
    told to end."""
    with DaemonSocket(machine, path) as loud:
        packets = [loud.command(RAPID_OVERRIDE, i, 0.5 + i % 2 * 0.1, client=os.getpid())
                   for i in range(1, 20001)]
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
    """Unix time of period 0, never before it: of the last messages the one that came soonest behind its period. On a
    busy host periods are late, so it holds for the moment only: what has waited in the socket is too old."""
    while True:
        begun = time.time()
        heard = [motion for motion in client.hear(0.3, "motion") if motion.time_us / 1e6 > begun]
        if heard:
            return min(motion.time_us / 1e6 - motion.period * PERIOD_S for motion in heard[-LAST:])


def clock_of_client(bench, i):
    """An expiry by a clock that is an hour behind the daemon's, and by one that is an hour before."""
    return bench.status()["clock_us"] + (HOUR_US if i % 2 else -HOUR_US)


class Clocks:
    """The clock of the periods before a command and behind what it did. Where the host took the core away between the
    two, periods have become later: what is told is by the later clock, which no reaction is shorter than."""

    def __init__(self, client):
        self.client, self.before, self.behind = client, clock_of_periods(client), None

    def close(self):
        self.behind = clock_of_periods(self.client)

    @property
    def late_s(self):
        """What the host took, at most."""
        return max(0.0, self.behind - self.before)

    def since(self, sent, period):
        return max(self.before, self.behind) + period * PERIOD_S - sent


def stops(bench, client, count, sequence):
    """Seconds from sending to the period that heard it, and seconds the host took, of `count` emergency stops in
    motion."""
    clocks, asked = [], []
    for i in range(count):
        bench.ask("reset", "--wait")
        bench.ask("start")
        bench.until(lambda s: s["state"] == "running", 60)
        packet = client.command(ESTOP, sequence + i, client=78, expires_us=clock_of_client(bench, i))
        clocks.append(Clocks(client))
        asked.append(time.time())
        client.send(packet)
        bench.until(lambda s: s["state"] == "estop", 60)
        clocks[-1].close()
    with open(os.path.join(bench.folder.name, "session.log")) as file:
        entries = [json.loads(line) for line in file]
    heard = [entry["period"] for entry in entries if entry.get("command") == "emergency_stop"][-count:]
    return [(clock.since(sent, period), clock.late_s) for clock, period, sent in zip(clocks, heard, asked)]


def holds(bench, client, count, sequence):
    """(clocks, time of sending, period and place of a moment before it) of `count` holds in motion."""
    asked = []
    for i in range(count):
        bench.ask("resume" if i else "start")
        client.hear(0.01, "motion")
        while True:  # in the middle of a line, at its speed
            packet = client.command(HOLD, sequence + i, client=79, expires_us=clock_of_client(bench, i))
            clocks = Clocks(client)
            moment = (client.hear(0.05, "motion") or [None])[-1]
            steady = moment and abs(moment.override_now - 1) < 1e-9 and abs(moment.q_setpoint[0]) < TURNS_MM - 30
            if steady and moment.line in (3, 4):
                break
        asked.append((clocks, time.time(), moment.period, moment.q_setpoint[0]))
        client.send(packet)
        bench.until(lambda s: s["state"] == "holding" and s["override_now"] == 0, 60)
        clocks.close()
    return asked


def until_slower(record, asked):
    """Seconds from sending to the first setpoint that goes less far than the one before, and seconds the host took, of
    each hold."""
    with open(record) as file:
        x = [float(row["X"]) for row in csv.DictReader(file)]
    times, at = [], 0
    for clocks, sent, period, place in asked:
        at = x.index(place, at)
        first_period = period - at
        steady = abs(x[at + 1] - x[at])
        while abs(x[at + 1] - x[at]) > steady * (1 - SLOWER):
            at += 1
        times.append((clocks.since(sent, first_period + at + 1), clocks.late_s))
    return times


def show(what, times):
    times_ms = sorted(1000 * t for t, _ in times)
    late_ms = 1000 * max(late for _, late in times)
    of = lambda share: times_ms[min(len(times_ms) - 1, int(share * len(times_ms)))]  # noqa: E731
    print(f"{what}: {len(times_ms)}; p50 {of(0.5):.1f} ms, p99 {of(0.99):.1f} ms, worst {times_ms[-1]:.1f} ms;"
          f" the host took up to {late_ms:.1f} ms",
          flush=True)


def main():
    daemon_e2e.BINARY, daemon_e2e.SOURCE = (os.path.abspath(path) for path in sys.argv[1:3])
    enter_own_network()
    count = int(os.environ.get("TRN_LONG", "5"))
    with Bench() as bench:
        record = os.path.join(bench.folder.name, "record.csv")
        bench.start_daemon("--log", os.path.join(bench.folder.name, "session.log"), "--record", record)
        bench.ask("home", "--wait")
        bench.ask("load", bench.write("straight.ngc", STRAIGHT))
        with DaemonSocket.of(bench) as client:
            path = client.socket.getpeername()
            held = holds(bench, client, count, 1)
            bench.ask("stop", "--wait")
            with Flood(client, path):
                held_flooded = holds(bench, client, count, 1000000)
            bench.ask("stop", "--wait")
            bench.ask("load", bench.write("part.ngc", LONG_PROGRAM))
            bench.ask("estop")
            quiet = stops(bench, client, count, 1)
            show("emergency stop, quiet, to the drives", quiet)
            before, begun = cpu_s(bench.process.pid), time.time()
            time.sleep(2)
            idle_cpu = (cpu_s(bench.process.pid) - before) / (time.time() - begun)
            with Flood(client, path) as loud:
                before, begun = cpu_s(bench.process.pid), time.time()
                flooded = stops(bench, client, count, 1000)
                busy_cpu = (cpu_s(bench.process.pid) - before) / (time.time() - begun)
            show(f"emergency stop, beside {loud.rate_hz:.0f} commands a second", flooded)
            print(f"processor of the daemon: {100 * idle_cpu:.1f} % of one, {100 * busy_cpu:.1f} % beside the flood")
        log = bench.log_text()
        assert bench.end() == 0
        slower = until_slower(record, held + held_flooded)
    show("hold, quiet, to the first slower setpoint", slower[:count])
    show("hold, beside the flood", slower[count:])
    every = quiet + flooded + slower
    assert min(t for t, _ in every) > -0.001, "the clock of the periods is not understood"
    assert max(t - late for t, late in every) < 0.5, "a stop that waits is none"
    assert log.count("more commands than are heard") <= 4, "a flood is told once for each sender"
    print("passed")


if __name__ == "__main__":
    main()
