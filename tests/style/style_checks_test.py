#!/usr/bin/python3
"""The style checks find what they are for: planted faults, and the same text without them."""
import sys
import unittest

import check_dead
import check_form
import check_includes
import check_links
import check_mutants
import check_names
import check_realtime
import check_sentences
import check_uses
from source_text import code_only, functions

CODE = '''
#include "core/axes.h"
namespace trn {
class Ring {
 public:
  Ring() : a_{1}, b_{2} { fill(); }
  bool pop() TRN_RT { return a_ > '{'; }  // } in a comment
 private:
  int a_, b_;
};
const char* text = R"(void hidden() { new int; })";
constexpr auto kTable = make_table<int>({
    {1}, {2},
});
const std::array<int, static_cast<std::size_t>(Kind::kCount)> kSizes{{1, 2}};
template <typename T>
void Ring<T>::tick(double t) const TRN_RT {
  const auto f = [&](int i) { return i; };
  if (t > 0) {
    f(1);
  }
}
}  // namespace trn
'''


class FunctionsTest(unittest.TestCase):
    def test_finds_functions_and_their_length(self):
        found = [(f.name, f.line, f.length) for f in functions(code_only(CODE))]
        self.assertEqual(found, [("Ring", 6, 1), ("pop", 7, 1), ("Ring<T>::tick", 16, 7)])

    def test_long_function(self):
        body = "  f();\n" * 68
        self.assertEqual(check_form.check_cpp("a.cc", "void g() {\n" + body + "}\n", []), [])
        errors = check_form.check_cpp("a.cc", "\nvoid g() {\n" + body + "  f();\n}\n", [])
        self.assertEqual(errors, ["a.cc:2: g has 71 lines; a function has at most 70"])

    def test_answer_that_threads_share(self):
        errors = check_form.check_cpp("a.cc", "void g() {\n  const passwd* user = getpwuid(7);\n}\n", [])
        self.assertEqual(errors, ["a.cc:2: getpwuid has one answer for all threads; use getpwuid_r"])
        for text in ("getpwuid_r(7, a, b, c, d);", "fmt::localtime(t);", "h = \"getpwuid(7)\";"):
            self.assertEqual(check_form.check_cpp("a.cc", f"void g() {{\n  {text}\n}}\n", []), [])


class TickTest(unittest.TestCase):
    def errors(self, statement, mark="TRN_RT"):
        return check_form.check_cpp("a.cc", f"void tick() {mark} {{\n  {statement}\n}}\n", [])

    def test_forbidden(self):
        for statement in ("int* p = new int;", "delete p;", "v.push_back(1);", "throw 1;", "std::string s;",
                          "std::vector<int> v(3);", "while (true) {}", "for (;;) {}", "std::lock_guard g(m);",
                          "fmt::print(f);", "malloc(3);", "try { f(); } catch (...) {}", "usleep(3);"):
            self.assertTrue(self.errors(statement), statement)
            self.assertEqual(self.errors(statement)[0].split(":")[:2], ["a.cc", "2"])
            self.assertEqual(self.errors(statement, "const"), [])

    def test_legal(self):
        for statement in ("q.resize(5);", "const std::vector<int>& v = v_;", "for (int i = 0; i < n; ++i) f(i);",
                          "ring.try_push(x);", "// new throw\n  f();"):
            self.assertEqual(self.errors(statement), [], statement)


