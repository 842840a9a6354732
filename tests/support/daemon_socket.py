"""A client of the daemon's socket that is not ours: packets made by the Python code that lcm-gen writes for the message
types, so that the C++ side is held to somebody else's encoder."""
import atexit
import glob
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))


def _generate():
    folder = tempfile.mkdtemp()
    atexit.register(shutil.rmtree, folder, True)
    types = glob.glob(os.path.join(HERE, "../../hal/lcm/*.lcm"))
    subprocess.run(["lcm-gen", "--python", "--ppath", folder, *types], check=True)
    sys.path.insert(0, folder)


_generate()
from trunnion.acknowledge_t import acknowledge_t  # noqa: E402
from trunnion.alarms_t import alarms_t  # noqa: E402
from trunnion.command_t import command_t  # noqa: E402
from trunnion.motion_t import motion_t  # noqa: E402
from trunnion.sensor_t import sensor_t  # noqa: E402
from trunnion.signed_command_t import signed_command_t  # noqa: E402, F401
from trunnion.status_t import status_t  # noqa: E402
from trunnion.tables_t import tables_t  # noqa: E402

TYPES = {"acknowledge": acknowledge_t, "command": command_t, "motion": motion_t, "sensor": sensor_t, "status": status_t,
         "tables": tables_t, "alarms": alarms_t}


def packet_of(machine, channel, payload):
    return b"LC02\0\0\0\1" + f"{machine}.{channel}".encode() + b"\0" + payload


class DaemonSocket:
    """`machine`: its name; `path`: of the socket."""

    def __init__(self, machine, path):
        self.machine = machine
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.connect(path)

    @classmethod
    def of(cls, bench):
        """To a daemon that a Bench has started: its log names the socket."""
        return cls(bench.name, re.search(r" socket (\S+)", bench.log_text()).group(1))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def command(self, verb, sequence, value=0.0, text="", client=77, joint=0, expires_us=0):
        """The packet of a command."""
        message = command_t()
        message.client, message.sequence, message.expires_us = client, sequence, expires_us
        message.verb, message.joint, message.value, message.text = verb, joint, value, text
        return packet_of(self.machine, "command", message.encode())

    def send(self, packet):
        self.socket.send(packet)

    def hear(self, duration_s, channel):
        """The messages of one channel that come in this time."""
        heard, end = [], time.time() + duration_s
        while (left := end - time.time()) > 0:
            self.socket.settimeout(left)
            try:
                data = self.socket.recv(70000)
            except TimeoutError:
                break
            if not data:
                break
            name, payload = data[8:].split(b"\0", 1)
            if name.decode() == f"{self.machine}.{channel}":
                heard.append(TYPES[channel].decode(payload))
        return heard
