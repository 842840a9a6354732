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


def as_json(message):
    """The message as our clients write it with --json: fields of a list are brought together."""
    values = {name: list(value) if isinstance(value, (tuple, map)) else value  # of truth values it is a map
              for name, value in ((name, getattr(message, name)) for name in message.__slots__)}
    lists = {name.removesuffix("count"): name for name in values if name.endswith("_count")}
    out = {}
    for name, value in values.items():
        prefix = next((one for one in lists if name.startswith(one) and name != lists[one]), None)
        if prefix and isinstance(value, list):
            entries = out.setdefault(prefix[:-1] + "s", [{} for _ in value])
            for entry, element in zip(entries, value):
                entry[name.removeprefix(prefix)] = element
        elif name not in lists.values():
            out[name] = value
    return out


class DaemonSocket:
    """`machine`: its name; `path`: of the socket."""

    def __init__(self, machine, path):
        self.machine = machine
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.connect(path)

    @classmethod
    def of(cls, bench, behind=""):
        """To a daemon that a Bench has started: its log names the socket. `behind`: ".safety" for the second one."""
        return cls(bench.name, re.search(r" socket (\S+)", bench.log_text()).group(1) + behind)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def command(self, verb, sequence, value=0.0, text="", client=77, joint=0, expires_us=0, **more):
        """The packet of a command; `more`: other fields of command_t."""
        message = command_t()
        message.client, message.sequence, message.expires_us = client, sequence, expires_us
        message.verb, message.joint, message.value, message.text = verb, joint, value, text
        for name, other in more.items():
            setattr(message, name, other)
        return packet_of(self.machine, "command", message.encode())

    def send(self, packet):
        self.socket.send(packet)

    def messages(self, duration_s, channel):
        """Yields the messages of one channel as they come, until this time is over or the daemon has gone."""
        end = time.time() + duration_s
        while (left := end - time.time()) > 0:
            self.socket.settimeout(left)
            try:
                data = self.socket.recv(70000)
            except (TimeoutError, ConnectionError):
                return
            if not data:
                return
            name, payload = data[8:].split(b"\0", 1)
            if name.decode() == f"{self.machine}.{channel}":
                yield TYPES[channel].decode(payload)

    def hear(self, duration_s, channel):
        """The messages of one channel that come in this time."""
        return list(self.messages(duration_s, channel))
