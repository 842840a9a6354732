#!/usr/bin/python3
"""Runs what the documents show, in a folder of its own for each page, and tells what does not go as the page says.

    tests/docs/run_commands.py TRUNNION SOURCE [PAGE...]

A block of commands or of G-code carries a marker in the line above its fence:

    <!-- run -->                           every command must end with 0
    <!-- run: exit 2 -->                   the last one must end with 2
    <!-- run: daemon configs/mill.toml --> a daemon of this machine is there meanwhile
    <!-- not run: REASON -->               REASON says what it needs: a drive, root, a network, hours
    <!-- interpret: mill [TEXT] -->        G-code on configs/mill.toml (or: none); its canonical functions must have
                                           TEXT, or each of several with && between
    <!-- interpret: mill refused TEXT -->  must be refused, by a message with TEXT

Blocks of a page run one after the other in the same folder. In a block with prompts ("$ ") the other lines are output:
each must come, in this order; "..." stands for anything. A block that looks like commands and has no marker is an
error. So is a code in bold, as **G33**, of which the page has no example.
"""
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from pages import blocks, documents

COMMAND = re.compile(r"(?:[\w-]*\$ |sudo |\./run\.sh|\./test\.sh|trunnion(?:-drives)? |build/release/|python3 |cmake |"
                     r"ip link|systemctl |npm |git |journalctl |dpkg |apt)")
MARKER = re.compile(r"<!-- (run|not run|interpret)(?:: (.*?))? -->$")
SECONDS_MAX = 240


def prompt_split(text):
    """(commands, lines of output behind each) of a block; without prompts every line is a command."""
    lines = re.sub(r"\\\n\s*", "", text).split("\n")
    if not any(line.startswith("$ ") for line in lines):
        return [(line, []) for line in lines if line.strip() and not line.startswith("#")]
    out = []
    for line in lines:
        if line.startswith("$ "):
            out.append((line[2:], []))
        elif out and line.strip():
            out[-1][1].append(line)
    return out


def shown_in(expected, output):
    """The first expected line that does not come, or None; spaces count as one, '...' as anything."""
    rest = [" ".join(line.split()) for line in output.split("\n")]
    for line in expected:
        pattern = re.compile("".join(".*" if part == "..." else re.escape(part)
                                     for part in re.split(r"(\.\.\.)", " ".join(line.split()))) + "$")
        at = next((n for n, found in enumerate(rest) if pattern.match(found)), None)
        if at is None:
            return line
        rest = rest[at + 1:] if line.strip() != "..." else rest
    return None


class Page:
    """The folder in which the blocks of one page run."""

    def __init__(self, binary, source, folder):
        self.folder, self.binary = folder, os.path.join(folder, "bin", "trunnion")
        os.makedirs(os.path.join(folder, "bin"))
        for name in ("configs", "examples"):
            shutil.copytree(os.path.join(source, name), os.path.join(folder, name))
        for name in ("trunnion", "trunnion-drives"):
            os.symlink(os.path.join(os.path.dirname(binary), name), os.path.join(folder, "bin", name))
        for name in ("tests", "bench", "docs", "packaging", "core", "hal", "app"):
            os.symlink(os.path.join(source, name), os.path.join(folder, name))
        os.makedirs(os.path.join(folder, "build"))
        os.symlink(os.path.dirname(binary), os.path.join(folder, "build", "release"))
        shutil.copy(os.path.join(source, "run.sh"), folder)
        os.makedirs(os.path.join(folder, "scripts"))
        with open(os.path.join(folder, "scripts", "setup.sh"), "w", encoding="ascii") as file:  # built already
            file.write("install_packages() { :; }\nbuild() { :; }\n")
        self.machine = ""
        runtime = os.path.join(folder, "r")
        os.makedirs(runtime, mode=0o700)
        self.environment = dict(os.environ, PATH=os.path.join(folder, "bin") + ":" + os.environ["PATH"], HOME=folder,
                                RUNTIME_DIRECTORY=runtime, TRUNNION_TIMEOUT="20")

    def shell(self, command, state):
        """Exit code, output of a line; `state` keeps what the lines before have exported and their folder."""
        ours = f"export TRUNNION_MACHINE={self.machine}\n" if self.machine else ""  # whatever else runs on this host
        script = (f"cd {self.folder}\n[ -e {state} ] && . {state}\n{ours}{command}\n"
                  f"code=$?\nexport -p >{state}\nexit $code\n")
        run = subprocess.Popen(["bash", "-c", script], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               env=self.environment, stdin=subprocess.DEVNULL, start_new_session=True)
        try:
            output, _ = run.communicate(timeout=SECONDS_MAX)
            return run.returncode, output
        except subprocess.TimeoutExpired:
            os.killpg(run.pid, signal.SIGKILL)
            return -1, f"not over after {SECONDS_MAX} s"

    def daemon(self, machine):
        command = [self.binary, "daemon", "--machine", machine, "--vars", "docs.var", "--tools", "examples/tools.tbl"]
        daemon = subprocess.Popen(command, cwd=self.folder, env=self.environment, stdout=subprocess.DEVNULL,
                                  stderr=open(os.path.join(self.folder, "daemon.txt"), "w", encoding="utf-8"))
        for _ in range(200):
            status = subprocess.run([self.binary, "status", "--machine", machine], cwd=self.folder,
                                    env=self.environment, capture_output=True, text=True)
            if "idle" in status.stdout:
                return daemon
            time.sleep(0.1)
        daemon.kill()
        raise RuntimeError("the daemon did not get ready: " + status.stderr)

    def run(self, block, what):
        """Number of commands, errors."""
        machine = re.search(r"daemon (\S+)", what)
        code = re.search(r"exit (\d+)", what)
        try:
            daemon = self.daemon(machine.group(1)) if machine else None
        except RuntimeError as error:
            return 0, [str(error)]
        self.machine = machine.group(1) if machine else ""
        try:
            return self.run_lines(block, int(code.group(1)) if code else 0)
        finally:
            if daemon:
                daemon.terminate()
                daemon.wait(30)

    def run_lines(self, block, last_code):
        errors, lines, state = [], prompt_split(block.text), os.path.join(self.folder, "r", "exports")
        for at, (command, expected) in enumerate(lines):
            code, output = self.shell(command, state)
            wanted = last_code if at == len(lines) - 1 else 0
            if code != wanted:
                errors.append(f"'{command}' ended with {code}, not {wanted}: {output.strip()[-300:]}")
            missing = shown_in(expected, output)
            if missing is not None:
                errors.append(f"'{command}' does not show '{missing.strip()}' there; it shows:\n{output.rstrip()}")
        return len(lines), errors

    def interpret(self, block, what):
        machine, _, text = what.partition(" ")
        refused = text.startswith("refused")
        text = text.removeprefix("refused").strip()
        program = os.path.join(self.folder, "examples", "example.ngc")
        with open(program, "w", encoding="utf-8") as file:
            file.write(block.text if re.search(r"\bM(2|30|99)\b|^%", block.text, re.M) else block.text + "M2\n")
        place = [] if machine == "none" else ["--machine", f"configs/{machine}.toml"]
        run = subprocess.run([self.binary, "interpret", program, *place, "--tools", "examples/tools.tbl", "--canon"],
                             cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=600)
        said = run.stderr if refused else run.stdout
        if run.returncode != (2 if refused else 0):
            return 1, [f"interpret ended with {run.returncode}: {run.stderr.strip()}"]
        missing = [part for part in text.split(" && ") if part not in said]
        return 1, [f"interpret does not say '{part}', but:\n{said.rstrip()}" for part in missing]


