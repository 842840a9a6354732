#!/usr/bin/python3
"""Checks includes: which folder may include which (the table of docs/architecture.md), and that no units of a folder
include each other in a circle. Errors as file:line."""
import re
import sys

from source_text import ROOT, source_files

INCLUDE = re.compile(r'^\s*#\s*include\s+(["<])([^">]+)[">]')

ENGINE = {"core", "interp", "interp/gcode", "interp/plan", "kinematics", "compensation", "hal", "sim", "kernel"}
APP = {"app/check", "app/client", "app/gateway", "app/import", "app/session", "app/daemon", "app/lab", "app/cli",
       "panel/server"}
RATE = "kernel/rate"  # beside the tick: it searches, and the tick must not
FITS = "compensation/fit"  # off-line, with a solver that nothing else needs
EVERYTHING = ENGINE | APP | {RATE, FITS, "app/library", "bench", "tests"}
ALLOWED = {
    "core": {"core"},
    "interp": {"core", "interp"},
    "interp/gcode": {"core", "interp", "interp/gcode"},
    "interp/plan": {"core", "interp", "interp/plan"},
    "kinematics": {"core", "kinematics"},
    "compensation": {"core", "compensation"},
    FITS: {"core", "compensation", FITS},
    "hal": {"core", "hal"},
    "sim": {"core", "kinematics", "compensation", "hal", "sim"},
    "kernel": {"core", "compensation", "kernel"},
    RATE: {"core", "kernel", RATE},
    "app/check": {"core", "interp", "app/check"},
    "app/client": {"core", "hal", "app/client"},
    "app/gateway": {"core", "hal", "app/client", "app/gateway"},
    "panel/server": {"core", "hal", "app/client", "panel/server"},
    "app/import": {"core", "interp", "interp/gcode", "app/import"},
    "app/session": ENGINE | {RATE, "app/check", "app/client", "app/session"},
    "app/daemon": ENGINE | {RATE, "app/check", "app/client", "app/session", "app/daemon"},
    "app/lab": ENGINE | {FITS, "app/check", "app/session", "app/lab"},
    "app/library": ENGINE | {FITS, "app/lab", "app/session", "app/library"},
    "app/cli": ENGINE | APP | {FITS},
    "bench": EVERYTHING,
    "tests": EVERYTHING,
    "cmake": {"core"},
    "examples": set(),  # what a user of the installed library writes
}

# System headers that belong to some folders only: bus and operating system stay out of the mathematics.
SYSTEM = [
    (re.compile(r"^(lcm/|modbus|linux/|net/|sys/socket)"),
     {"hal", "sim", "app/session", "app/daemon", "app/cli", "bench", "tests", "examples"}),
    (re.compile(r"^(spdlog/|CLI/|systemd/|nlohmann/)"), APP | {"bench", "tests", "cmake"}),
    (re.compile(r"^(pthread|sched|sys/mman|sys/timerfd|thread$|mutex$|condition_variable$)"),
     APP | {"hal", "sim", "bench", "tests"}),
    (re.compile(r"^ceres/"), {FITS, "bench", "tests"}),
    (re.compile(r"^sodium"), {"app/client", "panel/server", "tests"}),
    (re.compile(r"^(libwebsockets|mosquitto)"), {"panel/server"}),
    (re.compile(r"^(gtest|gmock|rapidcheck|kdl/)"), {"tests", "bench", "cmake"}),
    (re.compile(r"^toml"), {"core", "tests"}),
]


def folder_of(path):
    """The key of ALLOWED that `path` lies in, or '' outside of all."""
    parts = path.split("/")
    for depth in (2, 1):
        if "/".join(parts[:depth]) in ALLOWED and len(parts) > depth:
            return "/".join(parts[:depth])
    return ""


def judge(own, mark, target):
    """Why folder `own` must not include `target`, or None."""
    if mark == "<":
        for pattern, folders in SYSTEM:
            if pattern.search(target) and own not in folders:
                return f"{own}/ must not include <{target}>; only {', '.join(sorted(folders))} may"
        return None
    if target.startswith("lcm_types/"):
        return None if own in {"hal", "tests", "bench"} | APP else f"{own}/ must not include LCM types"
    theirs = folder_of(target)
    if not theirs:  # beside the including file, as the tests' own helpers
        return None if own in ("tests", "bench", "cmake") else f'"{target}" must be named from the top folder'
    if theirs not in ALLOWED[own]:
        legal = ", ".join(sorted(ALLOWED[own]))
        return f'{own}/ must not include {theirs}/ ("{target}"); it may include {legal}'
    if not (ROOT / target).is_file():
        return f'"{target}" does not exist'
    return None


def unit_of(path):
    """A .h and the .cc of the same name are one unit; any other file is one by itself."""
    return re.sub(r"\.(h|cc)$", "", path)


def unit_includes(texts):
    """{unit: {other unit: "file:line" of an include}} of `texts` {path: text}, as far as both lie in one folder."""
    out = {}
    for path, text in texts.items():
        own = out.setdefault(unit_of(path), {})
        for number, line in enumerate(text.splitlines(), 1):
            match = INCLUDE.match(line)
            if not match or match.group(2) not in texts:
                continue
            target = unit_of(match.group(2))
            if target != unit_of(path) and folder_of(path) == folder_of(match.group(2)):
                own.setdefault(target, f"{path}:{number}")
    return out


def circles(includes):
    """Errors for units that include each other, directly or through others: one for each shortest circle found."""
    errors, done = [], set()
    for start in sorted(includes):
        came_from, queue = {start: None}, [start]
        while queue and start not in done:
            unit = queue.pop(0)
            if start in includes.get(unit, {}):
                way = [unit]
                while came_from[way[0]] is not None:
                    way.insert(0, came_from[way[0]])
                names = " - ".join(name.split("/")[-1] for name in way + [start])
                place = includes[unit][start]
                errors.append(f"{place}: circle of units {names}; move what both need to a unit of its own")
                done.update(way)
                break
            for target in includes.get(unit, {}):
                if target not in came_from:
                    came_from[target] = unit
                    queue.append(target)
    return errors


def check(path):
    own = folder_of(path)
    if not own:
        return [f"{path}:1: no row of the include table for this folder"]
    errors = []
    for number, line in enumerate((ROOT / path).read_text().splitlines(), 1):
        match = INCLUDE.match(line)
        reason = match and judge(own, match.group(1), match.group(2))
        if reason:
            errors.append(f"{path}:{number}: {reason}")
    return errors


def main():
    files = source_files(".h", ".cc")
    errors = [error for path in files for error in check(path)]
    errors += circles(unit_includes({path: (ROOT / path).read_text() for path in files}))
    print("\n".join(errors + [f"{len(files)} files, {len(errors)} errors"]))
    return 1 if errors or not files else 0


if __name__ == "__main__":
    sys.exit(main())
