#!/usr/bin/env python3
"""Lines per second of `trunnion interpret` beside another RS274/NGC interpreter, if one is installed.

    bench/compare_interpreters.py build/release/trunnion [--other 'rs274 -g'] [--lines 200000] [--canon]

Times are processor seconds of the whole process, five in turns, canonical output thrown away: the ratio of the
best ones, and of the median ones in brackets. --canon: ours prints its canonical functions as the other one
does, without a machine. The other one has a HOME of its own, since it keeps its tool table there in one file.
"""
import argparse
import os
import resource
import shlex
import shutil
import statistics
import subprocess
import tempfile


def programs(n):
    three = ["N%d X%.3f Y%.3f Z%.3f" % (i, i % 997 * .1, i % 331 * .07, -(i % 71) * .013) for i in range(n)]
    five = ["X%.4f Y%.4f Z%.4f A%.4f C%.4f" % (i % 997 * .1, i % 331 * .07, -(i % 71) * .013, i % 89 * .3,
                                               i % 359 * .5) for i in range(n)]
    loop = ["#1=0", "o100 while [#1 lt %d]" % n, "G1 X[10*sin[#1]] Y[10*cos[#1]]", "#1=[#1+1]", "o100 endwhile"]
    return {"three axes": three, "five axes": five, "loop of sines": loop}


def cpu_seconds(command, folder):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=folder, env={**os.environ, "HOME": folder}, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trunnion")
    parser.add_argument("--machine", default=os.path.join(os.path.dirname(__file__), "../configs/cradle.toml"))
    parser.add_argument("--other", default="rs274 -g")
    parser.add_argument("--lines", type=int, default=200000)
    parser.add_argument("--canon", action="store_true")
    args = parser.parse_args()
    ours = os.path.abspath(args.trunnion)
    other = shlex.split(args.other)
    has_other = shutil.which(other[0]) is not None
    with tempfile.TemporaryDirectory() as folder:
        for name, lines in programs(args.lines).items():
            path = os.path.join(folder, name.replace(" ", "_") + ".ngc")
            with open(path, "w", encoding="ascii") as file:
                file.write("\n".join(["G21 G90 G1 F1000", *lines, "M2", ""]))
            size = os.path.getsize(path) / 1e6
            how = ["--canon"] if args.canon else ["--machine", os.path.abspath(args.machine)]
            commands = [[ours, "interpret", path, *how]]
            if has_other:
                commands.append([*other, path])
            rounds = [[cpu_seconds(command, folder) for command in commands] for _ in range(5)]
            mine, *theirs = (min(times) for times in zip(*rounds))
            middle, *others = (statistics.median(times) for times in zip(*rounds))
            text = f"{name}: {args.lines / mine / 1e3:.0f}k a second, {size / mine:.0f} MB/s"
            if theirs:
                text += f"; {other[0]} {args.lines / theirs[0] / 1e3:.0f}k"
                text += f"; ratio {theirs[0] / mine:.1f} ({others[0] / middle:.1f})"
            print(text)


if __name__ == "__main__":
    main()
