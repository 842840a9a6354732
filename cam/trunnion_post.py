"""FreeCAD post-processor for Trunnion: three axes, five axes with RTCP, tilted planes. docs/cam.md explains it.

Copy this file into FreeCAD's folder of macros and choose "trunnion" in the job's output. Written from the documented
interface of FreeCAD's Path workbench (0.20 and later): a module NAME_post.py with export(objects, file, arguments).
"""
import argparse
import math
import shlex

TOOLTIP = "G-code for Trunnion: three axes, five axes with RTCP (--rtcp), tilted planes from an operation's Placement."


class _Parser(argparse.ArgumentParser):
    """FreeCAD must not end because of a misspelt argument."""

    def error(self, message):
        raise ValueError(f"trunnion post: {message}; the arguments are:\n{self.format_help()}")


def _parser():
    parser = _Parser(prog="trunnion", add_help=False)
    add = parser.add_argument
    add("--machine", help="config of the machine, relative to the program, as ../configs/cradle.toml")
    add("--tools", help="tool table, relative to the program, as tools.tbl")
    add("--tolerance", type=float, default=0.01, help="G64 P in mm: how far the tip may leave the path")
    add("--axis-tolerance", type=float, help="G64 R in degrees: how far the tool axis may leave it")
    add("--retract", type=float, help="machine Z in mm (G53) to which the tool goes before a change and at the end; "
        "it must be given, since every machine has its zero elsewhere")
    add("--rtcp", action="store_true", help="X Y Z are the tip in the part, also while A B C turn (G43.4)")
    add("--inches", action="store_true", help="G20 instead of G21")
    add("--precision", type=int, default=4, help="digits behind the point; 5 are usual with --inches")
    add("--no-show-editor", action="store_true", help="as in FreeCAD's own posts; there is no editor here")
    return parser


TOOLTIP_ARGS = _parser().format_help()

LENGTHS = "XYZIJKRQ"
ORDER = "XYZABCIJKRQHDPLSF"
RAPIDS = {"G0", "G00"}
FEEDS = {"G1", "G01", "G2", "G02", "G3", "G03"}
CYCLES = {"G73", "G74", "G81", "G82", "G83", "G84", "G85", "G86", "G89"}


