#!/usr/bin/python3
"""A file includes the header of every type of the project that it names, not one that happens to include that. And
it includes a header of every library in LIBRARIES whose namespace it names: with sources in groups, the compiler
does not notice.

The header of every free function of the project that it calls must be included as well, here by whatever includes it.

What the header of the same name includes counts for a .cc and for its test. A type that is only declared (`class X;`)
needs no header. `--mend` writes the missing lines of the project's own headers. Errors as file:line.
"""
import re
import sys

from source_text import ROOT, code_only, source_files

DEFINED = re.compile(r"^(?:template\s*<[^;{]*>\s*)?(?:class|struct|enum class|enum struct|enum|union)\s+"
                     r"(?:\[\[.*?\]\]\s*|alignas\([^)]*\)\s*)?(\w+)(?:\s+final)?\s*(?::(?!:)[^;{]*)?\{", re.M)
ALIAS = re.compile(r"^using\s+(\w+)\s*=", re.M)
DECLARED = re.compile(r"^\s*(?:class|struct|enum class|enum)\s+(\w+)\s*(?::\s*[\w:]+\s*)?;", re.M)
NAMED = re.compile(r"\b(?:class|struct|enum class|enum|using|typename)\s+(\w+)")
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]+"([^"]+)"', re.M)
NAMESPACE = re.compile(r"\b[a-z]\w*::")  # types begin with a capital letter
# The face of the library, whose types have such names, too
FACE = re.compile(r"^namespace trunnion \{|^#include <trunnion/", re.M)
OUTSIDE = re.compile(r"\btrunnion::(?:\w+::)*\w+")
LIBRARIES = {"spdlog": "spdlog/spdlog.h", "fmt": "fmt/format.h", "nlohmann": "nlohmann/json.hpp"}
LIBRARY = re.compile(r"(?<![\w:])(" + "|".join(LIBRARIES) + r")::")
OUTER = re.compile(r"^[ \t]*#[ \t]*include[ \t]+<([^>]+)>", re.M)
WORD = re.compile(r"(?<![\w.>:])([A-Z]\w+)")


# A function at namespace scope, whose declaration begins in the first column.
FUNCTION = re.compile(r"^(?!using|return|namespace|static_assert)[A-Za-z_][\w:<>,&*\[\] ]*[\s&*>](\w+)"
                      r"\((?!\*)[^;{}]*\)[^;{}()]*[;{]", re.M)
# A member that is called, or something inside a function or a class with its type before its name.
MEMBER = re.compile(r"(?:\.|->)(\w+)")
INSIDE = re.compile(r"^[ \t].*$", re.M)
NAMED_INSIDE = re.compile(r"(?<![\w>.])(?!(?:return|else|throw|case|delete|new|goto|and|or|not)\b)"
                          r"(?=(?:[A-Za-z_][\w:]*(?:<[^;(){}]*>)?(?:[ \t]+|[&*]+[ \t]*|[ \t]+[&*]+))(\w+)"
                          r"(?:[({;=,)\[ ]|$))"
                          r"|>[&*]+ (\w+)")
CALL = re.compile(r"(?<![\w.>:~])(\w+)\(")


def functions(texts):
    """Function to header, of the free functions that exactly one header declares and whose name is no member's and no
    variable's anywhere."""
    found, others = {}, set()
    for name, text in texts.items():
        code = code_only(text)
        others.update(MEMBER.findall(code))
        for line in INSIDE.findall(code):
            others.update(word for words in NAMED_INSIDE.findall(line) for word in words)
        if name.endswith(".h") and not FACE.search(text):
            for match in FUNCTION.finditer(code):
                found.setdefault(match.group(1), set()).add(name)
    return {word: headers.pop() for word, headers in found.items() if len(headers) == 1 and word not in others}


def reached(name, texts, known):
    """Every header of the project that comes in with `name`; `known` keeps what was found."""
    if name not in known:
        known[name] = set()  # a circle ends here
        for header in INCLUDE.findall(texts[name]):
            if header in texts:
                known[name] |= {header} | reached(header, texts, known)
    return known[name]


