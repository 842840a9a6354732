#!/usr/bin/python3
"""Checks that every C++ file stands as clang-format would write it. Exit 77 (skipped) where there is none."""
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

from source_text import ROOT, source_files


def check(files):
    command = ["clang-format", "--dry-run", "-Werror", "--ferror-limit=3", *files]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


def main():
    if not shutil.which("clang-format"):
        print("clang-format is not installed: skipped")
        return 77
    files = source_files(".h", ".cc")
    batches = [files[i:i + 16] for i in range(0, len(files), 16)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(check, batches))
    for result in results:
        sys.stdout.write(result.stderr)
    failed = any(result.returncode for result in results)
    state = "some are not formatted: clang-format -i FILE mends it" if failed else "all formatted"
    print(f"{len(files)} files, {state}")
    return 1 if failed or not files else 0


if __name__ == "__main__":
    sys.exit(main())
