#!/usr/bin/env python3
"""The page of a machine on another computer. Its daemon and its gateway are in a network of their own, with folders of
their own; the panel reaches them over multicast alone, and signs what it asks.

usage: page_remote.py TRUNNION_BINARY SOURCE_DIR PAGE_DIR OUTPUT_DIR

Starts itself again in a network of its own; exit code 77 (skipped) where the kernel does not allow that.
"""
import json
import os
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../support")]
from own_network import enter_own_network  # noqa: E402
from page_client import Page, get  # noqa: E402
from panel_bench import PanelBench  # noqa: E402

PATIENCE_S = 30
GROUP, TELEMETRY = "udpm://239.255.76.71:7671?ttl=1", "udpm://239.255.76.72:7672?ttl=1"
ROLES = {"office": "operate", "visitor": "look"}


class OtherComputer(PanelBench):
    """A machine with its daemon and its gateway."""

    def __init__(self, binary, source, keys):
        super().__init__(binary, source, daemon=False, config="mill", name="far_mill", lcm_url=TELEMETRY, extra=keys)
        self.start_daemon()
        end = time.time() + PATIENCE_S
        while " socket " not in self.daemon_log():  # the gateway looks for it when it starts
            assert time.time() < end, self.daemon_log()
            time.sleep(0.05)
        with open(self.path("gateway.log"), "w", encoding="utf-8") as log:
            self.gateway = subprocess.Popen([binary, "gateway", "--machine", self.config], stdout=log, stderr=log,
                                            env=self.environment, cwd=self.folder)

    def daemon_log(self):
        with open(self.path("daemon.log"), encoding="utf-8") as log:
            return log.read()

    def close(self):
        self.gateway.terminate()
        self.gateway.wait(PATIENCE_S)
        super().close()


class Office(PanelBench):
    """A computer that has the machine's config and a key of its own, and no daemon."""

    def __init__(self, binary, source):
        super().__init__(binary, source, daemon=False, config="mill", name="far_mill", lcm_url=TELEMETRY)
        self.sections = f'[gateway]\nurl = "{GROUP}"\ncounters = "{self.path("counters")}"\n'
        for name, role in ROLES.items():
            made = subprocess.run([binary, "key", "make", self.path(name + ".key"), name, "--role", role], check=True,
                                  capture_output=True, text=True, env=self.environment)
            self.sections += made.stdout[made.stdout.index("[[gateway.key]]"):]
        with open(self.config, "a", encoding="utf-8") as file:
            file.write(self.sections)


def wait(page, wanted, what):
    """The first message that `wanted` accepts."""
    end = time.time() + PATIENCE_S
    while time.time() < end:
        message = page.next()
        if message and wanted(message):
            return message
    raise AssertionError(f"never {what}")


def ask(page, number, verb, **values):
    page.send({"type": "command", "id": number, "verb": verb, **values})
    return wait(page, lambda m: m["type"] == "answer" and m["id"] == number, f"an answer to {verb}")