class IncludesTest(unittest.TestCase):
    def test_table(self):
        judge = check_includes.judge
        for own, mark, target in (("core", '"', "interp/move.h"), ("kinematics", '"', "interp/move.h"),
                                  ("interp/gcode", '"', "interp/plan/stages.h"), ("hal", '"', "kinematics/x.h"),
                                  ("core", "<", "lcm/lcm-cpp.hpp"), ("sim", '"', "kernel/joint_map.h"),
                                  ("interp/plan", '"', "nothing.h"), ("kernel", '"', "tests/x.h"),
                                  ("kernel", '"', "interp/move.h"), ("kernel", '"', "app/lab/picture/svg_chart.h"),
                                  ("kernel", "<", "spdlog/spdlog.h"), ("app/check", '"', "kernel/cycle.h"),
                                  ("app/session", '"', "app/daemon/daemon.h"),
                                  ("app/daemon", '"', "app/lab/workspace.h"),
                                  ("app/lab", '"', "app/cli/commands.h"),
                                  ("kernel", '"', "compensation/fit/ballbar.h"),
                                  ("compensation", '"', "compensation/fit/ballbar.h"),
                                  ("compensation", "<", "ceres/ceres.h"),
                                  ("app/daemon", '"', "compensation/fit/ballbar.h")):
            self.assertIsNotNone(judge(own, mark, target), (own, target))
        for own, mark, target in (("core", '"', "core/axes.h"), ("interp/plan", '"', "interp/move.h"),
                                  ("app/session", '"', "interp/plan/stages.h"), ("app/cli", '"', "app/daemon/daemon.h"),
                                  ("app/check", '"', "interp/move.h"), ("hal", "<", "modbus/modbus.h"),
                                  ("core", "<", "vector"), ("compensation/fit", "<", "ceres/ceres.h"),
                                  ("compensation/fit", '"', "compensation/spline.h"),
                                  ("app/lab", '"', "compensation/fit/ballbar.h")):
            self.assertIsNone(judge(own, mark, target), (own, target))

    def test_circles_of_units(self):
        line = "#include \"kernel/{}.h\"\n"
        grid = {}
        # A .cc's includes count for its .h: no file includes itself here, but grid - law is a circle.
        grid["kernel/grid.h"] = "#pragma once\n"
        grid["kernel/grid.cc"] = line.format("grid") + line.format("law")
        law = {"kernel/law.h": line.format("problem"), "kernel/problem.h": line.format("grid")}
        errors = check_includes.circles(check_includes.unit_includes(grid | law))
        self.assertEqual(errors, ["kernel/problem.h:1: circle of units grid - law - problem - grid; "
                                  "move what both need to a unit of its own"])
        pair = {"kernel/face.h": "", "kernel/face.cc": line.format("inside"), "kernel/inside.h": line.format("face")}
        self.assertEqual(len(check_includes.circles(check_includes.unit_includes(pair))), 1)

    def test_no_circle(self):
        line = "#include \"{}\"\n"
        texts = {"kernel/grid.h": "", "kernel/grid.cc": line.format("kernel/grid.h") + line.format("kernel/law.h"),
                 "kernel/law.h": line.format("kernel/problem.h"), "kernel/problem.h": line.format("core/axes.h"),
                 "core/axes.h": "", "kernel/other.cc": line.format("kernel/grid.h") + line.format("kernel/law.h")}
        self.assertEqual(check_includes.circles(check_includes.unit_includes(texts)), [])

    def test_folders(self):
        self.assertEqual(check_includes.folder_of("interp/plan/geometry/x.cc"), "interp/plan")
        self.assertEqual(check_includes.folder_of("interp/move.h"), "interp")
        self.assertEqual(check_includes.folder_of("compensation/fit/x.cc"), "compensation/fit")
        self.assertEqual(check_includes.folder_of("elsewhere/x.cc"), "")


class DeadTest(unittest.TestCase):
    HEADER = """
namespace trn {
class Tank : public Vessel {
 public:
  explicit Tank(double size_mm, Obey obey);
  double level() const { return level_mm_; }
  void fill(double mm);
  void pour() override;
  Vec3 spout_of(const Vec3& place) const;
  template <typename T>
  void drain(T part) { level_mm_ -= part; }
 private:
  static constexpr int kDrops = 3;
  std::lock_guard<Mutex> guard_;
  double size_mm_, level_mm_ = 0;
  std::atomic<bool> full_ = false;
  int drops_ = 0, spilt_ = 0;
  Obey obey_;
};
void shake(Tank& tank);
void shake(Tank& tank) { reply(tank, tank.obey_(tank)); }
}  // namespace trn
"""
    SOURCE = """
#include "core/tank.h"
namespace trn {
Tank::Tank(double size_mm, Obey obey)
    : size_mm_(size_mm),
      obey_(std::move(obey)) {}
void Tank::fill(double mm) {
  level_mm_ = std::min(level_mm_ + mm, size_mm_);
  full_ = true;
  ++drops_;
  spilt_ += 2;
  if (spilt_ == 7) shake(*this);
}
void Tank::pour() { drain(1); }
}  // namespace trn
"""

    def errors(self, header=HEADER, source=SOURCE):
        return check_dead.check({"core/tank.h": header, "core/tank.cc": source})

    def test_dead(self):
        self.assertEqual(self.errors(), [
            "core/tank.h:6: nobody calls Tank::level", "core/tank.h:7: nobody calls Tank::fill",
            "core/tank.h:9: Tank::spout_of is declared and has no body", "core/tank.h:16: nothing reads Tank::full_",
            "core/tank.h:17: nothing reads Tank::drops_"])

    def test_alive(self):
        user = self.SOURCE + "double f(Tank& t) { t.fill(t.drops_); return t.full_ ? t.level() : 0; }\n"
        user += "Vec3 Tank::spout_of(const Vec3& place) const { return f(*this) * spout_of(place); }\n"
        self.assertEqual(self.errors(source=user), [])
        # A comment keeps nothing alive.
        other = self.SOURCE.replace("++drops_;", "++drops_;  // drops_ is read, Tank::fill is called")
        self.assertEqual(self.errors(source=other), self.errors())


