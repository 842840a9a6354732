#!/usr/bin/env python3
"""Measures how fluent the page shows the plans of programs: the impeller of examples/, or those that are named.

usage: page_frames.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR [PROGRAM...]
"""
import os
import shutil
import subprocess
import sys

from panel_bench import PanelBench

TIMEOUT_S = 300


def main():
    binary, source, page, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    programs = sys.argv[5:] or [os.path.join(source, "examples/impeller.ngc")]
    os.makedirs(output, exist_ok=True)
    bench = PanelBench(binary, source, tools=os.path.join(source, "examples/tools.tbl"))
    try:
        for program in programs:
            shutil.copy(program, bench.path("programs"))
        bench.start_panel(page=page)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        return subprocess.run(["node", os.path.join(source, "tests/panel/page_frames.mjs"), bench.origin, bench.key,
                               os.path.join(source, "panel/page"), output, *map(os.path.basename, programs)],
                              check=False, timeout=TIMEOUT_S, env=bench.environment | environment).returncode
    finally:
        bench.close()


if __name__ == "__main__":
    sys.exit(main())
