#!/usr/bin/python3
"""Instructions of a tick, mean and worst, of every shipped config in five modes: as planned, a sweep of the override,
holds and resumes, single block, a late planner.

  python3 bench/tick_table.py build/release/bench_tick [--ticks 1000] [--config cradle ...] [--mode override ...]
                              [--in-order-ghz 1.5] [--keep FOLDER] [--answers]

Counted by callgrind (Debian's valgrind), tick by tick, without the simulated plant and without the rate planner, which
the daemon runs in a thread of its own. The first hundred ticks, which fill the caches of nobody but stand before the
motion, are left out.

With --answers the rate planner is counted in its place: the instructions of each look for a question of the tick, with
the answer if there is one. An answer should take no longer than the lead of 2 ms, which is 3 million instructions on a
core that executes one a clock at 1.5 GHz. What takes longer comes late, and the plan in force is followed meanwhile.

With --in-order-ghz callgrind also simulates caches and branches, and a last column estimates the longest tick on a
core that executes one instruction a clock, in order: 10 clocks for a miss of the first cache and for a mispredicted
branch, 100 for a miss of the last cache (the weights of KCachegrind's cycle estimation).
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MODES = ("planned", "override", "holds", "single_block", "late_planner")
SKIPPED = 100
TICK, ANSWER = "trn::Cycle::tick()", "trn::RatePlannerThread::work()"
CLOCKS = {"Ir": 1, "Bcm": 10, "Bim": 10, "I1mr": 10, "D1mr": 10, "D1mw": 10, "ILmr": 100, "DLmr": 100, "DLmw": 100}


def count_in(part):
    """Instructions of one tick, and its estimated clocks."""
    text = part.read_text()
    match = re.search(r"^(?:summary|totals): ([\d ]+)", text, re.M)
    if not match:
        return 0, 0
    events = re.search(r"^events: (.+)", text, re.M).group(1).split()
    counts = dict(zip(events, map(int, match.group(1).split())))
    return counts["Ir"], sum(CLOCKS.get(event, 0) * count for event, count in counts.items())


def count_ticks(bench, name, ticks, caches, keep=None, counted=TICK):
    """Instructions and clocks of each tick. Callgrind writes a file for each, which is read and deleted at once. That
    of the longest tick is kept in the folder `keep`, for callgrind_annotate."""
    counts, longest = {}, 0
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "cg")
        simulated = ["--cache-sim=yes", "--branch-sim=yes"] if caches else []
        command = ["valgrind", "--tool=callgrind", *simulated, f"--toggle-collect={counted}", "--dump-line=no",
                   f"--dump-after={counted}", f"--callgrind-out-file={out}", bench,
                   f"--benchmark_filter=^{name}/iterations:1$"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   env={**os.environ, "TRN_LONG": str(ticks)})
        running = True
        while running:
            running = process.poll() is None
            parts = sorted((int(part.suffix[1:]), part) for part in Path(folder).glob("cg.*"))
            for number, part in parts[:-1] if running else parts:  # the last one may not be whole yet
                counts[number] = count_in(part)
                if keep and number > SKIPPED and counts[number][0] > longest:
                    longest = counts[number][0]
                    shutil.copy(part, Path(keep) / f"{name.replace('/', '_')}.callgrind")
                part.unlink()
            time.sleep(0.2 if running else 0)
        if process.returncode:
            sys.exit(f"{name}: callgrind ended with {process.returncode}")
    return [count for number, count in sorted(counts.items()) if number > SKIPPED and count[0] > 0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bench")
    parser.add_argument("--ticks", type=int, default=1000)
    parser.add_argument("--config", nargs="*")
    parser.add_argument("--mode", nargs="*", choices=MODES, default=MODES)
    parser.add_argument("--in-order-ghz", type=float)
    parser.add_argument("--answers", action="store_true", help="of the rate planner, not of the tick")
    parser.add_argument("--keep", metavar="FOLDER", help="keep callgrind's file of each mode's longest tick there")
    args = parser.parse_args()
    bench = str(Path(args.bench).resolve())
    configs = args.config or sorted(path.stem for path in (Path(__file__).parent.parent / "configs").glob("*.toml"))
    ghz = args.in_order_ghz
    if args.answers:
        heads = [f"{mode}: median, 99 %, worst, millions" for mode in args.mode]
    else:
        heads = [f"{mode}: mean, worst" for mode in args.mode] + ["worst over planned mean"]
    heads += [f"longest, in order at {ghz} GHz, us"] if ghz else []
    print("| config | " + " | ".join(heads) + " |")
    print("|---|" + "---|" * len(heads), flush=True)
    for config in configs:
        cells, worst, mean, clocks = [], 0, 0, 0
        for mode in args.mode:
            print(f"{config}/{mode}", end="\r", file=sys.stderr)
            counted = count_ticks(bench, f"{config}/{mode}", args.ticks, ghz is not None, args.keep,
                                  ANSWER if args.answers else TICK)
            if not counted:
                sys.exit(f"{config}/{mode}: no ticks were counted")
            counts = [instructions for instructions, _ in counted]
            clocks = max(clocks, *(estimate for _, estimate in counted))
            mean = mean or sum(counts) / len(counts)
            worst = max(worst, max(counts))
            if args.answers:
                answers = sorted(count for count in counts if count > 1000)  # the rest were looks without a question
                shown = (answers[int(share * (len(answers) - 1))] for share in (0.5, 0.99, 1))
                cells.append(", ".join(f"{count / 1e6:.2f}" for count in shown))
            else:
                cells.append(f"{sum(counts) / len(counts):.0f}, {max(counts)}")
        if not args.answers:
            cells.append(f"{worst / mean:.2f}")
        cells += [f"{clocks / ghz / 1000:.1f}"] if ghz else []
        print(f"| {config} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
