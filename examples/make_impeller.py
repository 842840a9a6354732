#!/usr/bin/python3
"""Writes impeller.ngc: finishing the channels of an impeller-like part, five axes at once.

The hub is a quarter ellipse turned about Z; the channels wind around it. A ball nose runs along each channel:
three passes on the floor, one along each blade. The tool leans out of the hub's own normal so that it clears the
neighbouring blades, which makes A and C move all the time. Program zero is where the cradle's A and C cross, so the
part stands on the table at Z-75; X Y Z are the ball's tip on the part (RTCP).

usage: make_impeller.py > impeller.ngc
"""
import math

BLADES = 7
PASSES = (-1.0, -0.45, 0.0, 0.45, 1.0)  # across the channel: blade, floor, floor, floor, blade
WRAP_DEG = 55.0                          # how far a channel winds around the hub
HALF_WIDTH_DEG = (13.0, 16.0)            # of a channel, at its top and at its bottom
LEAN_DEG = (62.0, 18.0)                  # tool axis from the vertical, at the top and at the bottom
SIDE_LEAN_DEG = 9.0                      # away from the blade
BALL_RADIUS = 3.0
STEP = 0.7                               # mm between points
RETRACT = 60.0                           # mm along the tool axis

HEADER = """%
(impeller: the channels of a seven-bladed impeller, five axes at once, written by make_impeller.py)
(shows: RTCP with A and C moving in every block, moves of 0.7 mm kept fast by G64, rapids that turn the table)
(machine: ../configs/cradle.toml; tools: tools.tbl, tool 1 is a ball nose of 6 mm, 100 mm long)
(program zero: where A and C cross; the part stands on the table, 75 mm below)
G21 G17 G40 G49 G80 G90 G94
T1 M6
S9000 M3
G53 G0 Z450
G0 X0 Y0 A0 C0
M8
G43.4 H1 (RTCP on, length of tool 1)
G64 P0.01 R0.05 (tip 0.01 mm, tool axis 0.05 deg)
G0 Z60
"""

FOOTER = """G0 Z120 A0
G49 (RTCP off)
G53 G0 Z450
M9 M5
M30
%
"""


def blend(ends, t):
    """From the first to the second value, level at both ends."""
    return ends[0] + (ends[1] - ends[0]) * t * t * (3 - 2 * t)


def hub(t):
    """Radius and height of the hub and its outward normal in that half plane, t = 0 at the top."""
    angle = t * math.pi / 2
    r, z = 12 + 30 * (1 - math.cos(angle)), -15 - 45 * math.sin(angle)
    nr, nz = 45 * math.cos(angle), 30 * math.sin(angle)
    norm = math.hypot(nr, nz)
    return r, z, nr / norm, nz / norm


def pose(blade, across, t):
    """Ball tip and tool axis, in the part."""
    r, z, nr, nz = hub(t)
    half_width = math.radians(blend(HALF_WIDTH_DEG, t))
    wrap = math.radians(WRAP_DEG) * t * t * (3 - 2 * t)
    theta = 2 * math.pi * blade / BLADES + wrap + across * half_width
    radial, around = (math.cos(theta), math.sin(theta)), (-math.sin(theta), math.cos(theta))
    lean, side = math.radians(blend(LEAN_DEG, t)), -across * math.radians(SIDE_LEAN_DEG)
    u = [math.cos(side) * math.sin(lean) * radial[i] + math.sin(side) * around[i] for i in (0, 1)]
    u.append(math.cos(side) * math.cos(lean))
    ball = [(r + BALL_RADIUS * nr) * radial[0], (r + BALL_RADIUS * nr) * radial[1], z + BALL_RADIUS * nz]
    return [ball[i] - BALL_RADIUS * u[i] for i in range(3)], u


def words(u, c_before):
    """A (downward tilt, never positive) and C in degrees for the tool axis u; C is the turn nearest to the last."""
    a = -math.degrees(math.acos(max(-1.0, min(1.0, u[2]))))
    c = math.degrees(math.atan2(-u[0], -u[1]))
    return a, c + 360 * round((c_before - c) / 360)


def channel_points(blade, across, downward):
    """Poses along a channel, STEP apart."""
    fine = [pose(blade, across, i / 2000) for i in range(2001)]
    if not downward:
        fine.reverse()
    points, travelled, wanted = [fine[0]], 0.0, STEP
    for before, here in zip(fine, fine[1:]):
        travelled += math.dist(before[0], here[0])
        if travelled >= wanted:
            points.append(here)
            wanted += STEP
    return points + [fine[-1]]


def main():
    print(HEADER, end="")
    c = 0.0
    for blade in range(BLADES):
        for index, across in enumerate(PASSES):
            points = channel_points(blade, across, index % 2 == 0)
            print(f"(channel {blade + 1}, pass {index + 1})")
            for number, (p, u) in enumerate(points):
                a, c = words(u, c)
                if number == 0:
                    away = [p[i] + RETRACT * u[i] for i in range(3)]
                    print(f"G0 X{away[0]:.4f} Y{away[1]:.4f} Z{away[2]:.4f} A{a:.4f} C{c:.4f}")
                    print(f"G1 X{p[0]:.4f} Y{p[1]:.4f} Z{p[2]:.4f} F3000")
                    print("F1800")
                else:
                    print(f"X{p[0]:.4f} Y{p[1]:.4f} Z{p[2]:.4f} A{a:.4f} C{c:.4f}")
            away = [points[-1][0][i] + RETRACT * points[-1][1][i] for i in range(3)]
            print(f"G0 X{away[0]:.4f} Y{away[1]:.4f} Z{away[2]:.4f}")
    print(FOOTER, end="")


if __name__ == "__main__":
    main()
