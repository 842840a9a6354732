#!/usr/bin/python3
"""Draws what several machines made of one program: their tips in the work, side by side, and how they differ.

usage: draw_part.py NAME=TRACE.csv NAME=TRACE.csv ... > part.svg
The traces come from `trunnion run PROGRAM --machine CFG --trace TRACE.csv`. The first is the one that the others
are compared with. Needs numpy and scipy.
"""
import csv
import sys

import numpy as np
from scipy.spatial import cKDTree

PANEL, GAP, TOP = 360, 30, 70
COLOURS = ("#1b6ca8", "#b5361c", "#2c7a2c", "#7a3c8f")


def load(path):
    """Tips (n, 3), axes (n, 3) and lines of a trace, standing samples left out."""
    with open(path, encoding="ascii") as file:
        rows = csv.reader(file)
        header = next(rows)
        first = header.index("p_x")
        data = np.array([[float(value) for value in row[first:]] for row in rows])
    moving = np.r_[True, np.linalg.norm(np.diff(data[:, :3], axis=0), axis=1) > 1e-9]
    data = data[moving]
    return data[:, :3], data[:, 3:6], data[:, 6].astype(int)


def view(points):
    """Isometric view: right and up in mm."""
    x, y, z = points.T
    return np.c_[(x - y) * np.cos(np.pi / 6), z + (x + y) * 0.5 * 0.6]


def difference(one, other):
    """Greatest distance of one's tips from the other's path, and greatest angle of the axes there, deg."""
    tips, axes, _ = one
    tree = cKDTree(other[0])
    near = tree.query(tips)[1]
    worst = np.full(len(tips), np.inf)
    for step in (-1, 1):  # the two pieces of path that meet in the nearest sample
        a = other[0][near]
        b = other[0][np.clip(near + step, 0, len(other[0]) - 1)]
        way = b - a
        length2 = np.maximum((way * way).sum(axis=1), 1e-300)
        share = np.clip(((tips - a) * way).sum(axis=1) / length2, 0, 1)[:, None]
        worst = np.minimum(worst, np.linalg.norm(a + share * way - tips, axis=1))
    angles = np.linalg.norm(np.cross(axes, other[1][near]), axis=1)
    return worst.max(), np.degrees(np.arcsin(np.minimum(angles, 1))).max()


def path_of(points):
    """An SVG path through the points that are 0.05 mm apart or more."""
    kept = [points[0]]
    for point in points[1:]:
        if np.abs(point - kept[-1]).max() > 0.05:
            kept.append(point)
    return "M" + "L".join(f"{x:.2f},{y:.2f}" for x, y in kept)


def main():
    if len(sys.argv) < 2 or any("=" not in argument for argument in sys.argv[1:]):
        sys.exit(__doc__)
    parts = [(name, load(path)) for name, path in (argument.split("=", 1) for argument in sys.argv[1:])]
    low = [part[0][:, 2].min() for _, part in parts]
    in_work = [(name, tuple(values[part[0][:, 2] < 12] for values in part)) for name, part in parts]
    seen = np.vstack([view(part[0]) for _, part in in_work])
    scale = (PANEL - 20) / np.ptp(seen, axis=0).max()
    width, height = len(parts) * (PANEL + GAP) + GAP, PANEL + TOP
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}">')
    print('<style>text{font:13px sans-serif}path{fill:none;stroke-width:.8}</style>'
          '<rect width="100%" height="100%" fill="white"/>')
    for i, (name, part) in enumerate(in_work):
        left = GAP + i * (PANEL + GAP)
        flat = (view(part[0]) - seen.min(axis=0)) * scale
        flat = np.c_[left + flat[:, 0], height - 20 - flat[:, 1]]
        print(f'<path d="{path_of(flat)}" stroke="{COLOURS[i % len(COLOURS)]}"/>')
        print(f'<text x="{left}" y="24" style="font-weight:bold">{name}</text>')
        if i == 0:
            note = f"tip in the work, deepest {low[0]:.3f} mm"
        else:
            tip, angle = difference(part, in_work[0][1])
            note = f"from {in_work[0][0]}: tip {tip:.2g} mm, axis {angle:.2g} deg at most"
            print(f"{name}: {note}", file=sys.stderr)
        print(f'<text x="{left}" y="44">{note}</text>')
    print("</svg>")


if __name__ == "__main__":
    main()
