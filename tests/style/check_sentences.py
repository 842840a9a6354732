#!/usr/bin/python3
"""Checks that a refusal of the interpreter has as many parts as its sentence has places for them.

The sentences stand in a table of their own, where no compiler compares them with what `fail` is given: one part too
few, and the refusal itself ends in "argument not found". Errors as file:line.
"""
import re
import sys

from source_text import ROOT, source_files

TABLE = "interp/gcode/error.cc"
ROW = re.compile(r"\{GcodeErrorCode::(\w+),\s*\{(.*?)\}\}", re.DOTALL)
TEXT = re.compile(r'"((?:[^"\\]|\\.)*)"')
PLACE = re.compile(r"\{[^{}]*\}")
CALL = re.compile(r"\bfail\(GcodeErrorCode::(\w+)")


def places(table):
    """{code: places in its sentence}, the sentence being the second text of a row."""
    counts = {}
    for code, row in ROW.findall(table):
        fields = re.split(r",(?=(?:[^\"\\]|\\.|\"(?:[^\"\\]|\\.)*\")*$)", row, maxsplit=2)
        counts[code] = len(PLACE.findall("".join(TEXT.findall(fields[1]))))
    return counts


def arguments(text, start):
    """How many arguments the call has whose bracket opens at `start`."""
    depth, count, i = 0, 1, start + 1
    while True:
        c = text[i]
        if c in "\"'":
            i += 1
            while text[i] != c:
                i += 2 if text[i] == "\\" else 1
        elif c in "([{":
            depth += 1
        elif c in ")]}":
            if depth == 0:
                return count
            depth -= 1
        elif c == "," and depth == 0:
            count += 1
        i += 1


def check(sources, counts):
    errors = []
    for path, text in sources.items():
        for call in CALL.finditer(text):
            given = arguments(text, text.index("(", call.start())) - 2  # the code and the column
            wanted = counts.get(call.group(1))
            if given != wanted:
                line = text.count("\n", 0, call.start()) + 1
                errors.append(f"{path}:{line}: {call.group(1)} is given {given} parts; its sentence in {TABLE} has "
                              f"places for {wanted}")
    return errors


def main():
    counts = places((ROOT / TABLE).read_text())
    sources = {name: (ROOT / name).read_text() for name in source_files(".cc", ".h")
               if name.startswith(("interp/", "app/"))}
    calls = sum(len(CALL.findall(text)) for text in sources.values())
    errors = check(sources, counts)
    print("\n".join(errors + [f"{calls} refusals, {len(counts)} sentences"]))
    return 1 if errors or calls < 100 or len(counts) < 50 else 0


if __name__ == "__main__":
    sys.exit(main())
