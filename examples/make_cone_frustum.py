#!/usr/bin/python3
"""Writes a five-axis test cut in the manner of ISO 10791-7: the flank of a cone frustum, its axis tilted against the
table, milled once around with the side of the tool, which lies along the cone. RTCP on; A and C follow the tool axis
u = (sin a sin c, sin a cos c, cos a) of the cradle without a jump of C.

usage: make_cone_frustum.py > cone_frustum.ngc
"""
import math

HALF_ANGLE = math.radians(15)
TILT = math.radians(10)
RADIUS_MM = 40.0
CENTRE = (10.0, -15.0, 20.0)
STEPS = 720


def tilted(v):
    """Turned about Y by the tilt."""
    c, s = math.cos(TILT), math.sin(TILT)
    return (c * v[0] + s * v[2], v[1], -s * v[0] + c * v[2])


def main():
    print("(cone frustum in the manner of ISO 10791-7: half angle 15, tilted by 10 deg; "
          "machine: ../configs/cradle.toml; tools: tools.tbl)")
    print("G21 G90 G94 G64 P0.005 R0.02\nT1 M6 G43 H1\nM428")
    last_c = 0.0
    for i in range(STEPS + 1):
        phi = 2 * math.pi * i / STEPS
        round_about = (math.cos(phi), math.sin(phi), 0.0)
        p = tilted(tuple(RADIUS_MM * x for x in round_about))
        inward = -math.sin(HALF_ANGLE)
        u = tilted((inward * round_about[0], inward * round_about[1], math.cos(HALF_ANGLE)))
        a, c = math.acos(u[2]), math.atan2(u[0], u[1])
        c += 2 * math.pi * round((last_c - c) / (2 * math.pi))
        last_c = c
        x, y, z = (p[k] + CENTRE[k] for k in range(3))
        words = f"X{x:.6f} Y{y:.6f} Z{z:.6f} A{math.degrees(a):.6f} C{math.degrees(c):.6f}"
        print(f"G0 {words}" if i == 0 else f"G1 {words}" + (" F1500" if i == 1 else ""))
    print("M429\nM2")


if __name__ == "__main__":
    main()
