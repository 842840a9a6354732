"""What a bus log says: setpoints, PDOs as mapped, SYNC periods, and what tshark's CANopen dissector thinks of it."""
import collections
import csv
import math
import re
import statistics
import subprocess
import tomllib


class Drive:
    """One [[drives.node]] of a config."""

    def __init__(self, node, joints, default_bus):
        self.joint = node["joint"]
        self.index = [j["name"] for j in joints].index(self.joint)
        self.bus = node.get("bus", default_bus)
        self.id = node["id"]
        rotary = "counts_per_deg" in node
        self.counts = node["counts_per_deg"] * 180 / math.pi if rotary else node["counts_per_mm"]


def drives_of(config):
    table = tomllib.loads(config.read_text())
    default_bus = table["drives"]["bus"][0]["interface"]
    drives = [Drive(node, table["joint"], default_bus) for node in table["drives"]["node"]]
    return sorted(drives, key=lambda d: d.index), table["machine"]["period_s"]


def read_log(path):
    """(time s, interface, id, bytes) of every frame of a candump log."""
    frames = []
    for line in path.read_text().splitlines():
        match = re.match(r"\(([\d.]+)\) (\S+) ([0-9A-F]+)#(?:#[0-9A-F])?([0-9A-F]*)$", line)
        if match:
            frames.append((float(match[1]), match[2], int(match[3], 16), bytes.fromhex(match[4])))
    return frames


def changing(rows):
    """Each row that differs from the one before."""
    out = []
    for row in rows:
        if not out or out[-1] != row:
            out.append(row)
    return out


def targets_on_bus(frames, drives):
    """Target positions of all drives, one row a SYNC of the first drive's bus, while every drive is commanded
    'enable operation' (controlword 0x0F) in mode 8. Several buses: the k-th SYNC of each belongs together."""
    rows = {}
    for bus in {d.bus for d in drives}:
        now, mine = {}, [d for d in drives if d.bus == bus]
        by_id = {0x200 + d.id: d.joint for d in mine}
        column = rows.setdefault(bus, [])
        for _, interface, can_id, data in frames:
            if interface != bus:
                continue
            if can_id == 0x80:
                column.append(dict(now))
            elif can_id in by_id and len(data) == 7:
                enabled = data[0] & 0x1F == 0x0F and data[6] == 8
                now[by_id[can_id]] = int.from_bytes(data[2:6], "little", signed=True) if enabled else None
    merged = [{k: v for part in parts for k, v in part.items()} for parts in zip(*rows.values())]
    complete = [tuple(row.get(d.joint) for d in drives) for row in merged]
    return [row for row in complete if None not in row]


def targets_of_trace(path, drives, first_line):
    """The trace's setpoints in counts, from `first_line` of the program on."""
    with open(path, encoding="utf-8") as file:
        table = csv.DictReader(line for line in file if not line.startswith("#"))
        return [tuple(round(float(row[d.joint]) * d.counts) for d in drives)
                for row in table if int(row["line"]) >= first_line]


def judge_setpoints(frames, drives, trace, first_line, name):
    wanted = changing(targets_of_trace(trace, drives, first_line))
    seen = changing(targets_on_bus(frames, drives))
    starts = [i for i in range(len(seen)) if seen[i:i + 4] == wanted[:4]]
    start = starts[-1] if starts else 0
    same = len(wanted) > 100 and bool(starts) and seen[start:start + len(wanted)] == wanted
    print(f"  setpoints: {len(wanted)} rows of `{name}`, {len(seen)} on the bus, the same to the count: {same}")
    if not same:
        first = next((i for i, (a, b) in enumerate(zip(seen[start:], wanted)) if a != b), None)
        print(f"    from row {start} of the bus, first difference at {first} of `{name}`")
    return same


def judge_frames(log, frames, drives):
    out = subprocess.run(["tshark", "-r", log, "-d", "can.subdissector,canopen", "-T", "fields", "-e",
                          "frame.protocols", "-e", "_ws.malformed", "-e", "canopen.function_code"],
                         capture_output=True, text=True, check=False)
    fields = [line.split("\t") for line in out.stdout.splitlines()]
    malformed = sum("malformed" in line[0] or (len(line) > 1 and line[1] != "") for line in fields)
    kinds = collections.Counter(line[2] for line in fields if len(line) > 2)
    print(f"  tshark: {len(fields)} frames, {malformed} malformed; function codes {dict(kinds)}")
    as_mapped = True
    for drive in drives:
        for base in (0x180, 0x200):
            sizes = {len(d) for _, bus, i, d in frames if bus == drive.bus and i == base + drive.id}
            as_mapped &= sizes == {7}
    print(f"  {2 * len(drives)} PDOs as mapped (7 bytes each): {as_mapped}")
    return len(fields) == len(frames) and malformed == 0 and as_mapped


def ranks(values):
    values = sorted(values)
    return [values[min(len(values) - 1, int(share * len(values)))] for share in (0.5, 0.99, 0.999)] + [values[-1]]


def report_sync(frames, period_s):
    for bus in sorted({f[1] for f in frames}):
        times = [t for t, interface, can_id, _ in frames if interface == bus and can_id == 0x80]
        gaps = [1e6 * (b - a) for a, b in zip(times, times[1:])]
        late = ranks([abs(gap - 1e6 * period_s) for gap in gaps])
        print(f"  {bus}: {len(times)} SYNC, mean period {statistics.mean(gaps):.2f} us, "
              "jitter p50 {:.0f} p99 {:.0f} p99.9 {:.0f} max {:.0f} us".format(*late))
