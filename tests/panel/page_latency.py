#!/usr/bin/env python3
"""How long it takes from a press of a button to the first setpoint that moves, and from a setpoint to its number on the
page.

usage: page_latency.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR [PRESSES]

A real browser presses a jog button. The daemon records every setpoint; its messages tell at which time of the clock a
period was. Prints median and 99th percentile in ms.
"""
import csv
import json
import os
import statistics
import subprocess
import sys
import threading
import time

from panel_bench import PanelBench

JOINT = "X"


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


class Clock:
    """Which period was when, of the daemon's messages: a line through the earliest of them."""

    def __init__(self, bench):
        self.pairs = []
        self.process = subprocess.Popen([bench.binary, "monitor", "--json", "--machine", bench.config],
                                        stdout=subprocess.PIPE, text=True, env=bench.environment)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            message = json.loads(line)
            if "period" in message and "time_us" in message:
                self.pairs.append((message["period"], message["time_us"] / 1e3))

    def close(self):
        self.process.kill()
        self.process.wait()

    def wall_ms(self, period_s):
        """From the number of a period to ms of Unix time. A message comes behind its period, never before."""
        offset = min(at - 1e3 * period_s * period for period, at in self.pairs)
        return lambda period: offset + 1e3 * period_s * period


def trace_of(path):
    """(time_s of each period, places of the joint)."""
    with open(path, encoding="ascii") as file:
        rows = csv.reader(line for line in file if not line.startswith("#"))
        head = next(rows)
        time_at = next(i for i, name in enumerate(head) if name.startswith("t"))
        joint_at = next(i for i, name in enumerate(head) if JOINT in name)
        times, places = [], []
        for row in rows:
            if len(row) == len(head):
                times.append(float(row[time_at]))
                places.append(float(row[joint_at]))
    return times, places


def main():
    binary, source, page = (os.path.abspath(arg) for arg in sys.argv[1:4])
    presses = sys.argv[4] if len(sys.argv) > 4 else "60"
    bench = PanelBench(binary, source, daemon=False)
    clock = None
    try:
        bench.start_daemon("--record", bench.path("trace.csv"))
        bench.start_panel(page=page)
        time.sleep(1)
        clock = Clock(bench)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        done = subprocess.run(["node", os.path.join(source, "tests/panel/page_latency.mjs"), bench.origin, bench.key,
                               os.path.join(source, "panel/page"), presses], check=True, capture_output=True, text=True,
                              timeout=900, env=bench.environment | environment)
        seen = json.loads(done.stdout)
        bench.daemon.terminate()
        bench.daemon.wait()
        times, places = trace_of(bench.path("trace.csv"))
        period_s = times[1] - times[0]
        wall_ms = clock.wall_ms(period_s)
        at = [wall_ms(round(time_s / period_s)) for time_s in times]
        print(json.dumps({"presses": len(seen["presses"]), "shown": len(seen["shown"]),
                          "press_to_setpoint_ms": summary(press_delays(seen["presses"], at, places)),
                          "setpoint_to_pixel_ms": summary(shown_delays(seen["shown"], at, places))}, indent=1))
        return 0
    finally:
        if clock:
            clock.close()
        bench.close()


def summary(values):
    return {"count": len(values), "p50": round(statistics.median(values), 1), "p99": round(percentile(values, 0.99), 1),
            "max": round(max(values), 1)}


def press_delays(presses, at, places):
    """From each press to the first period in which the joint moves."""
    delays, i = [], 0
    for press in presses:
        while at[i] < press:
            i += 1
        begin = i
        while places[i + 1] == places[begin]:
            i += 1
        delays.append(at[i + 1] - press)
    return delays


def shown_delays(shown, at, places):
    """From the moment in which the joint was last told the shown place to the frame that shows it."""
    delays = []
    end = 0
    for when, place in shown:
        while end < len(at) and at[end] <= when:
            end += 1
        found = next((i for i in range(end - 1, max(0, end - 2000), -1) if abs(places[i] - place) < 0.0051), None)
        if found is not None:
            delays.append(when - at[found])
    return delays


if __name__ == "__main__":
    sys.exit(main())
