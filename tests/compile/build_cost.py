#!/usr/bin/env python3
"""What a clean build reads: build_cost.py COMPILE_COMMANDS [--table]

Counts the preprocessed lines of every source of the build, behind the precompiled headers, which are read once. Seconds
differ from one computer to the next; these lines do not, and a header that spreads shows at once. Both bounds are told
per line and per file of our own, so that they hold while the project grows. gcc compiles a source at the optimisation
of the precompiled headers that it takes, whatever its own command says: where the two differ, that is told. Ends with
1 beyond a bound or where they differ, 77 where sources are compiled one at a time (TRN_UNITY=OFF).
"""
import json
import os
import re
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
READ_PER_LINE_MAX = 14   # 12.8 when this was written
SOURCES_PER_UNIT_MIN = 8  # sources are compiled some at a time; 8.6 when this was written


def lines_of(entry):
    words = [word for word in shlex.split(entry["command"]) if word != "-Winvalid-pch"]
    start = next(i for i, word in enumerate(words) if word.endswith("++"))
    out = words.index("-o")
    command = words[start:out] + words[out + 2:]
    command[command.index("-c")] = "-E"
    text = subprocess.run(command + ["-fpch-preprocess", "-P"], cwd=entry["directory"], capture_output=True, check=True)
    return text.stdout.count(b"\n")


def optimisation(words):
    levels = [word for word in words if re.fullmatch(r"-O\w*", word)]
    return levels[-1] if levels else "-O0"


def differing_levels(entries):
    """Sentences, one for each source that asks for another optimisation than its precompiled headers."""
    commands = [(entry, shlex.split(entry["command"])) for entry in entries]
    levels = {entry["file"].removesuffix(".cxx"): optimisation(words)
              for entry, words in commands if entry["file"].endswith("cmake_pch.hxx.cxx")}
    out = []
    for entry, words in commands:
        for option, header in zip(words, words[1:]):
            if option == "-include" and header in levels and levels[header] != optimisation(words):
                out.append(f"{entry['file']}: {optimisation(words)}, but its precompiled headers are made with "
                           f"{levels[header]}, which counts")
    return out


def own_sources():
    """How many sources, and how many lines, with their headers."""
    done = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.cc", "*.h"], cwd=ROOT,
                          capture_output=True, text=True, check=True)
    files = [ROOT / name for name in done.stdout.split() if (ROOT / name).is_file()]
    return sum(path.suffix == ".cc" for path in files), sum(path.read_bytes().count(b"\n") for path in files)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        every = json.load(file)
    entries = [entry for entry in every if "cmake_pch" not in entry["file"]]
    if not any("/Unity/" in entry["file"] for entry in entries):
        print("the sources are compiled one at a time: nothing to count")
        return 77
    wrong = differing_levels(every)
    print("\n".join(wrong), end="\n" if wrong else "")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        lines = list(pool.map(lines_of, entries))
    if "--table" in sys.argv:
        for count, entry in sorted(zip(lines, entries), key=lambda pair: -pair[0]):
            print(f"{count:8} {os.path.relpath(entry['file'], entry['directory'])}")
    sources, own = own_sources()
    read_per_line, sources_per_unit = sum(lines) / own, sources / len(entries)
    print(f"{sum(lines)} lines behind the precompiled headers, {read_per_line:.1f} for each of our own (at most "
          f"{READ_PER_LINE_MAX}); {len(entries)} units of {sources_per_unit:.1f} sources (at least "
          f"{SOURCES_PER_UNIT_MIN})")
    return 0 if not wrong and read_per_line <= READ_PER_LINE_MAX and sources_per_unit >= SOURCES_PER_UNIT_MIN else 1


sys.exit(main())
