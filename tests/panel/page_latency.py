#!/usr/bin/env python3
"""How long it takes from a press of a button to the first setpoint that moves, and from a setpoint to its number on the
page.

usage: page_latency.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR [PRESSES]

A real browser presses a jog button. 'trunnion scope' records every setpoint, and the daemon's messages tell at which
time of the clock a period was. Prints median and 99th percentile in ms.
"""
import csv
import json
import os
import signal
import statistics
import subprocess
import sys
import threading

from panel_bench import PanelBench

SIGNAL = "X.plan"  # without corrections, which always move a little


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


class Clock:
    """Which period was when, of the daemon's messages: a line through the earliest of them."""

    def __init__(self, bench):
        self.pairs = []
        self.process = subprocess.Popen([bench.binary, "monitor", "--json", "--timeout", "30", "--machine",
                                         bench.config], stdout=subprocess.PIPE, text=True, env=bench.environment)
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


class Recorder:
    """Every setpoint of the joint, with the number of its period, as 'trunnion scope' has it."""

    def __init__(self, bench):
        self.path = bench.path("scope.csv")
        self.process = subprocess.Popen([bench.binary, "scope", SIGNAL, "--seconds", "3600", "--csv", self.path,
                                         "--timeout", "30", "--machine", bench.config], stdout=subprocess.DEVNULL,
                                        env=bench.environment)

    def rows(self):
        """(periods, places)."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=60)
        with open(self.path, encoding="ascii") as file:
            rows = csv.reader(line for line in file if not line.startswith("#"))
            head = [name.split(" ")[0] for name in next(rows)]
            period_at, place_at = head.index("period"), head.index(SIGNAL)
            found = [(int(row[period_at]), float(row[place_at])) for row in rows]
        return [period for period, _ in found], [place for _, place in found]


def period_of(bench):
    """Of the tick, s; waits until the daemon answers."""
    done = subprocess.run([bench.binary, "status", "--json", "--timeout", "30", "--machine", bench.config],
                          capture_output=True, text=True, check=True, env=bench.environment)
    return json.loads(done.stdout)["period_s"]


def main():
    binary, source, page = (os.path.abspath(arg) for arg in sys.argv[1:4])
    presses = sys.argv[4] if len(sys.argv) > 4 else "60"
    bench = PanelBench(binary, source)
    clock = None
    try:
        bench.start_panel(page=page)
        period_s = period_of(bench)
        clock, recorder = Clock(bench), Recorder(bench)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        done = subprocess.run(["node", os.path.join(source, "tests/panel/page_latency.mjs"), bench.origin, bench.key,
                               os.path.join(source, "panel/page"), presses], check=True, capture_output=True, text=True,
                              timeout=900, env=bench.environment | environment)
        seen = json.loads(done.stdout)
        periods, places = recorder.rows()
        wall_ms = clock.wall_ms(period_s)
        at = [wall_ms(period) for period in periods]
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
        while i + 1 < len(at) and places[i + 1] == places[begin]:
            i += 1
        if i + 1 < len(at) and at[i + 1] - press < 2000:  # else it was at a limit
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
