#!/usr/bin/python3
"""cam/trunnion_post.py on small jobs of the real FreeCAD, without a screen: the tool must come to every place.

    tests/cam/freecad_post.py TRUNNION SOURCE        exit code 77 (skipped) without Debian's freecad
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
    freecad = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
    if not freecad:
        print("skipped: there is no freecadcmd (apt-get install freecad)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        for name in ("configs", "examples"):
            os.symlink(os.path.join(source, name), os.path.join(folder, name))
        out = os.path.join(folder, "out")
        os.mkdir(out)
        environment = dict(os.environ, TRN_POST=os.path.join(source, "cam"), TRN_OUT=out, HOME=folder,
                           PYTHONDONTWRITEBYTECODE="1", QT_QPA_PLATFORM="offscreen")
        job = subprocess.run([freecad, os.path.join(source, "tests/cam/freecad_job.py")], env=environment, text=True,
                             capture_output=True, stdin=subprocess.DEVNULL, timeout=300)
        if "jobs posted" not in job.stdout:
            print(job.stdout[-3000:], job.stderr[-3000:])
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
