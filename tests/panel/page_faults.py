#!/usr/bin/env python3
"""A page in a real browser while its line is cut, its panel hangs and its daemon dies; page_faults.mjs tells it.

usage: page_faults.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR
"""
import json
import os
import signal
import subprocess
import sys

from cut_line import CutLine
from panel_bench import PanelBench


class Hand:
    """Does what the page's script asks for."""

    def __init__(self, bench, line):
        self.bench, self.line = bench, line

    def place(self):
        """Where joint X is told to be, by the daemon itself."""
        done = subprocess.run([self.bench.binary, "monitor", "--json", "--count", "8", "--machine", self.bench.config],
                              capture_output=True, text=True, check=True, timeout=60, env=self.bench.environment)
        messages = [json.loads(text) for text in done.stdout.splitlines()]
        return str(next(one["q_setpoint"][0] for one in messages if "q_setpoint" in one))

    def do(self, what):
        if what == "place":
            return self.place()
        if what in ("cut", "mend"):
            getattr(self.line, what)()
        elif what == "stop panel":
            self.bench.panel.send_signal(signal.SIGSTOP)
        elif what == "go on panel":
            self.bench.panel.send_signal(signal.SIGCONT)
        elif what == "kill daemon":
            self.bench.daemon.kill()
            self.bench.daemon.wait()
        elif what == "start daemon":
            self.bench.start_daemon()
        else:
            raise ValueError(what)
        return "done"


def main():
    binary, source, page, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    os.makedirs(output, exist_ok=True)
    bench = PanelBench(binary, source)
    line = None
    try:
        bench.write("programs/short.ngc", "G21 G90 G94\nG1 X1 F600\nM2\n")
        bench.start_panel(page=page)
        line = CutLine(bench.port)
        hand = Hand(bench, line)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        with subprocess.Popen(["node", os.path.join(source, "tests/panel/page_faults.mjs"),
                               f"http://127.0.0.1:{line.port}", bench.key, os.path.join(source, "panel/page"), output],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1,
                              env=bench.environment | environment) as script:
            for said in script.stdout:
                if not said.startswith("DO "):
                    print(said, end="")
                    continue
                script.stdin.write(hand.do(said.removeprefix("DO ").strip()) + "\n")
        return script.returncode
    finally:
        if bench.panel:
            bench.panel.send_signal(signal.SIGCONT)
        if line:
            line.close()
        bench.close()


if __name__ == "__main__":
    sys.exit(main())
