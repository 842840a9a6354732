#!/usr/bin/python3
"""What each joint uses of its limits in a program: limits.py MACHINE.toml PROGRAM.ngc [TOOLS.tbl]"""
import sys

import numpy
import trunnion

if len(sys.argv) < 3:
    sys.exit(__doc__)
machine = trunnion.Machine(sys.argv[1])
motion = machine.plan(sys.argv[2], tools=sys.argv[3] if len(sys.argv) > 3 else "")
print(f"{motion.time[-1]:.2f} s on {machine.name}")
for i, joint in enumerate(machine.joints):
    place = motion.position[:, i]
    used = [abs(numpy.diff(place, order)).max() / machine.period**order / most
            for order, most in enumerate((joint.velocity_max, joint.acceleration_max, joint.jerk_max), 1)]
    print(f"{joint.name}: {100 * used[0]:.0f} % of its velocity, {100 * used[1]:.0f} % of its acceleration, "
          f"{100 * used[2]:.0f} % of its jerk")