def operates(office, far):
    """All that a page asks is done by the machine there."""
    page = Page(office)
    wait(page, lambda m: m["type"] == "status" and m["state"] == "idle", "a status from the other computer")
    assert json.loads(get(office, "/api/v1/machine")[1])["remote"] == {"key": "office", "role": "operate"}
    refused = ask(page, 1, "mdi", text="G0 X5")
    assert refused["outcome"] == "refused" and "take the controls" in refused["text"], refused
    page.send({"type": "take_controls"})
    wait(page, lambda m: m["type"] == "controls" and m["mine"], "the controls")
    answer = ask(page, 2, "mdi", text="G1 X5 F6000")
    assert answer["outcome"] == "accepted", answer
    wait(page, lambda m: m["type"] == "motion" and abs(m["work"][0] - 5) < 1e-6, "X5")
    wait(page, lambda m: m["type"] == "status" and m["state"] == "idle", "rest")
    answer = ask(page, 3, "jog", text="X", value=2, press=7)
    assert answer["outcome"] == "accepted", answer
    wait(page, lambda m: m["type"] == "motion" and abs(m["work"][0] - 7) < 1e-6, "X7, once")
    # Held, and then silent: the machine stops.
    answer = ask(page, 4, "jog", text="X", value=1, alive_ms=250, press=8, speed=10)
    assert answer["outcome"] == "accepted", answer
    ended = answer["status_count"]
    wait(page, lambda m: m["type"] == "status" and m["state"] == "idle" and m["count"] > ended, "its end")
    load = ask(page, 5, "load", text="part.ngc")
    assert load["outcome"] == "refused" and "whole path" in load["text"], load
    far.write("programs/part.ngc", "G21 G90\nG1 X20 F3000\nX0\nM2\n")
    load = ask(page, 6, "load", text=far.path("programs/part.ngc"))
    assert load["outcome"] == "accepted", load
    assert ask(page, 7, "start")["outcome"] == "accepted"
    assert ask(page, 8, "estop")["outcome"] == "accepted"
    wait(page, lambda m: m["type"] == "status" and m["state"] == "estop", "an emergency stop")
    assert ask(page, 9, "reset")["outcome"] == "accepted"
    with open(far.path("gateway.log"), encoding="utf-8") as log:
        text = log.read()
    assert "office" in text, "the gateway's log names the key"
    page.close()


def looks(office):
    """A key that may only look lets nobody operate, and everybody stop."""
    page = Page(office)
    wait(page, lambda m: m["type"] == "status", "a status")
    page.send({"type": "take_controls"})
    said = wait(page, lambda m: m["type"] == "message" and m["kind"] == "refused", "a refusal")
    assert "look" in said["text"], said
    assert ask(page, 1, "mdi", text="G0 X1")["outcome"] == "refused"
    assert ask(page, 2, "estop")["outcome"] == "accepted"
    wait(page, lambda m: m["type"] == "status" and m["state"] == "estop", "an emergency stop")
    page.close()


def wrong_keys(office):
    """The panel does not start with a key that the config does not know, or one that others may read."""
    make = ("key", "make", office.path("eve.key"), "eve", "--role", "operate")
    for prepare, why in ((make, "'eve'"), (None, "chmod 600")):
        if prepare:
            subprocess.run([office.binary, *prepare], check=True, capture_output=True, env=office.environment)
        else:
            os.chmod(office.path("eve.key"), 0o644)
        done = subprocess.run([office.binary, "panel", "--machine", office.config, "--listen", "127.0.0.1:0", "--page",
                               office.path("page"), "--remote", office.path("eve.key")], capture_output=True, text=True,
                              env=office.environment, timeout=PATIENCE_S, check=False)
        assert done.returncode in (3, 4) and why in done.stderr, (done.returncode, done.stderr)


def stop_panel(office):
    office.panel.terminate()
    office.panel.wait(PATIENCE_S)
    office.panel.stdout.close()
    office.panel = None


def main():
    binary, source, page, output = (os.path.abspath(arg) for arg in sys.argv[1:5])
    os.makedirs(output, exist_ok=True)
    enter_own_network()
    office = Office(binary, source)
    far = OtherComputer(binary, source, office.sections)
    try:
        wrong_keys(office)
        office.start_panel("--remote", office.path("office.key"), page=page)
        operates(office, far)
        environment = {name: os.environ[name] for name in ("CHROMIUM",) if name in os.environ}
        subprocess.run(["node", os.path.join(source, "tests/panel/page_remote.mjs"), office.origin, office.key,
                        os.path.join(source, "panel/page"), output], check=True, timeout=200,
                       env=office.environment | environment)
        stop_panel(office)
        office.start_panel("--remote", office.path("visitor.key"))
        looks(office)
    finally:
        office.close()
        far.close()
    print("passed")


if __name__ == "__main__":
    main()
