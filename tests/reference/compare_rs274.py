#!/usr/bin/env python3
"""Canonical functions of `trunnion interpret --canon` line for line beside another interpreter of the dialect.

    tests/reference/compare_rs274.py build/release/trunnion [--random 500] [--seed 1] [--only NAME] [-v]

The other one is Debian's rs274 (package linuxcnc-uspace), found on the path or given by TRN_RS274 as a command
line; without it the comparison is skipped (exit 77). Programs come from programs/*.txt beside this script and,
with --random, from random_programs.py. A program that stops with an error must do so in both, after the same
functions; the sentences differ, and ours goes on to the end of a contour before it tells that it gouges. Every fourth
of them, or all with TRN_LONG or --only. programs/on_purpose.txt names the programs that differ on purpose, with the
reason.
"""
import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import random_programs

HERE = os.path.dirname(os.path.abspath(__file__))
# Inches, for both.
TOOLS = """T1 P1 D0.236220472441 Z+1.968503937008
T2 P2 D0.393700787402 Z+3.169291338583
T3 P3 X+0.03937007874 Y-0.07874015748 Z+1.181102362205 D0.177165354331 I95 J155 Q6
T4 P4 Z+0.482283464567 D0.03937007874
T5 P5 Z+0.03937007874 D0.019685039370 Q2
T9 P12 Z+0.003937007874 D-0.07874015748
"""


def load(folder):
    """{name: text} of every program; a program begins at a line '=== name'."""
    programs = {}
    for file_name in sorted(os.listdir(folder)):
        if not file_name.endswith(".txt") or file_name == "on_purpose.txt":
            continue
        with open(os.path.join(folder, file_name), encoding="utf-8") as file:
            parts = re.split(r"^=== *(\S+) *\n", file.read(), flags=re.M)
        for name, text in zip(parts[1::2], parts[2::2]):
            programs[f"{file_name[:-4]}/{name}"] = text
    return programs


def load_on_purpose(path):
    with open(path, encoding="utf-8") as file:
        return dict(line.strip().split(": ", 1) for line in file if ": " in line and line[0] != "#")


def run(command, folder):
    # The reference keeps its tool table in one file of HOME, which every rs274 that runs would share.
    try:
        result = subprocess.run(command, cwd=folder, env={**os.environ, "HOME": folder}, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, check=False, timeout=10)
    except subprocess.TimeoutExpired:
        return 124, "", "does not end"
    return result.returncode, result.stdout.decode("latin-1"), result.stderr.decode("latin-1")


def of_reference(command, folder, name):
    """(canonical lines, error text or None)."""
    for _ in range(5):  # it now and then dies at its start
        code, out, err = run([*command, "-v", "ref.var", "-t", "tools.tbl", "-g", name], folder)
        if code >= 0:
            break
    lines = [re.sub(r"^ *\d+ N\S+ +", "", line).rstrip() for line in out.splitlines()]
    error = None if code == 0 else (err.strip() or "no word")
    return [line for line in lines if line and line != "executing"], error


def of_ours(trunnion, folder, name):
    code, out, err = run([trunnion, "interpret", "--canon", "--tools", "tools.tbl", name], folder)
    error = None if code == 0 else (f"exit code {code}" if code < 0 else err.strip() or f"exit code {code}")
    return [line.rstrip() for line in out.splitlines()], error


def numbers_agree(one, two):
    """The same text but for a last digit that rounding may turn."""
    number = r"-?\d+\.\d+"
    tolerance = 1.5e-4
    if re.sub(number, "#", one) != re.sub(number, "#", two):
        return False
    return all(abs(float(a) - float(b)) < 1.5e-4 for a, b in zip(re.findall(number, one), re.findall(number, two)))


def first_difference(ours, theirs):
    for i, (a, b) in enumerate(zip(ours, theirs)):
        if not numbers_agree(a, b):
            return i
    return None if len(ours) == len(theirs) else min(len(ours), len(theirs))


def agree(ours, our_error, theirs, their_error):
    if (our_error is None) != (their_error is None):
        return False
    if our_error and "would gouge" in our_error:  # the reference stops at the move, and resets
        while theirs[-1:] == ["ON_RESET()"]:
            theirs = theirs[:-1]
        ours = ours[:len(theirs)]
    return first_difference(ours, theirs) is None


def write(folder, name, text):
    with open(os.path.join(folder, name), "w", encoding="latin-1") as file:
        file.write(text)


def compare(name, text, args):
    """None if both agree, else the report of the difference."""
    with tempfile.TemporaryDirectory() as folder:
        write(folder, "p.ngc", text)
        write(folder, "tools.tbl", TOOLS)
        ours, our_error = of_ours(args.trunnion, folder, "p.ngc")
        for _ in range(3):  # what it does without a tool in the spindle changes from run to run
            write(folder, "ref.var", "")  # it leaves its parameters there
            theirs, their_error = of_reference(args.reference, folder, "p.ngc")
            crashed = our_error and our_error.startswith("exit code -")
            if not crashed and agree(ours, our_error, theirs, their_error):
                return None
    if our_error and our_error.startswith("exit code -"):
        kind = "ours crashes"
    elif (our_error is None) != (their_error is None):
        kind = "only ours stops" if our_error else "only the reference stops"
    else:
        at = first_difference(ours, theirs)
        kind = f"line {at + 1}: ours '{(ours + ['nothing'])[at]}', reference '{(theirs + ['nothing'])[at]}'"
    report = [f"{name}: {kind}"]
    if our_error:
        report.append("  ours: " + our_error.splitlines()[0])
    if their_error:
        report.append("  reference: " + their_error.splitlines()[-1])
    if args.verbose:
        report += ["  | " + line for line in text.splitlines()]
    return "\n".join(report)


def find_reference():
    command = shlex.split(os.environ.get("TRN_RS274", "rs274"))
    return [shutil.which(command[0]), *command[1:]] if shutil.which(command[0]) else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trunnion", type=os.path.abspath)
    parser.add_argument("--random", type=int, default=0, help="so many random programs more")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="programs whose name contains this")
    parser.add_argument("-v", "--verbose", action="store_true")
    args = parser.parse_args()
    args.reference = find_reference()
    if not args.reference:
        print("no rs274 here (package linuxcnc-uspace, or TRN_RS274): skipped")
        return 77
    programs = load(os.path.join(HERE, "programs"))
    if not os.environ.get("TRN_LONG") and not args.only:
        programs = dict(list(programs.items())[::4])
    programs.update(random_programs.make(args.random, args.seed))
    programs = {name: text for name, text in programs.items() if args.only in name}
    on_purpose = load_on_purpose(os.path.join(HERE, "programs", "on_purpose.txt"))
    with ThreadPoolExecutor(2) as pool:
        reports = list(pool.map(lambda item: compare(*item, args), programs.items()))
    differ = {name: report for name, report in zip(programs, reports) if report}
    for name, report in differ.items():
        if name not in on_purpose:
            print(report)
    agreed = [name for name in on_purpose if name in programs and name not in differ]
    for name in agreed:
        print(f"{name}: listed as different on purpose, but agrees")
    wrong = sum(name not in on_purpose for name in differ)
    print(f"{len(programs)} programs, {len(differ) - wrong} differ on purpose, {wrong} differ")
    return 1 if wrong or agreed else 0


if __name__ == "__main__":
    sys.exit(main())