class LinesTest(unittest.TestCase):
    def test_lines(self):
        self.assertEqual(check_form.check_lines("a.py", "x = 1\n"), [])
        for text in ("x = 1 \n", "\tx\n", "# TO" + "DO\n", "x" * 121 + "\n", "\n" * 601 + "x"):
            self.assertTrue(check_form.check_lines("a.py", text), text[:20])


class LinksTest(unittest.TestCase):
    def test_links(self):
        there = {"docs/a.md", "docs", "README.md"}.__contains__
        text = "[a](a.md#part) [up](../README.md)\n[web](https://example.org/x.md) ![picture](p.svg) [out](../../x)\n"
        errors = check_links.check("docs/b.md", text, there)
        self.assertEqual([error.split(" there")[0] for error in errors],
                         ["docs/b.md:2:", "docs/b.md:2: '../../x' leads out of the repository"])


class SentencesTest(unittest.TestCase):
    TABLE = """
    {GcodeErrorCode::kNone, {"none", "no end, {not} here", "M2"}},
    {GcodeErrorCode::kTwo,
     {"two", "'{}' is {:.4f}, "
             "too much", "less {}"}},
"""

    def test_parts(self):
        counts = check_sentences.places(self.TABLE)
        self.assertEqual(counts, {"kNone": 1, "kTwo": 2})
        text = 'fail(GcodeErrorCode::kTwo, b.at(1, 2), f("a, (b", \',\'), x);\nfail(GcodeErrorCode::kTwo, 1, {2, 3});\n'
        errors = check_sentences.check({"a.cc": text}, counts)
        self.assertEqual([error.split(";")[0] for error in errors], ["a.cc:2: kTwo is given 1 parts"])


class NamesTest(unittest.TestCase):
    TREE = check_names.Tree({
        "kernel/cycle.h": "class Cycle { void tick(); };  // Cycle::take_up_lag was here",
        "kernel/cycle.cc": "constexpr int kSteps = 3; int way_to_end(const char* key = \"late_max\");",
        "hal/can/master.h": "class Master { void send(); };", "configs/mill.toml": "late_max = 3", "run.sh": "",
        "docs/a.md": "`Gone` and gone()"})

    def test_living(self):
        for span in ("Cycle", "Cycle::tick", "trn::Cycle::tick()", "Cycle::kSteps", "way_to_end()", "late_max",
                     "mill", "kernel/cycle.cc", "cycle.cc", "kernel/", "can/", "hal/*/*.h", "./run.sh",
                     "configs/X.toml", "run --machine configs/mill.toml", "std::thread", "G1 X5", "--late_min", "T0",
                     "X_BS", "LINE"):
            self.assertEqual(check_names.dead(span, self.TREE), [], span)

    def test_dead(self):
        for span in ("Gone", "Cycle::take_up_lag", "Cycle::send", "gone()", "kGone", "way_back", "TRN_GONE",
                     "kernel/check/", "kernel/gone.cc", "gone.cc", "kernel/g*.cc"):
            self.assertEqual(check_names.dead(span, self.TREE), [span], span)
        self.assertEqual(check_names.dead("run --machine configs/gone.toml", self.TREE), ["configs/gone.toml"])

    def test_place(self):
        text = "`Cycle`\n```\n`Gone`\n```\nsee `Gone`\n"
        self.assertEqual(check_names.check("docs/b.md", text, self.TREE),
                         ["docs/b.md:5: 'Gone' is not in the source; mend the name"])


