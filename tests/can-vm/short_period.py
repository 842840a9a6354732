#!/usr/bin/python3
"""The daemon with a period of 250 us on one slow core, in the five modes of the tick.

usage: short_period.py BUILD_DIR SOURCE_DIR [CONFIG...]         (skipped, exit code 77, without TRN_LONG)

The guest (guest.py) has one processor that runs an instruction in a nanosecond of its own time, whatever the host
does: tick, both planners, simulated drives and all clients share it. A program is cut as planned, under a sweep of the
override, with holds, line by line, and with a planner that stands for 1.5 s at a time. No period may be overrun.
"""
import json
import os
import pathlib
import re
import sys

import guest

MODES = ("planned", "override", "holds", "single_block", "late_planner")
MOVES = [(8, 3), (-5, 6), (3, -9), (-6, 4), (5, -8), (-5, 4)] * 4
STROKES = "".join(f"G1 X{x} Y{y} F3000\n" for x, y in MOVES)
PART = "G21 G94 G64 P0.02\nG91 G1 Z{0} F3000\n#1=0\no1 while [#1 lt 12]\n" + STROKES + "#1=[#1+1]\no1 endwhile\nM2\n"
RETREAT = {"hexapod": -60}  # its legs are near their shortest where it is homed: down, mm
SCRIPT = """trunnion daemon --machine machine.toml > daemon.log 2>&1 &
daemon=$!
ask() { trunnion "$@" --machine machine.toml --timeout 30; }
show() { echo "mode $1"; ask status --json; }
again() { ask stop > /dev/null; sleep 0.5; ask start > /dev/null; }
sleep 4
ask home --wait; ask load part.ngc
ask start --wait; show planned
again
for o in 10 150 60 200 30 120 80 100; do ask override $o; sleep 0.3; done
show override
again
for i in $(seq 1 8); do ask hold; sleep 0.2; ask resume; sleep 0.2; done
show holds
ask step on; again
for i in $(seq 1 20); do sleep 0.3; ask resume; done
show single_block
ask step off; again
for p in /proc/[0-9]*; do grep -q "(programs)" $p/stat && planner=${p#/proc/}; done
for i in 1 2 3; do kill -STOP $planner; sleep 1.5; kill -CONT $planner; sleep 0.5; done
show late_planner
kill $daemon; wait $daemon
"""


def run(config, build, source):
    text = (source / "configs" / f"{config}.toml").read_text()
    text, changed = re.subn(r"(?m)^period_s = 0\.001", "period_s = 0.00025", text)
    assert changed == 1, f"{config}: no period of 1 ms to shorten"
    text += "\n[realtime]\nlate_periods_max = 0\n"
    work = build / "can-vm" / f"short_period_{config}"
    work.mkdir(parents=True, exist_ok=True)
    root = guest.kernel_folder(build / "can-vm")
    files = {"machine.toml": text, "part.ngc": PART.format(RETREAT.get(config, 0))}
    guest.boot(work, root, guest.make_initramfs(work / "fs", root, [build / "trunnion"], ["vcan"], files, SCRIPT))
    lines = (work / "console.log").read_text().splitlines()
    good = True
    for mode in MODES:
        status = json.loads(lines[lines.index(f"mode {mode}") + 1])
        good &= status["overruns"] == 0 and status["periods"] > 20000 and status["realtime"]
        good &= status["state"] == "idle" if mode == "planned" else status["state"] in ("running", "holding")
        good &= status["program"] != "" and status["fault"] == "ok"
        good &= (status["starvations"] > 0) == (mode == "late_planner")
        print(f"{config} {mode}: {status['state']}, {status['periods']} periods so far, {status['overruns']} overruns, "
              f"{status['starvations']} starvations; tick p50 {status['tick_us_p50']:.1f}, worst "
              f"{status['tick_us_max']:.1f} us; late by at most {status['wake_us_max']:.1f} us", flush=True)
    return good


def main():
    if not os.environ.get("TRN_LONG"):
        guest.skip("minutes: set TRN_LONG")
    build, source = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
    good = [run(config, build, source) for config in sys.argv[3:] or ("mill", "cradle", "hexapod")]
    print("passed" if all(good) else "FAILED")
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
