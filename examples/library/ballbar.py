#!/usr/bin/python3
"""Readings of a ball bar become the errors of the rotary axes: ballbar.py MACHINE.toml TEST.csv..."""
import sys

import numpy
import trunnion

if len(sys.argv) < 3:
    sys.exit(__doc__)
machine = trunnion.Machine(sys.argv[1])
traces = {}
for path in sys.argv[2:]:
    with open(path) as file:
        name = next(line.split()[2] for line in file if line.startswith("# test"))
    angle_deg, reading = numpy.loadtxt(path, delimiter=",", comments=("#", "a"), unpack=True)
    traces[name] = numpy.radians(angle_deg), reading
fit = machine.fit_ballbar(traces)
for name, (value, deviation) in fit.errors.items():
    print(f"{name:12} {value:12.7f} +- {deviation:.7f}")
print(f"{1000 * fit.rms:.3f} um are left of the readings")
