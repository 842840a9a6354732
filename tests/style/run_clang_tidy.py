#!/usr/bin/python3
"""Runs clang-tidy (.clang-tidy) on sources of the build folder's compile_commands.json.

usage: run_clang_tidy.py BUILD_FOLDER [FILE...]     without files: every .cc of the repository
"""
import json
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from source_text import ROOT

# What g++ knows and clang does not, and precompiled headers made by g++.
DROPPED = re.compile(r"\s-Winvalid-pch|\s-include\s+\S*cmake_pch\S*|\s-fno-sanitize-recover=\S+")


def database(build, folder):
    """A copy of the compile commands that clang can read; returns the repository's own sources."""
    entries = json.loads((Path(build) / "compile_commands.json").read_text())
    own = []
    for entry in entries:
        entry["command"] = DROPPED.sub("", entry["command"])
        name = os.path.relpath(entry["file"], ROOT)
        if not name.startswith(("build/", "..")) and "cmake_pch" not in name:
            own.append(name)
    (Path(folder) / "compile_commands.json").write_text(json.dumps(entries))
    return sorted(set(own))


def main():
    if len(sys.argv) < 2:
        print(__doc__)
        return 5
    with tempfile.TemporaryDirectory() as folder:
        own = database(sys.argv[1], folder)
        files = sys.argv[2:] or own

        def run(name):
            command = ["clang-tidy", "--quiet", "-p", folder, name]
            return name, subprocess.run(command, cwd=ROOT, capture_output=True, text=True)

        failed = 0
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            for count, (name, result) in enumerate(pool.map(run, files), 1):
                print(f"[{count}/{len(files)}] {name}{' FAILED' if result.returncode else ''}", flush=True)
                if result.returncode:
                    failed += 1
                    print(result.stdout, result.stderr)
                elif result.stdout.strip():
                    print(result.stdout)
    print(f"clang-tidy: {len(files) - failed} passed, {failed} failed")
    return 1 if failed or not files else 0


if __name__ == "__main__":
    sys.exit(main())
