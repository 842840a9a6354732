#!/usr/bin/python3
"""Runs daemon and drives over SocketCAN, on virtual CAN and between two Kvaser controllers.

usage: can_vm.py BUILD_DIR SOURCE_DIR CASE...        ("long": every case but the first, if TRN_LONG is set)

Boots Debian's real-time kernel in QEMU (guest.py); where the host's own kernel has virtual CAN, the cases that need no
controllers run on it instead (native.py). There the daemon brings up, homes and cuts a part on
emulated drives of another process; candump records the bus. Then, on this side (bus_log.py): the setpoints on the
bus are those of the replayed session and, if neither planner was late, those of `trunnion run`, to the count;
tshark finds no malformed frame; SYNC periods are summed up. A case with faults shows that each one is told and that
`reset` brings the machine back. The case "lss" needs no daemon: node ids and parameters that stay in a node
(lss_session.py). Exit code 77 (skipped) where QEMU or the kernel package cannot be had.
"""
import os
import pathlib
import re
import subprocess
import sys
import time
from dataclasses import dataclass

import bus_log
import guest
import lss_session
import native

VCAN = "/bin/ip link add dev {0} type vcan; /bin/ip link set {0} txqueuelen 1000 up\n"
FD = "/bin/ip link add dev can0 type vcan; /bin/ip link set can0 mtu 72 txqueuelen 1000 up\n"
KVASER = ("for c in can0 can1; do /bin/ip link set $c type can bitrate 1000000 restart-ms 100; "
          "/bin/ip link set $c txqueuelen 100 up; done\n")
# On virtual CAN, where a frame that was sent is there at once.
SOCKET_TEST = "TRN_CAN=can0 test_hal --gtest_filter='SocketCan*'"
# Before these lines' end the way depends on where the machine was homed; behind them it stands where `run` does.
PREFIX = "G21 G90 G53 G0 {0}\nG4 P0.1\n"
FIRST_LINE = 3


# What the operator does.
CUT = """ask home --wait --patience 300
ask load part.ngc
ask start --wait --patience 900
ask status --json
"""
# Again and again until the script of faults is through; then once more to the end.
LIVE_THROUGH = """ask home --wait --patience 300
ask load part.ngc
for i in $(seq 1 {count}); do
  ask start --wait --patience 300 | grep -v "^---"
  trunnion status --machine machine.toml | grep -E "fault|message"
  sleep 1
  trunnion reset --machine machine.toml --timeout 20
  await idle
done
ask start --wait --patience 900
ask status --json
"""
# The interface goes down while the machine moves, and comes up again.
DOWN_AND_UP = """ask home --wait --patience 300
ask load part.ngc
(sleep 4; /bin/ip link set can0 down; sleep 1; /bin/ip link set can0 up) &
ask start --wait --patience 300
trunnion status --machine machine.toml | grep -E "fault|message"
sleep 2
trunnion reset --machine machine.toml --timeout 20
await idle
ask start --wait --patience 900
ask status --json
"""
# What the controller reports, and what a second master sends, as frames of another program.
INTRUDER = """ask home --wait --patience 300
ask load part.ngc
for frame in 20000040#0000000000000000 080#; do
  (sleep 4; cansend can0 $frame) &
  ask start --wait --patience 300 | grep -v "^---"
  trunnion status --machine machine.toml | grep -E "fault|message"
  sleep 2
  trunnion reset --machine machine.toml --timeout 20
  await idle
done
ask start --wait --patience 900
ask status --json
"""
FUZZ = """ask home --wait --patience 300
python3 bus_fuzzer.py can0 20000 1
trunnion status --machine machine.toml | grep -E "state|fault|message"
for i in 1 2 3; do trunnion reset --machine machine.toml --timeout 20; await idle && break; done
ask home --wait --patience 300
ask load part.ngc
ask start --wait --patience 900
ask status --json
"""
FAULTS = (("silent", 1, "drive_lost"), ("fault", 0x3210, "drive_fault"), ("drop", 0, "drive_dropped"),
          ("emergency", 0x4210, "drive_warning"), ("reset", 0, "drive_restarted"), ("short_pdo", 1, "drive_lost"),
          ("pre_operational", 0, "drive_dropped"), ("lie", 2000000, "following_error"))


def fault_script():
    """One fault every five seconds, mended half a second later."""
    lines = []
    for i, (kind, value, _) in enumerate(FAULTS):
        at_s = 4 + 5 * i
        lines.append(f'[[fault]]\nat_s = {at_s}\nnode = 2\nkind = "{kind}"\nvalue = {value}\n')
        if kind in ("silent", "short_pdo", "lie"):
            lines.append(f'[[fault]]\nat_s = {at_s + 0.5}\nnode = 2\nkind = "{kind}"\nvalue = 0\n')
    return "\n".join(lines)


