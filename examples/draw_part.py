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
IN_WORK = 12  # mm: what is drawn lies below
COLOURS = ("#1b6ca8", "#b5361c", "#2c7a2c", "#7a3c8f")


def load(path):
    """Tips (n, 3), axes (n, 3) and lines of a trace, standing samples left out."""
    with open(path, encoding="ascii") as file:
        rows = csv.reader(file)
        header = next(rows)
        first = header.index("p_x")
        data = np.array([[float(value) for value in row[first:]] for row in rows])
    moving = np.r_[False, np.linalg.norm(np.diff(data[:, :3], axis=0), axis=1) > 1e-9]
    data = data[moving]
    return data[:, :3], data[:, 3:6], data[:, 6].astype(int)


def view(points):
    """Isometric view: right and up in mm."""
    x, y, z = points.T
    return np.c_[(x - y) * np.cos(np.pi / 6), z + (x + y) * 0.5 * 0.6]


def in_work(part):
    """What lies in or near the work: below IN_WORK, after the tool has first been above."""
    tips = part[0]
    first = np.argmax(tips[:, 2] > IN_WORK)
    kept = (np.arange(len(tips)) > first) & (tips[:, 2] < IN_WORK)
    return tuple(values[kept] for values in part)


def off_path(tips, path):
    """Distance of each tip from the polyline; where the samples are more than 1 mm apart it was left."""
    nearest = cKDTree(path).query(tips, k=min(8, len(path)))[1].reshape(len(tips), -1)
    worst = np.full(len(tips), np.inf)
    for near in nearest.T:
        for step in (-1, 1):  # the two pieces of path that meet in a sample
            a = path[near]
            way = path[np.clip(near + step, 0, len(path) - 1)] - a
            way[np.linalg.norm(way, axis=1) > 1] = 0
            length2 = np.maximum((way * way).sum(axis=1), 1e-300)
            share = np.clip(((tips - a) * way).sum(axis=1) / length2, 0, 1)[:, None]
            worst = np.minimum(worst, np.linalg.norm(a + share * way - tips, axis=1))
    return worst, nearest[:, 0]


def difference(one, other):
    """Greatest distance of one's tips from the other's path on the same line, and of the axes there, deg."""
    worst_mm = worst_sine = 0
    for line in np.unique(one[2]):
        mine = (one[2] == line) & (one[0][:, 2] < IN_WORK - 1)  # the other goes on a little further
        theirs = other[2] == line
        theirs |= np.r_[theirs[1:], False] | np.r_[False, theirs[:-1]]  # and the samples before and after
        if not mine.any() or not theirs.any():
            continue
        away, near = off_path(one[0][mine], other[0][theirs])
        worst_mm = max(worst_mm, away.max())
        sines = np.linalg.norm(np.cross(one[1][mine], other[1][theirs][near]), axis=1)
        worst_sine = max(worst_sine, sines.max())
    return worst_mm, np.degrees(np.arcsin(worst_sine))


def path_of(points):
    """An SVG path through the points that matter at 0.06 of its units (Ramer, Douglas, Peucker)."""
    keep = np.zeros(len(points), bool)
    keep[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        inner = points[first + 1:last] - points[first]
        way = points[last] - points[first]
        share = np.clip(inner @ way / max(way @ way, 1e-12), 0, 1)[:, None]
        away = np.linalg.norm(inner - share * way, axis=1)
        if away.max() > 0.06:
            middle = first + 1 + int(away.argmax())
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return "M" + "L".join(f"{x:.1f},{y:.1f}" for x, y in points[keep])


def main():
    if len(sys.argv) < 2 or any("=" not in argument for argument in sys.argv[1:]):
        sys.exit(__doc__)
    parts = [(name, load(path)) for name, path in (argument.split("=", 1) for argument in sys.argv[1:])]
    parts = [(name, in_work(part)) for name, part in parts]
    seen = np.vstack([view(part[0]) for _, part in parts])
    scale = (PANEL - 20) / np.ptp(seen, axis=0).max()
    width = len(parts) * (PANEL + GAP) + GAP
    height = TOP + 20 + np.ptp(seen, axis=0)[1] * scale
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height:.0f}" width="{width}" '
          f'height="{height:.0f}">')
    print('<style>text{font:13px sans-serif}path{fill:none;stroke-width:.8}</style>'
          '<rect width="100%" height="100%" fill="white"/>')
    for i, (name, part) in enumerate(parts):
        left = GAP + i * (PANEL + GAP)
        flat = (view(part[0]) - seen.min(axis=0)) * scale
        flat = np.c_[left + flat[:, 0], height - 20 - flat[:, 1]]
        print(f'<path d="{path_of(flat)}" stroke="{COLOURS[i % len(COLOURS)]}"/>')
        print(f'<text x="{left}" y="24" style="font-weight:bold">{name}</text>')
        if i == 0:
            note = f"tip in the work, deepest {part[0][:, 2].min():.3f} mm"
        else:
            tip, angle = difference(part, parts[0][1])
            note = f"from {parts[0][0]}: tip {tip:.2g} mm, axis {angle:.2g} deg at most"
            print(f"{name}: {note}", file=sys.stderr)
        print(f'<text x="{left}" y="44">{note}</text>')
    print("</svg>")


if __name__ == "__main__":
    main()
