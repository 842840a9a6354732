#!/usr/bin/python3
"""cam/trunnion.cps on small jobs, in node with a stand-in for the post-processor: the tool must come to every place.

    tests/cam/fusion_post.py TRUNNION SOURCE        exit code 77 (skipped) without node
"""
import json
import os
import shutil
import subprocess
import sys
import tempfile

from cam_judge import judge


def main():
    binary, source = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    node = shutil.which("node")
    if not node:
        print("skipped: there is no node (apt-get install nodejs)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        for name in ("configs", "examples"):
            os.symlink(os.path.join(source, name), os.path.join(folder, name))
        out = os.path.join(folder, "out")
        os.mkdir(out)
        command = [node, *(os.path.join(source, name) for name in ("tests/cam/run_cps.js", "cam/trunnion.cps")), out]
        job = subprocess.run(command, capture_output=True, text=True, timeout=60)
        if "jobs posted" not in job.stdout:
            print(job.stdout, job.stderr)
            return 1
        errors = []
        for name in sorted(name for name in os.listdir(out) if name.endswith(".json")):
            with open(os.path.join(out, name), encoding="ascii") as file:
                expected = json.load(file)
            count, found = judge(binary, source, os.path.join(out, name.replace(".json", ".ngc")), expected)
            print(f"{name.removesuffix('.json')}: {count} places")
            errors += [f"{name}: {error}" for error in found] + ([] if count or found else [f"{name}: no places"])
        print("\n".join(errors))
        if errors and os.environ.get("TRN_KEEP"):
            shutil.copytree(out, os.environ["TRN_KEEP"], dirs_exist_ok=True)
        return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
