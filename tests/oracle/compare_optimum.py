#!/usr/bin/python3
"""Cycle times beside the time-optimal motion on the same path, and beside a tolerance reference.

    tests/oracle/compare_optimum.py build/release/trunnion [CASE|PROGRAM.ngc ...] [--machine CFG] [--offset X,Y,Z]
                                    [--share 0.999] [--check-period 0.001]

Without names: the short form (line lcorner square circle). `all`: every case of the reference's generator. A file:
this program on --machine; each of its stretches between full stops is judged by itself.

The reference is a stand-alone solver (--oracle): `topp.py path` gives for the joint path that `trunnion run --path`
wrote a certified lower bound (T3_lb) and a feasible optimum (T3_feas) under the limits of the machine and the feed;
`topp.py poly` gives a good time for any path within the tolerance. Columns: our time, those three, the ratios.
The feasible optimum's own differences over --check-period are inside the limits; where the path bends within less
than that, its jerk is not, so that a shorter period shows what a motion inside the limits at every moment can reach.
On another machine than the cradle, --offset puts the part where it can be reached.
Exit: 0, 1 when a ratio is above --limit or --limit-poly, 77 when the reference is not there.
"""
import argparse
import csv
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON = "/usr/bin/python3"
SHORT = ["line", "lcorner", "square", "circle"]
ALL = SHORT + ["freeform", "spiral", "impeller", "singular"]
FEED_FREE = 1e9


