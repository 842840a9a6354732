#!/usr/bin/python3
"""Optimal times of exported joint paths, by an independent solver.

usage: speed_reference.py SOLVER.py FOLDER

FOLDER holds NAME.csv and NAME.json as written by `TRN_EXPORT=FOLDER test_app_session
--gtest_filter='StretchExport.Writes*'`. SOLVER.py is a stand-alone program called as
`SOLVER.py path NAME.csv --limits NAME.json --json RESULT.json`; its result holds the certified lower bound
`T3_lb` and a feasible optimum `T3_feas`, in seconds.
"""
import json
import pathlib
import subprocess
import sys
import tempfile


def main():
    solver, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    for csv in sorted(folder.glob("*.csv")):
        with tempfile.NamedTemporaryFile(suffix=".json") as result:
            command = ["/usr/bin/python3", solver, "path", csv, "--limits", csv.with_suffix(".json"),
                       "--json", result.name]
            subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL)
            times = json.load(open(result.name))[0]
        print(f"{csv.stem:16s} lower bound {times['T3_lb']:.5f}  feasible optimum {times['T3_feas']:.5f}", flush=True)


if __name__ == "__main__":
    main()
