"""A mill in a workshop, and what its operator does there: for the tests that follow an operator through a day."""
import os
import re
import subprocess
import time
import unittest

import daemon_e2e
from daemon_e2e import Bench, rows

TABLE = "; the workshop's tools\nT1 P1 D6 Z+50 ;end mill\nT2 P2 Z+80 ;8 mm ball\n"


class Shop(Bench):
    """The shipped mill with a tool table and a file of variables."""

    def __init__(self, extra="", machine="mill"):
        super().__init__(machine=machine, extra=extra)
        self.vars = os.path.join(self.folder.name, "m.var")
        self.tools = self.write("tools.tbl", TABLE)

    def start(self, *options, idle=True):
        self.start_daemon("--vars", self.vars, "--tools", self.tools, *options, idle=idle)

    def parameter(self, number):
        if not os.path.exists(self.vars):
            return 0.0
        with open(self.vars) as file:
            return dict((int(a), float(b)) for a, b in (line.split() for line in file)).get(number, 0.0)

    def length(self, tool):
        with open(self.tools) as file:
            return float(re.search(rf"^T{tool} .*?Z([-+0-9.]+)", file.read(), re.M).group(1))

    def joints(self):
        return self.motion()[0]["q_setpoint"]

    def process_for_programs(self):
        for pid in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{pid}/stat", encoding="ascii") as file:
                    name, rest = file.read().rsplit(")", 1)
                maker = rest.split()[1]
                with open(f"/proc/{maker}/stat", encoding="ascii") as file:
                    daemon = file.read().rsplit(")", 1)[1].split()[1]
            except OSError:  # it has ended
                continue
            if name.endswith("(programs") and daemon == str(self.process.pid):
                return int(pid)
        raise AssertionError("no process plans programs")

    def kill(self):
        self.process.kill()
        self.process.wait()


def held_jog(shop, joint, *arguments):
    """A client that jogs, once the joint has moved by 2 mm, four times as far as without a word of its client. A busy
    host may keep it from saying in time that it is there: then the machine stops, rightly, and it is tried again."""
    for _ in range(5):
        before = shop.joints()[joint]
        client = subprocess.Popen([daemon_e2e.BINARY, "jog", *arguments, "--speed", "5", "--machine", shop.config],
                                  stderr=subprocess.PIPE, text=True)
        shop.until(lambda s: s["state"] != "idle")
        if shop.until(lambda s: s["state"] == "idle" or abs(shop.joints()[joint] - before) > 2)["state"] != "idle":
            return client
        client.kill()
        client.communicate()
    if (stall_s := longest_stall_s()) > 0.1:
        raise unittest.SkipTest(f"this host stands still for {stall_s:.2f} s at a time: nobody can hold a jog here")
    raise AssertionError(f"the jog ends by itself\n{shop.log_text()}")


def longest_stall_s():
    """By how much the latest of 300 sleeps of 10 ms is late: how long this host leaves a process alone."""
    times = [time.monotonic()]
    for _ in range(300):
        time.sleep(0.01)
        times.append(time.monotonic())
    return max(after - before for before, after in zip(times, times[1:])) - 0.01


def assert_replays(test, shop, record, log, least):
    """The session's log, replayed, moves the joints by the same bits. Returns the recorded places, `least` of them."""
    again = os.path.join(shop.folder.name, "again.csv")
    done = subprocess.run([daemon_e2e.BINARY, "replay", log, "--trace", again], text=True, capture_output=True)
    test.assertEqual(done.returncode, 0, done.stderr)
    first, second = (moving_xyz(rows(path)) for path in (record, again))
    test.assertGreater(min(len(first), len(second)), least)
    test.assertEqual(first[:len(second)], second[:len(first)])
    return first


def moving_xyz(trace):
    """The joint columns, as text, from the first motion on."""
    names = list(trace[0])
    joints = [tuple(row[name] for name in names[names.index("t_s") + 1:names.index("p_x")]) for row in trace]
    first = next(i for i, q in enumerate(joints) if any(float(value) != 0 for value in q))
    last = next(i for i in reversed(range(len(joints))) if joints[i] != joints[-1])
    return joints[first:last + 2]
