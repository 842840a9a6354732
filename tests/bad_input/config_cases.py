"""Damaged machine configs, each with the exact first line of the message it gets.

A case is the cradle's config with `old` replaced by `new` once, or `text` (str or bytes) instead of it; `message`
has {file} for the config's path, and may end in * for what varies.
"""
from dataclasses import dataclass


@dataclass
class Config:
    name: str
    old: str = None
    new: str = None
    text: object = None
    message: str = None
    command: str = "interpret"


CONFIGS = [
    Config("missing_file",
            message="{file}:1:1: cannot read this file: No such file or directory"),
    Config("empty", text="",
            message="{file}:1:1: missing key 'machine'"),
    Config("not_toml", text="<machine name='cradle'/>\n",
            message="{file}:1:1: Error while parsing root table: expected keys, tables, whitespace or "
                    "comments, saw '<'"),
    Config("noise", text=bytes(range(128, 256)) * 8,
            message="{file}:1:1: the byte 0x80 is no UTF-8; save the file as UTF-8"),
    Config("comma_in_number", "period_s = 0.001", "period_s = 0,001",
            message="{file}:6:13: 'period_s': '0,001' is no number; write 0.001, with a point"),
    Config("text_without_quotes", 'type = "linear"', "type = linear",
            message='{file}:11:8: a text stands in straight quotes: type = "linear"'),
    Config("other_unit", "max_mm", "max_inch",
            message="{file}:13:1: unknown key 'joint[0].max_inch'; did you mean 'max_mm'?"),
    Config("table_not_closed", "[machine]", "[machine",
            message="{file}:4:9: a table is named in [ ], one of a list in [[ ]]: [machine] or [[machine]]"),
    Config("name_missing", 'name = "cradle"\n', "",
            message="{file}:4:1: missing key 'machine.name'"),
    Config("key_misspelt", "period_s", "periode_s",
            message="{file}:6:1: unknown key 'machine.periode_s'; did you mean 'period_s'?"),
    Config("section_misspelt", "[machine]", "[machin]",
            message="{file}:4:2: unknown key 'machin'; did you mean 'machine'?"),
    Config("unknown_section", "[machine]", "[coolant]\nflow = 1\n[machine]", command="run",
            message="{file}:4:2: unknown key 'coolant'*"),
    Config("wrong_type", "period_s = 0.001", 'period_s = "1 ms"',
            message="{file}:6:12: 'machine.period_s' must be a number, without quotes and without a unit"),
    Config("period_out_of_range", "period_s = 0.001", "period_s = 1.0",
            message="{file}:6:12: 'machine.period_s' = 1 is out of range: 1e-05 to 0.1 is legal"),
    Config("not_a_number", "period_s = 0.001", "period_s = nan",
            message="{file}:6:12: 'machine.period_s' = nan is out of range: 1e-05 to 0.1 is legal"),
    Config("limits_swapped", "min_mm = -400.0", "min_mm = 500.0",
            message="{file}:13:10: the upper limit must lie above the lower limit"),
    Config("velocity_negative", "velocity_mm_s = 500.0", "velocity_mm_s = -500.0",
            message="{file}:14:17: 'joint[0].velocity_mm_s' = -500 is out of range: above 0 is "
                    "legal"),
    Config("jerk_zero", "jerk_mm_s3 = 100000.0", "jerk_mm_s3 = 0.0",
            message="{file}:16:14: 'joint[0].jerk_mm_s3' = 0 is out of range: above 0 is legal"),
    Config("unit_wrong", "velocity_deg_s = 120.0", "velocity_mm_s = 120.0",
            message="{file}:41:1: unknown key 'joint[3].velocity_mm_s'; did you mean 'velocity_deg_s'?"),
    Config("joint_type_unknown", 'type = "linear"', 'type = "liner"',
            message='{file}:11:8: \'joint[0].type\' = "liner" is not legal; did you mean "linear"? Legal: '
                    'linear, rotary'),
    Config("joint_twice", 'name = "Y"', 'name = "X"',
            message="{file}:19:8: two joints are named 'X'"),
    Config("key_twice", "min_mm = -400.0", "min_mm = -400.0\nmin_mm = -300.0",
            message="{file}:13:10: 'min_mm' is there already, further up in this table"),
    Config("kinematics_unknown", 'type = "serial"', 'type = "serail"',
            message='{file}:57:8: \'kinematics.type\' = "serail" is not legal; did you mean "serial"? Legal: serial, '
                    "hexapod, rail_mill"),
    Config("branch_joint_unknown", 'joint = "X"', 'joint = "U"',
            message='{file}:60:9: \'kinematics.tool_branch[0].joint\' = "U" is not legal; did you mean "X"? '
                    'Legal: X, Y, '
                    "Z, A, C"),
    Config("branch_joint_twice", 'joint = "X"', 'joint = "Y"',
            message="{file}:64:9: this joint is already in a branch"),
    Config("sense_of_two", 'joint = "Y"', 'joint = "Y"\nsense = 2',
            message="{file}:65:9: sense is 1 or -1, not 2"),
    Config("direction_short", "direction = [0.0, 1.0, 0.0]", "direction = [0.0, 1.0]",
            message="{file}:65:13: 'kinematics.tool_branch[1].direction' must have three numbers"),
    Config("direction_zero", "direction = [0.0, 1.0, 0.0]", "direction = [0.0, 0.0, 0.0]",
            message="{file}:65:13: a direction must not be zero"),
    Config("path_mode_unknown", 'path_mode = "G64"', 'path_mode = "G65"',
            message='{file}:82:13: \'program.path_mode\' = "G65" is not legal; did you mean "G61"? Legal: G61, '
                    'G61.1, G64'),
    Config("tolerance_negative", "tolerance_deg = 0.05", "tolerance_deg = -0.05",
            message="{file}:84:17: 'program.tolerance_deg' = -0.05 is out of range: above 0 is "
                    "legal"),
    Config("rtcp_word_no_word", '"M428", ', '"4711", ',
            message="{file}:85:11: '4711' is no word: M and a number, or at least two letters"),
    Config("drives_unknown", 'type = "simulated"', 'type = "simulted"', command="run",
            message="{file}:92:8: 'drives.type' = \"simulted\" is not legal; did you mean \"simulated\"? Legal: *"),
]
