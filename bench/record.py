#!/usr/bin/python3
"""Writes down what every benchmark takes, so that a slowdown between two releases is seen.

  bench/record.py build/release                     beside the last record: what became slower or faster
  bench/record.py build/release --write 0.2.0       the same, and keeps it in bench/records.json under that name
  bench/record.py build/release --only bench_speed  of one program

Times are told in units of `bench_reference`, a fixed piece of work: that takes the computer out of the figure,
roughly. Each time is the shortest of some repetitions, so that a busy host does harm only if it is busy all the time.
Ticks are counted in instructions by callgrind, which no host disturbs. A figure that is worse by more than a tenth
(ticks: by more than a fiftieth) is marked.

Exit codes: 0 nothing is marked, 1 something is, 5 usage.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

RECORDS = Path(__file__).resolve().parent / "records.json"
TICKED = ("mill", "cradle", "cradle_measured", "hexapod", "micro_stage")
TICKS = 2000
WORSE_TIME, WORSE_TICK = 1.10, 1.02
UNIT_NS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}


def times_of(program, repetitions, least_s):
    """Nanoseconds of each benchmark of a program: the shortest of all repetitions."""
    with tempfile.NamedTemporaryFile(suffix=".json") as out:
        done = subprocess.run([program, f"--benchmark_out={out.name}", "--benchmark_out_format=json",
                               f"--benchmark_repetitions={repetitions}", f"--benchmark_min_time={least_s}"],
                              capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{program} ended with {done.returncode}: {done.stderr.strip()[-300:]}")
        runs = json.load(open(out.name, encoding="utf-8"))["benchmarks"]
    times = {}
    for run in runs:
        if run.get("run_type") == "aggregate" or run.get("error_occurred"):
            continue
        nanoseconds = run["cpu_time"] * UNIT_NS[run["time_unit"]]
        times[run["run_name"]] = min(nanoseconds, times.get(run["run_name"], nanoseconds))
    return times


def instructions_of_ticks(build, config, ticks):
    """Mean of a tick as planned, without the simulated plant."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(["valgrind", "--tool=callgrind", "--toggle-collect=trn::Cycle::tick()",
                               f"--callgrind-out-file={folder}/out", str(build / "bench_tick"),
                               f"--benchmark_filter=^{config}/planned/iterations:1$"], capture_output=True, text=True,
                              env={**os.environ, "TRN_LONG": str(ticks)})
        found = re.search(r"Collected : (\d+)", done.stderr)
        if done.returncode or not found:
            sys.exit(f"callgrind of {config}: {done.stderr.strip()[-300:]}")
        return int(found.group(1)) / ticks


def measure(build, only, short):
    repetitions, least_s = (1, 0.001) if short else (7, 0.05)
    programs = sorted(path for path in build.glob("bench_*") if os.access(path, os.X_OK) and path.is_file())
    programs = [path for path in programs if path.name not in ("bench_reference", "bench_tick")]
    if not programs:
        sys.exit(f"{build}: no bench_* programs are built there")
    figures = {}
    for program in programs:
        if only and program.name != only:
            continue
        print(program.name, end=" ", file=sys.stderr, flush=True)
        reference = [times_of(build / "bench_reference", repetitions, least_s)["reference"]]
        times = times_of(program, repetitions, least_s)
        reference.append(times_of(build / "bench_reference", repetitions, least_s)["reference"])
        figures |= {f"{program.name}/{name}": time / min(reference) for name, time in times.items()}
    for config in TICKED[:1] if short else TICKED:
        if only in (None, "bench_tick"):
            print(f"tick of {config}", end=" ", file=sys.stderr, flush=True)
            figures[f"bench_tick/{config}"] = instructions_of_ticks(build, config, 200 if short else TICKS)
    print(file=sys.stderr)
    return figures


def compare(figures, before, name_before):
    """Prints both; the names of what is marked."""
    marked = []
    print(f"{'benchmark':58} {name_before:>12} {'now':>12} {'change':>8}")
    for name, now in sorted(figures.items()):
        was = before.get(name)
        ratio = now / was if was else 1
        worse = ratio > (WORSE_TICK if name.startswith("bench_tick/") else WORSE_TIME)
        marked += [name] if worse else []
        change = f"{100 * (ratio - 1):+7.1f}%" if was else "    new"
        print(f"{name:58} {was or 0:12.5g} {now:12.5g} {change:>8}{'  slower' if worse else ''}")
    for name in sorted(set(before) - set(figures)):
        print(f"{name:58} {before[name]:12.5g} {'-':>12}    gone")
    return marked


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path)
    parser.add_argument("--write", metavar="RELEASE")
    parser.add_argument("--only", metavar="PROGRAM")
    parser.add_argument("--short", action="store_true", help="that it runs, not how fast: for the tests")
    parser.error = lambda text: (print(f"{parser.prog}: {text}", file=sys.stderr), sys.exit(5))
    args = parser.parse_args()
    if args.write and (args.only or args.short):
        parser.error("a release is written whole: not with --only or --short")
    records = json.loads(RECORDS.read_text(encoding="utf-8")) if RECORDS.exists() else {}
    figures = measure(args.build, args.only, args.short)
    name_before = list(records)[-1] if records else "none"
    before = records.get(name_before, {})
    if args.only:
        before = {name: value for name, value in before.items() if name.startswith(args.only + "/")}
    if args.short:
        unknown = [name for name in before if name.split("/")[0] != "bench_tick" and name not in figures]
        if unknown:
            sys.exit(f"recorded and no longer there (write a new record): {', '.join(unknown)}")
        return 0
    marked = compare(figures, before, name_before)
    if args.write:
        records[args.write] = {name: float(f"{value:.5g}") for name, value in sorted(figures.items())}
        RECORDS.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
    return 1 if marked else 0


if __name__ == "__main__":
    sys.exit(main())
