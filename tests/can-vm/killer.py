#!/usr/bin/python3
"""Kills, freezes and ends a daemon, or takes its interface away, at random moments of a motion; runs in the guest.

usage: killer.py INTERFACE ROUNDS SEED

`trunnion-drives` writes down in drives.csv what the drives do. Each round prints one line of JSON: what was done, the
time from there to the drives' last movement, by how many counts they moved after that, and what the daemon said.
"""
import json
import random
import signal
import subprocess
import sys
import time

KINDS = ("kill", "freeze", "terminate", "interface_down")
PATIENCE_S = 60
REST_S = 0.25  # without a count of change: a standstill
FROZEN_S = 1.0
DOWN_S = 0.5
ASK = ("--machine", "machine.toml", "--timeout", "20")


class Drives:
    """Reads on in the drives' own record: (time s, counts of each drive) of every row."""

    def __init__(self, path):
        self.file, self.rest = open(path, encoding="utf-8"), ""
        self.file.readline()
        self.last = (0.0, None)

    def rows(self):
        """Those that were written since the last call."""
        *lines, self.rest = (self.rest + self.file.read()).split("\n")
        for line in lines:
            time_s, *cells = line.split(",")
            row = (float(time_s), tuple(map(int, cells[::2])))
            if row[1] != self.last[1]:
                self.last = row
                yield row

    def counts(self):
        for _ in self.rows():
            pass
        return self.last[1]

    def wait_for_motion(self):
        end = time.monotonic() + PATIENCE_S
        self.counts()
        while not any(True for _ in self.rows()):
            if time.monotonic() > end:
                raise RuntimeError("the drives do not move")
            time.sleep(0.01)

    def wait_for_rest(self):
        """The moment of the last movement."""
        end = time.monotonic() + PATIENCE_S
        self.counts()
        while time.monotonic() - self.last[0] < REST_S:
            if time.monotonic() > end:
                raise RuntimeError("the drives do not come to rest")
            time.sleep(0.02)
            self.counts()
        return self.last[0]


def ask(*words):
    return subprocess.run(["trunnion", *words, *ASK], capture_output=True, text=True, check=False)


def status():
    answer = ask("status", "--json")
    return json.loads(answer.stdout) if answer.returncode == 0 else {}


def wait_until(*states):
    """The state that the daemon is in then."""
    end = time.monotonic() + PATIENCE_S
    while (state := status().get("state")) not in states:
        if time.monotonic() > end:
            raise RuntimeError(f"the daemon is {state}: {status()}")
        time.sleep(0.4)
    return state


def make_ready():
    """Drives that lost their master stand in a fault; a daemon that finds them so says it, and waits for `reset`."""
    found = wait_until("idle", "fault")
    if found == "fault" and ask("reset").returncode == 0:
        wait_until("idle")
    return found


def link(interface, what):
    subprocess.run(["/bin/ip", "link", "set", interface, what], check=True)


def programs_left():
    """Processes of a daemon that is gone."""
    found = subprocess.run("grep -l '(programs)' /proc/[0-9]*/stat", shell=True, capture_output=True, check=False)
    return len(found.stdout.split())


def begin(drives, log):
    daemon = subprocess.Popen(["trunnion", "daemon", "--machine", "machine.toml"], stdout=log, stderr=log)
    found = make_ready()
    before = drives.counts()
    for words in (("load", "part.ngc"), ("start",)):
        answer = ask(*words)
        if answer.returncode:
            raise RuntimeError(f"{words}: {answer.stdout} {answer.stderr}")
    drives.wait_for_motion()
    return daemon, {"found": found, "before": before}


def act(kind, daemon, interface):
    if kind == "interface_down":
        link(interface, "down")
    else:
        daemon.send_signal({"kill": signal.SIGKILL, "freeze": signal.SIGSTOP, "terminate": signal.SIGTERM}[kind])


def come_back(kind, daemon, interface, begun):
    """The daemon lives on: it must say what happened, move nothing, and be ready again behind a `reset`."""
    time.sleep(max(0.0, begun + (FROZEN_S if kind == "freeze" else DOWN_S) - time.monotonic()))
    daemon.send_signal(signal.SIGCONT) if kind == "freeze" else link(interface, "up")
    time.sleep(1)
    fault = status().get("fault")
    reset = ask("reset")
    wait_until("idle")
    daemon.send_signal(signal.SIGTERM)
    return {"fault": fault, "reset": reset.returncode}


def one_round(kind, wait_s, drives, interface, log):
    daemon, begun_with = begin(drives, log)
    time.sleep(wait_s)
    begun = time.monotonic()
    act(kind, daemon, interface)
    rest = drives.wait_for_rest()
    counts = drives.counts()
    told = come_back(kind, daemon, interface, begun) if kind in ("freeze", "interface_down") else {}
    code = daemon.wait(PATIENCE_S)
    time.sleep(0.5)
    moved = max(abs(a - b) for a, b in zip(counts, drives.counts()))
    return {"kind": kind, "moving_s": round(wait_s, 3), "to_rest_s": round(max(0.0, rest - begun), 4), "moved": moved,
            "exit": code, "left": programs_left(), "after": drives.counts(), **begun_with, **told}


def main():
    interface, rounds, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    draw = random.Random(seed)
    drives = Drives("drives.csv")
    with open("daemon.log", "w", encoding="utf-8") as log:
        for i in range(rounds):
            print(json.dumps(one_round(KINDS[i % len(KINDS)], draw.uniform(0, 3), drives, interface, log)), flush=True)


if __name__ == "__main__":
    main()
