#!/usr/bin/env python3
"""./run.sh beside a built program: every example by its name alone, every option of `trunnion run`, whose the relative
paths are, and programs without end.

    tests/app/cli/run_script.py TRUNNION SOURCE

run.sh itself is the repository's; the folder that it stands in is a copy whose set-up builds nothing and whose program
is TRUNNION.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

SHORT = "G21 G90\nG0 X1 Y1\nG1 X3 F600\nG1 Y3\nM2\n"
# What every option of `run` that takes a value is given here, and the file that it must leave in the caller's folder.
VALUES = {
    "--machine": ("mine.toml", None),
    "--project": (None, None),  # run.sh gives it
    "--trace": ("out/t.csv", "out/t.csv"),
    "--trace-density": ("2", None),
    "--path": ("out/p.csv", "out/p.csv"),
    "--stretches": ("out/s.csv", "out/s.csv"),
    "--report": ("out/report", "out/report/report.html"),
    "--tools": ("mine.tbl", None),
    "--vars": ("mine.var", "mine.var"),
    "--from": ("3", None),
    "--stop-after": ("0.1", None),
    "--operator": ("op.txt", None),
    "--log": ("out/l.log", "out/l.log"),
    "--logs": ("out", None),
}


def make_project(folder, binary, source):
    """A stand-in for the repository."""
    project = os.path.join(folder, "project")
    os.makedirs(os.path.join(project, "scripts"))
    os.makedirs(os.path.join(project, "build/release"))
    shutil.copy(os.path.join(source, "run.sh"), project)
    for name in ("examples", "configs"):
        os.symlink(os.path.join(source, name), os.path.join(project, name))
    os.symlink(binary, os.path.join(project, "build/release/trunnion"))
    with open(os.path.join(project, "scripts/setup.sh"), "w", encoding="ascii") as file:
        file.write("install_packages() { :; }\nbuild() { :; }\n")
    return project


def make_caller(folder, source):
    """The folder that run.sh is called from, with files of the caller's own."""
    caller = os.path.join(folder, "caller")
    os.makedirs(os.path.join(caller, "out"))
    os.makedirs(os.path.join(caller, "parts"))
    files = {"short.ngc": SHORT, "parts/pocket.ngc": SHORT, "mine.tbl": "T1 P1 Z50\n", "mine.var": "", "op.txt":
             "0.05 hold\n0.1 resume\n"}
    for name, text in files.items():
        with open(os.path.join(caller, name), "w", encoding="ascii") as file:
            file.write(text)
    shutil.copy(os.path.join(source, "configs/mill.toml"), os.path.join(caller, "mine.toml"))
    return caller


class Checks:
    def __init__(self, project, caller):
        self.script = os.path.join(project, "run.sh")
        self.caller = caller
        self.failed = 0

    def run(self, *arguments, folder=None):
        return subprocess.run([self.script, *arguments], cwd=folder or self.caller, capture_output=True, text=True,
                              timeout=600, check=False)

    def expect(self, what, good, result=None):
        if good:
            return
        self.failed += 1
        print(f"FAILED: {what}")
        if result is not None:
            print(f"  exit {result.returncode}\n  {result.stdout[-600:]}\n  {result.stderr[-600:]}")


def check_examples(checks, source):
    for name in sorted(os.listdir(os.path.join(source, "examples"))):
        if not name.endswith(".ngc"):
            continue
        for arguments in ([name[:-4]], [os.path.join("examples", name)])[:1 if name == "warm_up.ngc" else 2]:
            result = checks.run(*arguments)
            checks.expect(f"example {arguments[0]}", result.returncode == 0 and "within its limits" in result.stdout,
                          result)
    result = checks.run("--json")
    checks.expect("without a program", result.returncode == 0 and '"lines": 3316' in result.stdout, result)


def options_with_value(checks):
    """Names, asked of the program itself."""
    text = checks.run("--help-run").stdout
    return re.findall(r"^ +(--[\w-]+) [A-Z]+\b", text, flags=re.M)


