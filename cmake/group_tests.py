#!/usr/bin/env python3
"""Writes one source that holds several tests: group_tests.py OUT TEST...

What many tests instantiate is then compiled once. Each test keeps its names for itself, because its unnamed namespace
gets a name of its own; errors point at the test's own file. The headers come first: none is read behind a test.
"""
import pathlib
import re
import sys

INCLUDE = re.compile(r"^#include .*", re.M)


def body(path):
    name = "in_" + re.sub(r"\W", "_", path.stem)
    text = INCLUDE.sub("", path.read_text())
    return f'#line 1 "{path}"\n' + re.sub(r"^namespace \{", f"namespace {name} {{", text, flags=re.M) + "\n"


def main():
    out, *tests = map(pathlib.Path, sys.argv[1:])
    headers = dict.fromkeys(line for test in tests for line in INCLUDE.findall(test.read_text()))
    out.write_text("\n".join(headers) + "\n" + "".join(map(body, tests)))


main()
