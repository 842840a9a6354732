"""C++ source as text for the style checks: what is code, and where functions begin and end."""
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def source_files(*suffixes):
    """Files of the repository with one of the suffixes, tracked or about to be, sorted."""
    command = ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, capture_output=True, text=True)
    if listed.returncode == 0 and listed.stdout:
        names = listed.stdout.splitlines()
    else:  # an unpacked archive
        names = [str(path.relative_to(ROOT)) for path in ROOT.rglob("*")
                 if not path.relative_to(ROOT).parts[0] in ("build", "out", ".git")]
    return sorted({name for name in names if name.endswith(suffixes) and (ROOT / name).is_file()})


TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|R"(?P<d>[^(\s]*)\(.*?\)(?P=d)"|"(?:\\.|[^"\\\n])*"'
                   r"|(?<![0-9a-fA-F])'(?:\\.|[^'\\\n])+'", re.DOTALL)


def blank(match):
    """As many lines as before, nothing else; a string stays a string."""
    text = match.group(0)
    return ('""' if text[0] in '"R' else " ") + "\n" * text.count("\n")


def code_only(text):
    """The text without comments, strings and preprocessor lines, line numbers unchanged."""
    text = TOKEN.sub(blank, text)
    return re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", lambda m: "\n" * m.group(0).count("\n"), text, flags=re.M)


@dataclass
class Function:
    name: str
    line: int      # of the header's first line
    length: int    # lines, header to closing brace
    header: str
    body: str
    body_line: int


CONTAINER = re.compile(r"\b(namespace|class|struct|union|enum|extern)\b")
NAME = re.compile(r"((?:[~\w]+(?:<[^<>()]*>)?::)*[~\w]+|operator\s*[^\s\w(]+|operator\(\))\s*\(")
FUNCTION_END = re.compile(r"\)\s*(const|noexcept|TRN_RT|override|final|&&?|\s)*(->[^=]*|:[^:].*)?$", re.DOTALL)
ACCESS = ("public", "private", "protected")


def is_function(header):
    """True for the text before a function's brace, false for a container's, an initialiser's or a table's."""
    if not FUNCTION_END.search(header) or is_container(header):
        return False
    before_paren = re.sub(r"template\s*<.*?>|operator\s*\S+", "", header.split("(")[0])
    return "=" not in before_paren


def is_container(header):
    before_paren = header.split("(")[0]
    qualifiers = r"\)\s*(const|noexcept|TRN_RT|override|\s)*$"
    return bool(CONTAINER.search(before_paren)) and not re.search(qualifiers, header)


def functions(code):
    """Functions with a body at namespace or class scope; lambdas and blocks inside count to their function."""
    out, depth, line, header_from = [], [], 1, 0
    opened = None  # (header, its line, offset and line of the body, brace depth)
    for at, char in enumerate(code):
        if char == "\n":
            line += 1
        if opened is None and (char in ";{}" or char == ":" and code[header_from:at].strip() in ACCESS):
            header = code[header_from:at]
            stripped = header.strip()
            header_line = line - header[len(header) - len(header.lstrip()):].count("\n")
            if char == "{":
                if is_function(stripped):
                    opened = (stripped, header_line, at, line, len(depth))
                depth.append(char)
            elif char == "}" and depth:
                depth.pop()
            header_from = at + 1
        elif opened is not None and char in "{}":
            if char == "{":
                depth.append(char)
            else:
                depth.pop()
                if len(depth) == opened[4] and not continues(code, at):
                    head, head_line, begin, body_line, _ = opened
                    name = NAME.search(head)
                    name = name.group(1) if name else head[:40]
                    body = code[begin:at + 1]
                    out.append(Function(name, head_line, line - head_line + 1, head, body, body_line))
                    opened, header_from = None, at + 1
    return out


def continues(code, at):
    """A brace of a member initialiser, not of the body: `A() : x_{1}, y_{2} {`."""
    return bool(re.match(r"\s*[,{]", code[at + 1:at + 40]))