def check_options(checks):
    names = options_with_value(checks)
    checks.expect("options are found in the help", len(names) > 8)
    for name in names:
        checks.expect(f"VALUES of this test say nothing of {name}", name in VALUES)
        value, made = VALUES.get(name, (None, None))
        if value is None:
            continue
        for arguments in ([name, value], [f"{name}={value}"]):
            for around in (["short.ngc", *arguments], [*arguments, "short.ngc"]):
                if made and made != value.split("/")[0] and os.path.isfile(os.path.join(checks.caller, made)):
                    os.remove(os.path.join(checks.caller, made))
                result = checks.run(*around)
                checks.expect(" ".join(around), result.returncode == 0, result)
                checks.expect(f"{made} of {' '.join(around)}",
                              not made or os.path.isfile(os.path.join(checks.caller, made)))
    result = checks.run("--report", "out/alone")
    checks.expect("--report without a program", result.returncode == 0 and
                  os.path.isfile(os.path.join(checks.caller, "out/alone/report.html")), result)


def check_endless(checks, binary):
    """Programs without end come to one here, say so, and are replayed bit for bit."""
    programs = {
        "round.ngc": ("O1\nG21 G90\nG0 X9\nM98 P2\nG0 X0\nM99\nO2\nG0 Z-7\nG0 Z0\nM99\n", [], "for ever"),
        "counts.ngc": ("G21\n#100=[#100+1]\nG0 X9\nG0 X0\nM99\n", ["--stop-after", "2"], "perhaps for ever"),
        "loop.ngc": ("G21\no1 while [1]\nG0 X9\nG0 X0\no1 endwhile\nM2\n", ["--stop-after=2"], "perhaps for ever"),
    }
    for name, (text, options, said) in programs.items():
        with open(os.path.join(checks.caller, name), "w", encoding="ascii") as file:
            file.write(text)
        result = checks.run(name, *options, "--trace", "out/run.csv", "--log", "out/run.log")
        checks.expect(f"{name} ends and says why", result.returncode == 0 and said in result.stderr, result)
        replay = subprocess.run([binary, "replay", "out/run.log", "--trace", "out/replay.csv"], cwd=checks.caller,
                                capture_output=True, text=True, check=False)
        with open(os.path.join(checks.caller, "out/run.csv"), "rb") as one, \
                open(os.path.join(checks.caller, "out/replay.csv"), "rb") as two:
            checks.expect(f"replay of {name}", one.read() == two.read(), replay)


def check_paths(checks):
    own = checks.run("parts/pocket.ngc", "--json")
    checks.expect("a path of the caller's before one of the project", '"lines": 5' in own.stdout, own)
    own = checks.run("pocket.ngc", "--json", folder=os.path.join(checks.caller, "parts"))
    checks.expect("a file of the caller's before an example", '"lines": 5' in own.stdout, own)
    mill = checks.run("short.ngc", "--machine", "mine.toml", "--json")
    checks.expect("a machine of the caller's", '"A"' not in mill.stdout and mill.returncode == 0, mill)
    mill = checks.run("short.ngc", "--machine", "configs/mill.toml", "--json")
    checks.expect("a machine of the project's", '"A"' not in mill.stdout and mill.returncode == 0, mill)
    none = checks.run("no_such_part")
    checks.expect("a program that is nowhere", none.returncode == 2 and "no_such_part" in none.stderr, none)


def main():
    binary, source = map(os.path.abspath, sys.argv[1:3])
    with tempfile.TemporaryDirectory() as folder:
        checks = Checks(make_project(folder, binary, source), make_caller(folder, source))
        check_paths(checks)
        check_options(checks)
        check_endless(checks, binary)
        check_examples(checks, source)
        bare = subprocess.run([binary, "run", "short.ngc"], cwd=checks.caller, capture_output=True, text=True,
                              check=False)
        checks.expect("without a machine", bare.returncode == 5 and "--machine" in bare.stderr, bare)
    print(f"{checks.failed} failed")
    return 1 if checks.failed else 0


if __name__ == "__main__":
    sys.exit(main())
