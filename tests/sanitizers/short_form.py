#!/usr/bin/python3
"""The short form of ./test.sh --asan and --tsan: what reads bytes from elsewhere, and what threads share.

usage: short_form.py SOURCE address|thread

With `address` (and undefined behaviour): the readers of programs, tables, drives' data sheets, frames and messages,
each on the kept corpus of its fuzzer, and the tests of core and hal. With `thread`: the tests of core and hal, in
which threads meet at queues and sockets. The long form runs every test so.
Exit codes: 0 nothing found, 1 something found, or it does not build.
"""
import re
import subprocess
import sys
from pathlib import Path

PROGRAMS = {"address": ["test_hal", "test_core"], "thread": ["test_hal", "test_core"]}
DOORS = ["gcode_fuzz", "expression_fuzz", "message_fuzz", "can_frame_fuzz", "eds_fuzz", "table_fuzz", "operator_fuzz",
         "page_message_fuzz"]
FLAGS = "-O1 -g1 -DNDEBUG"  # half the compiler's time of the long form
SANITIZERS = {"address": "address,undefined", "thread": "thread"}
INSTRUMENTED = {"address": b"__asan_init", "thread": b"__tsan_init"}


def run(*command, folder):
    result = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            check=False)
    if result.returncode:
        print(result.stdout)
        sys.exit(f"{' '.join(map(str, command))}: exit code {result.returncode}")
    return result.stdout


def main():
    source, kind = Path(sys.argv[1]), sys.argv[2]
    build = source / "build" / f"short_{kind}"
    programs = PROGRAMS[kind]
    doors = DOORS if kind == "address" else []
    if not (build / "build.ninja").exists():
        run("cmake", "--preset", "release", "-B", build, f"-DTRN_SANITIZE={SANITIZERS[kind]}",
            f"-DCMAKE_CXX_FLAGS_RELEASE={FLAGS}", folder=source)
    run("cmake", "--build", build, "--target", *programs, *[f"{door}_replay" for door in doors], folder=source)
    if INSTRUMENTED[kind] not in (build / programs[0]).read_bytes():
        sys.exit(f"{build}/{programs[0]} was built without the {kind} sanitizer")
    names = programs + [f"{door}_corpus" for door in doors]
    told = run("ctest", "--test-dir", build, "--output-on-failure", "-j2", "-R", f"^({'|'.join(names)})$",
               folder=source)
    passed = re.search(r"100% tests passed, 0 tests failed out of (\d+)", told)
    if not passed or int(passed[1]) != len(names):
        print(told)
        sys.exit(f"{len(names)} tests were to run with the {kind} sanitizer")
    print(f"{passed[1]} tests with the {kind} sanitizer: nothing found")


if __name__ == "__main__":
    main()
