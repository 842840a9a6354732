#!/usr/bin/env python3
"""What 50 pages and a recorder cost the daemon: its processor time with and without them. Above 5 % of a core it fails.

usage: page_load.py TRUNNION_BINARY SOURCE_DIR [SECONDS]

Pages read all that they are told. The daemon records every setpoint, and a second client reads it over the socket.
"""
import json
import os
import subprocess
import sys
import threading
import time

from page_client import Page
from panel_bench import PanelBench

PAGES = 50
MORE_MAX = 0.05  # of a core
TICKS = os.sysconf("SC_CLK_TCK")


def processor_s(pid):
    """What a process has used of the processor."""
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def share(pid, seconds):
    """Of a core, over that time."""
    before, begin = processor_s(pid), time.monotonic()
    time.sleep(seconds)
    return (processor_s(pid) - before) / (time.monotonic() - begin)


def read_all(page, counts):
    """What a page is told, until it is closed."""
    try:
        while (message := page.next()) is not None:
            counts[message["type"]] = counts.get(message["type"], 0) + 1
    except (OSError, ValueError):
        pass


def ticks(bench):
    """Lateness of the tick, as the daemon tells it."""
    out = subprocess.run([bench.binary, "status", "--json", "--machine", bench.config], capture_output=True, text=True,
                         check=True, env=bench.environment).stdout
    status = json.loads(out)
    return {name: status[name] for name in ("overruns", "wake_us_p50", "wake_us_p999", "tick_us_p50", "tick_us_p999")}


def main():
    binary, source = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 10
    bench = PanelBench(binary, source, daemon=False)
    monitor = None
    try:
        bench.start_daemon("--record", bench.path("trace.csv"))
        bench.start_panel()
        first = Page(bench)
        first.state("idle")
        first.close()
        time.sleep(1)
        alone, tick_alone = share(bench.daemon.pid, seconds), ticks(bench)
        pages = [Page(bench) for _ in range(PAGES)]
        counts = [{} for _ in pages]
        for page, count in zip(pages, counts):
            threading.Thread(target=read_all, args=(page, count), daemon=True).start()
        monitor = subprocess.Popen([binary, "monitor", "--json", "--machine", bench.config], stdout=subprocess.DEVNULL,
                                   env=bench.environment)
        time.sleep(2)
        panel_before = processor_s(bench.panel.pid)
        loaded = share(bench.daemon.pid, seconds)
        panel = (processor_s(bench.panel.pid) - panel_before) / seconds
        least = min(count.get("motion", 0) for count in counts)
        print(json.dumps({"daemon_alone": round(alone, 4), "daemon_with_pages": round(loaded, 4),
                          "more": round(loaded - alone, 4), "panel": round(panel, 3),
                          "motion_a_second_of_the_slowest_page": round(least / (seconds + 2), 1),
                          "tick_alone": tick_alone, "tick_with_pages": ticks(bench)}, indent=1))
        for page in pages:
            page.socket.close()
        if least < 1:
            return "a page was told nothing"
        return 0 if loaded - alone < MORE_MAX else "the pages cost the daemon more than 5 % of a core"
    finally:
        if monitor:
            monitor.kill()
            monitor.wait()
        bench.close()


if __name__ == "__main__":
    sys.exit(main())
