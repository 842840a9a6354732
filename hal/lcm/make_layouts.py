#!/usr/bin/python3
"""Writes what C++ must know of the LCM types, from the .lcm files themselves: no field is typed twice.

usage: make_layouts.py LAYOUTS.h FIELDS.h FILE.lcm...

LAYOUTS.h: hal/wire_layout.h walks a received message by it before a decoder sees it. FIELDS.h: hal/message_fields.h
visits the fields of a message by it, with their names. Only what our types use is understood: numbers, booleans and
strings, alone or in one dimension, whose length is a constant or an int32_t field before.
"""
import pathlib
import re
import sys

SIZES = {"int8_t": 1, "byte": 1, "boolean": 1, "int16_t": 2, "int32_t": 4, "int64_t": 8, "float": 4, "double": 8}
STRUCT = re.compile(r"package\s+(\w+)\s*;\s*struct\s+(\w+)\s*\{(.*)\}\s*$", re.S)
FIELD = re.compile(r"(\w+)\s+(\w+)\s*((?:\[\s*\w+\s*\]\s*)*)$")


def fields_of(body, where):
    """(type, name, dimension or None) of every field, in order."""
    found = []
    for statement in filter(None, (part.strip() for part in body.split(";"))):
        if statement.startswith("const "):
            continue
        match = FIELD.match(statement)
        dimensions = re.findall(r"\w+", match.group(3)) if match else []
        if not match or len(dimensions) > 1 or match.group(1) not in [*SIZES, "string"]:
            raise SystemExit(f"{where}: '{statement}' is not understood; see the head of make_layouts.py")
        found.append((match.group(1), match.group(2), dimensions[0] if dimensions else None))
    return found


def rows_of(fields, where):
    """One line of C++ a field."""
    lengths = {dimension for _, _, dimension in fields if dimension and not dimension.isdigit()}
    counts, rows = [], []
    for kind, name, dimension in fields:
        times = int(dimension) if dimension and dimension.isdigit() else 1
        if dimension and not dimension.isdigit() and dimension not in counts:
            raise SystemExit(f"{where}: '{name}' needs the int32_t field '{dimension}' before it")
        count = counts.index(dimension) if dimension in counts else -1
        what = "kString" if kind == "string" else "kCount" if name in lengths else "kNumber"
        if what == "kCount":
            if kind != "int32_t" or dimension:
                raise SystemExit(f"{where}: the length '{name}' must be an int32_t")
            counts.append(name)
        rows.append(f"      {{WireField::Kind::{what}, {SIZES.get(kind, 4)}, {times}, {count}}},  // {name}")
    return rows


def parsed(path):
    """(package and name of the type, its fields)."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.S)
    match = STRUCT.match(text.strip())
    if not match:
        raise SystemExit(f"{path}: one package and one struct are expected")
    package, name, body = match.groups()
    return f"{package}::{name}", fields_of(body, path)


def layout_of(path):
    """The C++ text of one type's layout."""
    name, fields = parsed(path)
    rows = rows_of(fields, path)
    return "\n".join(["template <>", f"struct WireLayout<{name}> {{",
                      f"  static constexpr std::array<WireField, {len(rows)}> kFields{{{{", *rows, "  }};", "};"])


def visit_of(path):
    """The C++ text that visits one type's fields, without the lengths of others."""
    name, fields = parsed(path)
    lengths = {dimension for _, _, dimension in fields if dimension}
    rows = []
    for kind, field, dimension in fields:
        if field in lengths:
            continue
        count = dimension if dimension and not dimension.isdigit() else ""
        boolean = "true" if kind == "boolean" else "false"
        rows.append(f'    visit(MessageField{{"{field}", "{count}", {boolean}}}, m.{field});')
    return "\n".join(["template <>", f"struct MessageFields<{name}> {{", "  template <typename Visit>",
                      f"  static void each(const {name}& m, Visit visit) {{", *rows, "  }", "};"])


def write(output, includes, texts):
    """One header."""
    head = ["// Made by hal/lcm/make_layouts.py from the .lcm files.", "#pragma once", "", *includes, "",
            "namespace trn {", ""]
    pathlib.Path(output).write_text("\n".join(head) + "\n\n".join(texts) + "\n\n}  // namespace trn\n",
                                    encoding="utf-8")


def main(layouts, fields, *paths):
    """Writes both headers."""
    paths = [pathlib.Path(path) for path in sorted(paths)]
    write(layouts, ["#include <array>", "", '#include "hal/lcm_messages.h"', '#include "hal/wire_layout.h"'],
          [layout_of(path) for path in paths])
    write(fields, ['#include "hal/lcm_messages.h"', '#include "hal/message_fields.h"'],
          [visit_of(path) for path in paths])


if __name__ == "__main__":
    main(*sys.argv[1:])
