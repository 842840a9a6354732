"""Damaged machine configs, each with the exact first line of the message it gets.

A case is the cradle's config with `old` replaced by `new` once, or `text` (str or bytes) instead of it; `message`
has {file} for the config's path.
"""
from dataclasses import dataclass


@dataclass
class Config:
    name: str
    old: str = None
    new: str = None
    text: object = None
    message: str = None


CONFIGS = [
    Config("missing_file"),
    Config("empty", text=""),
    Config("not_toml", text="<machine name='cradle'/>\n"),
    Config("noise", text=bytes(range(128, 256)) * 8),
    Config("table_not_closed", "[machine]", "[machine"),
    Config("name_missing", 'name = "cradle"\n', ""),
    Config("key_misspelt", "period_s", "periode_s"),
    Config("section_misspelt", "[machine]", "[machin]"),
    Config("unknown_section", "[machine]", "[coolant]\nflow = 1\n[machine]"),
    Config("wrong_type", "period_s = 0.001", 'period_s = "1 ms"'),
    Config("period_out_of_range", "period_s = 0.001", "period_s = 1.0"),
    Config("not_a_number", "period_s = 0.001", "period_s = nan"),
    Config("limits_swapped", "min_mm = -400.0", "min_mm = 500.0"),
    Config("velocity_negative", "velocity_mm_s = 500.0", "velocity_mm_s = -500.0"),
    Config("jerk_zero", "jerk_mm_s3 = 100000.0", "jerk_mm_s3 = 0.0"),
    Config("unit_wrong", "velocity_deg_s = 120.0", "velocity_mm_s = 120.0"),
    Config("joint_type_unknown", 'type = "linear"', 'type = "liner"'),
    Config("joint_twice", 'name = "Y"', 'name = "X"'),
    Config("key_twice", "min_mm = -400.0", "min_mm = -400.0\nmin_mm = -300.0"),
    Config("kinematics_unknown", 'type = "serial"', 'type = "serail"'),
    Config("branch_joint_unknown", 'joint = "X"', 'joint = "U"'),
    Config("branch_joint_twice", 'joint = "X"', 'joint = "Y"'),
    Config("direction_short", "direction = [0.0, 1.0, 0.0]", "direction = [0.0, 1.0]"),
    Config("direction_zero", "direction = [0.0, 1.0, 0.0]", "direction = [0.0, 0.0, 0.0]"),
    Config("path_mode_unknown", 'path_mode = "G64"', 'path_mode = "G65"'),
    Config("tolerance_negative", "tolerance_deg = 0.05", "tolerance_deg = -0.05"),
    Config("rtcp_word_no_word", '"M428", ', '"4711", '),
    Config("drives_unknown", 'type = "simulated"', 'type = "simulted"'),
]
