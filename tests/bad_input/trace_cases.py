"""Damaged setpoint traces, each with the exact first line of the message `check-trace` gives."""
from dataclasses import dataclass

HEADER = "t_s,X,Y,Z,A,C,p_x,p_y,p_z,u_i,u_j,u_k,line\n"
REST = ",0,0,0,0,0,0,0,0,0,0,1,1\n"


@dataclass
class Trace:
    name: str
    text: object
    message: str = None


TRACES = [
    Trace("good", HEADER + "0" + REST + "0.001" + REST),
    Trace("missing", None, "{file}:1:1: cannot read this file: No such file or directory"),
    Trace("empty", "", "{file}:1:1: the trace is empty; a header row is expected"),
    Trace("header_only", HEADER, "{file}:1:1: the trace has a header but no rows"),
    Trace("joint_missing", HEADER.replace(",C,", ",B,") + "0" + REST,
          "{file}:1:1: no column for joint 'C'; the header must name it"),
    Trace("row_short", HEADER + "0" + REST + "0.001,0,0\n",
          "{file}:3:9: this row does not have the 13 fields of the header"),
    Trace("not_a_number", HEADER + "0" + REST.replace(",0,", ",zero,", 1),
          "{file}:2:3: 'zero' is not a finite number"),
    Trace("row_missing", HEADER + "".join(f"{t}{REST}" for t in ("0", "0.001", "0.003")),
          "{file}:4:1: rows are missing or out of order: 0.003 s follows 0.001 s, the step is 0.001 s"),
    Trace("cut_off", HEADER + "0" + REST + "0.001,0,0,0",
          "{file}:3:1: the trace was cut off here: this row has no line end"),
    Trace("too_coarse", HEADER + "0" + REST + "0.01" + REST,
          "{file}:3:1: rows are 0.01 s apart, but the machine's period is 0.001 s: peaks would be missed"),
    Trace("noise", bytes(range(1, 256)) * 1000, "{file}:1:1: column 1 must be 't_s', and no other; here stands "
          "'\\x01\\x02\\x03\\x04\\x05\\x06\\x07\\x08\\x09'"),
]