class _Post:
    def __init__(self, options):
        self.options = options
        self.lines = []
        self.scale = 1 / 25.4 if options.inches else 1.0
        self.at = {}            # the words that the machine has, as written
        self.feed = None
        self.cycle = None       # the words of the cycle in force
        self.tool = None        # number, and whether its length is on yet
        self.length_on = False
        self.plane_on = False

    # -- text ---------------------------------------------------------------------------------------------------------

    def say(self, line):
        self.lines.append(line)

    def comment(self, text):
        plain = text.encode("ascii", "replace").decode().replace("(", "[").replace(")", "]")
        self.say(f"({plain.strip()})")

    def number(self, letter, value):
        if letter in LENGTHS:
            value = value * self.scale
        text = f"{value:.{self.options.precision}f}".rstrip("0").rstrip(".")
        return "0" if text == "-0" else text

    def word(self, letter, value):
        return f"{letter}{self.number(letter, value)}"

    def feed_word(self, value_mm_s):
        """FreeCAD has feeds in mm/s; a program has them a minute."""
        return f"F{f'{value_mm_s * 60 * self.scale:.3f}'.rstrip('0').rstrip('.')}"

    # -- head and end -------------------------------------------------------------------------------------------------

    def head(self, objects):
        options = self.options
        if options.machine:
            self.comment(f"machine: {options.machine}" + (f"; tools: {options.tools}" if options.tools else ""))
        self.comment("made by trunnion_post.py for FreeCAD")
        for number, text in sorted(tools_of(objects).items()):
            self.comment(f"T{number} {text}")
        self.say(("G20" if options.inches else "G21") + " G17 G40 G49 G80 G90 G91.1 G94")
        if options.axis_tolerance is None:
            self.say(f"G64 P{self.number('X', options.tolerance)}")
        else:
            self.say(f"G64 P{self.number('X', options.tolerance)} R{options.axis_tolerance:g}")

    def end(self):
        self.retract()
        self.say("M5")
        self.say("M9")
        self.say("M30")

    def retract(self):
        self.end_cycle()
        if self.plane_on:
            self.say("G69")
            self.plane_on = False
        if self.length_on:
            self.say("G49")
            self.length_on = False
        self.say(f"G53 G0 {self.word('Z', self.options.retract)}")
        self.at.clear()

    # -- tools and planes ---------------------------------------------------------------------------------------------

    def change_tool(self, number):
        self.retract()
        self.tool = number
        self.say(f"T{number} M6")

    def length_words(self):
        """G43.4 is RTCP with the length of the tool; G43 the length alone. Both act with the first move behind them."""
        return f"{'G43.4' if self.options.rtcp else 'G43'} H{self.tool}"

    def begin_plane(self, placement):
        """An operation whose Placement is tilted is cut in that plane: G68.2 lays it, G53.1 turns the tool to it."""
        if not self.options.rtcp:
            raise ValueError("trunnion post: an operation with a tilted Placement needs --rtcp")
        self.retract()
        self.lay_plane(placement.Base, euler_zxz(placement.Rotation))
        self.plane_on = True
        self.begin_rtcp()

    def lay_plane(self, base, angles):
        words = [self.word("X", base[0]), self.word("Y", base[1]), self.word("Z", base[2])]
        words += [f"{letter}{self.angle(value)}" for letter, value in zip("IJK", angles)]
        self.say("G68.2 " + " ".join(words))
        self.say("G53.1")
        self.at.clear()

    def angle(self, value_deg):
        text = f"{value_deg:.6f}".rstrip("0").rstrip(".")
        return "0" if text == "-0" else text

    def end_plane(self):
        """Behind a plane the tool is still tilted: it is turned upright, far from the part."""
        if not self.plane_on:
            return
        self.retract()
        self.stand_upright()

    def stand_upright(self):
        """Wherever the rotary axes stood."""
        self.lay_plane((0, 0, 0), (0, 0, 0))
        self.say("G69")
        self.begin_rtcp()

    def begin_rtcp(self):
        """Behind G53.1, so that only rotary axes move there."""
        self.say(self.length_words())
        self.length_on = True

    # -- motion -------------------------------------------------------------------------------------------------------

    def end_cycle(self):
        if self.cycle is not None:
            self.say("G80")
            self.cycle = None
            self.at.clear()

    def move(self, name, parameters):
        """G0 to G3. Words that change nothing are left out, but not from arcs."""
        code = "G" + str(int(name[1:]))
        self.end_cycle()
        arc = code in ("G2", "G3")
        words = []
        for letter in ORDER:
            if letter not in parameters or letter in "FSH":
                continue
            value = parameters[letter]
            if letter == "K" and arc and abs(value) < 1e-9 and "I" in parameters and "J" in parameters:
                continue  # FreeCAD says K0 in the plane XY
            if letter in "XYZABC":
                text = self.number(letter, value)
                if not arc and self.at.get(letter) == text:
                    continue
                self.at[letter] = text
            words.append(self.word(letter, value))
        feed = parameters.get("F", 0)
        if code != "G0" and feed > 0 and feed != self.feed:
            self.feed = feed
            words.append(self.feed_word(feed))
        if not any(word[0] in "XYZABCIJK" for word in words):
            return
        if self.tool is not None and not self.length_on:
            self.begin_length(code, words)
            return
        self.say(" ".join([code, *words]))

    def begin_length(self, code, words):
        """The first move of a tool: across at the height where the tool is, then down with its length."""
        across = [word for word in words if word[0] in "XY"]
        down = [word for word in words if word[0] not in "XY"]
        if self.options.rtcp:
            if any(word[0] in "ABC" for word in words):
                self.begin_rtcp()
            else:
                self.stand_upright()
            self.say(" ".join([code, *words]))
            return
        if across and code == "G0":
            self.say(" ".join(["G0", *across]))
            words = down
        if any(word[0] == "Z" for word in words):
            self.say(" ".join([self.length_words(), code, *words]))
            self.length_on = True
        elif words:
            self.say(" ".join([code, *words]))

    def drill(self, name, parameters):
        """A cycle once, then only what changes from hole to hole."""
        words = {letter: self.word(letter, value) for letter, value in parameters.items() if letter in "XYZRQPL"}
        if parameters.get("F", 0) > 0:
            self.feed = parameters["F"]
            words["F"] = self.feed_word(self.feed)
        if self.cycle is not None and self.cycle.get("G") == name:
            fresh = {letter: text for letter, text in words.items() if self.cycle.get(letter) != text}
            self.say(" ".join(fresh[letter] for letter in ORDER if letter in fresh)
                     or " ".join(words[letter] for letter in "XY" if letter in words))
        else:
            self.say(" ".join([name, *(words[letter] for letter in ORDER if letter in words)]))
        self.cycle = {**(self.cycle or {}), "G": name, **words}

    # -- one command --------------------------------------------------------------------------------------------------

    def command(self, name, parameters):
        name = name.strip()
        if not name:
            return
        if name.startswith("("):
            self.comment(name.strip("()"))
        elif name in RAPIDS or name in FEEDS:
            self.move(name, parameters)
        elif name in CYCLES:
            self.drill(name, parameters)
        elif name in ("M6", "M06"):
            self.change_tool(int(parameters["T"]))
        elif name in ("M3", "M03", "M4", "M04"):
            if parameters.get("S", 0) > 0:
                self.say(f"S{parameters['S']:g} M{int(name[1:])}")
        elif name == "G80":
            self.end_cycle()
        elif name in ("G20", "G21", "G43", "G49"):
            pass  # the head and the tool change say them
        else:
            there = [letter for letter in ORDER if letter in parameters and letter != "F"]
            words = [self.word(letter, parameters[letter]) for letter in there]
            if "F" in parameters:
                words.append(self.feed_word(parameters["F"]))
            self.say(" ".join([name, *words]))


