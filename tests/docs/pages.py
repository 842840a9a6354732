"""Markdown as the tests of the documents need it: the documents, their prose, their blocks of code."""
import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def documents():
    """README, CONTRIBUTING and the pages of docs/, as names below the root."""
    return ["README.md", *(["CONTRIBUTING.md"] if (ROOT / "CONTRIBUTING.md").exists() else []),
            *sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").glob("*.md"))]


@dataclass
class Block:
    page: str
    line: int      # of the opening fence
    info: str      # what stands behind the fence, as "toml"
    before: str    # the line above, where a marker may stand
    text: str


def blocks(page, text):
    """Fenced blocks of a page in their order."""
    out, opened, before = [], None, ""
    for number, line in enumerate(text.split("\n"), 1):
        if opened is None and line.lstrip().startswith("```"):
            opened = Block(page, number, line.strip().strip("`").strip(), before, "")
        elif opened is not None and line.strip() == "```":
            out.append(opened)
            opened = None
        elif opened is not None:
            opened.text += line + "\n"
        if line.strip():
            before = line.strip()
    if opened is not None:
        raise ValueError(f"{page}:{opened.line}: a fence that nobody closes; add ``` below the block")
    return out


CODE = re.compile(r"`[^`]+`")
LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
COMMENT = re.compile(r"<!--.*?-->", re.S)
ITEM = re.compile(r"\s*(?:[-*]|\d+\.)\s+")


def paragraphs(text):
    """(line, text) of what people read as sentences: no code, tables, headings, formulas, pictures."""
    out, fenced = [], False
    for number, line in enumerate(COMMENT.sub(lambda m: "\n" * m.group(0).count("\n"), text).split("\n"), 1):
        stripped = line.strip()
        if stripped.startswith("```"):
            fenced = not fenced
            out.append([number, ""])
        elif fenced or not stripped or stripped[0] in "|#" or stripped.startswith("!["):
            out.append([number, ""])
        elif ITEM.match(line):
            out.append([number, ITEM.sub("", line, count=1)])
        elif line.startswith("    ") and not out[-1][1]:  # a formula
            out.append([number, ""])
        elif out and out[-1][1]:
            out[-1][1] += " " + stripped
        else:
            out.append([number, stripped])
    return [(number, text) for number, text in out if text]


ABBREVIATION = re.compile(r"\b(e\.g|i\.e|etc|vs|No|Fig)\.")
END = re.compile(r"(?<=[.!?])[)\"'*_]*\s+(?=[\"'(*_]*[A-Z0-9`])")
WORD = re.compile(r"[^\W_]")


def sentences(paragraph):
    """Sentences of a paragraph; code and a page's name count as one word, a link as its text."""
    text = CODE.sub("Code", paragraph)
    text = LINK.sub(lambda link: "Page" if link.group(1).endswith(".md") else link.group(1), text)
    return [part.strip() for part in END.split(ABBREVIATION.sub(r"\1", text)) if part.strip()]


def words(sentence):
    return [word for word in sentence.split() if WORD.search(word)]


