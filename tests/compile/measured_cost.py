#!/usr/bin/python3
"""usage: measured_cost.py SOURCE

scripts/build_cost.py on a project of three files: the file that makes work is the slowest, its time is about what the
compiler says by itself, and nothing comes out of a cache the second time.
"""
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

PROJECT = """cmake_minimum_required(VERSION 3.25)
project(small CXX)
find_program(CCACHE ccache)
set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env ${CCACHE})
add_executable(small main.cc quick.cc slow.cc)
"""
SLOW = "#include <regex>\nbool slow(const char* t) { return std::regex_match(t, std::regex(t)); }\n"


def measured(script, source):
    done = subprocess.run([script, "--source", source, "small"], check=True, capture_output=True, text=True)
    total = float(re.match(r"small: (\d+) s of processor time \([\d.]+ min\), \d+ s by the clock, 3 compilations\n",
                           done.stdout).group(1))
    return total, [(float(cost), name) for cost, name in re.findall(r"^ +([\d.]+) s  (\S+)$", done.stdout, re.M)]


def alone(folder):
    """What the compiler needs for the slow file, by the kernel's own account."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(["c++", "-O3", "-DNDEBUG", "-c", folder / "slow.cc", "-o", "/dev/null"], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file, text in (("CMakeLists.txt", PROJECT), ("main.cc", "int main() {}\n"), ("quick.cc", "int q;\n"),
                           ("slow.cc", SLOW)):
            (folder / file).write_text(text)
        truth = alone(folder)
        for _ in range(2):
            total, files = measured(pathlib.Path(sys.argv[1]) / "scripts/build_cost.py", folder)
            assert files[0][1].endswith("slow.cc.o") and len(files) == 3, files
            assert 0.5 * truth < files[0][0] < 2 * truth, (files, truth)
            assert abs(total - sum(cost for cost, _ in files)) < max(2, truth), (total, files)
        print(f"slow.cc: {files[0][0]} s, alone {truth:.2f} s; the build {total} s")


main()
