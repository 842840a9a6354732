#!/usr/bin/python3
# A stack light: lamp.py SOCKET (the daemon's log names it).
# Before: lcm-gen --python --ppath . /usr/share/trunnion/lcm/*.lcm
import socket
import sys
from trunnion import status_t

if len(sys.argv) != 2:
    sys.exit("usage: lamp.py SOCKET, as the daemon's log names it: /run/trunnion/trunnion-mill.sock")
link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
link.connect(sys.argv[1])
while packet := link.recv(65536):
    channel, data = packet[8:].split(b"\0", 1)  # behind "LC02" and a number
    if channel.endswith(b".status"):
        status = status_t.decode(data)
        print("red" if status.fault != "ok" else "green" if status.state == "running" else "yellow", flush=True)
