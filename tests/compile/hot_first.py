#!/usr/bin/env python3
"""Whether programs run the tick's own code: hot_first.py CMAKELISTS BUILD PROGRAM...

Functions of templates are compiled in every part that uses them, and the linker keeps one. The parts around the tick
are compiled with less optimisation. So each function that a program shares with the parts of the tick must have the
size that it has there. Ends with 1 where one has not.
"""
import re
import subprocess
import sys
from pathlib import Path

FUNCTION = re.compile(r"^[0-9a-f]+ ([0-9a-f]+) [TtWw] (\S+)$", re.M)


def sizes(*files):
    """{function: sizes}, by the linker's names."""
    listed = subprocess.run(["nm", "-S", *map(str, files)], capture_output=True, text=True, check=True).stdout
    out = {}
    for size, name in FUNCTION.findall(listed):
        out.setdefault(name, set()).add(int(size, 16))
    return out


def main():
    build = Path(sys.argv[2])
    parts = re.search(r"foreach\(part (trn_rate [^)]*)\)", Path(sys.argv[1]).read_text(encoding="utf-8")).group(1)
    hot = sizes(*(build / f"lib{part}.a" for part in parts.split()))
    code = 0
    for program in sys.argv[3:]:
        shared = {name: found for name, found in sizes(build / program).items() if name in hot and len(found) == 1}
        wrong = sorted(name for name, found in shared.items() if not found & hot[name])
        print(f"{program}: {len(shared)} functions shared with the parts of the tick, {len(wrong)} from elsewhere")
        if wrong:
            names = subprocess.run(["c++filt", *wrong[:10]], capture_output=True, text=True, check=True).stdout
            print("".join(f"  {line[:150]}\n" for line in names.splitlines()), end="")
        if wrong or len(shared) < 1000:
            code = 1
    return code


sys.exit(main())
