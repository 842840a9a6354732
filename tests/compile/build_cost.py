#!/usr/bin/env python3
"""What a clean build reads: build_cost.py COMPILE_COMMANDS [--table]

Counts the preprocessed lines of every source of the build, behind the precompiled headers, which are read once. Seconds
differ from one computer to the next; these lines do not, and a header that spreads shows at once. Ends with 1 above the
bound, 77 where sources are compiled one at a time (TRN_UNITY=OFF).
"""
import json
import os
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

LINES_MAX = 2_850_000  # 2.6 million before the library, the scope, tuning, gantries and commissioning
UNITS_MAX = 116


def lines_of(entry):
    words = [word for word in shlex.split(entry["command"]) if word != "-Winvalid-pch"]
    start = next(i for i, word in enumerate(words) if word.endswith("++"))
    out = words.index("-o")
    command = words[start:out] + words[out + 2:]
    command[command.index("-c")] = "-E"
    text = subprocess.run(command + ["-fpch-preprocess", "-P"], cwd=entry["directory"], capture_output=True, check=True)
    return text.stdout.count(b"\n")


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        entries = [entry for entry in json.load(file) if "cmake_pch" not in entry["file"]]
    if not any("/Unity/" in entry["file"] for entry in entries):
        print("the sources are compiled one at a time: nothing to count")
        return 77
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        lines = list(pool.map(lines_of, entries))
    if "--table" in sys.argv:
        for count, entry in sorted(zip(lines, entries), key=lambda pair: -pair[0]):
            print(f"{count:8} {os.path.relpath(entry['file'], entry['directory'])}")
    print(f"{len(entries)} units (at most {UNITS_MAX}), {sum(lines)} lines behind the precompiled headers "
          f"(at most {LINES_MAX})")
    return 0 if len(entries) <= UNITS_MAX and sum(lines) <= LINES_MAX else 1


sys.exit(main())
