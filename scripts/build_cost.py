#!/usr/bin/env python3
"""What a clean build costs, for the notes of a release: scripts/build_cost.py [--source DIR] [--folder DIR] TARGET...

Builds each target (trunnion, all, ...) in a folder of its own, from nothing and without the compiler's cache. Tells the
processor time of the whole build, user and system together, and the ten files that took longest. Processor time hardly
depends on what else the computer does, but on the computer; tests/compile/build_cost.py counts what does not.
"""
import argparse
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import time

# In the place of ccache, before the compiler. `times` tells user and system time of the children in its second line.
LAUNCHER = """#!/bin/bash
"$@"
code=$?
for word; do [[ $word != *.o && $word != *.gch ]] || out=$word; done
times >"$0.$$"
{ read -r _; read -r user system; } <"$0.$$"
rm "$0.$$"
echo "$user $system $out" >>"$0.log"
exit $code
"""


def seconds(text):
    """0m1.234s in seconds."""
    minutes, rest = text.rstrip("s").split("m")
    return 60 * int(minutes) + float(rest)


def children_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def build(source, folder, target):
    """Processor time of all, wall time, and [(seconds, file)], the slowest first."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    launcher = folder / "launcher"
    launcher.write_text(LAUNCHER)
    launcher.chmod(0o755)
    environment = dict(os.environ, CCACHE_DISABLE="1")
    quiet = {"env": environment, "stdout": subprocess.DEVNULL, "check": True}
    subprocess.run(["cmake", "-S", source, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                    f"-DCCACHE={launcher}"], **quiet)
    begin, wall = children_s(), time.monotonic()
    built = subprocess.run(["cmake", "--build", folder, "-j", str(os.cpu_count()), "--target", target], env=environment,
                           stdout=subprocess.PIPE, text=True, check=False)
    if built.returncode:
        sys.exit(f"{built.stdout[-4000:]}\n{target} does not build; what was built stays in {folder}")
    used, wall = children_s() - begin, time.monotonic() - wall
    files = []
    for line in pathlib.Path(f"{launcher}.log").read_text().splitlines():
        user, system, out = line.split()
        files.append((seconds(user) + seconds(system), out))
    return used, wall, sorted(files, reverse=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    here = pathlib.Path(__file__).resolve().parent.parent
    parser.add_argument("--source", type=pathlib.Path, default=here)
    parser.add_argument("--folder", type=pathlib.Path, help="default: build/cost of the source")
    parser.add_argument("target", nargs="*", default=["trunnion", "all"])
    options = parser.parse_args()
    folder = options.folder or options.source / "build/cost"
    for target in options.target:
        used, wall, files = build(options.source.resolve(), folder.resolve(), target)
        print(f"{target}: {used:.0f} s of processor time ({used / 60:.1f} min), {wall:.0f} s by the clock, "
              f"{len(files)} compilations")
        for cost, name in files[:10]:
            print(f"  {cost:6.1f} s  {name}")
        sys.stdout.flush()
    shutil.rmtree(folder, ignore_errors=True)


main()
