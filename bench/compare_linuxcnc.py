#!/usr/bin/python3
"""Cycle times and joint limits beside LinuxCNC's trajectory planner, for the same programs on the same machine.

LinuxCNC (Debian's linuxcnc-uspace, no dependency of ours) runs in its own simulation, in real time, with the joints'
velocities and accelerations of our config; it knows no jerk. Its joint commands are sampled each period of 1 ms, ours
are the trace of `trunnion run`, both are judged in the same way: differences of the commands against the limits. Time
counts from the first to the last period in which a joint moves. --jerk-scale 40 gives Trunnion's joints forty times
their jerk, about what LinuxCNC asks of them, to compare with acceleration and velocity alone.
"""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib

import numpy as np

PERIOD_S = 0.001
# What only one of the two reads: RTCP is always on in LinuxCNC's kinematics, as it is configured here.
RTCP_WORDS = re.compile(r"(?i)\bG43\.4\b")
SWITCH_WORDS = re.compile(r"(?i)^\s*M42[89]\b.*$", re.M)
ORIENTATION_TOLERANCE = re.compile(r"(?i)(\bG64\b[^\n]*?)\bR[\d.]+")

JERK = re.compile(r"(?m)^(jerk_\w+ = )([\d.e+]+)")


class Refused(Exception):
    """LinuxCNC did not run the program."""


def joints_of(config):
    with open(config, "rb") as file:
        machine = tomllib.load(file)
    joints = []
    for joint in machine["joint"]:
        linear = joint["type"] == "linear"
        unit, accel = ("mm_s", "mm_s2") if linear else ("deg_s", "deg_s2")
        joints.append({"name": joint["name"], "linear": linear,
                       "limits": [joint["velocity_" + unit], joint["acceleration_" + accel],
                                  joint["jerk_" + unit + "3"]]})
    return joints


def ini_text(joints, folder):
    letters = "".join(joint["name"] for joint in joints)
    five_axis = letters == "XYZAC"
    kinematics = "xyzac-trt-kins" if five_axis else f"trivkins coordinates={letters}"
    lines = ["[EMC]", "VERSION = 1.1", "MACHINE = bench", "[DISPLAY]",
             f"DISPLAY = {folder}/drive", "[TASK]", "TASK = milltask", "CYCLE_TIME = 0.001", "[RS274NGC]",
             f"PARAMETER_FILE = {folder}/linuxcnc.var", "[EMCMOT]", "EMCMOT = motmod", "COMM_TIMEOUT = 4.0",
             f"SERVO_PERIOD = {round(PERIOD_S * 1e9)}", "[HAL]", f"HALFILE = {folder}/bench.hal", "[EMCIO]",
             "EMCIO = io", "CYCLE_TIME = 0.1", f"TOOL_TABLE = {folder}/tool.tbl", "[KINS]",
             f"KINEMATICS = {kinematics}", f"JOINTS = {len(joints)}", "[TRAJ]",
             f"COORDINATES = {' '.join(letters)}", "LINEAR_UNITS = mm", "ANGULAR_UNITS = degree",
             "MAX_LINEAR_VELOCITY = 1000", "MAX_LINEAR_ACCELERATION = 100000", "DEFAULT_LINEAR_VELOCITY = 100",
             "DEFAULT_LINEAR_ACCELERATION = 100000", "MAX_ANGULAR_VELOCITY = 1000", "NO_FORCE_HOMING = 1"]
    for number, joint in enumerate(joints):
        velocity, acceleration, _ = joint["limits"]
        both = ["MIN_LIMIT = -99999", "MAX_LIMIT = 99999", f"MAX_VELOCITY = {velocity}",
                f"MAX_ACCELERATION = {acceleration}"]
        lines += [f"[AXIS_{joint['name']}]"] + both
        lines += [f"[JOINT_{number}]", f"TYPE = {'LINEAR' if joint['linear'] else 'ANGULAR'}", "HOME = 0",
                  "HOME_OFFSET = 0", "HOME_SEARCH_VEL = 0", "HOME_SEQUENCE = 0", "FERROR = 1000",
                  "MIN_FERROR = 1000"] + both
    return "\n".join(lines) + "\n"


