"""Random programs of the dialect, by topic; the same seed gives the same programs."""
import random


def number(rng, low=-20.0, high=20.0):
    value = rng.uniform(low, high)
    return rng.choice([f"{value:.3f}", f"{value:.1f}", f"{round(value)}"])


def axes(rng, letters="XYZ", most=3):
    chosen = rng.sample(letters, rng.randint(1, min(most, len(letters))))
    return " ".join(letter + number(rng) for letter in chosen)


def contour_move(rng, state, plane):
    """A line or an arc of the compensated contour; arcs with an exact centre."""
    first, second, i_word, j_word = plane
    here = state["at"]
    if rng.random() < 0.55:
        to = [round(here[0] + rng.uniform(-30, 30), 3), round(here[1] + rng.uniform(-30, 30), 3)]
        if rng.random() < 0.3:
            to[rng.randint(0, 1)] = here[rng.randint(0, 1)]
        state["at"] = to
        return f"G1 {first}{to[0]} {second}{to[1]}"
    centre = rng.choice([(5, 0), (0, 5), (-5, 0), (0, -5), (12, 0), (0, -12), (3, 4), (-8, 6)])
    turn = rng.choice([(1, 90), (-1, 90), (1, 180), (-1, 180), (1, 270), (-1, 270)])
    spoke = complex(-centre[0], -centre[1]) * (1j if turn[0] > 0 else -1j) ** (turn[1] // 90)
    to = [round(here[0] + centre[0] + spoke.real, 3), round(here[1] + centre[1] + spoke.imag, 3)]
    state["at"] = to
    code = "G3" if turn[0] > 0 else "G2"
    return f"{code} {first}{to[0]} {second}{to[1]} {i_word}{centre[0]} {j_word}{centre[1]}"


def compensation(rng):
    plane = rng.choice([("X", "Y", "I", "J")] * 4 + [("X", "Z", "I", "K")])
    lines = ["G21 G90 F100 S100 " + ("G17" if plane[1] == "Y" else "G18")]
    lines += ["G0 X0 Y0 Z0", rng.choice(["G41.1 D", "G42.1 D"]) + rng.choice(["1", "2", "4", "6", "0.5"])]
    state = {"at": [round(rng.uniform(5, 20), 3), round(rng.uniform(-20, 20), 3)]}
    lines.append(rng.choice(["G1", "G1", "G0"]) + f" {plane[0]}{state['at'][0]} {plane[1]}{state['at'][1]}")
    for _ in range(rng.randint(1, 6)):
        lines.append(contour_move(rng, state, plane))
        if rng.random() < 0.12:
            lines.append(rng.choice(["G4 P1", "M8", "(a word)", "G1 Z-3" if plane[1] == "Y" else "G1 Y-3", "S200"]))
    lines += ["G40", rng.choice(["G1 X-40 Y-40 Z-40", "G0 X50", "G0 Z5 Y9 X1"]), "M2"]
    return lines


def motion(rng):
    lines = [rng.choice(["G21", "G20"]) + " G17 " + rng.choice(["G90", "G91", "G90 G91.1"]) + " F100 S100"]
    pieces = [
        lambda: rng.choice(["G0 ", "G1 ", ""]) + axes(rng, "XYZABC"),
        lambda: rng.choice(["G17", "G18", "G19", "G90", "G91", "G20", "G21", "G94", "G61", "G64", "G64 P0.01",
                            "G61.1", "G90.1", "G91.1", "G7", "G8", "G98", "G99", "G80"]),
        lambda: rng.choice(["G2 ", "G3 "]) + axes(rng) + " R" + number(rng, 15, 60),
        lambda: rng.choice(["G2 ", "G3 "]) + rng.choice(["I", "J", "K"]) + number(rng, 1, 9),
        lambda: rng.choice(["F", "S"]) + number(rng, 1, 500),
        lambda: "G93 G1 X" + number(rng) + " F2\nG94 F50",
        lambda: "G53 G0 " + axes(rng, "XYZABC"),
        lambda: "G4 P" + number(rng, 0, 3),
        lambda: rng.choice(["M3", "M4", "M5", "M7", "M8", "M9", "M48", "M49", "M50 P0", "M51 P1", "M52", "M53"]),
    ]
    lines += [rng.choice(pieces)() for _ in range(rng.randint(2, 9))]
    return lines + ["M2"]


def offsets(rng):
    lines = ["G21 G90 F100", "G0 " + axes(rng, "XYZABC")]
    pieces = [
        lambda: "G10 L2 P" + str(rng.randint(0, 9)) + " " + axes(rng, "XYZABC") + rng.choice(["", " R30", " R-12.5"]),
        lambda: "G10 L20 P" + str(rng.randint(0, 9)) + " " + axes(rng, "XYZABC"),
        lambda: rng.choice(["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"]),
        lambda: rng.choice(["G92 ", "G52 "]) + axes(rng, "XYZABC"),
        lambda: rng.choice(["G92.1", "G92.2", "G92.3"]),
        lambda: rng.choice(["G43 H1", "G43 H3", "G43", "G49", "G43.2 H2", "G43.1 Z5 X1"]),
        lambda: f"T{rng.choice([1, 2, 3, 5, 9])} M6",
        lambda: "G10 L1 P" + str(rng.randint(1, 5)) + " " + axes(rng, "XYZABC") + rng.choice(["", " R2"]),
        lambda: rng.choice(["G10 L10 P", "G10 L11 P"]) + str(rng.randint(1, 5)) + " " + axes(rng, "XYZ"),
        lambda: rng.choice(["G28", "G30", "G28.1", "G30.1", "G28 Z5", "G30 X1 A5"]),
        lambda: rng.choice(["G20", "G21", "G91", "G90"]),
        lambda: "G0 " + axes(rng, "XYZABC"),
        lambda: "G1 " + axes(rng, "XYZABC"),
        lambda: "G53 G0 " + axes(rng, "XYZ"),
        lambda: "(DEBUG,#5220 #5230 #5210 #5420 #5421 #5422)",
        lambda: "(DEBUG,%f #<_abs_x> #<_abs_y> #<_abs_z> #<_abs_a> #<_x>)",
    ]
    for _ in range(rng.randint(3, 10)):
        lines.append(rng.choice(pieces)())
    return lines + ["G0 X1 Y1 Z1", "M2"]


def cycles(rng):
    lines = [rng.choice(["G17", "G17", "G18", "G19"]) + rng.choice([" G90", " G90", " G91"]) + " G21 F100 S100 M3"]
    lines.append("G0 " + axes(rng, "XYZ"))
    for _ in range(rng.randint(1, 4)):
        code = rng.choice(["G81", "G82", "G83", "G73", "G84", "G85", "G86", "G89", "G81", "G88", "G87"])
        polar = rng.choice(["", "", "", f"@{number(rng, 1, 9)} ", f"^{number(rng, -180, 180)} ",
                            f"@{number(rng, 1, 9)} ^{number(rng, -180, 180)} "])
        words = (polar + axes(rng, "Z") if polar else axes(rng, "XYZ")) + (" I.5 J-.5 K-1" if code == "G87" else "")
        words += rng.choice(["", f" R{number(rng, 0, 9)}"]) + rng.choice(["", " P1"]) + rng.choice(["", " Q1.3"])
        words += rng.choice(["", "", " L2", " L3"])
        lines.append(rng.choice(["", "", "G98 ", "G99 "]) + rng.choice([code + " ", code + " ", ""]) + words)
        if rng.random() < 0.2:
            lines.append(rng.choice(["G80", "G0 X1", "G1 Z2", "G90", "G91", "G17", "G18", "M4", "G20"]))
    return lines + ["M2"]


def expression_text(rng, depth=0):
    if depth > 3 or rng.random() < 0.3:
        return rng.choice([number(rng), "#1", "#2", "#<a>", "#[1+1]", "#<_bb>"])
    if rng.random() < 0.3:
        name = rng.choice(["ABS", "SIN", "COS", "TAN", "FIX", "FUP", "ROUND", "SQRT", "EXP", "LN", "ACOS", "ASIN"])
        if rng.random() < 0.15:
            return f"ATAN[{expression_text(rng, depth + 1)}]/[{expression_text(rng, depth + 1)}]"
        return f"{name}[{expression_text(rng, depth + 1)}]"
    parts = [expression_text(rng, depth + 1)]
    for _ in range(rng.randint(1, 3)):
        parts.append(rng.choice(["+", "-", "*", "/", "**", " MOD ", " EQ ", " NE ", " GT ", " GE ", " LT ", " LE ",
                                 " AND ", " OR ", " XOR ", "+", "-", "*"]))
        parts.append(expression_text(rng, depth + 1))
    return "[" + "".join(parts) + "]"


def expressions(rng):
    lines = ["#1=3.5 #2=-2", "#<a>=7", "#<_bb>=0.25"]
    lines += [f"#3=[{expression_text(rng)}]\n(DEBUG,#3)" for _ in range(rng.randint(1, 4))]
    return lines + ["G0 X[#3]", "M2"]


def flow(rng):
    lines = ["#1=0 #2=0"]
    label = [100]

    def body(depth):
        out = []
        for _ in range(rng.randint(1, 3)):
            kind = rng.choice(["move", "add", "while", "if", "repeat", "do", "call"]) if depth < 3 else "move"
            label[0] += 1
            o = f"o{label[0]}"
            if kind == "move":
                out.append("G0 X#1 Y#2")
            elif kind == "add":
                out.append(rng.choice(["#1=[#1+1]", "#2=[#2+#1]", "#1=[#1-0.5] #2=#1"]))
            elif kind == "while":
                counter = f"#{label[0] - 60}"
                leave = rng.choice([[], [f"o{label[0]}1 if [#1 gt 3]", f"{o} break", f"o{label[0]}1 endif"],
                                    [f"o{label[0]}1 if [#1 gt 2]", f"{o} continue", f"o{label[0]}1 endif"]])
                out += [f"{counter}=0", f"{o} while [{counter} lt {rng.randint(0, 3)}]", f"{counter}=[{counter}+1]",
                        *leave, *body(depth + 1), f"{o} endwhile"]
            elif kind == "do":
                counter = f"#{label[0] - 60}"
                out += [f"{counter}=0", f"{o} do", f"{counter}=[{counter}+1]", *body(depth + 1),
                        f"{o} while [{counter} lt {rng.randint(1, 3)}]"]
            elif kind == "repeat":
                out += [f"{o} repeat [{rng.randint(0, 3)}]", *body(depth + 1), f"{o} endrepeat"]
            elif kind == "if":
                out += [f"{o} if [#1 gt {rng.randint(-1, 3)}]", *body(depth + 1)]
                out += rng.choice([[], [f"{o} else", *body(depth + 1)],
                                   [f"{o} elseif [#2 gt 1]", *body(depth + 1), f"{o} else", *body(depth + 1)]])
                out.append(f"{o} endif")
            else:
                out += ["o1 call [#1+1] [2]", "#1=#<_value>"]
        return out

    sub = ["o1 sub", "G1 F10 X[#1*2] Y#2", "o2 if [#1 gt 4]", "o1 return [#1-3]", "o2 endif", "o1 endsub [#1+2]"]
    return sub + lines + body(0) + ["M2"]


def damage(rng):
    """A sound program with one token changed: mostly an error, and both must see it."""
    lines = rng.choice([motion, offsets, cycles, compensation, modes, splines])(rng)
    at = rng.randrange(len(lines) - 1)
    tokens = lines[at].split()
    if not tokens:
        return lines
    i = rng.randrange(len(tokens))
    tokens[i] = rng.choice([
        "", tokens[i] + " " + tokens[i], tokens[i][:1], tokens[i] + ".", tokens[i] + "-1", "-" + tokens[i],
        tokens[i][:1] + "[1/0]", tokens[i][:1] + "1.5", "G" + str(rng.randint(0, 99)), "M" + str(rng.randint(0, 99)),
        rng.choice("ABCDEFHIJKLPQRSTXYZ") + number(rng), "G53", "G92", "G10", "G41", "G40", "G43", "G28", "P", "X#99",
        tokens[i].lower(), "N5", "(x)", "L0", "F0", "S-1", "R0", "G91.1", "G5.1", "G38.2", "G33", "G76", "T2", "M6"])
    lines[at] = " ".join(tokens)
    return lines


def modes(rng):
    """Settings kept and brought back, in sub-programs too."""
    words = ["G20", "G21", "G90", "G91", "G17", "G18", "G19", "G93", "G94", "G95", "F12", "F7", "S50", "S80", "M3",
             "M4",
             "M5", "M7", "M8", "M9", "M48", "M49", "G54", "G55", "G59.1",
             "G61", "G61.1", "G64", "G64 P0.1 Q0.2", "G90.1", "G91.1", "G7", "G8", "G98", "G99", "G49", "G0 X1 Y2",
             "G92 X3", "G92.1", "G10 L2 P1 X1 R10", "G4 P1", "(MSG, word)", "(DEBUG,#<_metric> #<_feed> #5220)"]
    def some(most):
        return [rng.choice(words) for _ in range(rng.randint(1, most))]

    sub = ["o1 sub", rng.choice(["M70", "M73", "M73", ""]), *some(5), rng.choice(["M72", "", "M71"]), "o1 endsub"]
    inner = rng.choice([["o1 call"], ["M70", *some(4), "M72"], ["M70", *some(4), "M72", "o1 call"]])
    return [*sub, *some(6), *inner, "G0 X1 Y1 Z1", "G2 X3 R4", "M2"]


def splines(rng):
    lines = ["G21 G90 F100 " + rng.choice(["", "G17", "G20"])]
    pieces = [
        lambda: f"G5 X{number(rng)} Y{number(rng)} I{number(rng)} J{number(rng)} P{number(rng)} Q{number(rng)}",
        lambda: f"G5 X{number(rng)} Y{number(rng)} P{number(rng)} Q{number(rng)}",
        lambda: f"G5.1 X{number(rng)} Y{number(rng)} I{number(rng)} J{number(rng)}",
        lambda: f"G5.1 X{number(rng)} Y{number(rng)} J{number(rng)}",
        lambda: "G1 " + axes(rng), lambda: rng.choice(["G91", "G90", "G90.1", "G91.1", "G20", "G21"]),
        lambda: "G5.2 P1 L3\n" + "\n".join(f"X{number(rng)} Y{number(rng)} P{rng.randint(1, 4)}" for _ in range(4))
        + "\nG5.3",
        lambda: f"G0 @{number(rng, 1, 9)} ^{number(rng, 0, 360)}", lambda: f"G1 ^{number(rng, 0, 360)} Z1",
        lambda: "G33 " + axes(rng) + " K1.5", lambda: "S100 M3\nG33.1 Z-5 K1",
        lambda: "S100 M3\nG76 P1 Z-30 I-1 J.3 K1 R1.5 Q29.5 H1 E.3 L" + str(rng.randint(0, 3))]
    probes = [lambda: "G38.2 Z-30\n(DEBUG,#5061 #5062 #5063 #5070)", lambda: "G38.3 X-30", lambda: "G0 X0 Z0",
              lambda: rng.choice(["G91", "G90", "G20", "G92 X3", "G43 H1"])]
    pieces = rng.choice([pieces, pieces, probes])
    return lines + [rng.choice(pieces)() for _ in range(rng.randint(2, 7))] + ["M2"]


TOPICS = {"modes": modes, "spline": splines, "comp": compensation, "motion": motion, "offset": offsets, "cycle": cycles,
          "expr": expressions, "flow": flow, "damage": damage}


def make(count, seed):
    """{name: text} of `count` programs of each topic in turn."""
    programs = {}
    names = list(TOPICS)
    for i in range(count):
        topic = names[i % len(names)]
        rng = random.Random(f"{seed} {i}")
        programs[f"random/{topic}_{seed}_{i}"] = "\n".join(TOPICS[topic](rng)) + "\n"
    return programs
