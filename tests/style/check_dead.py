#!/usr/bin/python3
"""Checks that nothing in the source is dead: no private data member that is never read, no function that is declared
without a body, none that nobody calls. Errors as file:line.

Judged by the text and by simple names, so a dead function is not found where another one of its name lives; but what
is found is dead. Data members are those with a trailing underscore.
"""
import re
import sys
from collections import Counter
from dataclasses import dataclass

from source_text import CONTAINER, FUNCTION_END, NAME, ROOT, TOKEN, ACCESS, blank, code_only, continues, is_container
from source_text import is_function, source_files

WORD = re.compile(r"\b[A-Za-z_]\w*\b")
CLASS = re.compile(r"\b(?:class|struct|union)\s+(?:\[\[\w+\]\]\s*)?(\w+)")
MEMBER = re.compile(r"\b([a-z]\w*_)\s*(?=[;,={\[]|$)")
NO_BODY = re.compile(r"=\s*(0|default|delete)\s*$")
# Written and no more: an assignment or a count as a statement of its own, or the constructor's list.
ASSIGNED = re.compile(r"\s*(?:\[[^\]]*\]\s*)?(?:[-+*/|&]?=(?!=)|\+\+|--)")
# Held for what its destructor does.
GUARD = re.compile(r"lock|guard|thread|Lock|Guard|Holder|NoSignals|unique_ptr|PrivateCopy")
CALLED_BY_LIBRARIES = {"main", "LLVMFuzzerTestOneInput", "PrintTo", "begin", "end"}


@dataclass
class Statement:
    """What stands at namespace or class scope up to its ';' or its body."""
    text: str
    line: int
    scope: str   # the class it stands in, "" outside of all
    body: bool
    private: bool


def statements(code):
    """Declarations and definitions of the text in their order; what is in functions is left out."""
    out, stack, start, line, private = [], [], 0, 1, False
    skip_to = -1  # brace depth at which a function's body ends
    for at, char in enumerate(code):
        line += char == "\n"
        if skip_to >= 0:
            if char == "{":
                stack.append(("", private))
            elif char == "}":
                _, private = stack.pop()
                if len(stack) == skip_to and not continues(code, at):
                    skip_to, start = -1, at + 1
            continue
        if char == ":" and code[start:at].strip() in ACCESS:
            private, start = code[start:at].strip() != "public", at + 1
        elif char in ";{}":
            text = code[start:at]
            first = line - text[len(text) - len(text.lstrip()):].count("\n")
            scope = next((name for name, _ in reversed(stack) if name), "")
            if char == ";" or is_function(text.strip()):
                out.append(Statement(text.strip(), first, scope, char == "{", private))
            if char == "{":
                skip_to = len(stack) if is_function(text.strip()) else -1
                name = CLASS.search(text) if is_container(text.strip()) else None
                stack.append((name.group(1) if name and "enum" not in text else "", private))
                if CONTAINER.search(text):
                    private = "class" in text
            elif char == "}" and stack:
                _, private = stack.pop()
            if char != "{" or skip_to >= 0 or is_container(text.strip()):
                start = at + 1
    return out


@dataclass
class Source:
    path: str
    words: str   # without comments and strings, with preprocessor lines
    code: str
    statements: list
    known: frozenset  # its words


def parsed(path, text):
    code = code_only(text)
    return Source(path, TOKEN.sub(blank, text), code, statements(code), frozenset(WORD.findall(code)))


def function_name(statement):
    """(class, name, has a body) of a function's declaration or definition, or None."""
    text = re.sub(r"^(template\s*<.*?>\s*)+", "", statement.text, flags=re.DOTALL)
    declared = NO_BODY.sub("", text).strip()
    if "operator" in text or re.match(r"\s*(using|typedef|friend|extern|static_assert|return|namespace)\b", text):
        return None
    if not statement.body and (not FUNCTION_END.search(declared) or "=" in declared.split("(")[0]
                               or is_container(declared)):
        return None
    match = NAME.search(text)
    if not match or match.group(1) == statement.scope or not re.search(r"[\w>&*]\s*$", text[:match.start()]):
        return None  # no result before it: a constructor or a macro
    parts = re.sub(r"<[^<>]*>", "", match.group(1)).split("::")
    scope = parts[-2] if len(parts) > 1 else statement.scope
    return scope, parts[-1], statement.body or bool(NO_BODY.search(text))


