"""A bus log as sentences: LSS (CiA 305), expedited SDO, NMT and boot-up (CiA 301), decoded from the standards alone.

Everything that was said between two marks of the script is compared with what should have been, frame for frame.
"""
import subprocess

import bus_log

MARK = 0x7F0  # of the script: its step begins
TO_NODE, TO_MASTER = 0x7E5, 0x7E4
PARTS = ("vendor", "product", "revision", "serial")
SET_ID, SET_RATE, STORE, FOUND, SCAN, ASK_ID = 0x11, 0x13, 0x17, 0x4F, 0x51, 0x5E
SELECT, SELECTED = range(0x40, 0x44), 0x44
RESULTS = {SET_ID: "lss: node id", SET_RATE: "lss: bit rate", STORE: "lss: store"}
STATUSWORD = "0x6041:0"
EVERYBODY = 0x80  # instead of a bit: who is there at all?


def unsigned(data):
    return int.from_bytes(data, "little")


def scan_question(number, bit, part, following):
    return f"lss scan: 0x{number:08X} bit {bit} of {PARTS[part]}, then {PARTS[following]}"


def lss_request(data):
    code, value = data[0], unsigned(data[1:5])
    if code == SCAN and data[5] == EVERYBODY and not any(data[1:5] + data[6:]):
        return "lss scan: who is there?"
    if code == SCAN and data[5] < 32 and max(data[6:]) < 4:
        return scan_question(value, data[5], data[6], data[7])
    if code == SET_RATE and data[1] == 0 and not any(data[3:]):
        return f"lss set bit rate {data[2]}"
    if any(data[5:]):
        return None
    if code in SELECT:
        return f"lss select {PARTS[code - SELECT[0]]} 0x{value:X}"
    return {(0x04, 0): "lss all wait", (0x04, 1): "lss all configure", (STORE, 0): "lss store",
            (ASK_ID, 0): "lss node id?", (SET_ID, value): f"lss set node id {value}"}.get((code, value))


def lss_answer(data):
    code = data[0]
    if code in RESULTS and not any(data[3:]):
        return f"{RESULTS[code]} {'ok' if data[1] == 0 else f'refused, {data[1]}'}"
    if code == ASK_ID and not any(data[2:]):
        return f"lss: node id is {data[1]}"
    return {FOUND: "lss: yes", SELECTED: "lss: selected"}.get(code) if not any(data[1:]) else None


def sdo(node, data, to_node):
    """Read and write of up to four bytes; the rest of a longer transfer has no name here."""
    command, thing = data[0], f"0x{unsigned(data[1:3]):04X}:{data[3]}"
    size = 4 - (command >> 2 & 3)
    value = f"{unsigned(data[4:4 + size]):#x} in {size}"
    if thing == STATUSWORD and size == 2 and data[4] & 0x4F == 0x40:
        value = "switch on disabled"  # CiA 402: x1xx 0000 in the low byte
    carries = command & 0x03 == 0x03 and not any(data[4 + size:])
    if command == 0x80:
        return f"node {node}: {thing} abort 0x{unsigned(data[4:]):08X}"
    if to_node and command == 0x40 and not any(data[4:]):
        return f"node {node}: read {thing}"
    if to_node and command >> 4 == 2 and carries:
        return f"node {node}: write {thing} {value}"
    if not to_node and command == 0x60 and not any(data[4:]):
        return f"node {node}: {thing} written"
    if not to_node and command >> 4 == 4 and carries:
        return f"node {node}: {thing} is {value}"
    return None


def sentence(can_id, data):
    said, node = None, can_id & 0x7F
    if can_id in (TO_NODE, TO_MASTER) and len(data) == 8:
        said = lss_request(data) if can_id == TO_NODE else lss_answer(data)
    elif can_id & 0x780 in (0x600, 0x580) and node and len(data) == 8:
        said = sdo(node, data, can_id & 0x780 == 0x600)
    elif can_id == 0 and len(data) == 2:
        said = f"nmt {data[0]} to {data[1]}"
    elif can_id & 0x780 == 0x700 and node and data == b"\0":
        said = f"node {node}: boot-up"
    return said or f"{can_id:03X}#{data.hex().upper()}"


def steps_of(path):
    """Sentences of every step, in the order of the marks."""
    steps = {}
    now = steps.setdefault(-1, [])
    for _, _, can_id, data in bus_log.read_log(path):
        if can_id == MARK:
            now = steps.setdefault(int.from_bytes(data, "big"), [])
        else:
            now.append(sentence(can_id, data))
    return steps


def search(fresh):
    """A search among nodes without a node id, `fresh`: their identities, and which of them are left at its end.
    Each of those that take part answers, so two with the same bits say the same twice (CiA 305, fastscan)."""
    said, left = ["lss all wait", "lss scan: who is there?"] + ["lss: yes"] * len(fresh), list(fresh)
    for part in range(len(PARTS) if fresh else 0):
        number = 0
        for bit in range(31, -1, -1):
            yes = sum(who[part] >> bit == number >> bit for who in left)
            said += [scan_question(number, bit, part, part)] + ["lss: yes"] * yes
            number |= 0 if yes else 1 << bit
        left = [who for who in left if who[part] == number]
        said += [scan_question(number, 0, part, (part + 1) % len(PARTS))] + ["lss: yes"] * len(left)
    return said, left


def judge_dissector(path):
    """tshark knows every LSS frame as a service of CiA 305; {node ids that were set: how often}."""
    fields = ("canopen.lss.cs", "canopen.lss.nid", "_ws.malformed")
    out = subprocess.run(["tshark", "-r", path, "-d", "can.subdissector,canopen", "-Y",
                          f"can.id=={TO_NODE} || can.id=={TO_MASTER}", "-T", "fields", "-e", "can.id",
                          *(word for field in fields for word in ("-e", field))],
                         capture_output=True, text=True, check=False)
    rows = [line.split("\t") for line in out.stdout.splitlines()]
    mine = [(can_id, data) for _, _, can_id, data in bus_log.read_log(path) if can_id in (TO_NODE, TO_MASTER)]
    good = len(rows) == len(mine) > 0 and not any(row[3] for row in rows)
    good = good and all(int(row[1], 0) == data[0] for row, (_, data) in zip(rows, mine))
    ids = [int(row[2], 0) for row in rows if row[2] and int(row[0], 0) == TO_NODE]
    print(f"  tshark: {len(rows)} frames of LSS, of {len({row[1] for row in rows})} services, as decoded here: {good}; "
          f"node ids set: {ids}")
    return good, ids