def hal_text(joints, samples):
    count = len(joints)
    lines = ["loadrt [KINS]KINEMATICS",
             "loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS",
             f"loadrt sampler depth=60000 cfg={'f' * count}", "addf motion-command-handler servo-thread",
             "addf motion-controller servo-thread", "addf sampler.0 servo-thread"]
    for number in range(count):
        lines.append(f"net joint{number} joint.{number}.motor-pos-cmd => joint.{number}.motor-pos-fb "
                     f"sampler.0.pin.{number}")
    lines += ["net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in",
              "net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared",
              "net change iocontrol.0.tool-change => iocontrol.0.tool-changed"]
    if count == 5:
        lines += ["setp xyzac-trt-kins.z-rot-point 75", "setp xyzac-trt-kins.y-offset 0",
                  "setp xyzac-trt-kins.z-offset 0"]
    lines.append(f"loadusr halsampler -t {samples}")
    return "\n".join(lines) + "\n"


def drive(program, done, seconds):
    """What LinuxCNC starts as its display: switches on, homes, runs the program, waits for its end."""
    import linuxcnc
    command, state, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()

    def until(what, text, limit=10.0):
        end = time.monotonic() + limit
        while time.monotonic() < end:
            try:
                state.poll()
            except linuxcnc.error:  # its buffer was being written
                continue
            if what():
                return
            message = errors.poll()
            if message:
                raise Refused(message[1].strip())
            time.sleep(0.02)
        raise Refused(f"no {text} within {limit:g} s: at line {state.motion_line}, {state.current_vel:.3g} units/s, "
                      f"{state.distance_to_go:.3g} to go, in position {state.inpos}, queue {state.queue}")

    try:
        command.state(linuxcnc.STATE_ESTOP_RESET)
        command.wait_complete()
        command.state(linuxcnc.STATE_ON)
        until(lambda: state.task_state == linuxcnc.STATE_ON, "power")
        command.home(-1)
        until(lambda: all(state.homed[:state.joints]), "homing")
        command.mode(linuxcnc.MODE_AUTO)
        command.wait_complete()
        command.program_open(program)
        command.auto(linuxcnc.AUTO_RUN, 0)
        until(lambda: state.interp_state != linuxcnc.INTERP_IDLE, "start")
        until(lambda: state.interp_state == linuxcnc.INTERP_IDLE and state.inpos, "end", seconds)
        pathlib.Path(done).write_text("done")
    except Refused as refusal:
        pathlib.Path(done).write_text(str(refusal))
    time.sleep(0.5)


def run_linuxcnc(program, joints, tools, seconds):
    with tempfile.TemporaryDirectory() as folder:
        place = pathlib.Path(folder)
        text = pathlib.Path(program).read_text(encoding="latin-1")
        text = SWITCH_WORDS.sub("", RTCP_WORDS.sub("G43", text))
        (place / "program.ngc").write_text(ORIENTATION_TOLERANCE.sub(r"\1", text), encoding="latin-1")
        (place / "bench.ini").write_text(ini_text(joints, folder))
        (place / "bench.hal").write_text(hal_text(joints, place / "samples"))
        (place / "tool.tbl").write_text(pathlib.Path(tools).read_text() if tools else "T1 P1 Z0\n")
        script = place / "drive"
        script.write_text(f"#!/bin/sh\nexec /usr/bin/python3 {os.path.abspath(__file__)} --drive {folder}/program.ngc "
                          f"--done {folder}/done --seconds {seconds}\n")
        script.chmod(0o755)
        environment = dict(os.environ, RTAPI_FIFO_PATH=f"{folder}/fifo")
        if os.geteuid() == 0:  # it does not run as root
            environment["RTAPI_UID"] = "65534"
            subprocess.run(["chmod", "-R", "a+rwX", folder], check=True)
        command = ["script", "-qec", f"linuxcnc {folder}/bench.ini", "/dev/null"]  # it wants a terminal
        log = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             text=True, env=environment, timeout=seconds + 60, check=False).stdout
        done = place / "done"
        verdict = done.read_text() if done.exists() else "did not start:\n" + log[-1500:]
        if verdict != "done":
            with open(place / "samples", encoding="utf-8") as samples:
                raise Refused(f"{verdict}, after {sum(1 for _ in samples) * PERIOD_S:.1f} s of its own")
        rows = np.loadtxt(place / "samples", comments="overrun")
        if np.any(np.diff(rows[:, 0]) != 1):
            raise Refused("samples lost")
        return rows[:, 1:]


