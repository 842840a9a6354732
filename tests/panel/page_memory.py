#!/usr/bin/env python3
"""The memory of a page that somebody uses while a program is cut again and again: it stays what it was.

usage: page_memory.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR [SECONDS]

Without SECONDS: 30, or TRN_LONG=SECONDS. In the short form the page must only not grow by more than it holds; from
600 s on the slopes behind the first third are judged.
"""
import json
import os
import subprocess
import sys
import threading
import time

from panel_bench import PATIENCE_S, PanelBench

WARM_UP = 1 / 3
JUDGED_FROM_S = 600
SLOPE_KB_MIN = 10  # of a heap of some 20 MB, beside what the samples themselves scatter
RUN_S_MAX = 300  # of the program, which takes 140
MORE_NODES = 400  # lines of messages and of a table that may be there or not


class Cutter:
    """Starts the program again whenever it has ended."""

    def __init__(self, bench, program):
        self.bench, self.runs, self.stopped = bench, 0, False
        end = time.monotonic() + PATIENCE_S
        while self.state() != "idle" and time.monotonic() < end:
            time.sleep(0.1)
        assert self.ask("home", "--wait", "--timeout", "60") == 0, "it cannot be homed"
        self.thread = threading.Thread(target=self._cut, args=(program,), daemon=True)
        self.thread.start()

    def ask(self, *words):
        return subprocess.run([self.bench.binary, *words, "--machine", self.bench.config], capture_output=True,
                              env=self.bench.environment, check=False).returncode

    def _cut(self, program):
        while not self.stopped:
            if self.ask("load", program) or self.ask("start"):
                time.sleep(1)
                continue
            self.runs += 1
            while not self.stopped and (state := self.state()) not in ("idle", "fault"):
                if state == "holding":
                    self.ask("resume")  # M6 waits for the tool
                time.sleep(1)

    def state(self):
        shown = subprocess.run([self.bench.binary, "status", "--json", "--machine", self.bench.config], text=True,
                               capture_output=True, env=self.bench.environment, check=False).stdout
        return json.loads(shown)["state"] if shown else "none"

    def close(self):
        self.stopped = True
        self.thread.join()


def slope(rows, key):
    """Per minute, with its standard error: a straight line through the samples."""
    n = len(rows)
    mean_s, mean = sum(row["s"] for row in rows) / n, sum(row[key] for row in rows) / n
    spread = sum((row["s"] - mean_s) ** 2 for row in rows)
    found = sum((row["s"] - mean_s) * (row[key] - mean) for row in rows) / spread
    left = sum((row[key] - mean - found * (row["s"] - mean_s)) ** 2 for row in rows)
    return 60 * found, 60 * (left / (n - 2) / spread) ** 0.5


def judge(rows, seconds):
    last, kept = rows[-1], [row for row in rows if row["s"] >= WARM_UP * seconds]
    first = rows[0]
    print(f"heap {first['heap'] / 1e6:.1f} to {last['heap'] / 1e6:.1f} MB, "
          f"elements {first['nodes']} to {last['nodes']}, "
          f"listeners {first['listeners']} to {last['listeners']}, in {len(rows)} rounds")
    assert last["heap"] < 2 * rows[0]["heap"] + 5e6, "the heap grows"
    if seconds < JUDGED_FROM_S:
        return
    for key, unit, most in (("heap", 1e3, SLOPE_KB_MIN), ("nodes", 1, MORE_NODES / 60), ("listeners", 1, 1)):
        found, error = slope(kept, key)
        print(f"{key}: {found / unit:.2f} +- {error / unit:.2f} {'kB' if unit == 1e3 else ''} a minute")
        assert found / unit < most + 3 * error / unit, f"{key} grow"


def main():
    binary, source, page = (os.path.abspath(arg) for arg in sys.argv[1:4])
    seconds = float(sys.argv[4]) if len(sys.argv) > 4 else float(os.environ.get("TRN_LONG", "30"))
    bench = PanelBench(binary, source, tools=os.path.join(source, "examples/tools.tbl"))
    cutter = None
    try:
        bench.start_panel(page=page)
        cutter = Cutter(bench, os.path.join(source, "examples/impeller.ngc"))
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        done = subprocess.run(["node", os.path.join(source, "tests/panel/page_memory.mjs"), bench.origin, bench.key,
                               os.path.join(source, "panel/page"), str(seconds)], check=True, text=True,
                              stdout=subprocess.PIPE, timeout=2 * seconds + 240, env=bench.environment | environment)
        visits, *rows = (json.loads(line) for line in done.stdout.splitlines())
        print(f"{visits['visits']} visits of the 3-D view leave {visits['canvases']} canvases behind")
        assert visits["canvases"] < visits["visits"] / 4, "each of them leaves its canvas behind"
        print(f"{cutter.runs} runs of the program were begun")
        assert cutter.runs > seconds / RUN_S_MAX
        judge(rows, seconds)
        print("passed")
        return 0
    finally:
        if cutter:
            cutter.close()
        bench.close()


if __name__ == "__main__":
    sys.exit(main())
