#include "interp/gcode/text/expression.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>

#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/gcode/text/lexer.h"
#include "tests/interp/gcode/run_program.h"
#include "tests/support/rounds.h"

// Expressions against a second evaluator that builds and folds the tree while the text is made.
namespace trn {
namespace {

struct NoState : StateValues {
  double predefined(int) const override { return 0; }
  double position(int axis) const override { return axis; }
};

double evaluate(const std::string& text) {
  Parameters parameters;
  parameters[7] = 3.5;
  NoState state;
  Lexer lexer(text);
  std::vector<Instruction> code;
  ExpressionCompiler compiler(lexer, parameters.names(), code);
  const std::int32_t start = compiler.value();
  EXPECT_EQ(lexer.peek(), '\0') << text;
  return Evaluator(parameters, state).run(code, start);
}

// All ways a number may be read (eight bytes at once, digit by digit, white space inside) give what strtod
// gives for the same digits.
TEST(Lexer, NumbersAreTheNearestDoubles) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 20000; ++i) {
    std::string digits;
    const std::size_t count = 1 + random() % 17, point = random() % (count + 2);
    for (std::size_t k = 0; k < count; ++k) {
      if (k == point) digits += '.';
      digits += static_cast<char>('0' + random() % 10);
    }
    if (point == count) digits += '.';
    const double truth = std::strtod(digits.c_str(), nullptr);
    if (truth >= 1e15) continue;
    const std::string text = (i % 2 ? "-" : "") + digits;
    std::string spaced = text;
    spaced.insert(1 + random() % spaced.size(), "  ");
    for (const std::string& form : {text, " " + text + " ", text + "Y12345678", text + " Y1", spaced}) {
      Lexer lexer(form);
      EXPECT_EQ(lexer.number(), i % 2 ? -truth : truth) << form;
      EXPECT_TRUE(lexer.peek() == '\0' || lexer.peek() == 'y') << form;
    }
  }
}

TEST(Expression, PrecedenceAndAssociation) {
  EXPECT_EQ(evaluate("[2 ** 3 ** 2]"), 64);
  EXPECT_EQ(evaluate("[1 + 2 * 3 - 4 / 2]"), 5);
  EXPECT_EQ(evaluate("[10 mod 3 * 2]"), 2);
  EXPECT_EQ(evaluate("[-10 MOD 3]"), 2);
  EXPECT_EQ(evaluate("[1 lt 2 and 3 gt 4 or 1]"), 1);
  EXPECT_EQ(evaluate("[1 + 1 eq 2]"), 1);
  EXPECT_EQ(evaluate("[-2 ** 2]"), 4);
  EXPECT_EQ(evaluate("-[1+1]"), -2);
}

TEST(Expression, Functions) {
  EXPECT_DOUBLE_EQ(evaluate("atan[1]/[1]"), 45);
  EXPECT_DOUBLE_EQ(evaluate("atan[0]/[-1]"), 180);
  EXPECT_NEAR(evaluate("sin[30]"), 0.5, 1e-15);
  EXPECT_NEAR(evaluate("cos[60]"), 0.5, 1e-15);
  EXPECT_EQ(evaluate("round[-2.5]"), -3);
  EXPECT_EQ(evaluate("fix[-2.5]"), -3);
  EXPECT_EQ(evaluate("fup[-2.5]"), -2);
  EXPECT_EQ(evaluate("abs[-2]"), 2);
  EXPECT_DOUBLE_EQ(evaluate("ln[exp[2]]"), 2);
  EXPECT_EQ(evaluate("exists[#<nothing>]"), 0);
  EXPECT_EQ(evaluate("exists[#7]"), 1);
  EXPECT_EQ(evaluate("exists[#99999]"), 0);
  EXPECT_EQ(evaluate("exists[#[3+4]]"), 1);
  EXPECT_EQ(evaluate("exists[#[-1]]"), 0);
  EXPECT_EQ(evaluate("#7"), 3.5);
  EXPECT_EQ(evaluate("#[3.5 * 2]"), 3.5);
  EXPECT_EQ(evaluate("#5421"), 1);
}

struct Tree {
  std::string text;
  double value;
  bool sound;
};

class Maker {
 public:
  explicit Maker(unsigned seed) : random_(seed) {}

