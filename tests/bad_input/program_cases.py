"""Damaged programs, each with the exact first line of the message it gets.

`text` is the program (str or bytes), a function that yields its bytes piece by piece for one too large to keep,
or None for a path that is no file. `message` has {file} for the program's path; None: it runs to the end.
"""
import random
from dataclasses import dataclass


@dataclass
class Program:
    name: str
    text: object
    message: str = None
    command: str = "interpret"


def noise(size):
    return random.Random(7).randbytes(size)


def one_block(size):
    """Pieces of one endless block."""
    piece = b"X1.5 " * 13107
    for _ in range(size // len(piece)):
        yield piece


def many_lines(count):
    yield b"G21 G90 G94 F1000\n"
    piece = b"".join(b"G1 X%d Y%d Z0.5 (a line)\n" % (i % 40, i % 23) for i in range(2000))
    for _ in range(count // 2000):
        yield piece
    yield b"M2\n"


START = "G21 G90 G17 G94 F1000\n"

PROGRAMS = [
    # Read as they are
    Program("crlf", "G21 G90\r\nG0 X1\r\nM2\r\n"),
    Program("utf8_mark", b"\xef\xbb\xbfG21 G90\nG0 X1\nM2\n"),
    Program("no_last_line_end", "G21\nG0 X1\nM2"),
    Program("latin1_comment", b"(Fr\xe4ser)\nG0 X1\nM2\n"),
    Program("many_lines_bounded_memory", lambda: many_lines(400_000)),
    # The file itself
    Program("missing_file", None),
    Program("empty", ""),
    Program("noise", noise(100_000)),
    Program("zeros", bytes(4096)),
    Program("utf16_le", "G0 X1\nM2\n".encode("utf-16")),
    Program("utf16_be", b"\xfe\xff" + "G0 X1\nM2\n".encode("utf-16-be")),
    Program("line_of_1_mb", "G1 " + "X1 " * 350_000 + "\nM2\n"),
    Program("comment_of_1_mb", "(" + "a" * 1_000_000 + ")\nM2\n"),
    Program("block_of_2_gb", lambda: one_block(2 << 30)),
    Program("no_program_end", "G21\nG0 X1\n"),
    # Characters and numbers
    Program("odd_character", START + "G1 X1 ? Y2\nM2\n"),
    Program("umlaut", START + "G1 X1 \u00d6 Y2\nM2\n"),
    Program("two_points", START + "G1 X1.2.3\nM2\n"),
    Program("no_value", START + "G1 X\nM2\n"),
    Program("no_value_before_word", START + "G1 X Y5\nM2\n"),
    Program("huge_number", START + "G1 X" + "9" * 400 + "\nM2\n"),
    Program("open_comment", START + "G1 X1 (to the edge\nM2\n"),
    Program("nested_comment", START + "G1 X1 (to (the) edge)\nM2\n"),
    Program("line_number", "N99999999999 G0 X1\nM2\n"),
    Program("unknown_word", START + "SPINDLEON\nM2\n"),
    # Codes and words
    Program("unknown_g", START + "G12.3 X1\nM2\n"),
    Program("unknown_m", START + "M555\nM2\n"),
    Program("two_motions", START + "G0 G1 X1\nM2\n"),
    Program("two_planes", "G17 G18\nM2\n"),
    Program("two_spindle_codes", "S100 M3 M4\nM2\n"),
    Program("word_twice", START + "G1 X1 Y2 X3\nM2\n"),
    Program("no_such_axis", START + "G1 B10\nM2\n"),
    Program("no_motion_mode", "G80\nX10\nM2\n"),
    Program("feed_missing", "G21 G90 G94\nG1 X10\nM2\n"),
    Program("feed_negative", START + "G1 X10 F-5\nM2\n"),
    Program("inverse_feed_missing", START + "G93\nG1 X10\nM2\n"),
    Program("dwell_negative", "G4 P-1\nM2\n"),
    Program("dwell_without_time", "G4\nM2\n"),
    Program("spindle_negative", "S-100 M3\nM2\n"),
    Program("two_want_axis_words", START + "G92 G1 X1\nM2\n"),
    Program("tool_unknown", "T99 M6\nM2\n"),
    Program("tool_not_whole", "T1.5 M6\nM2\n"),
    Program("tolerance_negative", "G64 P-0.1\nM2\n"),
    # Arcs
    Program("arc_radius_too_small", START + "G0 X0 Y0\nG2 X10 Y0 R2\nM2\n"),
    Program("arc_ends_differ", START + "G0 X0 Y0\nG2 X10 Y0 I3 J0\nM2\n"),
    Program("arc_by_radius_to_itself", START + "G0 X0 Y0\nG2 X0 Y0 R5\nM2\n"),
    Program("arc_without_centre", START + "G0 X0 Y0\nG3 X10 Y10\nM2\n"),
    Program("arc_centre_of_other_plane", START + "G17\nG2 X10 Y0 K5\nM2\n"),
    # Cycles
    Program("cycle_without_r", START + "G81 X1 Y1 Z-5\nM2\n"),
    Program("cycle_above_r", START + "G81 X1 Y1 Z5 R2\nM2\n"),
    Program("pecks_without_q", START + "G83 X1 Y1 Z-5 R2\nM2\n"),
    # Parameters and expressions
    Program("bracket_missing", START + "G1 X[1 + 2\nM2\n"),
    Program("unknown_function", START + "G1 X[SINE[30]]\nM2\n"),
    Program("divide_by_zero", START + "#1 = 0\nG1 X[1 / #1]\nM2\n"),
    Program("root_of_negative", START + "G1 X[SQRT[0 - 4]]\nM2\n"),
    Program("unknown_parameter", START + "G1 X#<width>\nM2\n"),
    Program("parameter_number_too_large", START + "#9999 = 3\nM2\n"),
    Program("parameter_not_whole", START + "#[1.5] = 3\nM2\n"),
    Program("nested_too_deep", START + "G1 X" + "[" * 5000 + "1" + "]" * 5000 + "\nM2\n"),
    # Flow
    Program("sub_missing", START + "o100 call\nM2\n"),
    Program("sub_not_closed", "o100 sub\nG0 X1\nM2\n"),
    Program("recursion", "o100 sub\no100 call\no100 endsub\no100 call\nM2\n"),
    Program("endif_alone", "o1 endif\nM2\n"),
    Program("if_without_condition", "o1 if\no1 endif\nM2\n"),
    Program("while_not_closed", "#1 = 1\no1 while [#1 GT 0]\nM2\n"),
    # The machine
    Program("out_of_range", "G21 G90\nG53 G0 X1000\nM2\n", command="run"),
    Program("arc_leaves_range", START + "G0 X390 Y0\nG2 X390 Y0 I-5 J300\nM2\n", command="run"),
    Program("tolerance_too_large", "G64 P5\nG1 X1 F100\nM2\n", command="run"),
    Program("rtcp_out_of_range", START + "M428\nG1 X390 Y390 A90 C45\nM2\n", command="run"),
]
