#!/usr/bin/python3
"""A minimal CiA 402 drive on python-can, written from the standards alone: the master's independent peer.

usage: python_node.py INTERFACE NODE_ID

NMT, heartbeat, expedited SDO, PDOs as the master maps them, the state machine, cyclic position and homing. Its axis
stands where it is told at once.
"""
import os
import struct
import sys
import time

import can

SIZES = {0x6040: 2, 0x6041: 2, 0x6060: 1, 0x6061: 1, 0x6064: 4, 0x607A: 4}
STATUS = {"disabled": 0x40, "ready": 0x21, "on": 0x23, "enabled": 0x27, "stopped": 0x07}


class Node:
    def __init__(self, bus, node_id):
        self.bus, self.id = bus, node_id
        self.operational, self.state = False, "disabled"
        self.raw = {(0x1000, 0): struct.pack("<I", 0x00020192), (0x1016, 1): bytes(4)}
        self.value = dict.fromkeys(SIZES, 0)
        self.control_before, self.homed_bits = 0, 0
        self.next_beat = None
        self.send(0x700, b"\0")

    def send(self, function, data):
        self.bus.send(can.Message(arbitration_id=function + self.id, data=data, is_extended_id=False))

    def number(self, index, sub, fallback=0):
        return int.from_bytes(self.raw.get((index, sub), fallback.to_bytes(4, "little")), "little")

    def mapping(self, index):
        """[(object, bytes)] of a mapping record."""
        entries = [self.number(index, i + 1) for i in range(self.number(index, 0))]
        return [(entry >> 16, (entry & 0xFF) // 8) for entry in entries]

    def on_nmt(self, command, node):
        if node not in (0, self.id):
            return
        if command == 1:
            self.operational = True
            self.beat()
        elif command in (2, 128):
            self.operational = False
        elif command in (129, 130):
            self.__init__(self.bus, self.id)

    def beat(self):
        self.send(0x700, bytes([5 if self.operational else 127]))
        pause = self.number(0x1017, 0) / 1000
        self.next_beat = time.monotonic() + pause if pause else None

    def on_sdo(self, data):
        index, sub = struct.unpack_from("<HB", data, 1)
        head = data[1:4]
        if data[0] >> 5 == 1:  # download, expedited
            size = 4 - (data[0] >> 2 & 3)
            self.raw[index, sub] = bytes(data[4:4 + size])
            if index == 0x1017:
                self.beat()
            self.send(0x580, b"\x60" + head + bytes(4))
        elif (index, sub) in self.raw:
            content = self.raw[index, sub]
            self.send(0x580, bytes([0x43 | (4 - len(content)) << 2]) + head + content.ljust(4, b"\0"))
        else:
            self.send(0x580, b"\x80" + head + struct.pack("<I", 0x06020000))

    def on_setpoint(self, data):
        at = 0
        for index, size in self.mapping(0x1600):
            self.value[index] = int.from_bytes(data[at:at + size], "little", signed=index != 0x6040)
            at += size

    def obey(self):
        control = self.value[0x6040] & 0x0F
        if control & 2 == 0:
            self.state = "disabled"
        elif control & 4 == 0:
            self.state = "stopped" if self.state == "enabled" else "disabled"
        elif control & 1 == 0:
            self.state = "ready"
        elif control & 8 == 0:
            self.state = "on" if self.state in ("ready", "on", "enabled") else self.state
        elif self.state in ("on", "enabled"):
            self.state = "enabled"

    def on_sync(self):
        self.obey()
        mode = self.value[0x6061] = self.value[0x6060]
        start = self.value[0x6040] & 0x10 and not self.control_before & 0x10
        self.control_before = self.value[0x6040]
        if self.state == "enabled" and mode == 8:
            self.value[0x6064], self.homed_bits = self.value[0x607A], 0
        elif self.state == "enabled" and mode == 6 and start:
            offset = self.raw.get((0x607C, 0), bytes(4))
            self.value[0x6064], self.homed_bits = int.from_bytes(offset, "little", signed=True), 0x1400
        self.value[0x6041] = STATUS[self.state] | 0x0210 | self.homed_bits
        data = b"".join(self.value[index].to_bytes(size, "little", signed=index not in (0x6040, 0x6041))
                        for index, size in self.mapping(0x1A00))
        self.send(0x180, data)

    def take(self, message):
        data, can_id = bytes(message.data), message.arbitration_id
        if can_id == 0 and len(data) == 2:
            self.on_nmt(data[0], data[1])
        elif can_id == 0x600 + self.id and len(data) == 8:
            self.on_sdo(data)
        elif can_id == 0x80 and self.operational:
            self.on_sync()
        elif can_id == 0x200 + self.id and self.operational:
            self.on_setpoint(data)


# A drive has a processor of its own. In the guest it shares the only one with the daemon, whose threads would keep it
# from answering in its period: it goes before the rate planner (49), and behind the tick (80).
PRIORITY = 60


def go_before_the_rate_planner():
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError:
        pass  # on a host's own virtual CAN it is not root, and has another processor


def main():
    go_before_the_rate_planner()
    interface, node_id = sys.argv[1], int(sys.argv[2])
    filters = [{"can_id": i, "can_mask": 0x7FF} for i in (0, 0x80, 0x200 + node_id, 0x600 + node_id)]
    with can.Bus(interface="socketcan", channel=interface, can_filters=filters) as bus:
        node = Node(bus, node_id)
        while True:
            message = bus.recv(timeout=0.01)
            if message:
                node.take(message)
            if node.next_beat and time.monotonic() >= node.next_beat:
                node.beat()


if __name__ == "__main__":
    main()