@dataclass
class Case:
    """`drives`: arguments of trunnion-drives; `script`: what the operator does; `faults`: what must come, in order."""
    config: str
    part: str
    place: str
    setup: str
    drives: str = ""
    log: str = "can0"
    script: str = CUT
    peers: str = ""  # further programs on the bus
    faults: tuple = ()
    edits: tuple = ()  # of the config: (text, what stands in its place)


# The guest's processor is a slow one; a part that is planned before it starts is never late.
PLANNED_AHEAD = (("[planner]", "[planner]\nbuffer_s = 8.0"),)
# Before the kernel tells that an interface goes down it may drop frames for longer than the drives have.
DOWN = "(?:bus_down|drive_lost)"
CRADLE = "X0 Y0 Z200 A0 C0"
CASES = {
    "cradle": Case("cradle_can.toml", "cone_frustum.ngc", CRADLE, VCAN.format("can0")),
    "hexapod": Case("hexapod_can.toml", "hexapod_part", "X0 Y0 Z50 A0 B0", VCAN.format("can0") + VCAN.format("can1"),
                    log="can0 can1", edits=PLANNED_AHEAD),
    "kvaser": Case("cradle_can.toml", "cone_frustum.ngc", CRADLE, KVASER, drives="--can can1"),
    "impeller": Case("cradle_can.toml", "impeller.ngc", CRADLE, VCAN.format("can0")),
    "tilted_pocket": Case("hexapod_can.toml", "tilted_pocket.ngc", "X0 Y0 Z50 A0 B0",
                          VCAN.format("can0") + VCAN.format("can1"), log="can0 can1"),
    "faults": Case("hexapod_can.toml", "long_part", "X0 Y0 Z50 A0 B0", VCAN.format("can0") + VCAN.format("can1"),
                   drives="--faults faults.toml", log="can0 can1",
                   script=LIVE_THROUGH.format(count=len(FAULTS)), faults=tuple(f for _, _, f in FAULTS)),
    "down": Case("cradle_can.toml", "cone_frustum.ngc", CRADLE, VCAN.format("can0"), script=DOWN_AND_UP,
                 faults=(DOWN,)),
    "intruder": Case("cradle_can.toml", "cone_frustum.ngc", CRADLE, VCAN.format("can0"), script=INTRUDER,
                     faults=("bus_off", "foreign_master")),
    "fd": Case("cradle_can.toml", "cone_frustum.ngc", CRADLE, FD,
               edits=(('interface = "can0"', 'interface = "can0"\nfd = true\ndata_bitrate = 5000000'),)),
    "kvaser_down": Case("cradle_can.toml", "cone_frustum.ngc", CRADLE, KVASER, drives="--can can1",
                        script=DOWN_AND_UP, faults=(DOWN,)),
    "peer": Case("cradle_can.toml", "cone_frustum.ngc", CRADLE, VCAN.format("can0"), drives="--without 5",
                 peers="python3 python_node.py can0 5 > peer.log 2>&1 &\nsleep 2"),
    "fuzzer": Case("cradle_can.toml", "cone_frustum.ngc", CRADLE, VCAN.format("can0"), script=FUZZ,
                   peers="sleep 0", faults=("",)),
}
LOOP = "o100 repeat [4]\n{0}o100 endrepeat\nM2\n"
HEXAPOD_PART = """G64 P0.01 R0.05
G43.4 H1
G1 X20 Y0 Z30 A5 B0 F3000
G1 X20 Y25 Z28 A8 B-6
G3 X-20 Y25 I-20 J0 F2000
G1 X-15 Y-10 Z30 A0 B8
G1 X0 Y0 Z40 A0 B0
G49
M2
"""
SCRIPT = """{setup}
/bin/ip -details link show can0
{socket_test}
candump -L -r 4000000 {log} > bus.log &
{peers}
trunnion-drives --machine machine.toml {drives} --priority 60 > drives.log 2>&1 &
trunnion daemon --machine machine.toml --tools tools.tbl --log session.log > daemon.log 2>&1 &
daemon=$!
ask() {{ echo "--- $*"; trunnion "$@" --machine machine.toml --timeout 20; echo "exit $?"; }}
await() {{
  for i in $(seq 1 40); do trunnion status --machine machine.toml --timeout 2 | grep -q $1 && return 0; sleep 0.5; done
  echo "not $1"; return 1
}}
await idle
{script}
kill -TERM $daemon; wait $daemon
echo "daemon exit $?"
sleep 0.2
cat /proc/uptime
"""


def part_of(case, source):
    if case.part == "hexapod_part":
        text = HEXAPOD_PART
    elif case.part == "long_part":
        text = LOOP.format(HEXAPOD_PART.replace("M2\n", ""))
    else:
        text = (source / "examples" / case.part).read_text()
    return PREFIX.format(case.place) + text.removeprefix("%\n")