def euler_zxz(rotation):
    """The angles I J K of G68.2 in degrees: about Z, about X', about Z''."""
    axes = [rotation.multVec(axis) for axis in _unit_vectors(rotation)]
    x, y, z = axes
    tilt = math.acos(max(-1.0, min(1.0, z.z)))
    if math.sin(tilt) < 1e-9:
        return 0.0, math.degrees(tilt), math.degrees(math.atan2(x.y, x.x))
    return (math.degrees(math.atan2(z.x, -z.y)), math.degrees(tilt), math.degrees(math.atan2(x.z, y.z)))


def _unit_vectors(rotation):
    vector = type(rotation.Axis)
    return vector(1, 0, 0), vector(0, 1, 0), vector(0, 0, 1)


def is_tilted(placement):
    return placement is not None and abs(placement.Rotation.Angle) > 1e-9


def tools_of(objects):
    """Number to text of every tool that the objects change to."""
    found = {}
    for thing in objects:
        if hasattr(thing, "ToolNumber"):
            tool = getattr(thing, "Tool", None)
            diameter = getattr(tool, "Diameter", None)
            text = getattr(tool, "Label", "") or thing.Label
            found[int(thing.ToolNumber)] = f"{text}, diameter {float(diameter):g} mm" if diameter is not None else text
    return found


def export(objectslist, filename, argstring):
    """FreeCAD calls this. Returns the program's text and writes it to `filename`, unless that is "-"."""
    options = _parser().parse_args(shlex.split(argstring or ""))
    if options.retract is None:
        raise ValueError("trunnion post: --retract is missing: the machine Z in mm (G53) at which tools are changed, "
                         "as --retract 200")
    post = _Post(options)
    things = [thing for thing in objectslist if hasattr(thing, "Path")]
    post.head(things)
    for thing in things:
        if hasattr(thing, "Active") and not thing.Active:
            continue
        post.end_cycle()
        placement = getattr(thing, "Placement", None)
        commands = thing.Path.Commands
        if not hasattr(thing, "ToolNumber") and not (commands and commands[0].Name.startswith("(")):
            post.comment(thing.Label)
        if is_tilted(placement):
            post.begin_plane(placement)
        else:
            post.end_plane()
        for command in commands:
            post.command(command.Name, command.Parameters)
    post.end()
    text = "\n".join(post.lines) + "\n"
    if filename != "-":
        with open(filename, "w", encoding="ascii") as file:
            file.write(text)
    return text
