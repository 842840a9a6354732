#!/usr/bin/env python3
"""./run.sh beside a built program: every example by its name alone, every option of `trunnion run`, whose the relative
paths are, programs without end, and the operator's page of --panel.

    tests/app/cli/run_script.py TRUNNION SOURCE

run.sh itself is the repository's; the folder that it stands in is a copy whose set-up builds nothing and whose program
is TRUNNION.
"""
import json
import os
import pty
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request

SHORT = "G21 G90\nG0 X1 Y1\nG1 X3 F600\nG1 Y3\nM2\n"
# What every option of `run` that takes a value is given here, and the file that it must leave in the caller's folder.
VALUES = {
    "--machine": ("mine.toml", None),
    "--project": (None, None),  # run.sh gives it
    "--trace": ("out/t.csv", "out/t.csv"),
    "--trace-density": ("2", None),
    "--path": ("out/p.csv", "out/p.csv"),
    "--stretches": ("out/s.csv", "out/s.csv"),
    "--preview": ("out/plan", "out/plan"),
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
        file.write(f". {source}/scripts/setup.sh\n"
                   f"install_packages() {{ echo packages \"$@\" >>{folder}/set_up; }}\n"
                   f"build() {{ echo build \"$@\" >>{folder}/set_up; }}\n")
    shutil.copy(os.path.join(source, "scripts/panel.sh"), os.path.join(project, "scripts"))
    os.mkdir(os.path.join(project, "build/release/panel"))
    with open(os.path.join(project, "build/release/panel/index.html"), "w", encoding="ascii") as file:
        file.write("<p>the page</p>")
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


def check_ending(checks):
    """The last lines are for people: what it was, what limits it, what to try next; true against --json."""
    told = json.loads(checks.run("pocket", "--json").stdout)
    result = checks.run("pocket")
    lines = result.stdout.splitlines()[-4:]
    minutes, seconds = divmod(told["cycle_time_s"], 60)
    checks.expect("what was run", lines[0].startswith("pocket.ngc ran through on ") and
                  f"in {minutes:.0f} min {seconds:.3f} s: {told['lines']} lines" in lines[0], result)
    free = 100 * told["free_of_limits_s"] / told["cycle_time_s"]
    share, what, name = max((seconds, quantity, joint["name"]) for joint in told["joints"]
                            for quantity, seconds in joint["time_at_limit_s"].items())
    share *= 100 / told["cycle_time_s"]
    checks.expect("what limits it", f"the {what} of joint {name} for {share:.0f} %" in lines[1] and
                  f"feed or a dwell for {free:.0f} %" in lines[1] and
                  (lines[1].index("feed") < lines[1].index("joint")) == (free >= share), result)
    checks.expect("what to try", "--report" in lines[3], result)
    for how in (("--stop-after", "5"), ("--operator", "stands.txt")):
        with open(os.path.join(checks.caller, "stands.txt"), "w", encoding="ascii") as file:
            file.write("5 hold\n")
        line = json.loads(checks.run("pocket", "--json", *how).stdout)["stopped_at_line"]
        result = checks.run("pocket", *how)
        checks.expect(f"it did not run through ({how[0]})", told["stopped_at_line"] is None and line > 0 and
                      f"pocket.ngc was stopped at line {line} on " in result.stdout and
                      "ran through" not in result.stdout, result)


def check_browser(checks, folder):
    """--report shows the pictures in a browser, in a terminal with a display, and else says where they are."""
    programs = os.path.join(folder, "desktop")
    os.makedirs(programs)
    with open(os.path.join(programs, "xdg-open"), "w", encoding="ascii") as file:
        file.write(f"#!/bin/sh\necho \"$1\" >{folder}/opened.new && mv {folder}/opened.new {folder}/opened\n")
    os.chmod(os.path.join(programs, "xdg-open"), 0o755)
    environment = {name: value for name, value in os.environ.items() if "DISPLAY" not in name}
    environment["PATH"] = programs + ":" + environment["PATH"]
    for display, terminal in ((":9", False), ("", True), (":9", True)):
        ours, theirs = pty.openpty()
        with subprocess.Popen([checks.script, "short.ngc", "--machine", "mine.toml", "--report", "shown"],
                              cwd=checks.caller, stdout=theirs if terminal else subprocess.PIPE,
                              stderr=subprocess.DEVNULL, env=dict(environment, DISPLAY=display)) as process:
            os.close(theirs)
            said = read_all(ours) if terminal else process.stdout.read()
        os.close(ours)
        shown = terminal and display
        checks.expect(f"the path is said ({display}, {terminal})", b"Pictures: shown/report.html; " in said)
        checks.expect(f"what is said of the browser ({display}, {terminal})", (b"your browser" in said) == bool(shown))
        end = time.monotonic() + (20 if shown else 1)
        while time.monotonic() < end and not os.path.exists(os.path.join(folder, "opened")):
            time.sleep(0.05)
        checks.expect(f"a browser is asked ({display}, {terminal})",
                      os.path.exists(os.path.join(folder, "opened")) == bool(shown))
    with open(os.path.join(folder, "opened"), encoding="ascii") as file:
        checks.expect("the page", os.path.samefile(file.read().strip(),
                                                   os.path.join(checks.caller, "shown/report.html")))


def read_all(fd):
    """What a terminal shows, to its end."""
    out = b""
    while True:
        try:
            part = os.read(fd, 4096)
        except OSError:  # the other end is closed
            return out
        if not part:
            return out
        out += part


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


class Panel:
    """./run.sh --panel as a process, with folders of its own."""

    def __init__(self, checks, folder, *arguments):
        self.temporary = os.path.join(folder, "temporary")
        os.makedirs(self.temporary, mode=0o700, exist_ok=True)
        self.environment = dict(os.environ, RUNTIME_DIRECTORY=self.temporary, TMPDIR=self.temporary)
        self.process = subprocess.Popen([checks.script, "--panel", *arguments], cwd=checks.caller,
                                        env=self.environment,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                        start_new_session=True)
        self.said = self.process.stdout.readline()
        found = re.search(r"(http://127\.0\.0\.1:\d+)/#key=(\w+)$", self.said.strip())
        self.origin, self.key = found.groups() if found else ("", "")

    def get(self, path):
        request = urllib.request.Request(self.origin + path, headers={"Authorization": f"Bearer {self.key}"})
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.read().decode()

    def state(self):
        return json.loads(self.get("/api/v1/state"))["status"] or {}

    def client(self, verb):
        """A command of another client of the same daemon."""
        folder = os.path.dirname(self.process.args[0])
        subprocess.run([os.path.join(folder, "build/release/trunnion"), verb, "--machine",
                        os.path.join(folder, "configs/cradle.toml")], env=self.environment, check=True, timeout=60,
                       capture_output=True)

    def until(self, wanted):
        """The state that is so; nothing, and the last one told, where it never comes."""
        state, end = {}, time.monotonic() + 60
        while time.monotonic() < end and self.process.poll() is None:
            if wanted(state := self.state()):
                return state
        print(f"  the last state was {state}")
        return {}

    def end(self, by_ctrl_c=True):
        """As Ctrl-C does, which the whole group hears, or by a signal to the script alone; returns the exit code and
        what was written of errors."""
        if self.process.poll() is None:
            if by_ctrl_c:
                os.killpg(self.process.pid, signal.SIGINT)
            else:
                self.process.terminate()
        errors = self.process.communicate(timeout=120)[1]
        return self.process.returncode, errors

    def left(self):
        """What has stayed behind: processes of its group, and files but locks and sockets, which stay."""
        group = subprocess.run(["pgrep", "-g", str(self.process.pid)], capture_output=True, text=True, check=False)
        return group.stdout.split() + [name for name in os.listdir(self.temporary) if name.startswith("tmp")]


def check_panel(checks, folder):
    panel = Panel(checks, folder, "--port", "0")
    try:
        checks.expect(f"--panel prints the address: {panel.said}", panel.key)
        checks.expect("--panel serves the page", panel.get("/") == "<p>the page</p>")
        state = panel.until(lambda now: "tool 1" in now.get("waits_for", ""))
        checks.expect(f"--panel starts the impeller with its tools: {state}",
                      state.get("program", "").endswith("/impeller.ngc") and "ball" in state.get("waits_for", ""))
        panel.client("resume")
        checks.expect("the program of --panel runs", panel.until(lambda now: now.get("state") == "running"))
    finally:
        code, errors = panel.end()
    checks.expect(f"--panel ends with Ctrl-C: {code}, {errors}", code == 0)
    checks.expect(f"--panel leaves nothing behind: {panel.left()}", not panel.left())
    with open(os.path.join(folder, "set_up"), encoding="ascii") as file:
        checks.expect("--panel sets up what it needs",
                      "packages panel\nbuild release trunnion panel_page\n" in file.read())


def check_panel_homes(checks, folder):
    """A machine that does not know its place, and a signal to the script alone."""
    with open(os.path.join(checks.caller, "mine.toml"), encoding="utf-8") as file:
        text = file.read().replace("[drives]\n", "[drives]\nhomed = false\nhoming_speed_mm_s = 500.0\n")
    with open(os.path.join(checks.caller, "unhomed.toml"), "w", encoding="utf-8") as file:
        file.write(text)
    panel = Panel(checks, folder, "short.ngc", "--machine", "unhomed.toml", "--port=0")
    try:
        state = panel.until(lambda now: now.get("program", "").endswith("/short.ngc") and now["state"] == "idle")
        checks.expect(f"--panel homes the machine: {state}",
                      all(joint["homed"] for joint in state.get("joints", [{"homed": False}])))
    finally:
        code, errors = panel.end(by_ctrl_c=False)
    checks.expect(f"--panel ends by a signal: {code}, {errors}", code == 0)
    checks.expect(f"--panel leaves nothing behind a signal: {panel.left()}", not panel.left())


def check_panel_refusals(checks, folder):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        panel = Panel(checks, folder, "--port", port)
        code, errors = panel.end()
        checks.expect(f"--panel at a port that is taken: {code}, {errors}",
                      code == 4 and port in errors and "--port" in errors and not panel.said)
        checks.expect(f"a taken port leaves nothing behind: {panel.left()}", not panel.left())
    for arguments, code, said in ((["--machine", "configs/cradle_can.toml"], 3, "real drives"),
                                  (["--machine", "configs/mill_modbus.toml"], 3, "real drives"),
                                  (["no_such_part"], 2, "no_such_part"), (["--json"], 5, "usage")):
        result = checks.run("--panel", "--port", "0", *arguments)
        checks.expect(f"--panel {arguments} is refused", result.returncode == code and said in result.stderr, result)


def main():
    binary, source = map(os.path.abspath, sys.argv[1:3])
    with tempfile.TemporaryDirectory() as folder:
        checks = Checks(make_project(folder, binary, source), make_caller(folder, source))
        check_paths(checks)
        check_options(checks)
        check_ending(checks)
        check_browser(checks, folder)
        check_panel(checks, folder)
        check_panel_homes(checks, folder)
        check_panel_refusals(checks, folder)
        check_endless(checks, binary)
        check_examples(checks, source)
        bare = subprocess.run([binary, "run", "short.ngc"], cwd=checks.caller, capture_output=True, text=True,
                              check=False)
        checks.expect("without a machine", bare.returncode == 5 and "--machine" in bare.stderr, bare)
    print(f"{checks.failed} failed")
    return 1 if checks.failed else 0


if __name__ == "__main__":
    sys.exit(main())