def dead_functions(sources):
    """Errors of functions that are declared in a header and have no body, or that nobody names."""
    uses = Counter(word for source in sources for word in WORD.findall(source.words))
    declared, bodies = {}, set()
    for source in sources:
        for statement in source.statements:
            found = function_name(statement)
            if not found:
                continue
            scope, name, body = found
            uses[name] -= 1
            if body:
                bodies.add((scope, name))
            if re.search(r"\boverride\b", statement.text):
                uses[name] += 1  # called through its base
            declared.setdefault((scope, name), (source.path, statement.line))
    errors = []
    for (scope, name), (path, line) in declared.items():
        full = f"{scope}::{name}" if scope else name
        if path.startswith(("tests/", "bench/")) or name in CALLED_BY_LIBRARIES or name.startswith("~"):
            continue
        if (scope, name) not in bodies:
            errors.append(f"{path}:{line}: {full} is declared and has no body")
        elif uses[name] <= 0:
            errors.append(f"{path}:{line}: nobody calls {full}")
    return errors


def initialises(code, at):
    """Whether an initialiser of a constructor's list begins here, not a call: behind it come the next or the body."""
    close = {"(": ")", "{": "}"}.get(code[at:at + 1])
    depth = 0
    for end in range(at, min(len(code), at + 2000) if close else at):
        depth += (code[end] == code[at]) - (code[end] == close)
        if depth == 0:
            return bool(re.match(r"\s*[,{]", code[end + 1:end + 80]))
    return False


def is_read(code, match):
    """Whether a member's name in the code is a read of it, not only a write."""
    before, after = code[max(0, match.start() - 80):match.start()].rstrip(), code[match.end():match.end() + 80]
    if before.endswith(("++", "--")) and before[:-2].rstrip()[-1:] in ";{})":
        return False
    if before[-1:] in (":", ",") and not before.endswith("::") and initialises(code, match.end()):
        return False
    return not (ASSIGNED.match(after) and before[-1:] in ";{})=")


def dead_members(sources):
    """Errors of private data members of which no code of their class reads the value."""
    errors = []
    for header in sources:
        for statement in header.statements:
            if not statement.private or not statement.scope or "(" in re.sub(r"<.*?>", "", statement.text):
                continue
            if GUARD.search(statement.text) or re.match(r"(using|friend|static|enum|struct|class)\b", statement.text):
                continue
            for member in MEMBER.findall(statement.text):
                word = re.compile(rf"\b{member}(?!\w)")
                own = (source.code for source in sources if {member, statement.scope} <= source.known)
                if not any(is_read(code, match) and not declares(code, match, statement)
                           for code in own for match in word.finditer(code)):
                    errors.append(f"{header.path}:{statement.line}: nothing reads {statement.scope}::{member}")
    return errors


def declares(code, match, statement):
    """Whether the name stands in the member's own declaration."""
    begin = code.rfind(statement.text, 0, match.end() + len(statement.text))
    return 0 <= begin <= match.start() < begin + len(statement.text)


def check(texts):
    """`texts`: file name to text, of every C++ file."""
    sources = [parsed(path, text) for path, text in texts.items()]
    return dead_functions(sources) + dead_members(sources)


def main():
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in source_files(".h", ".cc")}
    errors = check(texts)
    print("\n".join(errors + [f"{len(texts)} files, {len(errors)} errors"]))
    return 1 if errors or not texts else 0


if __name__ == "__main__":
    sys.exit(main())
