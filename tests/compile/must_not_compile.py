#!/usr/bin/python3
"""Checks that the compiler refuses what the types are there to refuse.

    must_not_compile.py COMPILE_COMMANDS

Each case has a body that compiles and a twin that must not, with the one difference that the type forbids. Compiler
and flags are those of a source of the build. Exit code 1 where a body does not compile, or a twin does.
"""
import json
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass

FLAGS_OF = "trn_gcode.dir"
HEADERS = ("core/ports.h", "interp/gcode/canon.h", "interp/gcode/interpreter.h", "interp/gcode/text/block.h",
           "interp/gcode/work_frame.h")

# An error at the case's own place, or in a constant expression that begins there.
REFUSAL = r"^case_(\d+):\d+:\d+: +(?:error: |in .constexpr. expansion)"


@dataclass
class Case:
    """`good` compiles, `bad` does not; both stand in a function with the parameters `given`."""
    name: str
    given: str
    good: str
    bad: str


CASES = [
    Case("a number is no G code", "", "GCode code = 61_g; static_cast<void>(code);",
         "GCode code = 61; static_cast<void>(code);"),
    Case("a G code is not compared with a number", "GCode motion", "static_cast<void>(motion == 80_g);",
         "static_cast<void>(motion == 800);"),
    Case("a G code is no number", "GCode motion", "int number = tenths(motion); static_cast<void>(number);",
         "int number = motion; static_cast<void>(number);"),
    Case("a G code has one decimal at most", "", "static_cast<void>(38.2_g);", "static_cast<void>(38.25_g);"),
    Case("an M code is no G code", "const Block& b", "static_cast<void>(b.code(GGroup::kMotion) == 1_g);",
         "static_cast<void>(b.code(MGroup::kStop) == 1_g);"),
    Case("a canonical probe move takes a G code", "const ProgramWords& to",
         "static_cast<void>(canon::StraightProbe{to, 38.3_g});", "static_cast<void>(canon::StraightProbe{to, 383});"),
    Case("words of the program are not in mm", "const ProgramWords& words, const WorkFrame& frame",
         "static_cast<void>(frame.to_machine(in_mm(words, true)));", "static_cast<void>(frame.to_machine(words));"),
    Case("inch and mm are not added", "const ProgramWords& words, const MmWords& offset",
         "static_cast<void>(in_mm(words, true) + offset);", "static_cast<void>(words + offset);"),
    Case("words of the tool table are not the program's", "const TableWords& table, ProgramWords& words",
         "words = in_program_units(in_mm(table, 25.4), true);", "words = table;"),
    Case("degrees are not radians", "const MmWords& words, const Kinematics& kinematics, JointVec& q",
         "static_cast<void>(kinematics.joints_from_words(in_radians(words), q));",
         "static_cast<void>(kinematics.joints_from_words(words, q));"),
    Case("radians are not degrees", "const Words& y, MmWords& words", "words = in_degrees<MmWords>(y);", "words = y;"),
    Case("a place of the program is none of the machine", "const MmWords& place, const WorkFrame& frame",
         "static_cast<void>(frame.to_machine(place));", "static_cast<void>(frame.to_program(place));"),
    Case("a place of the machine is none of the program", "const MachineWords& place, const WorkFrame& frame",
         "static_cast<void>(frame.to_program(place));", "static_cast<void>(frame.to_machine(place));"),
    Case("the work frame alone carries a place from one to the other",
         "const MachineWords& place, const WorkFrame& frame, MmWords& to", "to = frame.to_program(place);",
         "to = place;"),
    Case("a program begins where the machine stands, in its own coordinates",
         "Interpreter& interpreter, const MmWords& place, const WorkFrame& frame",
         'interpreter.open("p.ngc", frame.to_machine(place));', 'interpreter.open("p.ngc", place);'),
    Case("words of the program are not the machine's", "const MachineWords& place, const WorkFrame& frame",
         "static_cast<void>(in_program_units(frame.to_program(place), true));",
         "static_cast<void>(in_program_units(place, true));"),
    Case("an offset moves a place of the machine, another place does not",
         "const MachineWords& place, const MachineWords& other, const MmWords& offset",
         "static_cast<void>(place + offset); static_cast<void>(other);", "static_cast<void>(place + other);"),
    Case("mm and rad become places of the frame that is named", "const Words& y, MachineWords& place",
         "place = in_degrees<MachineWords>(y);", "place = in_degrees<MmWords>(y);"),
    Case("only mm become mm and rad", "const ProgramWords& words",
         "static_cast<void>(in_radians(in_mm(words, true)));", "static_cast<void>(in_radians(words));"),
    Case("what the tick calls is noexcept in every class", "",
         "struct Map : JointMap { KinStatus map(const Words&, const MapContext&, JointVec&) const TRN_RT override "
         "{ return KinStatus::kOk; } };",
         "struct Map : JointMap { KinStatus map(const Words&, const MapContext&, JointVec&) const override "
         "{ return KinStatus::kOk; } };"),
]


def source_of(bodies):
    """A source with a function for each pair of parameters and statements; the compiler takes it for file case_N."""
    includes = "".join(f'#include "{header}"\n' for header in HEADERS)
    functions = "".join(f'#line 1 "case_{i}"\n[[maybe_unused]] void case_{i}({given}) {{ {body} }}\n'
                        for i, (given, body) in enumerate(bodies))
    return f"{includes}namespace trn {{\nnamespace {{\n{functions}}}\n}}\n"


def compiler_command(path):
    """A command that compiles for the target FLAGS_OF, told to look at a source on its input instead."""
    with open(path, encoding="utf-8") as file:
        entry = next(entry for entry in json.load(file)
                     if FLAGS_OF in entry["command"] and "cmake_pch" not in entry["file"])
    words = shlex.split(entry["command"])
    start = next(i for i, word in enumerate(words) if word.endswith(("++", "g++", "clang++")))
    kept = [words[start]]
    arguments = iter(words[start + 1:])
    for word in arguments:
        if word in ("-isystem", "-I"):
            kept += [word, next(arguments)]
        elif word.startswith(("-I", "-D", "-std", "-W")) and word not in ("-Winvalid-pch", "-Werror"):
            kept.append(word)
    return kept + ["-Wno-unused-parameter", "-fsyntax-only", "-x", "c++", "-"], entry["directory"]


def main():
    command, folder = compiler_command(sys.argv[1])

    def messages(bodies):
        return subprocess.run(command, cwd=folder, input=source_of(bodies), capture_output=True, text=True).stderr

    errors = []
    good = messages([(case.given, case.good) for case in CASES])
    if "error: " in good:
        errors.append(f"what is legal does not compile:\n{good}")
    bad = messages([(case.given, case.bad) for case in CASES])
    refused = {int(number) for number in re.findall(REFUSAL, bad, re.MULTILINE)}
    errors += [f"compiles, and should not: {case.name}: {case.bad}"
               for i, case in enumerate(CASES) if i not in refused]
    print("\n".join(errors))
    print(f"{len(CASES)} cases, {len(errors)} errors")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
