"""Node ids and parameters that stay in a node, as an operator sets them: `trunnion can lss` and `can store` on a bus.

Three shelves of emulated drives, one after the other: drives out of their boxes among others that have an id, two of
one identity, and one whose memory is broken. Each step is a command. Its exit code, what it says, and every frame of
the bus while it ran are judged (lss_log.py). A reset of a node is its loss of power: only what was stored is left.
"""
import itertools
import re
from dataclasses import dataclass

import lss_log

CONFIG = "cradle_can.toml"
LAST = 12  # node id that is asked for in a scan
SAVE = 0x65766173  # "save", the low byte first
RESET_NODE, RESET_COMMUNICATION = 129, 130


def identity(serial):
    return (0, 0x402, 0x10000, serial)  # as in servo.eds


def options(serial):
    return " ".join(f"--{part} {number:#x}" for part, number in zip(lss_log.PARTS, identity(serial)))


def called(serial):
    return " ".join(f"{part} 0x{number:X}" for part, number in zip(lss_log.PARTS, identity(serial)))


# The fourth drive comes second: a search finds the lowest identity. Drives 1 to 3 have their serial numbers by the
# data sheet.
FIRST, SECOND, TWIN, BROKEN = 0x00010002, 0x80000003, 7, 9


@dataclass
class Shelf:
    name: str
    motors: tuple  # (node id of the config, keys of [[drives.emulation.motor]])
    steps: tuple


@dataclass
class Step:
    """`bus`: every frame, as sentences; `told`: what the command says, in this order."""
    command: str
    bus: list
    told: tuple = ()
    code: int = 0
    nodes: tuple = ()  # of a scan: those that answer, and no others

    def __post_init__(self):
        self.command = f"trunnion can {self.command}" if self.command else ""


def found(*serials):
    """A search, and the question for the node id that follows: each that is left says that it has none."""
    said, left = lss_log.search([identity(serial) for serial in serials])
    return said + (["lss node id?"] + ["lss: node id is 255"] * len(left) if left else [])


def selected(serial, node):
    who = zip(lss_log.PARTS, identity(serial))
    return ["lss all wait", *(f"lss select {part} 0x{number:X}" for part, number in who), "lss: selected",
            "lss node id?", f"lss: node id is {node}"]


def named(node, store="ok", rate=None):
    rates = [] if rate is None else [f"lss set bit rate {rate}", "lss: bit rate ok"]
    stores = [] if store is None else ["lss store", f"lss: store {store}"]
    return [f"lss set node id {node}", "lss: node id ok", *rates, *stores]


WAIT = ["lss all wait"]


def boots(*nodes):
    return [f"node {node}: boot-up" for node in nodes]


def reads(node, thing, value):
    return [f"node {node}: read {thing}", f"node {node}: {thing} is {value}"]


def writes(node, thing, value):
    return [f"node {node}: write {thing} {value}", f"node {node}: {thing} written"]


def sets(node, thing, before, value):
    """As `can sdo` does it: it looks at the size before, and at the value behind."""
    return reads(node, thing, before) + writes(node, thing, value) + reads(node, thing, value)


def may_store(node, sub):
    return reads(node, "0x6041:0", "switch on disabled") + reads(node, f"0x1010:{sub}", "0x1 in 4")


def saves(node, sub):
    return writes(node, f"0x1010:{sub}", f"{SAVE:#x} in 4")


def resets(command, node, *comes_back):
    return [f"nmt {command} to {node}"] + boots(*comes_back)


def scan(*nodes):
    return Step(f"scan --last {LAST} --timeout 0.05", [], nodes=nodes)


