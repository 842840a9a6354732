#!/usr/bin/python3
"""Checks the form of the source: file and function length, what the tick may do, and small manners.

Errors as file:line. What TRN_RT functions may do is judged by their text; the tests that count allocations in the
tick judge it by running.
"""
import re
import statistics
import sys

from source_text import ROOT, code_only, functions, source_files

FILE_LINES_MAX = 600
FUNCTION_LINES_MAX = 70
COLUMNS_MAX = 120  # of Python, shell and TOML

# In a function marked TRN_RT.
TICK_FORBIDDEN = [
    (re.compile(r"\bnew\b(?!\s*\()"), "allocates (new)"),
    (re.compile(r"\bdelete\b"), "frees (delete)"),
    (re.compile(r"\b(malloc|calloc|realloc|free)\s*\("), "allocates"),
    (re.compile(r"\bstd::make_(unique|shared)\b"), "allocates"),
    (re.compile(r"\bstd::(string|vector|map|unordered_map|set|deque|list|function)\b(?!\s*(<[^;{}]*>)?\s*[&*])"),
     "makes an object that allocates"),
    (re.compile(r"\bEigen::(MatrixXd|VectorXd|MatrixXf|VectorXf)\b"), "makes a matrix that allocates"),
    (re.compile(r"\.(push_back|emplace_back|reserve)\s*\("), "grows a container"),
    (re.compile(r"\bthrow\b"), "throws"),
    (re.compile(r"\b(try|catch)\b"), "handles exceptions"),
    (re.compile(r"\b(mutex|lock_guard|unique_lock|scoped_lock|condition_variable)\b"), "locks"),
    (re.compile(r"\b(fmt::|spdlog::|std::cout|std::cerr|printf\s*\(|std::to_string|stringstream)"), "formats text"),
    (re.compile(r"\b(sleep_for|sleep_until|usleep|nanosleep|clock_nanosleep)\b"), "sleeps"),
    (re.compile(r"\bwhile\s*\(\s*(true|1)\s*\)|\bfor\s*\(\s*;\s*;"), "has an unbounded loop"),
]

ANYWHERE = [
    (re.compile(r"\b(TODO|FIXME|XXX|HACK)\b"), "unfinished work does not stay in the source"),
    (re.compile(r"\t"), "tab"),
    (re.compile(r"\s$"), "space at the end of the line"),
]

# One answer for all threads (the manual pages' ATTRIBUTES): another thread's call overwrites it.
SHARED_ANSWER = re.compile(
    r"\b(f?getpwent|getpwuid|getpwnam|f?getgrent|getgrgid|getgrnam|localtime|gmtime|asctime|ctime|strtok|gethostbyname|"
    r"gethostbyaddr|getservbyname|getservbyport|ttyname|getlogin|ptsname|crypt|drand48)\s*\(")


def line_of(text, offset, first):
    return first + text.count("\n", 0, offset)


def check_tick(path, function):
    if not re.search(r"\bTRN_RT\b", function.header):
        return []
    return [f"{path}:{line_of(function.body, match.start(), function.body_line)}: {function.name} is marked TRN_RT "
            f"but {why}: '{match.group(0).strip()}'"
            for pattern, why in TICK_FORBIDDEN for match in pattern.finditer(function.body)]


def check_lines(path, text):
    errors = []
    lines = text.split("\n")
    if len(lines) > FILE_LINES_MAX + 1:
        errors.append(f"{path}:{FILE_LINES_MAX + 1}: {len(lines) - 1} lines; a file has at most {FILE_LINES_MAX}")
    for number, line in enumerate(lines, 1):
        errors += [f"{path}:{number}: {why}" for pattern, why in ANYWHERE if pattern.search(line)]
        if len(line) > COLUMNS_MAX and not path.endswith((".h", ".cc")):  # clang-format has those
            errors.append(f"{path}:{number}: {len(line)} columns; at most {COLUMNS_MAX}")
    return errors


def check_cpp(path, text, lengths):
    errors = []
    if path.endswith(".h") and "#pragma once" not in text:
        errors.append(f"{path}:1: a header needs #pragma once")
    code = code_only(text)
    if path.endswith(".h"):
        errors += [f"{path}:{line_of(code, match.start(), 1)}: 'using namespace' in a header"
                   for match in re.finditer(r"\busing\s+namespace\b", code)]
    errors += [f"{path}:{line_of(code, match.start(), 1)}: {match.group(1)} has one answer for all threads; use "
               f"{match.group(1)}_r" for match in SHARED_ANSWER.finditer(code)
               if not code[:match.start()].endswith("fmt::")]
    for function in functions(code):
        lengths.append(function.length)
        if function.length > FUNCTION_LINES_MAX:
            errors.append(f"{path}:{function.line}: {function.name} has {function.length} lines; a function has at "
                          f"most {FUNCTION_LINES_MAX}")
        errors += check_tick(path, function)
    return errors


def main():
    errors, lengths = [], []
    suffixes = (".h", ".cc", ".py", ".sh", ".toml", ".lcm")
    files = [name for name in source_files(*suffixes) if name != "tests/style/check_form.py"]  # it names the words
    for path in files:
        text = (ROOT / path).read_text(encoding="utf-8")
        errors += check_lines(path, text)
        if path.endswith((".h", ".cc")):
            errors += check_cpp(path, text, lengths)
    print("\n".join(errors))
    median = statistics.median(lengths) if lengths else 0
    print(f"{len(files)} files, {len(lengths)} functions of median {median:g} lines, {len(errors)} errors")
    return 1 if errors or not lengths else 0


if __name__ == "__main__":
    sys.exit(main())
