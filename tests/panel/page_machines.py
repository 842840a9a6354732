#!/usr/bin/env python3
"""Every shipped config at its page: what the machine is drawn of, and a picture of it; with a daemon behind it where
the drives are simulated. Pictures: OUTPUT_DIR/machine_NAME.png.

usage: page_machines.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR [CONFIG...]
"""
import json
import os
import re
import subprocess
import sys

from page_client import get
from panel_bench import PanelBench

TIMEOUT_S = 120


def drives_are_simulated(source, config):
    with open(os.path.join(source, "configs", config + ".toml"), encoding="utf-8") as file:
        return re.search(r'(?m)^type = "(canopen|modbus)"', file.read()) is None


def check_chain(machine, name):
    """Each joint is drawn once."""
    chain, count = machine["kinematics"], len(machine["joints"])
    if chain["type"] == "serial":
        drawn = [axis["joint"] for axis in chain["tool"] + chain["work"] if axis["joint"] >= 0]
        assert sorted(drawn) == list(range(count)), f"{name}: {drawn}"
    else:
        assert len(chain["actuators"]) == count == {"hexapod": 6, "rail_mill": 4}[chain["type"]], name


def show(binary, source, page, output, config):
    live = drives_are_simulated(source, config)
    bench = PanelBench(binary, source, daemon=live, config=config)
    try:
        bench.start_panel(page=page)
        check_chain(json.loads(get(bench, "/api/v1/machine")[1]), config)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        return subprocess.run(["node", os.path.join(source, "tests/panel/page_machines.mjs"), bench.origin, bench.key,
                               os.path.join(source, "panel/page"), os.path.join(output, f"machine_{config}.png"),
                               "live" if live else "alone"], check=False, timeout=TIMEOUT_S,
                              env=bench.environment | environment).returncode
    finally:
        bench.close()


def main():
    binary, source, page, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    os.makedirs(output, exist_ok=True)
    every = sorted(name.removesuffix(".toml") for name in os.listdir(os.path.join(source, "configs"))
                   if name.endswith(".toml"))
    failed = [config for config in sys.argv[5:] or every if show(binary, source, page, output, config) != 0]
    return f"the page of {', '.join(failed)} failed" if failed else 0


if __name__ == "__main__":
    sys.exit(main())
