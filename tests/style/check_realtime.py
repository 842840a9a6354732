#!/usr/bin/python3
"""What the tick calls is marked, too: a function marked TRN_RT calls only functions of the project that are marked.

What a marked function may do is judged by its text (check_form.py). This check follows its calls, so that a helper
without the mark cannot hide what it does. Names are resolved by text: a call means the functions of that name in the
same file, else those of the same class, else all. Errors as file:line.
"""
import re
import sys
from dataclasses import dataclass

from source_text import ROOT, code_only, functions, source_files

# sim stands in their place
FOLDERS = ("core/", "kinematics/", "compensation/", "kernel/", "hal/", "app/daemon/rate_planner_thread")
CALL = re.compile(r"(?<![\w~])((?:\w+::)*)(~?[A-Za-z_]\w*)\s*\(")
CHECKED_BY_TEXT = {"if", "for", "while", "switch", "return", "sizeof", "decltype", "noexcept", "catch", "alignof"}
# Of the standard library's containers and atomics, where something stands before the dot.
LIBRARY = {"load", "store", "exchange", "data", "size", "begin", "end", "front", "back", "fill", "empty"}
DECLARATION = re.compile(r"([A-Za-z_]\w*)\s*\((?:[^(){};]|\([^()]*\))*\)[^;{}=]*\bTRN_RT\b")


@dataclass(frozen=True)
class Known:
    file: str
    owner: str  # class, "" if none
    marked: bool


def stem(name):
    return re.sub(r"\.(h|cc)$", "", name)


def last_two(name):
    parts = re.sub(r"<[^<>]*>", "", name).split("::")
    return (parts[-2] if len(parts) > 1 else "", parts[-1])


def in_class(code):
    """Offset to class, for what stands in a class body."""
    spans = []
    for match in re.finditer(r"\b(?:class|struct)\s+(\w+)[^;{}()]*\{", code):
        depth, at = 1, match.end()
        while depth and at < len(code):
            depth += {"{": 1, "}": -1}.get(code[at], 0)
            at += 1
        spans.append((match.start(), at, match.group(1)))
    return spans


def known_functions(codes):
    """Simple name to its functions with a body; a mark of the declaration counts for the definition."""
    declared, found = set(), {}
    for name, code in codes.items():
        declared |= {(stem(name), match.group(1)) for match in DECLARATION.finditer(code)}
    for name, code in codes.items():
        spans = in_class(code)
        for function in functions(code):
            owner, simple = last_two(function.name)
            at = code.find(function.header)
            around = [span[2] for span in spans if span[0] <= at < span[1]]
            owner = owner or (around[-1] if around else "")
            marked = "TRN_RT" in function.header or (stem(name), simple) in declared
            found.setdefault(simple, []).append(Known(name, owner, marked))
    return found


def candidates(known, name, owner, qualifier):
    """Of the functions of one simple name those that a call from `name`, in class `owner`, can mean."""
    if qualifier:
        wanted = qualifier.rstrip(":").split("::")[-1]
        return [k for k in known if k.owner == wanted] or known
    same_unit = [k for k in known if stem(k.file) == stem(name)]
    return [k for k in same_unit if k.owner in ("", owner)] or same_unit or known


def check(texts):
    codes = {name: code_only(text) for name, text in texts.items()}
    known, errors = known_functions(codes), []
    for name, code in codes.items():
        for function in functions(code):
            if "TRN_RT" not in function.header:
                continue
            owner = last_two(function.name)[0]
            for match in CALL.finditer(function.body):
                qualifier, called = match.groups()
                if qualifier.startswith("std::") or called in CHECKED_BY_TEXT or called not in known:
                    continue
                if re.search(rf"\bauto&?\s+{called}\s*=", function.body):  # a lambda of its own
                    continue
                before = function.body[:match.start()].rstrip()
                if called in LIBRARY and before.endswith((".", "->")):
                    continue
                if not any(k.marked for k in candidates(known[called], name, owner, qualifier)):
                    line = function.body_line + function.body.count("\n", 0, match.start())
                    errors.append(f"{name}:{line}: {function.name} is marked TRN_RT and calls {called}, which is not")
    return errors


def main():
    names = [name for name in source_files(".h", ".cc") if name.startswith(FOLDERS)]
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in names}
    errors = check(texts)
    print("\n".join(errors + [f"{len(texts)} files, {len(errors)} errors"]))
    return 1 if errors or not texts else 0


if __name__ == "__main__":
    sys.exit(main())