class UsesTest(unittest.TestCase):
    HEADERS = {"core/tank.h": "struct Tank {\n  int level;\n};\n",
               "core/pump.h": '#include "core/tank.h"\nclass Pump {\n};\n'}

    def judged(self, text, name="core/plant.cc", **more):
        return check_uses.check({**self.HEADERS, name: text, **more})

    def test_a_type_that_comes_in_through_another_header_is_told(self):
        (error,) = self.judged('#include "core/pump.h"\nvoid fill(Tank& tank);\n')
        self.assertIn('core/plant.cc:2: Tank is used, and "core/tank.h" is not included', error)

    def test_what_is_included_declared_or_only_named_in_words_passes(self):
        self.assertEqual(self.judged('#include "core/tank.h"\nvoid fill(Tank& tank);\n'), [])
        self.assertEqual(self.judged('class Tank;\nvoid fill(Tank& tank);\n'), [])
        self.assertEqual(self.judged('// A Tank.\nconst char* text = "Tank";\n'), [])

    def test_the_own_header_speaks_for_its_source_and_its_test(self):
        own = '#include "core/tank.h"\nclass Plant {\n  Tank tank_;\n};\n'
        for name in ("core/plant.cc", "tests/core/plant_test.cc"):
            text = '#include "core/plant.h"\nTank& tank();\n'
            self.assertEqual(self.judged(text, name, **{"core/plant.h": own}), [])

    def test_a_function_whose_header_does_not_come_in_is_told(self):
        pipes = {"core/pipes.h": '#include "core/valve.h"\n', "core/valve.h": "double open_share(int valve);\n"}
        (error,) = self.judged("void run() {\n  open_share(1);\n}\n", **pipes)
        self.assertIn('core/plant.cc:2: open_share() is called, and "core/valve.h" does not come in', error)
        # By whatever header, as a member of something, or as a function of the file's own, it is known.
        self.assertEqual(self.judged('#include "core/pipes.h"\nvoid run() { open_share(1); }\n', **pipes), [])
        self.assertEqual(self.judged("struct Tap;\nvoid run(Tap& tap) {\n  tap.open_share(1);\n}\n", **pipes), [])
        self.assertEqual(self.judged("double open_share(int) { return 1; }\ndouble x = open_share(2);\n", **pipes), [])

    def test_a_library_that_comes_in_through_another_header_is_told(self):
        (error,) = self.judged('void say() { spdlog::info("full"); }\n')
        self.assertIn("core/plant.cc:1: spdlog:: is used, and <spdlog/spdlog.h> is not included", error)
        self.assertEqual(self.judged('#include <fmt/ranges.h>\nvoid say() { fmt::print("full"); }\n'), [])
        self.assertEqual(self.judged('// As fmt::print.\nconst char* text = "fmt::print";\n'), [])


class RealtimeTest(unittest.TestCase):
    HEADER = "class Pump {\n public:\n  double rate() const TRN_RT;\n  double level() const;\n};\n"
    SOURCE = """
namespace {
double half(double x) { return x / 2; }
double twice(double x) TRN_RT { return 2 * x; }
}
double Pump::rate() const TRN_RT { return twice(std::sqrt(2)); }
double Pump::level() const { return half(1); }
"""

    def judged(self, more=""):
        return check_realtime.check({"core/pump.h": self.HEADER, "core/pump.cc": self.SOURCE + more})

    def test_marked_calls_marked(self):
        self.assertEqual(self.judged(), [])
        # A mark of the declaration counts, and a lambda of the function itself needs none.
        run = "void run(Pump& p) TRN_RT {\n  const auto f = [] { return 1; };\n  f();\n  p.rate();\n}\n"
        self.assertEqual(self.judged(run), [])

    def test_a_helper_without_the_mark_is_told(self):
        (error,) = self.judged("void run() TRN_RT {\n  half(3);\n}\n")
        self.assertIn("core/pump.cc:9: run is marked TRN_RT and calls half, which is not", error)
        (error,) = self.judged("void run(Pump& p) TRN_RT { p.level(); }\n")
        self.assertIn("calls level", error)


class MutantsTest(unittest.TestCase):
    ROW = "core/tank.cc: return a < b; -> return a <= b;  # never the same\n"

    def judged(self, text):
        return check_mutants.check(text, lambda file: {f"{file}: return a < b; -> return a <= b;"})

    def test_a_row_of_a_change_with_its_reason(self):
        self.assertEqual(self.judged("# of core\n\n" + self.ROW), [])

    def test_a_row_of_what_is_gone(self):
        (error,) = self.judged(self.ROW + self.ROW.replace("a < b", "a < c"))
        self.assertIn("tests/mutants.txt:2: core/tank.cc has no such line any more", error)

    def test_no_reason_and_twice(self):
        (error,) = self.judged(self.ROW.split("  # ")[0])
        self.assertIn("no reason", error)
        (error,) = self.judged(self.ROW * 2)
        self.assertIn("twice", error)


if __name__ == "__main__":
    sys.exit(0 if unittest.main(exit=False).result.wasSuccessful() else 1)
