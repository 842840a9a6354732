#!/usr/bin/python3
"""Feeds damaged programs, configs and traces to `trunnion` and compares exit code and message with the expected.

usage: check_bad_input.py TRUNNION_BINARY [--show] [--only NAME]

Every process runs under a limit of address space: input of any size must be refused in bounded memory.
--show prints what each case gets instead of comparing.
"""
import argparse
import os
import resource
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from config_cases import CONFIGS
from program_cases import PROGRAMS
from trace_cases import TRACES

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from instrumented import sanitized  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
CRADLE = ROOT / "configs" / "cradle.toml"
TOOLS = ROOT / "examples" / "tools.tbl"
MEMORY_MAX = 512 << 20
SECONDS_MAX = 120
BAD_PROGRAM, BAD_CONFIG = 2, 3


def limited(instrumented):
    return None if instrumented else lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY_MAX, MEMORY_MAX))


def feed(path, pieces):
    """Writes into a named pipe until the reader has had enough."""
    try:
        with open(path, "wb", buffering=0) as pipe:
            for piece in pieces:
                pipe.write(piece)
    except BrokenPipeError:
        pass


def write(path, text):
    if text is not None:
        path.write_bytes(text.encode() if isinstance(text, str) else text)


class Runner:
    def __init__(self, binary, folder):
        self.binary, self.folder = binary, Path(folder)
        self.sanitized = sanitized(binary)

    def run(self, *arguments):
        done = subprocess.run([self.binary, *map(str, arguments)], capture_output=True, timeout=SECONDS_MAX,
                              preexec_fn=limited(self.sanitized), cwd=self.folder)
        return done.returncode, done.stderr.decode("utf-8", "replace")

    def program(self, case):
        path = self.folder / f"{case.name}.ngc"
        writer = None
        if callable(case.text):
            os.mkfifo(path)
            writer = threading.Thread(target=feed, args=(path, case.text()), daemon=True)
            writer.start()
        else:
            write(path, case.text)
        return path, self.run(case.command, path, "--machine", CRADLE, "--tools", TOOLS)

    def config(self, case):
        path = self.folder / f"{case.name}.toml"
        text = case.text
        if case.old is not None:
            cradle = CRADLE.read_text()
            assert case.old in cradle, f"{case.name}: '{case.old}' is not in the cradle's config"
            text = cradle.replace(case.old, case.new, 1)
        write(path, text)
        program = self.folder / "good.ngc"
        write(program, "G21 G90\nG0 X1\nM2\n")
        return path, self.run(case.command, program, "--machine", path)

    def trace(self, case):
        path = self.folder / f"{case.name}.csv"
        write(path, case.text)
        return path, self.run("check-trace", path, "--machine", CRADLE)


def first_line(stderr, path):
    return (stderr.splitlines() or [""])[0].replace(str(path), "{file}")


def matches(got, message):
    return got.startswith(message[:-1]) if message.endswith("*") else got == message


def compare(case, path, result, bad_exit):
    """What is wrong with the answer, or ''."""
    code, stderr = result
    wanted = bad_exit if case.message else 0
    got = first_line(stderr, path)
    if code != wanted:
        return f"exit {code}, expected {wanted}; message: {got}"
    if case.message and not matches(got, case.message):
        return f"message\n    {got}\n  expected\n    {case.message}"
    return ""


def cases(runner):
    for case in PROGRAMS:
        yield "program", case, runner.program, BAD_PROGRAM
    for case in CONFIGS:
        yield "config", case, runner.config, BAD_CONFIG
    for case in TRACES:
        yield "trace", case, runner.trace, BAD_PROGRAM


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("binary")
    parser.add_argument("--show", action="store_true")
    parser.add_argument("--only")
    options = parser.parse_args()
    passed = failed = 0
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(os.path.abspath(options.binary), folder)
        for kind, case, run, bad_exit in cases(runner):
            if options.only and options.only != case.name:
                continue
            path, result = run(case)
            if options.show:
                print(f"{kind} {case.name}: exit {result[0]}\n    {first_line(result[1], path)}", flush=True)
                continue
            wrong = compare(case, path, result, bad_exit)
            passed, failed = passed + (not wrong), failed + bool(wrong)
            if wrong:
                print(f"{kind} {case.name}: {wrong}", flush=True)
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
