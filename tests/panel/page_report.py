#!/usr/bin/env python3
"""Runs the impeller with --report, and lets page_report.mjs look at the path in a browser, from the file.

usage: page_report.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR
"""
import json
import os
import subprocess
import sys
import tempfile

TIMEOUT_S = 300


def main():
    binary, source, _, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    os.makedirs(output, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([binary, "run", os.path.join(source, "examples/impeller.ngc"), "--report", folder,
                               "--json"], capture_output=True, text=True, check=True, timeout=TIMEOUT_S)
        told = json.loads(done.stdout)
        return subprocess.run(["node", os.path.join(source, "tests/panel/page_report.mjs"),
                               os.path.join(folder, "path.html"), os.path.join(source, "panel/page"), output,
                               str(told["cycle_time_s"]), str(told["deviation"]["tip_mm"]["value"])], check=False,
                              timeout=TIMEOUT_S).returncode


if __name__ == "__main__":
    sys.exit(main())
