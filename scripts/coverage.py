#!/usr/bin/env python3
"""Lines and branches of a folder that its tests reach, or that the simulated world reaches.

    scripts/coverage.py [--folder interp/gcode] [--tests REGEX] [--build build/coverage]
    scripts/coverage.py --world SEEDS [--build build/coverage_world]

The first form compiles this folder's files alone, unoptimised and counted by gcov, and links them with what the
release has of the rest. Then it runs the tests (ctest, in their short form, or the long one with TRN_LONG) and
sums up each file. The second form compiles kernel, hal, sim and app so, runs so many seeds of tests/world, and
sums up each folder; --files shows each file. The two sides of a call that may throw are no decision of the source
and do not count as branches.
"""
import argparse
import glob
import json
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
RELEASE = os.path.join(ROOT, "build", "release")
LIBRARIES = {"interp/gcode": "trn_gcode"}
TARGETS = ["test_interp_gcode", "gcode_fuzz_replay", "expression_fuzz_replay", "trunnion"]
WORLD_FOLDERS = ["kernel", "kernel/rate", "hal", "sim", "app/session", "app/daemon", "app/client"]
TESTS = "^(test_interp_gcode|rs274_comparison|bad_input|gcode_fuzz_corpus|expression_fuzz_corpus)$"


def run(*command, **more):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, **more).stdout


def build(build_folder, folder):
    library = LIBRARIES[folder]
    for where, targets, option in ((RELEASE, TARGETS, ""), (build_folder, [library], folder)):
        run("cmake", "-S", ROOT, "-B", where, "-GNinja", "-DCMAKE_BUILD_TYPE=Release", "-DTRN_COVERAGE=" + option,
            "-DTRN_UNITY=OFF")
        run("cmake", "--build", where, "--target", *targets)
    for target in TARGETS:
        link = run("ninja", "-C", RELEASE, "-t", "commands", target).splitlines()[-1]
        link = link.replace(f"lib{library}.a", os.path.join(build_folder, f"lib{library}.a") + " --coverage")
        run("sh", "-c", link.replace(f"-o {target} ", f"-o {os.path.join(build_folder, target)} "), cwd=RELEASE)


def build_world(build_folder):
    run("cmake", "-S", ROOT, "-B", build_folder, "-GNinja", "-DCMAKE_BUILD_TYPE=Release", "-DTRN_UNITY=OFF",
        "-DTRN_COVERAGE=" + ";".join(WORLD_FOLDERS))
    subprocess.run(["cmake", "--build", build_folder, "--target", "test_world"], check=True)


def decisions(branches):
    """Counts of the branches that are no sides of a call that may throw."""
    sides = set()
    for i, branch in enumerate(branches):
        if branch["throw"]:
            sides |= {i, i - 1} if i > 0 and branches[i - 1]["fallthrough"] else {i}
    return [branch["count"] for i, branch in enumerate(branches) if i not in sides]


def counts(build_folder, folder):
    """{source: (lines, lines reached, branches, branches taken)} of the folder's files, with those that the inner
    folders have. A file that never ran has notes of its lines, but no counts."""
    result = {}
    for notes in sorted(glob.glob(os.path.join(build_folder, "CMakeFiles", "*.dir", folder, "**", "*.gcno"),
                                  recursive=True)):
        data = notes[:-len("gcno")] + "gcda"
        data = data if os.path.exists(data) else notes
        text = subprocess.run(["gcov", "-b", "-j", "-t", data], capture_output=True, text=True, check=True,
                              cwd=build_folder).stdout
        for file in json.loads(text)["files"]:
            name = os.path.normpath(os.path.join(build_folder, file["file"]))
            if not name.startswith(os.path.join(ROOT, folder)) or not name.endswith(".cc"):
                continue
            reached, branches = {}, []
            for line in file["lines"]:
                reached[line["line_number"]] = reached.get(line["line_number"], 0) + line["count"]
                branches += decisions(line["branches"])
            short = os.path.relpath(name, os.path.join(ROOT, folder))
            result[short] = (len(reached), sum(count > 0 for count in reached.values()), len(branches),
                             sum(count > 0 for count in branches))
    return result


def remove_counts(build_folder):
    for data in glob.glob(os.path.join(build_folder, "CMakeFiles", "**", "*.gcda"), recursive=True):
        os.remove(data)  # of an earlier run


def tell(folder, files, each):
    for name, (lines, reached, branches, taken) in sorted(files.items()) if each else ():
        print(f"{name:36} lines {100 * reached / max(1, lines):5.1f} %  "
              f"branches {100 * taken / max(1, branches):5.1f} %")
    total = [sum(column) for column in zip(*files.values())]
    print(f"{folder}: lines {100 * total[1] / total[0]:.1f} % of {total[0]}, "
          f"branches {100 * total[3] / total[2]:.1f} % of {total[2]}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", default="interp/gcode", choices=LIBRARIES)
    parser.add_argument("--tests", default=TESTS, help="as for ctest -R")
    parser.add_argument("--world", type=int, metavar="SEEDS", help="what so many seeds of tests/world reach")
    parser.add_argument("--files", action="store_true", help="with --world: a line for each file")
    parser.add_argument("--build", type=os.path.abspath)
    args = parser.parse_args()
    if args.world:
        folder = args.build or os.path.join(ROOT, "build", "coverage_world")
        build_world(folder)
        remove_counts(folder)
        subprocess.run([os.path.join(folder, "test_world"), "--seeds", f"1-{args.world}"], check=True)
        for name in WORLD_FOLDERS:
            if name != "kernel/rate":  # told with kernel
                tell(name, counts(folder, name), args.files)
        return
    folder = args.build or os.path.join(ROOT, "build", "coverage")
    build(folder, args.folder)
    remove_counts(folder)
    subprocess.run(["ctest", "--test-dir", folder, "-R", args.tests, "--output-on-failure"], check=True)
    tell(args.folder, counts(folder, args.folder), True)


if __name__ == "__main__":
    sys.exit(main())
