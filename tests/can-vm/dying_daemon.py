#!/usr/bin/python3
"""What the drives do when their daemon is killed, frozen, ended or cut off, at random moments of a motion.

usage: dying_daemon.py BUILD_DIR SOURCE_DIR [ROUNDS] [SEED]

Without ROUNDS: 4, one of each kind, or TRN_LONG=ROUNDS. In the guest (guest.py) killer.py acts, and the drives' own
process writes down where they are (`trunnion-drives --trace`). The drives have absolute encoders, as machines have that
go on after a power cut. Judged, from that record alone: every drive stands within the time that it has to notice, plus
that of its quick stop; nothing moves after that, not when the daemon comes back, not at `reset`, not when the next
one begins; no process of a dead daemon is left; one that lives says what happened.
"""
import json
import os
import pathlib
import statistics
import sys
import tomllib

import guest

CONFIG = "cradle_can.toml"
PART = ("G21 G90 G94 G64 P0.05\nG53 G0 X0 Y0 Z200 A0 C0\n#1=0\no1 while [#1 lt 200]\n"
        "G1 X40 Y-30 Z230 A-20 C90 F6000\nG1 X-35 Y40 Z190 A15 C-60\nG0 X20 Y20 A0\nG3 X20 Y-20 I0 J-20 C30 F4000\n"
        "#1=[#1+1]\no1 endwhile\nM2\n")
SCRIPT = """/bin/ip link add dev can0 type vcan; /bin/ip link set can0 txqueuelen 1000 up
trunnion-drives --machine machine.toml --priority 60 --trace drives.csv > drives.log 2>&1 &
sleep 1
python3 killer.py can0 {rounds} {seed} > rounds.log 2> killer.log
tail -5 drives.csv
"""
# Until a drive misses its master: periods without SYNC (`sync_periods_max`, which the config leaves as it is).
NOTICE_PERIODS = {"kill": 5, "freeze": 5, "interface_down": 5, "terminate": 0}
SLACK_S = 0.05  # scheduling, and the record's own step
FAULTS = {"freeze": ("drive_fault", "drive_lost", "drive_dropped", "tick_late"),
          "interface_down": ("bus_down", "drive_lost")}


def slowest_stop_s(config, on_path):
    """From a joint's full speed by its own acceleration and jerk, the longest of all. A drive's quick stop begins to
    brake at once. A stop on the path keeps the joint's jerk: where it comes to full speed with full acceleration, it
    first takes that back."""
    def stop(joint):
        unit = "deg" if "velocity_deg_s" in joint else "mm"
        v, a, j = (joint[f"{name}_{unit}_{power}"] for name, power in
                   (("velocity", "s"), ("acceleration", "s2"), ("jerk", "s3")))
        return v / a + (2 if on_path else 1) * a / j
    return max(map(stop, config["joint"]))


def judge(round_, last, most_s):
    """What is wrong with this round, behind the last one."""
    kind, wrong = round_["kind"], []
    if round_["to_rest_s"] > most_s[kind]:
        wrong.append("the drives stopped late")
    if round_["moved"]:
        wrong.append("the drives moved after they had stopped")
    if last and last["after"] != round_["before"]:
        wrong.append("the drives moved when the next daemon came")
    if last and (round_["found"] == "fault") != (last["kind"] == "kill"):
        wrong.append("a daemon that finds drives without a master must say so, and only then")
    if round_["left"]:
        wrong.append("a process of the daemon is left")
    if round_["exit"] != (-9 if kind == "kill" else 0):
        wrong.append(f"the daemon ended with {round_['exit']}")
    if kind in FAULTS and (round_["fault"] not in FAULTS[kind] or round_["reset"]):
        wrong.append("the daemon did not say what happened, or `reset` failed")
    return wrong


def main():
    build, source = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else int(os.environ.get("TRN_LONG", "4"))
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    work = build / "can-vm/dying_daemon"
    work.mkdir(parents=True, exist_ok=True)
    root = guest.kernel_folder(build / "can-vm")
    text = (source / "configs" / CONFIG).read_text().replace("homing_method = 5", "absolute = true")
    text += '\n[tool_change]\nconfirm = "none"\n'
    files = {"machine.toml": text, "part.ngc": PART, "eds/servo.eds": source / "configs/eds/servo.eds",
             "killer.py": source / "tests/can-vm/killer.py"}
    programs = [build / "trunnion", build / "trunnion-drives"]
    guest.boot(work, root, guest.make_initramfs(work / "fs", root, programs, ["vcan"], files,
                                                SCRIPT.format(rounds=rounds, seed=seed)))
    done = [json.loads(line) for line in (work / "rounds.log").read_text().splitlines()]
    config = tomllib.loads(text)
    most_s = {kind: periods * config["machine"]["period_s"] + slowest_stop_s(config, kind == "terminate") + SLACK_S
              for kind, periods in NOTICE_PERIODS.items()}
    good = len(done) == rounds
    if not good:
        print(f"{len(done)} of {rounds} rounds")
        for name in ("killer.log", "daemon.log"):
            print((work / name).read_text()[-2000:] if (work / name).exists() else f"no {name}")
    for number, (last, round_) in enumerate(zip([None, *done], done), 1):
        wrong = judge(round_, last, most_s)
        good &= not wrong
        if wrong:
            print(f"round {number} of seed {seed}: {'; '.join(wrong)}: {json.dumps(round_)}")
    for kind, most in most_s.items():
        mine = [round_ for round_ in done if round_["kind"] == kind]
        times = [1e3 * round_["to_rest_s"] for round_ in mine]
        moved = max((round_["moved"] for round_ in mine), default=0)
        faults = sorted({round_["fault"] for round_ in mine if "fault" in round_})
        if mine:
            print(f"{kind}: {len(mine)} times; to the last movement median {statistics.median(times):.0f} ms, longest "
                  f"{max(times):.0f} of {1e3 * most:.0f}; then moved by {moved} counts; told {faults}")
    print("passed" if good else "FAILED")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
