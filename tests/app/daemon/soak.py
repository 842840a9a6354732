#!/usr/bin/env python3
"""A daemon under random operation for as long as asked: memory and descriptors stay what they were, logs grow by what
happened and are never written over, and no command ends it.

usage: soak.py TRUNNION_BINARY SOURCE_DIR [SECONDS] [SEED]

Without SECONDS: 20, or TRN_LONG=SECONDS. Exit code 77 (skipped) where the kernel allows no network of the test's own.
Three daemons one after the other keep their logs beside each other.
"""
import os
import random
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../support"))
import daemon_e2e  # noqa: E402
from daemon_e2e import LONG_PROGRAM, PROGRAM, Bench  # noqa: E402
from daemon_socket import DaemonSocket, command_t  # noqa: E402
from own_network import enter_own_network  # noqa: E402

SESSIONS = 3
WARM_UP = 1 / 3  # of a session
JUDGED_FROM_S = 300
SLOPE_KB_MIN = 16  # behind the warm-up, beside what the samples themselves scatter
SAMPLES_FOR_SLOPE = 300
PARTS_FOR_SLOPE = 20
CLIENT_PATIENCE_S = 5
REST_S = 60  # at most, behind the last command
# The daemon keeps its last 4,096 answers, so that a command that is heard twice is obeyed once
# (app/daemon/reply_cache.h), and the last 2,048 steps of programs, which somebody may go back along
# (kernel/retrace.h). Until they are there, memory grows by some MB.
FIRST_COMMANDS = 8000
MANY_STEPS = "G21 G91 G94\n" + "G1 X0.1 Y0.05 F6000\nG1 X-0.1 Y0.05\n" * 1200 + "M2\n"
FIRST_HZ = 120  # one client may ask for 200