def unmarked(block):
    lines = block.text.split("\n")
    commands = block.info in ("", "sh", "bash", "console") and any(COMMAND.match(line) for line in lines)
    return (commands or block.info == "gcode") and not MARKER.match(block.before)


def without_example(text):
    """Codes in bold that no example of the page has."""
    examples = "\n".join(re.sub(r"\([^)]*\)", "", block.text) for block in blocks("", text) if block.info == "gcode")
    return [code for code in re.findall(r"\*\*([GM]\d+(?:\.\d)?)\b", text)
            if not re.search(rf"(?<![\w.]){re.escape(code)}(?![\d.])", examples)]


def run_page(page, text, binary, source):
    """Counts of commands, programs, skipped commands; errors."""
    counts, errors = [0, 0, 0], [f"{page}: no example has {code}" for code in without_example(text)]
    with tempfile.TemporaryDirectory(prefix="docs") as folder:
        place = Page(binary, source, folder)
        for block in blocks(page, text):
            marker = MARKER.match(block.before)
            where = f"{page}:{block.line}: "
            if not marker:
                if unmarked(block):
                    errors.append(where + "no marker; say <!-- run --> or <!-- not run: REASON --> in the line above")
                continue
            kind, what = marker.group(1), marker.group(2) or ""
            if kind == "not run":
                counts[2] += len(prompt_split(block.text))
                if len(what) < 8:
                    errors.append(where + "no reason; say what it needs")
                continue
            number, found = place.run(block, what) if kind == "run" else place.interpret(block, what)
            counts[kind == "interpret"] += number
            errors += [where + error for error in found]
    return counts, errors


def check_the_check():
    assert unmarked(blocks("p", "```\ntrunnion run x\n```\n")[0])
    assert unmarked(blocks("p", "```gcode\nG0 X1\n```\n")[0])
    assert not unmarked(blocks("p", "<!-- run -->\n```\ntrunnion run x\n```\n")[0])
    assert not unmarked(blocks("p", "```\na picture\n```\n")[0])
    assert without_example("**G1** **G53.1** **M3**\n```gcode\nG1 X1 (M3)\nG53\n```\n") == ["G53.1", "M3"]
    assert prompt_split("$ a \\\n  b\nout\n") == [("a b", ["out"])]
    assert shown_in(["a ... c", "d"], "a  b c\nx\nd\n") is None
    assert shown_in(["a", "b"], "b\na\n") == "b"


def main():
    check_the_check()
    binary, source = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    pages, total, errors = sys.argv[3:] or documents(), [0, 0, 0], []
    for page in pages:
        with open(os.path.join(source, page), encoding="utf-8") as file:
            counts, found = run_page(page, file.read(), binary, source)
        total = [a + b for a, b in zip(total, counts)]
        errors += found
    print("\n".join(errors + [f"{len(pages)} pages: {total[0]} commands run, {total[1]} pieces of G-code interpreted, "
                              f"{total[2]} commands not run, each with its reason"]))
    return 1 if errors or (len(sys.argv) == 3 and total[0] + total[1] == 0) else 0


if __name__ == "__main__":
    sys.exit(main())
