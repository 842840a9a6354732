#!/usr/bin/python3
"""The pictures of planner.md, each from a program run on the cradle.

    docs/make_planner_pictures.py build/release/trunnion

Writes planner_profile.svg (speed, acceleration, jerk, coloured by the joint at a limit), planner_corner.svg (a corner
inside its tolerance) and planner_pass.svg (chords and the curve that is driven) beside itself.
"""
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
MACHINE = HERE.parent / "configs/cradle.toml"
START = "G21 G90 G94 G17\nG10 L2 P1 X0 Y0 Z40\nG54\n"


def run(binary, text, folder, *options):
    program = folder / "program.ngc"
    program.write_text(text)
    subprocess.run([binary, "run", program, "--machine", MACHINE, *options], check=True, stdout=subprocess.DEVNULL)


def profile_program():
    """A pass over a ball, the tool along the normal, from one side close by the pole to the other."""
    text = START + "G64 P0.01 R0.1\nG0 X20 Y-28 Z30 A30 C20\nM428\n"
    for i in range(160):
        t = i / 159
        y, tilt = -28 + 56 * t, 32 - 30 * math.sin(math.pi * t)
        turn = 20 + 150 / (1 + math.exp(-(t - 0.5) * 18))
        text += f"G1 X{20 * math.cos(2 * t):.4f} Y{y:.4f} Z{30 - y * y / 60:.4f} A{tilt:.4f} C{turn:.4f} F6000\n"
    return text + "M2\n"


def trace(folder):
    rows = np.genfromtxt(folder / "trace.csv", delimiter=",", names=True)
    return rows["p_x"], rows["p_y"]


def path_of(x, y, place):
    return "M" + " ".join(f"{a:.2f},{b:.2f}" for a, b in (place(*p) for p in zip(x, y)))


def picture(name, width, height, parts):
    svg = (f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' width='{width}' "
           "font-family='sans-serif' font-size='12'>\n"
           f"<rect width='{width}' height='{height}' fill='white'/>\n" + "\n".join(parts) + "\n</svg>\n")
    (HERE / name).write_text(svg)


def label(x, y, text):
    return f"<text x='{x}' y='{y}'>{text}</text>"


def corner(binary, folder):
    tolerance = 0.05
    run(binary, START + f"G64 P{tolerance}\nG0 X0 Y0 Z0\nG1 X20 F6000\nG1 Y20\nM2\n", folder, "--trace",
        folder / "trace.csv", "--trace-density", "20")
    x, y = trace(folder)
    size, span = 420, 0.5

    def place(a, b):
        return 30 + size * (a - (20 - span)) / (span + 0.1), 30 + size * ((span) - b) / (span + 0.1)

    near = (x > 20 - span) & (y < span) & (x > 1)
    centre, radius = place(20, 0), size * tolerance / (span + 0.1)
    corner_path = path_of([20 - span, 20, 20], [0, 0, span], place)
    parts = [f"<path d='{corner_path}' fill='none' stroke='#999' stroke-width='1.5' stroke-dasharray='6 3'/>",
             f"<circle cx='{centre[0]:.1f}' cy='{centre[1]:.1f}' r='{radius:.1f}' fill='#ee6677' fill-opacity='0.18' "
             "stroke='#ee6677'/>",
             f"<path d='{path_of(x[near], y[near], place)}' fill='none' stroke='#4477aa' stroke-width='2'/>",
             label(30, 20, "programmed corner (dashed), tolerance of 0.05 mm (red), what is driven (blue); "
                   f"{span + 0.1:.1f} mm wide")]
    picture("planner_corner.svg", 640, 480, parts)


def compressed_pass(binary, folder):
    tolerance, chord = 0.04, 2.5
    at = [i * chord for i in range(17)]
    wave = [2.5 * math.sin(u / 4.5) for u in at]
    text = START + f"G64 P{tolerance}\nG0 X{at[0]} Y{wave[0]:.4f} Z0\n"
    text += "".join(f"G1 X{u:.4f} Y{v:.4f} F9000\n" for u, v in zip(at[1:], wave[1:])) + "M2\n"
    run(binary, text, folder, "--trace", folder / "trace.csv")
    x, y = trace(folder)
    moving = np.concatenate([[False], np.hypot(np.diff(x), np.diff(y)) > 0]) & (x >= 0)
    x, y = x[moving], y[moving]

    def place(a, b):
        return 40 + 18 * a, 90 - 18 * b

    def place_off(a, off):
        return 40 + 18 * a, 230 - 900 * off

    chord_y = np.interp(x, at, wave)
    slope = np.gradient(chord_y, x)
    off = (y - chord_y) / np.hypot(1, slope)
    parts = [f"<path d='{path_of(at, wave, place)}' fill='none' stroke='#999' stroke-width='3'/>",
             *(f"<circle cx='{place(u, v)[0]:.1f}' cy='{place(u, v)[1]:.1f}' r='3.5' fill='#999'/>"
               for u, v in zip(at, wave)),
             f"<path d='{path_of(x, y, place)}' fill='none' stroke='#4477aa' stroke-width='1.3'/>",
             label(40, 20, "chords of 2.5 mm (grey) and the curve that is driven (blue)"),
             label(40, 175, "distance between them, 50 times larger, and the tolerance of 0.04 mm (red)"),
             *(f"<path d='M40,{230 - sign * 900 * tolerance:.1f} H{40 + 18 * at[-1]:.1f}' stroke='#ee6677'/>"
               for sign in (-1, 1)),
             f"<path d='{path_of(x, off, place_off)}' fill='none' stroke='#4477aa' stroke-width='1.3'/>"]
    picture("planner_pass.svg", 800, 280, parts)


def main():
    binary = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        run(binary, profile_program(), folder, "--report", folder / "report")
        shutil.copy(folder / "report/speed.svg", HERE / "planner_profile.svg")
        corner(binary, folder)
        compressed_pass(binary, folder)


if __name__ == "__main__":
    main()
