#!/usr/bin/env python3
"""Every shipped config at its page: what the machine is drawn of, and a picture of it; with a daemon behind it where
the drives are simulated. Then one machine with drawings of its own, which lie where and move as the config says.
Pictures: OUTPUT_DIR/machine_NAME.png.

usage: page_machines.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR [CONFIG...]
"""
import json
import os
import re
import subprocess
import sys

from page_client import get
from panel_bench import PanelBench

TIMEOUT_S = 300


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


# Corners of boxes in the base frame, and what they move with; the last one is behind the pole of A, below its axis.
BODIES = (("base", (-300, -300, -400), (300, 300, -300)), ("table", (-100, -100, -85), (100, 100, -75)),
          ("A", (-150, -80, -120), (-140, 60, 20)), ("Z", (-30, -30, 60), (30, 30, 400)))


def stl_of_box(low, high):
    """Twelve triangles, as text."""
    lines = ["solid box"]
    for axis in range(3):
        for side in (low, high):
            corners = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = [0, 0, 0]
                corner[axis] = side[axis]
                corner[(axis + 1) % 3] = (low, high)[a][(axis + 1) % 3]
                corner[(axis + 2) % 3] = (low, high)[b][(axis + 2) % 3]
                corners.append("vertex %g %g %g" % tuple(corner))
            for triangle in ((0, 1, 2), (0, 2, 3)):
                lines += ["facet normal 0 0 0", "outer loop", *(corners[i] for i in triangle), "endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box"]) + "\n"


def show_drawn(binary, source, page, output):
    bench = PanelBench(binary, source, daemon=False, config="cradle")
    try:
        with open(bench.config, "a", encoding="utf-8") as config:
            for i, (part, low, high) in enumerate(BODIES):
                bench.write(f"{i}.stl", stl_of_box(low, high))
                config.write(f'\n[[drawing]]\npart = "{part}"\nstl = "{i}.stl"\n')
        bench.start_panel(page=page)
        assert json.loads(get(bench, "/api/v1/machine")[1])["drawings"] == [part for part, _, _ in BODIES]
        for name in ("4", "-1", "x", "0.stl", "../0.stl", "", "0/"):
            assert get(bench, f"/api/v1/drawings/{name}")[0].status == 404, name
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        return subprocess.run(["node", os.path.join(source, "tests/panel/page_machines.mjs"), bench.origin, bench.key,
                               os.path.join(source, "panel/page"), os.path.join(output, "machine_drawn.png"), "alone",
                               json.dumps([[low, high] for _, low, high in BODIES])], check=False, timeout=TIMEOUT_S,
                              env=bench.environment | environment).returncode
    finally:
        bench.close()


def main():
    binary, source, page, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    os.makedirs(output, exist_ok=True)
    every = sorted(name.removesuffix(".toml") for name in os.listdir(os.path.join(source, "configs"))
                   if name.endswith(".toml"))
    wanted = sys.argv[5:] or [*every, "drawn"]
    failed = [name for name in wanted if (show_drawn(binary, source, page, output) if name == "drawn"
                                          else show(binary, source, page, output, name)) != 0]
    return f"the page of {', '.join(failed)} failed" if failed else 0


if __name__ == "__main__":
    sys.exit(main())
