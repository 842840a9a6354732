#!/usr/bin/env python3
"""Starts a daemon on simulated drives and its panel with TLS and users, and lets page_log_in.mjs work at the page.

usage: page_log_in.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR
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
        bench.start_panel_with_log_in(page=page)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        return subprocess.run(["node", os.path.join(source, "tests/panel/page_log_in.mjs"), bench.origin,
                               os.path.join(source, "panel/page"), output], check=False, timeout=TIMEOUT_S,
                              env=bench.environment | environment).returncode
    finally:
        bench.close()


if __name__ == "__main__":
    sys.exit(main())
