#!/usr/bin/env python3
"""Starts a daemon on simulated drives and its panel, and lets page_day.mjs work at the page in a browser. Then the same
for a mill and page_screens.mjs, which looks at the page on screens of all sizes; CHECK: only these of its checks.

usage: page_day.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR [CHECK...]
"""
import json
import os
import shutil
import subprocess
import sys

from panel_bench import PanelBench

PROGRAM = "impeller.ngc"
TIMEOUT_S = 600
LONG_LINES = 20000


def browse(bench, source, script, *arguments):
    environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
    return subprocess.run(["node", os.path.join(source, "tests/panel", script), bench.origin, bench.key,
                           os.path.join(source, "panel/page"), *arguments], check=False, timeout=TIMEOUT_S,
                          env=bench.environment | environment).returncode


def day(binary, source, page, output):
    bench = PanelBench(binary, source, tools=os.path.join(source, "examples/tools.tbl"))
    try:
        shutil.copy(os.path.join(source, "examples", PROGRAM), bench.path("programs"))
        bench.start_panel(page=page)
        run = subprocess.run([binary, "run", os.path.join(source, "examples", PROGRAM), "--machine", bench.config,
                              "--tools", os.path.join(source, "examples/tools.tbl"), "--json"], capture_output=True,
                             text=True, check=True, timeout=TIMEOUT_S, env=bench.environment)
        failed = browse(bench, source, "page_day.mjs", output, PROGRAM, str(json.loads(run.stdout)["cycle_time_s"]))
        if failed:
            with open(bench.path("daemon.log"), encoding="utf-8") as log:
                sys.stderr.writelines(log.readlines()[-20:])
        return failed
    finally:
        shutil.copy(bench.path("daemon.log"), output)
        bench.close()


def screens(binary, source, page, output, checks):
    bench = PanelBench(binary, source, config="mill", tools=os.path.join(source, "examples/tools.tbl"))
    try:
        bench.write("programs/short.ngc", "G21 G90 G94\nG1 X40 F1200\nG1 Y30\nG2 X20 Y10 R20\nG0 X0 Y0\nM2\n")
        # A line of it takes a tenth of a second.
        steps = "".join(f"G1 X{1 + i % 2} F600\n" for i in range(LONG_LINES))
        bench.write("programs/long.ngc", f"G21 G90 G94\n{steps}M2\n")
        bench.start_panel(page=page)
        return browse(bench, source, "page_screens.mjs", output, "short.ngc", "long.ngc", *checks)
    finally:
        shutil.copy(bench.path("daemon.log"), os.path.join(output, "screens_daemon.log"))
        bench.close()


def main():
    binary, source, page, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    if not os.path.exists(os.path.join(page, "index.html")):
        sys.exit(f"the page is not built: cmake --build {os.path.dirname(page)} --target panel_page")
    os.makedirs(output, exist_ok=True)
    checks = sys.argv[5:]
    return (0 if checks else day(binary, source, page, output)) or screens(binary, source, page, output, checks)


if __name__ == "__main__":
    sys.exit(main())
