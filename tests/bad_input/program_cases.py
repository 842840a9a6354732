"""Damaged programs, each with the exact first line of the message it gets.

`text` is the program (str or bytes), a function that yields its bytes piece by piece for one too large to keep,
or None for a path that is no file. `message` has {file} for the program's path, and may end in * for what varies;
None: the program runs to its end.
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
    Program("missing_file", None,
            message="cannot read '{file}': No such file or directory; legal: a readable file"),
    Program("empty", "",
            message="{file}:1:1: the file ends without M2, M30 or a closing %; legal: end the program with M2 or M30"),
    Program("noise", noise(100_000),
            message="{file}:1:71: byte 0x00 is not text; legal: a program is plain text: UTF-8, ASCII, or Windows-1252 "
                    "in comments"),
    Program("zeros", bytes(4096),
            message="{file}:1:1: byte 0x00 is not text; legal: a program is plain text: UTF-8, ASCII, or Windows-1252 "
                    "in comments"),
    Program("utf16_le", "G0 X1\nM2\n".encode("utf-16"),
            message="{file}:1:1: the file is UTF-16LE text; legal: save it as UTF-8 or ASCII"),
    Program("utf16_be", b"\xfe\xff" + "G0 X1\nM2\n".encode("utf-16-be"),
            message="{file}:1:1: the file is UTF-16BE text; legal: save it as UTF-8 or ASCII"),
    Program("mac_line_ends", b"%\rG21\rG0 X1\rM2\r",
            message="{file}:1:2: the lines end with CR alone, as on an old Mac; legal: LF or CR LF, which tr '\\r' "
                    "'\\n' < OLD > NEW makes of them"),
    Program("text_before_percent", "G21\n%\nG0 X1\nM2\n",
            message="{file}:2:1: '%' begins a program, and there is text before it: '%'; legal: the program's first "
                    "line, with nothing but empty lines before it"),
    Program("line_of_1_mb", "G1 " + "X1 " * 350_000 + "\nM2\n",
            message="{file}:1:1: the line is longer than 65536 bytes; legal: split it, or raise [program] "
                    "line_length_max"),
    Program("comment_of_1_mb", "(" + "a" * 1_000_000 + ")\nM2\n",
            message="{file}:1:1: the line is longer than 65536 bytes; legal: split it, or raise [program] "
                    "line_length_max"),
    Program("block_of_2_gb", lambda: one_block(2 << 30),
            message="{file}:1:1: the line is longer than 65536 bytes; legal: split it, or raise [program] "
                    "line_length_max"),
    # Characters and numbers
    Program("odd_character", START + "G1 X1 ? Y2\nM2\n",
            message="{file}:2:7: unexpected character '?': '?'; legal: a letter with a number, '#', '(', ';' or '/'"),
    Program("umlaut", START + "G1 X1 \u00d6 Y2\nM2\n",
            message="{file}:2:7: unexpected character 0xC3: 'Ö'; legal: a letter with a number, '#', '(', ';' or '/'"),
    Program("terminal_control", START + "G1 X1 \u009b31m Y2\nM2\n",
            message="{file}:2:7: unexpected character 0xC2: '?31m'; legal: a letter with a number, '#', '(', ';' or "
                    "'/'"),
    Program("long_word_of_umlauts", START + "G1 X" + "\u00d6" * 20 + "\nM2\n",
            message="{file}:2:4: no value after X: 'X" + "\u00d6" * 11 + "'; legal: a number, #parameter, [expression] "
                    "or function"),
    Program("two_points", START + "G1 X1.2.3\nM2\n",
            message="{file}:2:5: not a number: '1.2.3'; legal: digits with at most one decimal point, no exponent, "
                    "below 1e15"),
    Program("no_value", START + "G1 X\nM2\n",
            message="{file}:2:4: no value after X: 'X'; legal: a number, #parameter, [expression] or function"),
    Program("no_value_before_word", START + "G1 X Y5\nM2\n",
            message="{file}:2:6: unknown operator or function 'y': 'Y5'; legal: + - * / ** MOD EQ NE GT GE LT LE AND "
                    "OR XOR; ABS ACOS ASIN ATAN COS EXISTS EXP FIX FUP LN ROUND SIN SQRT TAN"),
    Program("open_comment", START + "G1 X1 (to the edge\nM2\n",
            message="{file}:2:7: the comment is not closed: '(to'; legal: ')' on the same line"),
    Program("nested_comment", START + "G1 X1 (to (the) edge)\nM2\n",
            message="{file}:2:11: '(' inside a comment: '(the)'; legal: comments do not nest; use [ ] or ;"),
    Program("line_number", "N99999999999 G0 X1\nM2\n",
            message="{file}:1:1: bad line number 99999999999: 'N99999999999'; legal: N and an integer from 0 to "
                    "999999999, first on the line"),
    Program("unknown_word", START + "SPINDLEON\nM2\n",
            message="{file}:2:1: this is no word of this language: 'SPINDLEON'; legal: a letter with a number, as "
                    "X10; a word that means nothing here may stand in [program] ignored"),
    Program("unknown_g", START + "G12.3 X1\nM2\n",
            message="{file}:2:1: unknown G code G12.3: 'G12.3'; legal: the codes listed in docs/gcode.md; "
                    "[program] ignored passes over others"),
    Program("code_of_another_control", START + "G54.1 P3\nM2\n",
            message="{file}:2:1: G54.1 is a code of other controls; here G54 to G59 and G59.1, G59.2 and G59.3 are the "
                    "work coordinate systems: 'G54.1'; legal: what docs/gcode.md lists"),
    Program("unknown_m", START + "M555\nM2\n",
            message="{file}:2:1: unknown M code M555: 'M555'; legal: the codes listed in docs/gcode.md; "
                    "[[program.m_code]] gives others a meaning, [program] ignored passes over them"),
    Program("two_motions", START + "G0 G1 X1\nM2\n",
            message="{file}:2:4: G0 and G1 are of one modal group: 'G1'; legal: one of them a line"),
    Program("two_planes", "G17 G18\nM2\n",
            message="{file}:1:5: G17 and G18 are of one modal group: 'G18'; legal: one of them a line"),
    Program("two_spindle_codes", "S100 M3 M4\nM2\n",
            message="{file}:1:9: M3 and M4 are of one modal group: 'M4'; legal: one of them a line"),
    Program("word_twice", START + "G1 X1 Y2 X3\nM2\n",
            message="{file}:2:10: the word X is given twice: 'X3'; legal: once a line"),
    Program("no_such_axis", START + "G1 B10\nM2\n",
            message="{file}:2:4: this machine has no B axis: 'B10'; legal: the axes of the config"),
    Program("no_motion_mode", "G80\nX10\nM2\n",
            message="{file}:2:1: axis words without a motion mode: 'X10'; legal: G0, G1, G2, G3 or a cycle before or "
                    "on this line"),
    Program("feed_missing", "G21 G90 G94\nG1 X10\nM2\n",
            message="{file}:2:1: G1 with feed rate 0: 'G1'; legal: an F word before or on this line"),
    Program("feed_negative", START + "G1 X10 F-5\nM2\n",
            message="{file}:2:8: F = -5 is not legal for a feed rate: F of 0 or more: 'F-5'"),
    Program("inverse_feed_missing", START + "G93\nG1 X10\nM2\n",
            message="{file}:3:1: G1 in G93 needs an F word on its own line: 'G1'; legal: F in moves per minute, "
                    "greater than 0"),
    Program("dwell_negative", "G4 P-1\nM2\n",
            message="{file}:1:4: P = -1 is not legal for G4: P of 0 or more seconds: 'P-1'"),
    Program("dwell_without_time", "G4\nM2\n",
            message="{file}:1:1: G4 needs a P word, seconds: 'G4'; legal: add the word"),
    Program("spindle_negative", "S-100 M3\nM2\n",
            message="{file}:1:1: S = -100 is not legal for a spindle speed: S of 0 or more: 'S-100'"),
    Program("two_want_axis_words", START + "G92 G1 X1\nM2\n",
            message="{file}:2:5: G1 and another code of the line both want the axis words: 'G1'; legal: two lines"),
    Program("tool_unknown", "T99 M6\nM2\n",
            message="{file}:1:1: tool 99 is not in *"),
    Program("tool_not_whole", "T1.5 M6\nM2\n",
            message="{file}:1:1: T = 1.5 is not an integer: 'T1.5'; legal: an integer"),
    Program("tolerance_negative", "G64 P-0.1\nM2\n",
            message="{file}:1:5: P = -0.1 is not legal for G64: a tolerance of 0 or more: 'P-0.1'"),
    # Arcs
    Program("arc_radius_too_small", START + "G0 X0 Y0\nG2 X10 Y0 R2\nM2\n",
            message="{file}:3:11: radius 2.0000 cannot span the distance 10.0000 to the end point: 'R2'; legal: a "
                    "radius of at least half the distance"),
    Program("arc_ends_differ", START + "G0 X0 Y0\nG2 X10 Y0 I3 J0\nM2\n",
            message="{file}:3:1: the arc's end misses its circle by 4.0000 (radius 3.0000 at the start, 7.0000 at the "
                    "end): 'G2'; legal: a gap of at most [program] arc_tolerance_mm"),
    Program("arc_by_radius_to_itself", START + "G0 X0 Y0\nG2 X0 Y0 R5\nM2\n",
            message="{file}:3:10: an arc by R that ends where it starts has no centre: 'R5'; legal: I, J or K for a "
                    "full circle"),
    Program("arc_without_centre", START + "G0 X0 Y0\nG3 X10 Y10\nM2\n",
            message="{file}:3:1: the arc in plane G17 has neither R nor I nor J: 'G3'; legal: centre words or R"),
    Program("arc_centre_of_other_plane", START + "G17\nG2 X10 Y0 K5\nM2\n",
            message="{file}:3:11: K is not possible in plane G17: use I and J: 'K5'"),
    # Cycles
    Program("cycle_without_r", START + "G81 X1 Y1 Z-5\nM2\n",
            message="{file}:2:1: G81 needs a word R: 'G81'; legal: add the word"),
    Program("cycle_above_r", START + "G81 X1 Y1 Z5 R2\nM2\n",
            message="{file}:2:1: G81: R 2.0000 lies below the bottom 5.0000: R above the bottom: 'G81'"),
    Program("pecks_without_q", START + "G83 X1 Y1 Z-5 R2\nM2\n",
            message="{file}:2:1: G83 needs a word Q: 'G83'; legal: add the word"),
    # Parameters and expressions
    Program("bracket_missing", START + "G1 X[1 + 2\nM2\n",
            message="{file}:2:11: missing ']'; legal: brackets come in pairs"),
    Program("unknown_function", START + "G1 X[SINE[30]]\nM2\n",
            message="{file}:2:9: missing '[': 'E[30]]'; legal: brackets come in pairs"),
    Program("divide_by_zero", START + "#1 = 0\nG1 X[1 / #1]\nM2\n",
            message="{file}:3:8: division by zero: '/'; legal: a divisor other than 0"),
    Program("root_of_negative", START + "G1 X[SQRT[0 - 4]]\nM2\n",
            message="{file}:2:6: SQRT of -4 is not defined: 'SQRT[0'; legal: an argument inside the function's range"),
    Program("unknown_parameter", START + "G1 X#<width>\nM2\n",
            message="{file}:2:5: parameter #<width> has no value yet: '#<width>'; legal: assign it first, or ask "
                    "EXISTS[#<name>]"),
    Program("parameter_number_too_large", START + "#9999 = 3\nM2\n",
            message="{file}:2:2: there is no parameter number 9999: '9999'; legal: an integer from 1 to 5601"),
    Program("parameter_not_whole", START + "#[1.5] = 3\nM2\n",
            message="{file}:2:1: the parameter number = 1.5 is not an integer: '#[1.5]'; legal: an integer"),
    Program("nested_too_deep", START + "G1 X" + "[" * 5000 + "1" + "]" * 5000 + "\nM2\n",
            message="{file}:2:55: the expression is nested more than 100 deep: '[[[[[[[[[[[[[[[[[[[[[[[['; legal: "
                    "split it over several parameters"),
    # Flow
    Program("sub_missing", START + "o100 call\nM2\n",
            message="{file}:2:1: there is no sub-program o100: 'o100'; legal: define it in the file, or as a file on "
                    "the sub-program path"),
    Program("sub_not_closed", "o100 sub\nG0 X1\nM2\n",
            message="{file}:4:1: no endsub for o100 of line 1; legal: close it in the same file"),
    Program("recursion", "o100 sub\no100 call\no100 endsub\no100 call\nM2\n",
            message="{file}:2:1: sub-programs nested more than 50 deep: 'o100'; legal: no endless recursion"),
    Program("if_without_condition", "o1 if\no1 endif\nM2\n",
            message="{file}:1:6: bad O-word: no condition: [expression]"),
    # The machine
    Program("out_of_range", "G21 G90\nG53 G0 X1000\nM2\n", "{file}:2:8: joint X would go to 1000.0000 mm, *", "run"),
    Program("out_of_range_in_interpret", "G21 G90\nG53 G0 X1000\nM2\n",
            "{file}:2:8: joint X would go to 1000.0000 mm, *"),
    Program("second_axis_out_of_range", "G21 G90\nN5 G0 X1 (far) Z-5000 Y2\nM2\n",
            "{file}:2:16: joint Z would go to -5000.0000 mm, *"),
    Program("rtcp_out_of_range_in_interpret", START + "M428\nG1 X390 Y390 A90 C45\nM2\n", "{file}:3:4: *"),
    Program("program_runs_on_into_the_next", "O1\nG0 X1\nO100\nG0 X2\nM99\n",
            "{file}:3:1: another program begins here, and the one before it has not ended: 'O100'; legal: M30 or M99 "
            "at the end of every program"),
    Program("other_language", "G21\nIF [#1 EQ 1] GOTO 5\nM2\n",
            "{file}:2:1: IF and THEN are other controls' words: 'IF'; legal: o100 if [#1 eq 2], o100 else and o100 "
            "endif, each on a line of its own"),
    Program("arc_leaves_range", START + "G0 X390 Y0\nG2 X390 Y0 I-5 J300\nM2\n", "{file}:3:*", "run"),
    Program("tolerance_too_large", "G64 P5\nG1 X1 F100\nM2\n",
            "{file}:2:4: the path tolerance of 5 mm is larger than the machine's tolerance_mm_max of 1 mm; "
            "give G64 a smaller P",
            "run"),
    Program("rtcp_out_of_range", START + "M428\nG1 X390 Y390 A90 C45\nM2\n", "{file}:3:*", "run"),
]
