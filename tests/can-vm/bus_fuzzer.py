#!/usr/bin/python3
"""Random frames on a CAN bus, from python-can; not those that command drives by rights (NMT, setpoints, SDO).

usage: bus_fuzzer.py INTERFACE COUNT SEED
"""
import random
import sys
import time

import can


def main():
    interface, count, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    draw = random.Random(seed)
    by_right = {0} | set(range(0x200, 0x280)) | set(range(0x600, 0x680))
    legal = [i for i in range(0x800) if i not in by_right]
    with can.Bus(interface="socketcan", channel=interface) as bus:
        for _ in range(count):
            size = draw.randrange(9)
            bus.send(can.Message(arbitration_id=draw.choice(legal), data=draw.randbytes(size), is_extended_id=False))
            time.sleep(0.0005)
    print(f"{count} random frames sent")


if __name__ == "__main__":
    main()
