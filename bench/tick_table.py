#!/usr/bin/python3
"""Instructions of a tick, mean and worst, of every shipped config in five modes: as planned, a sweep of the override,
holds and resumes, single block, a late planner.

  python3 bench/tick_table.py build/release/bench_tick [--ticks 1000] [--config cradle ...]

Counted by callgrind (Debian's valgrind), tick by tick, without the simulated plant and without the rate planner, which
the daemon runs in a thread of its own. The first hundred ticks, which fill the caches of nobody but stand before the
motion, are left out.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MODES = ("planned", "override", "holds", "single_block", "late_planner")
SKIPPED = 100


def count_in(part):
    match = re.search(r"^(?:summary|totals): (\d+)", part.read_text(), re.M)
    return int(match.group(1)) if match else 0


def instructions(bench, name, ticks):
    """Of each tick. Callgrind writes a file for each, which is read and deleted at once."""
    counts = {}
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "cg")
        command = ["valgrind", "--tool=callgrind", "--toggle-collect=trn::Cycle::tick()", "--dump-line=no",
                   "--dump-after=trn::Cycle::tick()", f"--callgrind-out-file={out}", bench,
                   f"--benchmark_filter=^{name}/iterations:1$"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   env={**os.environ, "TRN_LONG": str(ticks)})
        running = True
        while running:
            running = process.poll() is None
            parts = sorted((int(part.suffix[1:]), part) for part in Path(folder).glob("cg.*"))
            for number, part in parts[:-1] if running else parts:  # the last one may not be whole yet
                counts[number] = count_in(part)
                part.unlink()
            time.sleep(0.2 if running else 0)
        if process.returncode:
            sys.exit(f"{name}: callgrind ended with {process.returncode}")
    return [count for number, count in sorted(counts.items()) if number > SKIPPED and count > 0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bench")
    parser.add_argument("--ticks", type=int, default=1000)
    parser.add_argument("--config", nargs="*")
    args = parser.parse_args()
    bench = str(Path(args.bench).resolve())
    configs = args.config or sorted(path.stem for path in (Path(__file__).parent.parent / "configs").glob("*.toml"))
    print("| config | " + " | ".join(f"{mode}: mean, worst" for mode in MODES) + " | worst over planned mean |")
    print("|---|" + "---|" * (len(MODES) + 1), flush=True)
    for config in configs:
        cells, worst, mean = [], 0, 0
        for mode in MODES:
            print(f"{config}/{mode}", end="\r", file=sys.stderr)
            counts = instructions(bench, f"{config}/{mode}", args.ticks)
            if not counts:
                sys.exit(f"{config}/{mode}: no ticks were counted")
            mean = mean or sum(counts) / len(counts)
            worst = max(worst, max(counts))
            cells.append(f"{sum(counts) / len(counts):.0f}, {max(counts)}")
        print(f"| {config} | " + " | ".join(cells) + f" | {worst / mean:.2f} |", flush=True)


if __name__ == "__main__":
    main()