# A quick stop's deceleration, a parameter of the drive; a factor of guarding, one of the communication; and the master
# that a drive misses, by which one sees that it was restarted.
DECELERATION, FACTOR, MASTER = "0x6085:0", "0x100D:0", "0x1016:1"
BOXED = Shelf("boxed", ((4, f"without_id = true\nserial = {SECOND}"), (5, f"without_id = true\nserial = {FIRST}")), (
    Step("", boots(1, 2, 3)),
    scan(1, 2, 3),
    Step("lss", found(FIRST, SECOND) + WAIT, (f"{called(FIRST)}, without a node id",)),
    Step("lss --node 10 --store", found(FIRST, SECOND) + named(10) + WAIT + boots(10),
         (f"{called(FIRST)}, without a node id", "node id 10 set, stored")),
    scan(1, 2, 3, 10),
    # The node id is stored, the parameter is not yet.
    Step(f"sdo 10 {DECELERATION} 777", sets(10, DECELERATION, "0xf4240 in 4", "0x309 in 4"), (" = 777 ",)),
    Step("nmt reset-node 10", resets(RESET_NODE, 10, 10)),
    Step(f"sdo 10 {DECELERATION} 777", sets(10, DECELERATION, "0xf4240 in 4", "0x309 in 4"), (" = 777 ",)),
    Step("store 10 application", may_store(10, 3) + saves(10, 3),
         ("node 10: 0x1010:3 is told to save, and has done so",)),
    Step(f"sdo 10 {MASTER} 0x7F0096", sets(10, MASTER, "0x0 in 4", "0x7f0096 in 4")),
    Step("nmt reset-node 10", resets(RESET_NODE, 10, 10)),
    Step(f"sdo 10 {DECELERATION}", reads(10, DECELERATION, "0x309 in 4"), (" = 777 ",)),
    Step(f"sdo 10 {MASTER} 0x7F0096", sets(10, MASTER, "0x0 in 4", "0x7f0096 in 4")),
    Step(f"sdo 10 {FACTOR} 3", sets(10, FACTOR, "0x0 in 1", "0x3 in 1")),
    Step("store 10 communication", may_store(10, 2) + reads(10, MASTER, "0x7f0096 in 4")
         + writes(10, MASTER, "0x0 in 4") + reads(10, "0x100C:0", "0x0 in 2") + reads(10, "0x1006:0", "0x0 in 4")
         + saves(10, 2), ("0x1016:1 was 8323222, and is 0 now", "0x1010:2 is told to save, and has done so")),
    Step("nmt reset-node 10", resets(RESET_NODE, 10, 10)),
    Step(f"sdo 10 {FACTOR}", reads(10, FACTOR, "0x3 in 1"), ("0x100D:0 = 3 ",)),
    Step(f"sdo 10 {MASTER}", reads(10, MASTER, "0x0 in 4"), ("0x1016:1 = 0 ",)),
    # By its identity, with a bit rate that is not that of the bus: it is gone when its power has been.
    Step(f"lss {options(SECOND)} --node 11 --bitrate 500000 --store",
         selected(SECOND, 255) + named(11, rate=2) + WAIT + boots(11),
         (f"{called(SECOND)}, without a node id", "node id 11 set, stored", "bit rate 500000 set, stored")),
    scan(1, 2, 3, 10, 11),
    Step("nmt reset-node 11", resets(RESET_NODE, 11)),
    scan(1, 2, 3, 10),
    Step("lss", found() + WAIT, ("no node without a node id answers",), code=4),
    # One that has an id keeps it until it is told, and without --store only until its power is gone.
    Step(f"lss {options(3)} --node 12", selected(3, 3) + named(12, store=None) + WAIT,
         (f"{called(3)}, node 3", "node id 12 set, until it is switched off", "can nmt reset-communication 3")),
    Step("nmt reset-communication 3", resets(RESET_COMMUNICATION, 3, 12)),
    scan(1, 2, 10, 12),
    Step("nmt reset-node 12", resets(RESET_NODE, 12, 3)),
))
TWINS = Shelf("twins", tuple((node, f"without_id = true\nserial = {TWIN}") for node in (4, 5)), (
    Step("", boots(1, 2, 3)),
    Step("lss --node 9 --store", found(TWIN, TWIN) + WAIT,
         ("2 answers came where one node is selected: several nodes have the same identity", "one at a time"),
         code=4),
    scan(1, 2, 3),
    Step("nmt reset-node 0", resets(RESET_NODE, 0, 1, 2, 3)),
))
FORGETFUL = Shelf("forgetful", ((5, f"without_id = true\nserial = {BROKEN}\nstores = false"),), (
    Step("", boots(1, 2, 3, 4)),
    Step("lss --node 8 --store", found(BROKEN) + named(8, store="refused, 1") + WAIT + boots(8),
         ("the node cannot store by LSS;", "0x1010 instead (trunnion can store)"), code=4),
    scan(1, 2, 3, 4, 8),
    Step("store 8 application", may_store(8, 3) + [f"node 8: write 0x1010:3 {SAVE:#x} in 4",
                                                   "node 8: 0x1010:3 abort 0x06060000"],
         ("node 8: 0x1010:3 was told to save, and refuses: SDO abort 0x06060000",), code=4),
    Step("nmt reset-node 8", resets(RESET_NODE, 8)),
    scan(1, 2, 3, 4),
    Step("store 8 application", ["node 8: read 0x6041:0", "node 8: 0x6041:0 abort 0x05040000"],
         ("node 8: 0x6041:0 was not answered",), code=4),
))
SHELVES = (BOXED, TWINS, FORGETFUL)
STEPS = [(shelf, step) for shelf in SHELVES for step in shelf.steps]
NODE_IDS = [10, 11, 12, 8]  # that are set, and no others


