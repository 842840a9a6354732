#!/usr/bin/env python3
"""Lines and branches of a folder that its tests reach.

    scripts/coverage.py [--folder interp/gcode] [--target test_interp_gcode] [--build build/coverage]

Builds the test program without optimisation and with gcov's counters, runs it and sums up each file.
"""
import argparse
import glob
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def build(folder, target):
    flags = "--coverage -O0 -g0 -fprofile-update=atomic"
    subprocess.run(["cmake", "-S", ROOT, "-B", folder, "-GNinja", "-DCMAKE_BUILD_TYPE=None", "-DTRN_NO_PCH=ON",
                    "-DCMAKE_CXX_FLAGS=" + flags, "-DCMAKE_EXE_LINKER_FLAGS=--coverage"], check=True,
                   stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder, "--target", target], check=True, stdout=subprocess.DEVNULL)


def counts(build_folder, folder):
    """{source: (lines, lines reached, branches, branches taken)} of the folder's files."""
    result = {}
    objects = glob.glob(os.path.join(build_folder, "CMakeFiles", "*.dir", folder, "*.gcda"))
    for data in sorted(objects):
        text = subprocess.run(["gcov", "-b", "-n", data], capture_output=True, text=True, check=True,
                              cwd=build_folder).stdout
        for block in text.split("\n\n"):
            name = re.search(r"File '(.*)'", block)
            lines = re.search(r"Lines executed:([\d.]+)% of (\d+)", block)
            taken = re.search(r"Taken at least once:([\d.]+)% of (\d+)", block)
            if not name or not lines or not name[1].endswith(".cc") or f"/{folder}/" not in name[1]:
                continue
            total, branches = int(lines[2]), int(taken[2]) if taken else 0
            reached = round(total * float(lines[1]) / 100)
            result[name[1].split(f"/{folder}/")[1]] = (total, reached, branches,
                                                       round(branches * float(taken[1]) / 100) if taken else 0)
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", default="interp/gcode")
    parser.add_argument("--target", default="test_interp_gcode")
    parser.add_argument("--build", default=os.path.join(ROOT, "build", "coverage"))
    parser.add_argument("--filter", default="*", help="tests to run")
    args = parser.parse_args()
    build(args.build, args.target)
    command = [os.path.join(args.build, args.target), "--gtest_filter=" + args.filter]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    files = counts(args.build, args.folder)
    for name, (lines, reached, branches, taken) in sorted(files.items()):
        print(f"{name:24} lines {100 * reached / lines:5.1f} %  branches {100 * taken / max(1, branches):5.1f} %")
    total = [sum(column) for column in zip(*files.values())]
    print(f"{args.folder}: lines {100 * total[1] / total[0]:.1f} % of {total[0]}, "
          f"branches {100 * total[3] / total[2]:.1f} % of {total[2]}")


if __name__ == "__main__":
    sys.exit(main())
