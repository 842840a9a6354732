#!/usr/bin/python3
"""Writes docs/messages.md from hal/lcm/*.lcm. --check: writes nothing and fails if the page is stale."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "messages.md"
ORDER = ["command_t", "acknowledge_t", "status_t", "motion_t", "tables_t", "alarms_t", "sensor_t", "signed_command_t",
         "scope_request_t", "scope_data_t", "scope_signals_t"]

HEAD = """# Messages

A program can do whatever the `trunnion` commands do. This one runs a line of G-code and prints where the tool goes:

<!-- run: daemon configs/mill.toml -->
```
$ python3 examples/client.py $RUNTIME_DIRECTORY/trunnion-mill.sock 'G1 X2 F600'
...
X 2.000 Y 0.000 Z 0.000
```

`examples/clients` has a stack light in a few lines, in Python (`lamp.py`) and in C++ (`lamp.cc`). Its first lines say
how to build it.
`examples/client.py` is a whole client in 70 lines. The daemon's log names its socket, as
`/run/trunnion/trunnion-mill.sock`.

## How to talk to the daemon

1. Let `lcm-gen` (Debian's `liblcm-bin`) make the types for your language: `lcm-gen --python hal/lcm/*.lcm`, or `--cpp`,
   `--java`.
2. Connect to the socket. It is a Unix socket of whole packets (`SOCK_SEQPACKET`); one packet is one message.
3. A packet is a message in LCM's wire form. It begins with the four bytes `LC02` and a sequence number of four bytes.
   Then come the channel's name, a zero byte, and the encoded message.
4. You hear status, motion and tables from then on. Send a `command_t`, and wait for the `acknowledge_t` with your
   `client` and `sequence`. `WORKING` means that another answer follows.
5. Read what you are sent. What you do not read in time is lost to you, and to nobody else.

The daemon also sends status, motion and tables over LCM's multicast, unless `[lcm] url` is empty. It hears nothing
there. Which users may connect, and what they may do, is told by groups
([at the machine](operator.md#who-may-command-the-machine)). Other hosts sign their commands
([security](security.md#commands-from-another-computer)). The operator's page has an interface of its own, in JSON
([panel.md](panel.md#for-programs)).

Lengths are mm, angles rad, times s, unless a field's name or its text says otherwise.
`python3 docs/make_messages.py` writes this page from `hal/lcm/*.lcm`; a test compares the two.

## All at a glance

| message | channel | who sends it |
|---|---|---|
"""

SENDER = {"command_t": "a client", "scope_request_t": "a client", "sensor_t": "whoever has readings",
          "signed_command_t": "a client of another host"}

STRUCT = re.compile(r"package\s+(\w+)\s*;\s*((?:\s*//[^\n]*\n)*)\s*struct\s+(\w+)\s*\{(.*)\}\s*$", re.S)
FIELD = re.compile(r"(\w+)\s+(\w+)\s*((?:\[\w+\])?)$")
CONSTANTS = re.compile(r"const\s+(\w+)\s+(.*)$")
CHANNEL = re.compile(r'channel "([^"]+)"')


def prose(lines):
    return " ".join(line.strip().removeprefix("//").strip() for line in lines).strip()


def cell(text):
    """Text of a table's cell: no column ends in it, and nothing in it is taken for a link, a tag or a fence."""
    return text.replace("|", "\\|").replace("<", "&lt;").replace("[[", "\\[\\[")


def rows_of(body):
    """(declaration, lines of comment) in order: a comment belongs to the declaration before it."""
    rows = []
    for line in body.split("\n"):
        code, _, comment = line.partition("//")
        for part in filter(None, (part.strip() for part in code.split(";"))):
            rows.append([part, []])
        if comment and rows:
            rows[-1][1].append(comment)
    return rows


def section(path):
    match = STRUCT.match(path.read_text())
    if not match:
        sys.exit(f"{path}: not 'package', comment, 'struct' in this order; see the head of make_messages.py")
    _, head, name, body = match.groups()
    fields, constants = [], []
    for declaration, comment in rows_of(body):
        found = CONSTANTS.match(declaration)
        if found:
            values = re.findall(r"(\w+)\s*=\s*(-?\w+)", found.group(2))
            constants += [(name, value, prose(comment) if n == len(values) - 1 else "")
                          for n, (name, value) in enumerate(values)]
            continue
        found = FIELD.match(declaration)
        if not found:
            sys.exit(f"{path}: '{declaration}' is not understood; see the head of make_messages.py")
        kind, field, dimension = found.groups()
        fields.append((field, kind + dimension, prose(comment)))
    return name, prose(head.split("\n")), fields, constants


def page(paths):
    found = {name: rest for name, *rest in map(section, paths)}
    missing = set(ORDER) - set(found)
    if missing:
        sys.exit(f"docs/make_messages.py: there is no {', '.join(sorted(missing))} any more; take it out of ORDER")
    glance, text, count = [], [], 0
    for name in [*ORDER, *sorted(set(found) - set(ORDER))]:
        head, fields, constants = found[name]
        channel = CHANNEL.search(head)
        where, who = channel.group(1) if channel else "", SENDER.get(name, "the daemon")
        glance.append(f"| [`{name}`](#{name}) | `{where}` | {who} |")
        text.append(f"\n## {name}\n\n{head}\n\n| field | type | meaning |\n|---|---|---|")
        text += [f"| `{field}` | `{kind}` | {cell(meaning)} |" for field, kind, meaning in fields]
        if constants:
            text.append("\n| constant | value | |\n|---|---|---|")
            text += [f"| `{constant}` | {value} | {cell(meaning)} |" for constant, value, meaning in constants]
        count += len(fields)
    return HEAD + "\n".join(glance + text) + "\n", count


def main():
    text, count = page(sorted((ROOT / "hal" / "lcm").glob("*.lcm")))
    if "--check" in sys.argv[1:]:
        stale = not PAGE.exists() or PAGE.read_text() != text
        print("docs/messages.md:1: stale; run docs/make_messages.py" if stale else f"{count} fields, up to date")
        return 1 if stale or count == 0 else 0
    PAGE.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
