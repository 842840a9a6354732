#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "interp/gcode/error.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/text/expression.h"
#include "interp/gcode/text/lexer.h"

// Differential fuzz of expressions: bytes choose tokens of an expression; the compiler and evaluator of the
// interpreter against a naive one that reduces a list of tokens, level by level. Both must give the same
// value, or both none.
namespace {

// Rounded as the interpreter rounds: beside a pole, or of many turns, the last digit of an angle is all.
constexpr double kDegPerRadian = 180 / 3.14159265358979323846, kRadianPerDeg = 3.14159265358979323846 / 180;

struct Token {
  enum class Kind { kNumber, kBinary, kOpen, kClose, kUnary, kSlash } kind;
  double value = 0;
  std::string text;
};

const char* const kBinaryNames[] = {"**", "*",  "/",  "mod", "+",   "-",  "eq", "ne",
                                    "gt", "ge", "lt", "le",  "and", "or", "xor"};
const char* const kUnaryNames[] = {"abs", "acos", "asin",  "cos", "exp",  "fix",
                                   "fup", "ln",   "round", "sin", "sqrt", "tan"};

int level_of(const std::string& name) {
  if (name == "**") return 5;
  if (name == "*" || name == "/" || name == "mod") return 4;
  if (name == "+" || name == "-") return 3;
  return name == "and" || name == "or" || name == "xor" ? 1 : 2;
}

using Result = std::optional<double>;

// Of every operation: OR and EQ would make a number of an infinity again.
Result if_finite(Result value) { return value && std::isfinite(*value) ? value : std::nullopt; }

Result binary(const std::string& name, double a, double b) {
  if (name == "+") return a + b;
  if (name == "-") return a - b;
  if (name == "*") return a * b;
  if (name == "/") return b == 0 ? std::nullopt : Result(a / b);
  if (name == "mod") {
    if (b == 0) return std::nullopt;
    const double rest = std::fmod(a, b);
    return rest < 0 ? rest + std::fabs(b) : rest;
  }
  if (name == "**") {
    if ((a < 0 && b != std::floor(b)) || (a == 0 && b < 0)) return std::nullopt;
    return std::pow(a, b);
  }
  if (name == "eq") return std::fabs(a - b) < 1e-4;
  if (name == "ne") return !(std::fabs(a - b) < 1e-4);
  if (name == "gt") return a > b;
  if (name == "ge") return a >= b;
  if (name == "lt") return a < b;
  if (name == "le") return a <= b;
  if (name == "and") return a != 0 && b != 0;
  if (name == "or") return a != 0 || b != 0;
  return (a != 0) != (b != 0);
}

Result unary(const std::string& name, double a) {
  if (name == "abs") return a < 0 ? -a : a;
  if (name == "cos") return std::cos(a * kRadianPerDeg);
  if (name == "sin") return std::sin(a * kRadianPerDeg);
  if (name == "tan") return std::tan(a * kRadianPerDeg);
  if (name == "exp") return std::exp(a);
  if (name == "fix") return std::floor(a);
  if (name == "fup") return std::ceil(a);
  if (name == "round") return a < 0 ? -std::floor(0.5 - a) : std::floor(a + 0.5);
  if (name == "ln") return a > 0 ? Result(std::log(a)) : std::nullopt;
  if (name == "sqrt") return a >= 0 ? Result(std::sqrt(a)) : std::nullopt;
  if (a < -1 || a > 1) return std::nullopt;
  return kDegPerRadian * (name == "acos" ? std::acos(a) : std::asin(a));
}

// Innermost bracket first, then the operators of each level from left to right.
struct Naive {
  const std::vector<Token>& tokens;
  std::size_t at = 0;

  Result bracket() {
    std::vector<double> values;
    std::vector<std::string> operators;
    ++at;
    for (;;) {
      const Result value = operand();
      if (!value) return std::nullopt;
      values.push_back(*value);
      const Token& next = tokens[at++];
      if (next.kind == Token::Kind::kClose) break;
      operators.push_back(next.text);
    }
    for (int level = 5; level >= 1; --level)
      for (std::size_t i = 0; i < operators.size();) {
        if (level_of(operators[i]) != level) {
          ++i;
          continue;
        }
        const Result value = if_finite(binary(operators[i], values[i], values[i + 1]));
        if (!value) return std::nullopt;
        values[i] = *value;
        values.erase(values.begin() + static_cast<std::ptrdiff_t>(i) + 1);
        operators.erase(operators.begin() + static_cast<std::ptrdiff_t>(i));
      }
    return values[0];
  }
  Result operand() {
    const Token& token = tokens[at];
    if (token.kind == Token::Kind::kNumber) {
      ++at;
      return token.value;
    }
    if (token.kind == Token::Kind::kOpen) return bracket();
    ++at;  // a function
    const Result a = bracket();
    return a ? if_finite(unary(token.text, *a)) : std::nullopt;
  }
};

struct Maker {
  const std::uint8_t* data;
  std::size_t size, at = 0;
  std::vector<Token> tokens;

  unsigned next() { return at < size ? data[at++] : 0U; }
  void bracket(int depth) {
    tokens.push_back({Token::Kind::kOpen, 0, "["});
    operand(depth + 1);
    for (unsigned more = next() % 4; more > 0 && tokens.size() < 80; --more) {
      tokens.push_back({Token::Kind::kBinary, 0, kBinaryNames[next() % 15]});
      operand(depth + 1);
    }
    tokens.push_back({Token::Kind::kClose, 0, "]"});
  }
  void operand(int depth) {
    const unsigned kind = next() % 8;
    if (depth > 8 || kind < 5) {
      const double value = static_cast<double>(next()) / (kind == 0 ? 1.0 : 16.0);
      tokens.push_back({Token::Kind::kNumber, value, {}});
    } else if (kind == 5) {
      bracket(depth);
    } else {
      tokens.push_back({Token::Kind::kUnary, 0, kUnaryNames[next() % 12]});
      bracket(depth);
    }
  }
};

std::string text_of(const std::vector<Token>& tokens) {
  std::string text;
  for (const Token& token : tokens)
    text += token.kind == Token::Kind::kNumber ? fmt::format("{:.4f}", token.value) : " " + token.text + " ";
  return text;
}

class NoState : public trn::StateValues {
 public:
  double predefined(int) const override { return 0; }
  double position(int) const override { return 0; }
};

Result interpreted(const std::string& text) {
  trn::Parameters parameters;
  NoState state;
  std::vector<trn::Instruction> code;
  trn::Lexer lexer(text);
  try {
    trn::ExpressionCompiler compiler(lexer, parameters.names(), code);
    const std::int32_t start = compiler.value();
    return trn::Evaluator(parameters, state).run(code, start);
  } catch (const trn::BlockError&) {
    return std::nullopt;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Maker maker{data, size, 0, {}};
  maker.bracket(0);
  const std::string text = text_of(maker.tokens);
  Naive naive{maker.tokens};
  const Result expected = naive.bracket();
  const Result got = interpreted(text);
  const bool same = got.has_value() == expected.has_value() &&
                    (!got || std::fabs(*got - *expected) <= 1e-9 * std::fmax(1.0, std::fabs(*expected)));
  if (same) return 0;
  std::fprintf(stderr, "%s: interpreter %s, naive %s\n", text.c_str(),
               got ? std::to_string(*got).c_str() : "error",
               expected ? std::to_string(*expected).c_str() : "error");
  std::abort();
}