class Watch:
    """Memory and open descriptors of a daemon and its programs process.

    Counted are pages that belong to no file. What is private of a library changes with every other program that has it
    loaded: a client that begins makes it shared, and one that ends makes it private again.
    """

    def __init__(self, pid):
        self.pid, self.begun, self.rows = pid, time.time(), []

    def sample(self):
        kept_kb = 0
        for pid in self.family():
            try:
                with open(f"/proc/{pid}/smaps_rollup") as file:
                    kept_kb += sum(int(line.split()[1]) for line in file if line.startswith("Anonymous:"))
            except (FileNotFoundError, ProcessLookupError):
                return
        self.rows.append((time.time() - self.begun, kept_kb, len(os.listdir(f"/proc/{self.pid}/fd"))))

    def come_to_rest(self):
        """What a slow disk still has to write of a fault is given back; of that the last sample must not tell."""
        end, least = time.time() + REST_S, min(kb for _, kb, _ in self.rows[len(self.rows) // 2:])
        self.sample()
        while self.rows[-1][1] > least + SLOPE_KB_MIN and time.time() < end:
            time.sleep(0.5)
            self.sample()

    def where(self):
        """For people: what each process keeps of its heap, of other memory and of stacks, kB."""
        lines = []
        for pid in self.family():
            kept, what = {}, ""
            with open(f"/proc/{pid}/smaps") as file:
                for fields in map(str.split, file):
                    if not fields[0].endswith(":"):
                        what = fields[5] if len(fields) > 5 and fields[5].startswith("[") else "other"
                    elif fields[0] == "Anonymous:":
                        kept[what] = kept.get(what, 0) + int(fields[1])
            lines.append(f"process {pid}: {kept}")
        return "; ".join(lines)

    def family(self):
        with open(f"/proc/{self.pid}/task/{self.pid}/children") as file:
            return [self.pid, *map(int, file.read().split())]

    def kept(self, from_s):
        """(minutes, kB) behind `from_s`: the least of each of some equal parts. The recording of a fault takes some MB
        until it is written, which lasts the longer the busier the host is."""
        rows = [(t / 60, kb) for t, kb, _ in self.rows if t >= from_s]
        size = max(1, len(rows) // PARTS_FOR_SLOPE)
        parts = [rows[at:at + size] for at in range(0, len(rows) - size + 1, size)]
        return [min(part, key=lambda row: row[1]) for part in parts]

    def slope(self, from_s):
        """kB a minute of what is kept behind `from_s`, by least squares, and its standard error."""
        rows = self.kept(from_s)
        mean_t, mean_kb = (sum(column) / len(rows) for column in zip(*rows))
        square = sum((t - mean_t) ** 2 for t, _ in rows)
        slope = sum((t - mean_t) * (kb - mean_kb) for t, kb in rows) / square
        rest = sum((kb - mean_kb - slope * (t - mean_t)) ** 2 for t, kb in rows) / max(1, len(rows) - 2)
        return slope, (rest / square) ** 0.5


class Operator:
    """Does anything that an operator may do, legal or not."""

    def __init__(self, bench, seed):
        self.bench, self.rng, self.counts = bench, random.Random(seed), {}
        self.programs = [bench.write("long.ngc", LONG_PROGRAM), bench.write("short.ngc", PROGRAM),
                         bench.write("wrong.ngc", "G1 X9999 F100\nG99.9\n")]

    def act(self):
        rng = self.rng
        choices = [("load", rng.choice(self.programs)), ("start",), ("start",), ("hold",), ("resume",), ("resume",),
                   ("stop",), ("override", str(rng.randrange(0, 201))), ("override", "100"),
                   ("step", rng.choice(("on", "off", "off"))), ("jog", rng.choice("XYZ"), f"{rng.uniform(-5, 5):.2f}"),
                   ("mdi", f"G0 X{rng.uniform(-20, 20):.2f}"), ("mdi", "G999"), ("touch-off", "X", "0"),
                   ("home", "--wait"), ("status",), ("estop",), ("reset", "--wait")]
        weights = [4] * (len(choices) - 2) + [1, 4]
        what = rng.choices(choices, weights)[0]
        # A client may wait for a machine that is held, as in single block; an operator then presses Ctrl-C.
        command = [daemon_e2e.BINARY, *what, "--machine", self.bench.config]
        try:
            good = subprocess.run(command, capture_output=True, timeout=CLIENT_PATIENCE_S).returncode == 0
        except subprocess.TimeoutExpired:
            good = False
        key = (what[0], good)
        self.counts[key] = self.counts.get(key, 0) + 1


def warm_up(bench, operator):
    """A long program, then commands as the operator's, without a process for each."""
    bench.ask("load", bench.write("many.ngc", MANY_STEPS))
    bench.ask("start")
    bench.until(lambda status: status["state"] == "running", 60)
    bench.until(lambda status: status["state"] == "idle", 300)
    verbs = command_t
    with DaemonSocket.of(bench) as client:
        for sequence in range(1, FIRST_COMMANDS + 1):
            verb, value, text = operator.rng.choice((
                (verbs.LOAD, 0, operator.rng.choice(operator.programs)), (verbs.START, 0, ""), (verbs.HOLD, 0, ""),
                (verbs.RESUME, 0, ""), (verbs.STOP, 0, ""), (verbs.OVERRIDE, operator.rng.uniform(0, 2), ""),
                (verbs.SINGLE_BLOCK, operator.rng.randrange(2), ""), (verbs.JOG, operator.rng.uniform(-5, 5), ""),
                (verbs.MDI, 0, f"G0 X{operator.rng.uniform(-20, 20):.2f}"), (verbs.MDI, 0, "G999"), (verbs.HOME, 0, ""),
                (verbs.ESTOP if sequence % 50 == 0 else verbs.RESET, 0, "")))
            client.send(client.command(verb, sequence, value, text))
            client.hear(1 / FIRST_HZ, "acknowledge")


def session(bench, number, seconds, seed):
    log = os.path.join(bench.folder.name, "session.log")
    bench.start_daemon("--log", log, "--vars", os.path.join(bench.folder.name, "m.var"))
    watch, operator = Watch(bench.process.pid), Operator(bench, seed)
    bench.ask("home", "--wait")
    end = time.time() + seconds
    if seconds >= JUDGED_FROM_S:
        warm_up(bench, operator)
    while time.time() < end:
        operator.act()
        assert bench.process.poll() is None, f"the daemon has ended:\n{bench.log_text()[-3000:]}"
        watch.sample()
    watch.come_to_rest()
    where = watch.where()
    bench.ask("estop")
    assert bench.end() == 0
    from_s = WARM_UP * seconds
    kept = [row for row in watch.rows if row[0] >= from_s]
    slope, error = watch.slope(from_s)
    memory = watch.kept(from_s)
    done = sum(count for (_, good), count in operator.counts.items() if good)
    refused = sum(count for (_, good), count in operator.counts.items() if not good)
    print(f"session {number}, {seconds:.0f} s: {done} commands obeyed, {refused} refused; memory "
          f"{memory[0][1] / 1024:.1f} to {memory[-1][1] / 1024:.1f} MB, slope {slope:.1f} +- {error:.1f} kB/min; "
          f"descriptors {min(row[2] for row in kept)} to {max(row[2] for row in kept)}", flush=True)
    assert max(row[2] for row in kept) - min(row[2] for row in kept) <= 8, "descriptors are given back"
    if seconds >= JUDGED_FROM_S:
        assert len(kept) >= SAMPLES_FOR_SLOPE, "the host is too busy: too few samples to judge"
        assert slope < SLOPE_KB_MIN + 3 * error, f"memory grows: {memory}; {where}"
    return slope


def main():
    daemon_e2e.BINARY, daemon_e2e.SOURCE = (os.path.abspath(path) for path in sys.argv[1:3])
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else float(os.environ.get("TRN_LONG", "20"))
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    enter_own_network()
    with Bench(machine="mill") as bench:
        for number in range(1, SESSIONS + 1):
            session(bench, number, seconds / SESSIONS, seed + number)
        logs = sorted(name for name in os.listdir(bench.folder.name)
                      if name.startswith("session") and not name.endswith(".csv"))  # those are of faults
        sizes = [os.path.getsize(os.path.join(bench.folder.name, name)) for name in logs]
        print(f"logs: {', '.join(f'{name} {size / 1024:.0f} kB' for name, size in zip(logs, sizes))}")
        assert len(logs) == SESSIONS and all(sizes), "every session keeps its log"
    print("passed")


if __name__ == "__main__":
    main()
