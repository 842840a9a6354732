#!/usr/bin/python3
"""A client of the daemon in seventy lines: runs a line of G-code and prints where the tool goes.

    examples/client.py SOCKET 'G0 X10'       the socket as the daemon's log names it: /run/trunnion/trunnion-mill.sock

The message types come from hal/lcm/*.lcm through lcm-gen (Debian's liblcm-bin); docs/messages.md explains them.
"""
import glob
import os
import random
import socket
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.realpath(__file__))
TYPES = [name for folder in ("../hal/lcm", "../lcm") for name in glob.glob(os.path.join(HERE, folder, "*.lcm"))]
if not TYPES:
    sys.exit(f"no .lcm files in {HERE}/../hal/lcm or {HERE}/../lcm; put those of the source there")

generated = tempfile.TemporaryDirectory()
subprocess.run(["lcm-gen", "--python", "--ppath", generated.name, *TYPES], check=True)
sys.path.insert(0, generated.name)
from trunnion.acknowledge_t import acknowledge_t  # noqa: E402
from trunnion.command_t import command_t  # noqa: E402
from trunnion.motion_t import motion_t  # noqa: E402
from trunnion.status_t import status_t  # noqa: E402

KINDS = {"status": status_t, "motion": motion_t, "acknowledge": acknowledge_t}


class Daemon:
    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.settimeout(5)
        self.socket.connect(path)
        self.machine = os.path.basename(path).removeprefix("trunnion-").removesuffix(".sock")

    def hear(self, *kinds):
        """The next message of one of these kinds."""
        while True:
            packet = self.socket.recv(65536)
            if not packet:
                sys.exit("the daemon has closed the connection")
            channel, payload = packet[8:].split(b"\0", 1)  # behind "LC02" and a sequence number
            kind = channel.decode().rpartition(".")[2]
            if kind in kinds:
                return KINDS[kind].decode(payload)

    def mdi(self, line):
        command = command_t()
        command.client, command.sequence = random.getrandbits(62), 1
        command.expires_us = self.hear("status").clock_us + 2_000_000  # by the daemon's own clock
        command.verb, command.text = command_t.MDI, line
        channel = f"{self.machine}.command".encode()
        self.socket.send(b"LC02\0\0\0\1" + channel + b"\0" + command.encode())
        while (answer := self.hear("acknowledge")).client != command.client or answer.outcome == acknowledge_t.WORKING:
            pass
        if answer.outcome != acknowledge_t.ACCEPTED:
            sys.exit(f"refused: {answer.message}")
        return answer.status_count


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    daemon = Daemon(sys.argv[1])
    count, done = daemon.mdi(sys.argv[2]), False
    while True:
        heard = daemon.hear("status", "motion")
        if isinstance(heard, status_t):
            done = heard.count >= count and heard.state == "idle"
            continue
        print("X {:.3f} Y {:.3f} Z {:.3f}".format(*heard.work[:3]))
        if done:
            return


if __name__ == "__main__":
    main()