def missing_functions(name, texts, where, known):
    """(line, function, header) of each free function whose header does not come in, whatever includes it."""
    if FACE.search(texts[name]):
        return []
    out, code, come = {}, code_only(texts[name]), reached(name, texts, known)
    own = {match.group(1) for match in FUNCTION.finditer(code)}
    for match in CALL.finditer(code):
        word = match.group(1)
        header = where.get(word)
        if header and header != name and header not in come and word not in own and word not in out:
            out[word] = (code.count("\n", 0, match.start()) + 1, header)
    return [(line, word, header) for word, (line, header) in out.items()]


def definitions(texts):
    """Type to header, of the types that exactly one header defines at namespace scope."""
    found = {}
    for name, text in texts.items():
        if name.endswith(".h") and not FACE.search(text):
            code = code_only(text)
            for match in [*DEFINED.finditer(code), *ALIAS.finditer(code)]:
                found.setdefault(match.group(1), set()).add(name)
    return {word: headers.pop() for word, headers in found.items() if len(headers) == 1}


def own_headers(name, texts):
    """The header that a .cc implements, or whose test it is."""
    stem = re.sub(r"(_test)?\.cc$", "", name)
    folder = re.sub(r"^tests/", "", stem)
    return [header for header in (stem + ".h", folder + ".h") if header in texts]


def missing(name, texts, where):
    """(line, type, header) of each type whose header is not included."""
    text = texts[name]
    if FACE.search(text):
        return []
    code = code_only(text)
    included = set(INCLUDE.findall(text))
    for header in own_headers(name, texts):
        included |= {header} | set(INCLUDE.findall(texts[header]))
    local = set(DECLARED.findall(code)) | set(NAMED.findall(code))
    for header in own_headers(name, texts):  # a class's own types are known in its source
        local |= set(NAMED.findall(code_only(texts[header])))
    out, code = {}, NAMESPACE.sub("", OUTSIDE.sub("", code))
    for match in WORD.finditer(code):
        word = match.group(1)
        header = where.get(word)
        far = header and header.startswith("tests/") and not name.startswith("tests/")
        if header and not far and header != name and header not in included and word not in local and header not in out:
            out[header] = (code.count("\n", 0, match.start()) + 1, word)
    return [(line, word, header) for header, (line, word) in out.items()]


def missing_libraries(name, texts):
    """(line, namespace, header) of each library that is named and of which nothing is included."""
    included = "".join(f"<{header}>" for of in (name, *own_headers(name, texts)) for header in OUTER.findall(texts[of]))
    out, code = {}, code_only(texts[name])
    for match in LIBRARY.finditer(code):
        word = match.group(1)
        if f"<{word}/" not in included and word not in out:
            out[word] = code.count("\n", 0, match.start()) + 1
    return [(line, word, LIBRARIES[word]) for word, line in out.items()]


def check(texts):
    where, declared, known = definitions(texts), functions(texts), {}
    errors = []
    for name in sorted(texts):
        for line, word, header in missing_libraries(name, texts):
            errors.append(f"{name}:{line}: {word}:: is used, and <{header}> is not included")
        for line, word, header in missing(name, texts, where):
            errors.append(f'{name}:{line}: {word} is used, and "{header}" is not included')
        for line, word, header in missing_functions(name, texts, declared, known):
            errors.append(f'{name}:{line}: {word}() is called, and "{header}" does not come in')
    return errors


def mend(texts):
    """Headers first: what they include then counts for their sources."""
    where = definitions(texts)
    for name in sorted(texts, key=lambda file: (not file.endswith(".h"), file)):
        lines = sorted({f'#include "{header}"' for _, _, header in missing(name, texts, where)})
        if not lines:
            continue
        text, own = texts[name], own_headers(name, texts)
        old = [m for m in re.finditer(r'^#include "([^"]+)"\n', text, re.M) if m.group(1) not in own]
        block = "\n".join(lines) + "\n"
        if old:
            at = old[0].start()
        else:
            last = [*re.finditer(r"^#(?:include|pragma once)[^\n]*\n", text, re.M)][-1]
            at, block = last.end(), "\n" + block
        texts[name] = text[:at] + block + text[at:]
        (ROOT / name).write_text(texts[name], encoding="utf-8")


def main():
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in source_files(".h", ".cc")}
    if "--mend" in sys.argv:
        mend(texts)
        return 0
    errors = check(texts)
    print("\n".join(errors + [f"{len(texts)} files, {len(errors)} errors"]))
    return 1 if errors or not texts else 0


if __name__ == "__main__":
    sys.exit(main())
