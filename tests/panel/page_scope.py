#!/usr/bin/env python3
"""Starts a daemon on simulated drives and its panel, and lets page_scope.mjs work at the scope in a browser.

usage: page_scope.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR
"""
import os
import subprocess
import sys

from panel_bench import PanelBench

TIMEOUT_S = 300


def main():
    binary, source, page, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    os.makedirs(output, exist_ok=True)
    bench = PanelBench(binary, source)
    try:
        bench.start_panel(page=page)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        return subprocess.run(["node", os.path.join(source, "tests/panel/page_scope.mjs"), bench.origin, bench.key,
                               os.path.join(source, "panel/page"), output, binary, bench.config], check=False,
                              timeout=TIMEOUT_S, env=bench.environment | environment).returncode
    finally:
        bench.close()


if __name__ == "__main__":
    sys.exit(main())