def files(source):
    out = {"eds/servo.eds": source / "configs/eds/servo.eds"}
    for shelf in SHELVES:
        motors = "".join(f'\n[[drives.emulation.motor]]\nnode = "can0:{node}"\n{keys}\n'
                         for node, keys in shelf.motors)
        out[f"{shelf.name}.toml"] = (source / "configs" / CONFIG).read_text() + motors
    return out


def script(setup):
    """Each step has a number: on the bus, and before what its command says. Drives that are switched on begin a
    shelf."""
    lines = [setup, "candump -L -r 4000000 can0 > bus.log &", "sleep 0.5"]
    for number, (shelf, step) in enumerate(STEPS):
        lines += [f"echo '=== {number}'", f"cansend can0 {lss_log.MARK:03X}#{number:04X}"]
        if step.command:
            lines += [step.command, 'echo "exit $?"']
        else:
            lines += ["[ -z $drives ] || { kill $drives; wait $drives; }",
                      f"trunnion-drives --machine {shelf.name}.toml > {shelf.name}.log 2>&1 &", "drives=$!",
                      f"for i in $(seq 1 100); do grep -q drives {shelf.name}.log && break; sleep 0.1; done",
                      'echo "exit 0"']
        lines.append("sleep 0.1")
    return "\n".join(lines + ["kill $drives; wait $drives", "sleep 0.2", ""])


def first_difference(wanted, said):
    for at, (one, other) in enumerate(itertools.zip_longest(wanted, said)):
        if one != other:
            return f"frame {at} of {len(said)} is {other!r}, and should be {one!r}"
    return ""


def wrong_scan(step, said):
    """Every node id is asked, in order; those that answer are the ones that should be there."""
    asked = [one for one in said if re.fullmatch(r"node \d+: read 0x1000:0", one)]
    there = [int(one.split()[1][:-1]) for one in said if " 0x1000:0 is 0x20192 in 4" in one]
    if asked != [f"node {node}: read 0x1000:0" for node in range(1, LAST + 1)]:
        return f"{len(asked)} nodes were asked, not 1 to {LAST}"
    return "" if tuple(there) == step.nodes else f"the nodes {there} answer, not {list(step.nodes)}"


def wrong_words(step, text):
    code = re.findall(r"^exit (\d+)$", text, re.M)
    if code != [str(step.code)]:
        return f"it ended with {code}, not {step.code}"
    if not re.search(".*".join(map(re.escape, step.told)), text, re.S):
        return f"it said {text!r}, and should have said {step.told}"
    listed = tuple(map(int, re.findall(r"^node +(\d+)  profile", text, re.M)))
    return "" if listed == step.nodes else f"it lists the nodes {listed}, not {step.nodes}"


def judge(work):
    console, steps = (work / "console.log").read_text(), lss_log.steps_of(work / "bus.log")
    texts = re.split(r"^=== (\d+)\n", console, flags=re.M)
    texts = dict(zip(map(int, texts[1::2]), texts[2::2]))
    good, frames = steps.pop(-1) == [] and sorted(steps) == sorted(texts) == list(range(len(STEPS))), 0
    print(f"  {len(steps)} of {len(STEPS)} steps on the bus, {len(texts)} in the console")
    for number, (shelf, step) in enumerate(STEPS):
        said = steps.get(number, [])
        frames += len(said)
        on_bus = wrong_scan(step, said) if step.nodes else first_difference(step.bus, said)
        for wrong in filter(None, (on_bus, wrong_words(step, texts.get(number, "")))):
            good = False
            print(f"  {shelf.name}, step {number}, {step.command or 'switched on'}: {wrong}")
    dissected, ids = lss_log.judge_dissector(work / "bus.log")
    print(f"  {frames} frames in {len(STEPS)} steps of {len(SHELVES)} shelves, as they should be: {good}")
    return good and dissected and ids == NODE_IDS
