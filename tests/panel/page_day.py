#!/usr/bin/env python3
"""Starts a daemon on simulated drives and its panel, and lets page_day.mjs work at the page in a browser.

usage: page_day.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR
"""
import json
import os
import shutil
import subprocess
import sys

from panel_bench import PanelBench

PROGRAM = "impeller.ngc"
TIMEOUT_S = 600


def main():
    binary, source, page, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    if not os.path.exists(os.path.join(page, "index.html")):
        sys.exit(f"the page is not built: cmake --build {os.path.dirname(page)} --target panel_page")
    os.makedirs(output, exist_ok=True)
    bench = PanelBench(binary, source, tools=os.path.join(source, "examples/tools.tbl"))
    try:
        shutil.copy(os.path.join(source, "examples", PROGRAM), bench.path("programs"))
        bench.start_panel(page=page)
        run = subprocess.run([binary, "run", os.path.join(source, "examples", PROGRAM), "--machine", bench.config,
                              "--tools", os.path.join(source, "examples/tools.tbl"), "--json"], capture_output=True,
                             text=True, check=True, timeout=TIMEOUT_S, env=bench.environment)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        return subprocess.run(["node", os.path.join(source, "tests/panel/page_day.mjs"), bench.origin, bench.key,
                               os.path.join(source, "panel/page"), output, PROGRAM,
                               str(json.loads(run.stdout)["cycle_time_s"])], check=False, timeout=TIMEOUT_S,
                              env=bench.environment | environment).returncode
    finally:
        shutil.copy(bench.path("daemon.log"), output)
        bench.close()


if __name__ == "__main__":
    sys.exit(main())