def run_case(name, case, build, source, cache):
    work = cache / name
    work.mkdir(parents=True, exist_ok=True)
    config = (source / "configs" / case.config).read_text() + "\n[tool_change]\nconfirm = \"none\"\n"
    for text, instead in case.edits:
        config = config.replace(text, instead)
    files = {"machine.toml": config, "part.ngc": part_of(case, source),
             "tools.tbl": source / "examples/tools.tbl", "eds/servo.eds": source / "configs/eds/servo.eds"}
    if case.faults:
        files["faults.toml"] = fault_script()
    if case.peers:
        files.update({name: source / "tests/can-vm" / name for name in ("python_node.py", "bus_fuzzer.py")})
    script = SCRIPT.format(setup=case.setup, log=case.log, drives=case.drives, peers=case.peers, script=case.script,
                           socket_test="" if case.setup == KVASER else SOCKET_TEST)
    run_session(name, case.setup, build, cache, files, script)
    console = (work / "console.log").read_text()
    for line in console.splitlines():
        if not line.startswith(("{", " ")):
            print("  |", line)
    if "exit 0" not in console:
        print((work / "daemon.log").read_text()[-2000:])
    return judge(case, work, build)


def run_lss(name, build, source, cache):
    work = cache / name
    work.mkdir(parents=True, exist_ok=True)
    setup = VCAN.format("can0")
    run_session(name, setup, build, cache, lss_session.files(source), lss_session.script(setup))
    return lss_session.judge(work)


def run_session(name, setup, build, cache, files, script):
    work, begin = cache / name, time.time()
    for log in work.glob("*.log"):
        log.unlink()  # of the last time: what does not come back must not be judged
    if native.has_virtual_can() and setup != KVASER:
        where = "host"
        native.run(work, build, files, script)
    else:
        where = "guest"
        boot_guest(work, guest.kernel_folder(cache), setup, build, files, script)
    print(f"{name}: {where} ran {time.time() - begin:.0f} s", flush=True)


def boot_guest(work, root, setup, build, files, script):
    driver = "kvaser_pci" if setup == KVASER else "vcan"  # each takes the name can0
    programs = [build / "trunnion", build / "trunnion-drives", build / "test_hal"]
    guest.boot(work, root, guest.make_initramfs(work / "fs", root, programs, [driver], files, script))


def judge(case, work, build):
    console, place = (work / "console.log").read_text(), work / "fs/work"
    drives, period_s = bus_log.drives_of(place / "machine.toml")
    frames = bus_log.read_log(work / "bus.log")
    daemon_log = (work / "daemon.log").read_text()
    print("  daemon:", *re.findall(r"can\d: load.*", daemon_log))
    good = "daemon exit 0" in console and '"state":"idle"' in console
    good &= case.setup == KVASER or "[  PASSED  ] 3 tests" in console
    if case.faults:
        told = re.findall(r"^fault +(\w+)", console, re.M)
        print(f"  faults told: {told}")
        return good and (case.faults == ("",) or re.fullmatch(" ".join(case.faults), " ".join(told)) is not None)
    good &= console.count("\nexit 0") == 4
    loads = [float(a) / float(b) for a, b in re.findall(r"load ([\d.]+) % of ([\d.]+) % budgeted", daemon_log)]
    print("  load over budget:", *(f"{ratio:.4f}" for ratio in loads))
    good &= bool(loads) and all(abs(ratio - 1) < 0.02 for ratio in loads)
    good &= bus_log.judge_frames(work / "bus.log", frames, drives)
    bus_log.report_sync(frames, period_s)
    return good & judge_setpoints(work, place, build, console, frames, drives)


# A planner that is late slows the machine down on its path, and so does a rate planner: other setpoints than those of
# `run`, where nothing is late. The session's log says when they were, and gives the same ones.
def judge_setpoints(work, place, build, console, frames, drives):
    late = int(re.findall(r'"starvations": ?(\d+)', console)[-1])
    print(f"  the planner was late {late} times")
    told = re.findall(r"rate_plan_late: .* \((\d+) times so far\)", (work / "daemon.log").read_text())
    print(f"  the rate planner was late {int(told[-1]) if told else 0} times so that the motion felt it")
    log = work / "session.log"
    log.write_text(log.read_text().replace('"/work/', f'"{place}/'))  # the program's place in the guest
    traces = {"run": ["run", "part.ngc", "--machine", "machine.toml", "--tools", "tools.tbl"],
              "replay": ["replay", log]}
    same = {}
    for name, command in traces.items():
        trace = work / f"{name}.csv"
        subprocess.run([build / "trunnion", *command, "--trace", trace], cwd=place, check=True, capture_output=True)
        same[name] = bus_log.judge_setpoints(frames, drives, trace, FIRST_LINE, name)
    return same["replay"] and (same["run"] or late > 0 or bool(told))


def main():
    build, source = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
    cache = build / "can-vm"
    names = sys.argv[3:]
    if names == ["long"]:
        if not os.environ.get("TRN_LONG"):
            guest.skip("TRN_LONG is not set")
        names = list(CASES)[1:]
    good = True
    for name in names:
        good &= (run_lss(name, build, source, cache) if name == "lss" else
                 run_case(name, CASES[name], build, source, cache))
    print("passed" if good else "FAILED")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