def call(command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def machine_with_shares(config, share, folder):
    """A copy of the config whose planner uses `share` of acceleration and jerk; None: as it is."""
    if share is None:
        return config
    text = pathlib.Path(config).read_text()
    text = text.replace("[planner]\n", f"[planner]\nacceleration_share = {share}\njerk_share = {share}\n")
    out = folder / "machine.toml"
    out.write_text(text)
    return out


def case_program(case, folder, offset=None):
    """The case's program as our machine reads it: part zero 40 mm above the crossing of A and C, RTCP on, and a
    full stop before the first feed move, so that the way to the start is a stretch of its own."""
    text = re.sub(r"\([^)]*\)\n", "", (folder / f"{case}.ngc").read_text())  # comments over several lines
    lines = text.splitlines()
    approach = next((i for i, line in enumerate(lines) if line.startswith("G0 ")), None)
    if approach is not None:
        lines.insert(approach + 1, "G4 P0.1")
        if "A" in lines[approach]:
            lines[approach:approach] = ["G10 L2 P1 X0 Y0 Z40", "G54", "M428"]
        elif offset:
            lines[approach:approach] = ["G10 L2 P1 X{} Y{} Z{}".format(*offset.split(",")), "G54"]
    out = folder / f"{case}_ours.ngc"
    out.write_text("\n".join(lines) + "\n")
    return out


def run_program(binary, program, machine, tools, folder):
    command = [binary, "run", program, "--machine", machine, "--json", "--path", folder / "path.csv", "--stretches",
               folder / "stretches.csv"]
    report = json.loads(call(command + (["--tools", tools] if tools else [])))
    stretches = {}
    for row in csv.DictReader(open(folder / "stretches.csv")):
        one = stretches.setdefault(int(row["stretch"]), {"time_s": float(row["time_s"]), "line": int(row["line"]),
                                                         "feeds": []})
        one["feeds"].append((float(row["tip_mm"]), float(row["feed_mm_s"])))
    header, *rest = (folder / "path.csv").read_text().split("\n", 1)
    blocks = [np.array([[float(x) for x in row.split(",")] for row in block.splitlines()])
              for block in rest[0].split("\n\n")]
    return report, header, [dict(stretches[i], rows=b) for i, b in enumerate(blocks)]


def limits_of(report):
    """The machine's joint limits as the reference reads them; the path is in the same units (mm, rad)."""
    return [{"name": j["name"], "v": j["limits"]["velocity"], "a": j["limits"]["acceleration"],
             "j": j["limits"]["jerk"]} for j in report["joints"]]


def moving(rows, joints):
    """Columns of joints that move: the others limit nothing and cost time."""
    return [i for i in range(len(joints)) if np.ptp(rows[:, 1 + i]) > 1e-9]


def warped_tip(rows, feeds):
    """The tip's way in seconds at the programmed feed, so that one feed limit of 1 holds along the stretch."""
    at, out, ends = rows[:, -1], np.zeros(len(rows)), np.cumsum([mm for mm, _ in feeds])
    start, sum_s = 0.0, 0.0
    for end, (mm, feed) in zip(ends, feeds):
        rate = 0 if math.isinf(feed) else 1 / feed
        inside = (at > start) | (start == 0)
        out[inside] = sum_s + (np.minimum(at[inside], end) - start) * rate
        start, sum_s = end, sum_s + mm * rate
    return out


def path_optimum(topp, stretch, header, joints, period, folder):
    rows, feeds = stretch["rows"], stretch["feeds"]
    keep = moving(rows, joints)
    if not keep:
        return None
    limits = {"joints": [joints[i] for i in keep]}
    table = rows[:, [0] + [1 + i for i in keep] + [rows.shape[1] - 1]].copy()
    if len(feeds) == 1:
        limits["feed"] = min(feeds[0][1], FEED_FREE)
    else:
        table[:, -1] = warped_tip(rows, feeds)
        limits["feed"] = 1.0
    if rows[-1, -1] < 1e-9:  # the tip stands, so that its feed says nothing
        del limits["feed"]
    names = header.split(",")
    columns = ",".join(["s"] + [names[1 + i] for i in keep] + ["tip"])
    np.savetxt(folder / "one.csv", table, delimiter=",", header=columns, comments="", fmt="%.17g")
    (folder / "one.json").write_text(json.dumps(limits))
    call([PYTHON, topp, "path", folder / "one.csv", "--limits", folder / "one.json", "--check-period", period, "--json",
          folder / "out.json"])
    return json.load(open(folder / "out.json"))[0]


def poly_reference(topp, case, folder):
    facts = json.load(open(folder / f"{case}.json"))
    command = [PYTHON, topp, "poly", folder / f"{case}_poly.csv", "--limits", folder / f"{case}.json", "--tol",
               facts["tol"], "--no-relaxed"]
    if facts["kins"] == "trunnion":
        command += ["--tol-rot", facts["tol_rot"], "--kins", "trunnion", "--dy", facts["dy"], "--dz", facts["dz"]]
    found = re.search(r"best reference: (\S+) .*T ([0-9.]+) s", call(command))
    return float(found[2]), found[1]


def judge(binary, topp, name, args, folder):
    """One row of the table: sums over the stretches of a program, the first left out of a case (the way there)."""
    case = name in ALL
    program = case_program(name, folder, args.offset) if case else pathlib.Path(name)
    tools = program.parent / "tools.tbl"
    machine = machine_with_shares(args.machine, args.share, folder)
    report, header, stretches = run_program(binary, program, machine, tools if tools.exists() else None, folder)
    joints = limits_of(report)
    lines = program.read_text().splitlines()
    begins = lines.index("G4 P0.1") + 1 if case and "G4 P0.1" in lines else 0
    ours = lower = feasible = 0.0
    worst, worst_line = 0.0, 0
    for stretch in stretches:
        if stretch["line"] < begins:
            continue
        best = path_optimum(topp, stretch, header, joints, args.check_period, folder)
        if best is None:
            continue
        ours, lower = ours + stretch["time_s"], lower + best["T3_lb"]
        feasible += best["T3_feas"]
        if stretch["time_s"] / best["T3_feas"] > worst:
            worst, worst_line = stretch["time_s"] / best["T3_feas"], stretch["line"]
    poly = poly_reference(topp, name, folder) if case and name not in ("line", "circle") and not args.no_poly else None
    ratios = [j["ratios"] for j in report["joints"]]
    return {"name": program.stem.removesuffix("_ours"), "ours": ours, "lower": lower, "feasible": feasible,
            "ratio": ours / feasible, "worst_stretch": worst, "worst_line": worst_line,
            "poly": poly and ours / poly[0], "poly_kind": poly and poly[1], "plan_stops": report["plan_stops"],
            "limit_ratio": max(max(r.values()) for r in ratios), "planning_s": report["planning_s"],
            "deviation": report["tip_deviation_mm"],
            "blocks_s": report["lines"] / max(report["planning_s"], 1e-9)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trunnion")
    parser.add_argument("names", nargs="*", default=SHORT)
    parser.add_argument("--machine", default=ROOT / "configs/cradle.toml")
    parser.add_argument("--offset", help="of the part, mm, for the cases without rotary words")
    parser.add_argument("--oracle", type=pathlib.Path, default=ROOT / "../shared/oracle")
    parser.add_argument("--share", type=float, help="of acceleration and jerk for the planner")
    parser.add_argument("--check-period", type=float, default=1e-3, help="of the feasible optimum, s")
    parser.add_argument("--limit", type=float, default=1.03, help="of our time over the optimum on our path")
    parser.add_argument("--limit-poly", type=float, default=1.05, help="of our time over the tolerance reference")
    parser.add_argument("--no-poly", action="store_true")
    args = parser.parse_args()
    topp = args.oracle / "topp.py"
    if not topp.exists():
        print(f"no reference at {args.oracle}: skipped")
        return 77
    names = ALL if args.names == ["all"] else args.names
    bad = False
    print("| program | ours s | lower bound s | optimum s | ours/optimum | worst stretch (line) | ours/reference | "
          "plan stops | worst limit ratio | tip off, mm | planning s | blocks/s |\n" + "|---" * 12 + "|")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        cases = [n for n in names if n in ALL]
        if cases:
            call([PYTHON, args.oracle / "cases/gen.py", *cases, "--out", folder])
        for name in names:
            r = judge(pathlib.Path(args.trunnion).resolve(), topp, name, args, folder)
            poly = f"{r['poly']:.4f} ({r['poly_kind']})" if r["poly"] else "-"
            print(f"| {r['name']} | {r['ours']:.4f} | {r['lower']:.4f} | {r['feasible']:.4f} | {r['ratio']:.4f} | "
                  f"{r['worst_stretch']:.4f} ({r['worst_line']}) | {poly} | {r['plan_stops']} | "
                  f"{r['limit_ratio']:.6f} | {r['deviation']:.4f} | {r['planning_s']:.3f} | "
                  f"{r['blocks_s']:.0f} |", flush=True)
            bad |= r["ratio"] > args.limit or (r["poly"] or 0) > args.limit_poly or r["plan_stops"] > 0
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