  // `level` is the least precedence that needs no brackets here.
  Tree make(int depth, int level) {
    if (depth == 0) return leaf();
    switch (pick(8)) {
      case 0:
        return function(depth);
      case 1: {
        const Tree inner = make(depth - 1, 0);
        return {"[" + inner.text + "]", inner.value, inner.sound};
      }
      default:
        return binary(depth, level);
    }
  }

 private:
  int pick(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  Tree leaf() {
    const int hundredths = pick(2000) + 1;
    return {fmt::format("{}.{:02}", hundredths / 100, hundredths % 100),
            std::strtod(fmt::format("{}.{:02}", hundredths / 100, hundredths % 100).c_str(), nullptr), true};
  }
  Tree function(int depth) {
    const Tree x = make(depth - 1, 0);
    switch (pick(4)) {
      case 0:
        return {"abs[" + x.text + "]", std::abs(x.value), x.sound};
      case 1:
        return {"sin[" + x.text + "]", std::sin(x.value * kRadPerDeg), x.sound};
      case 2:
        return {"fix[" + x.text + "]", std::floor(x.value), x.sound};
      default:
        return {"sqrt[abs[" + x.text + "]]", std::sqrt(std::abs(x.value)), x.sound};
    }
  }
  Tree binary(int depth, int level) {
    struct Row {
      const char* text;
      int level;
      std::function<double(double, double)> apply;
    };
    static const Row kRows[] = {
        {"+", 3, [](double a, double b) { return a + b; }},
        {"-", 3, [](double a, double b) { return a - b; }},
        {"*", 4, [](double a, double b) { return a * b; }},
        {"/", 4, [](double a, double b) { return a / b; }},
        {"mod", 4,
         [](double a, double b) {
           const double r = std::fmod(a, b);
           return r < 0 ? r + std::abs(b) : r;
         }},
        {"lt", 2, [](double a, double b) { return a < b ? 1.0 : 0.0; }},
        {"ge", 2, [](double a, double b) { return a >= b ? 1.0 : 0.0; }},
        {"ne", 2, [](double a, double b) { return std::abs(a - b) >= 1e-4 ? 1.0 : 0.0; }},
        {"and", 1, [](double a, double b) { return a != 0 && b != 0 ? 1.0 : 0.0; }},
        {"xor", 1, [](double a, double b) { return (a != 0) != (b != 0) ? 1.0 : 0.0; }}};
    const Row& row = kRows[pick(10)];
    const Tree left = make(depth - 1, row.level), right = make(depth - 1, row.level + 1);
    const bool divides = row.text[0] == '/' || row.text[0] == 'm';
    Tree out{left.text + " " + row.text + " " + right.text, row.apply(left.value, right.value),
             left.sound && right.sound && !(divides && right.value == 0)};
    if (row.level < level) out.text = "[" + out.text + "]";
    return out;
  }
  std::mt19937 random_;
};

TEST(Expression, AgreesWithTheNaiveEvaluator) {
  const int count = test::rounds(20'000);
  Maker maker(20);
  for (int i = 0; i < count; ++i) {
    const Tree tree = maker.make(1 + i % 5, 0);
    if (!tree.sound || !std::isfinite(tree.value)) continue;
    ASSERT_EQ(evaluate("[" + tree.text + "]"), tree.value) << tree.text;
  }
}

TEST(Expression, AssignmentsTakeEffectAfterTheLine) {
  EXPECT_EQ(test::canon("#1=3 #2=8\n#1=4 ##1=5\nG0 X#1 Y#3"), test::moves({"T 4 5 0"})) << "indices too";
  EXPECT_EQ(test::canon("#1=5 #2=#1\n#1=7 G0 X#1\nG0 Y#1 Z#2"), test::moves({"T 5 0 0", "T 5 7 0"}));
}

TEST(Expression, LocalAndGlobalNames) {
  EXPECT_EQ(test::canon(
                "o1 sub\n#<a>=5\n#<_mine>=6\n#1=9\no1 endsub\n#<a>=1\n#1=2\no1 call\nG0 X#<a> Y#<_mine> Z#1"),
            test::moves({"T 1 6 2"}));
  EXPECT_EQ(test::canon("G0 X3\nG0 Y[#<_x> + #5420] Z#<_metric>"), test::moves({"T 3 0 0", "T 3 6 1"}));
}

}  // namespace
}  // namespace trn