def run_trunnion(trunnion, program, config, joints, tools, jerk_scale):
    with tempfile.TemporaryDirectory() as folder:
        trace = f"{folder}/trace.csv"
        text = pathlib.Path(config).read_text()
        config = f"{folder}/machine.toml"
        pathlib.Path(config).write_text(JERK.sub(lambda found: f"{found[1]}{jerk_scale * float(found[2])}", text))
        extra = ["--tools", tools] if tools else []
        subprocess.run([trunnion, "run", program, "--machine", config, "--trace", trace, *extra], check=True,
                       stdout=subprocess.DEVNULL)
        with open(trace, encoding="utf-8") as file:
            header = next(line for line in file if not line.startswith("#")).strip().split(",")
            return np.loadtxt(file, delimiter=",", usecols=[header.index(joint["name"]) for joint in joints])


def judge(q, joints):
    """(time in s, worst ratios of velocity, acceleration, jerk) of commands q (n, joints), one row a period."""
    rest = np.repeat(q[:1], 3, axis=0), np.repeat(q[-1:], 3, axis=0)
    q = np.vstack([rest[0], q, rest[1]])
    moving = np.flatnonzero(np.any(np.diff(q, axis=0) != 0, axis=1))
    ratios = []
    for order in range(3):
        d = np.diff(q, order + 1, axis=0) / PERIOD_S ** (order + 1)
        ratios.append(max(np.max(np.abs(d[:, i])) / joint["limits"][order] for i, joint in enumerate(joints)))
    return (moving[-1] - moving[0] + 1) * PERIOD_S, ratios


def compare(arguments):
    joints = joints_of(arguments.machine)
    rows = []
    for program in arguments.programs:
        name = pathlib.Path(program).stem
        ours = judge(run_trunnion(arguments.trunnion, program, arguments.machine, joints, arguments.tools,
                                  arguments.jerk_scale), joints)
        row = {"program": name, "trunnion_s": ours[0], "trunnion_ratios": ours[1]}
        print(f"{name}: {ours[0]:.2f} s here; LinuxCNC runs in real time ...", file=sys.stderr)
        try:
            theirs = judge(run_linuxcnc(program, joints, arguments.tools, arguments.seconds), joints)
            row |= {"linuxcnc_s": theirs[0], "linuxcnc_ratios": theirs[1], "time_ratio": theirs[0] / ours[0]}
        except Refused as refusal:
            row["linuxcnc_refused"] = str(refusal)
        rows.append(row)
    return rows


def show(rows):
    print(f"{'program':24} {'Trunnion':>9} {'v':>6} {'a':>6} {'j':>8}   {'LinuxCNC':>9} {'v':>6} {'a':>6} {'j':>8}"
          f" {'ratio':>6}")
    for row in rows:
        print(f"{row['program']:24} {row['trunnion_s']:7.2f} s " + ratio_text(row["trunnion_ratios"]), end="   ")
        if "linuxcnc_s" in row:
            print(f"{row['linuxcnc_s']:7.2f} s {ratio_text(row['linuxcnc_ratios'])} {row['time_ratio']:6.2f}")
        else:
            print(row["linuxcnc_refused"])


def ratio_text(ratios):
    return f"{ratios[0]:6.3f} {ratios[1]:6.3f} {ratios[2]:8.3f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="*", help="G-code that both can read")
    parser.add_argument("--machine", default="configs/mill.toml", help="three axes X Y Z, or the cradle")
    parser.add_argument("--tools", default="", help="tool table")
    parser.add_argument("--trunnion", default="build/release/trunnion")
    parser.add_argument("--seconds", type=float, default=1800, help="longest a program may take in LinuxCNC")
    parser.add_argument("--jerk-scale", type=float, default=1)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--drive", help=argparse.SUPPRESS)
    parser.add_argument("--done", help=argparse.SUPPRESS)
    arguments, _ = parser.parse_known_args()
    if arguments.drive:
        return drive(arguments.drive, arguments.done, arguments.seconds)
    if not arguments.programs:
        parser.error("which programs?")
    if not shutil.which("linuxcnc"):
        print("linuxcnc is not installed (package linuxcnc-uspace); nothing compared", file=sys.stderr)
        return 0
    rows = compare(arguments)
    print(json.dumps(rows, indent=1)) if arguments.json else show(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
