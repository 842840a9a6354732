#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "interp/gcode/parameters.h"

namespace trn {

class Lexer;

/// Operations of a compiled expression, in postfix order.
enum class Op : std::uint8_t {
  kConstant,
  kNumbered,
  kIndirect,
  kLocal,
  kGlobal,
  kPredefined,
  kExistsIndirect,
  kExistsLocal,
  kExistsGlobal,
  kExistsPredefined,
  kNegate,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kModulo,
  kPower,
  kEqual,
  kNotEqual,
  kGreater,
  kGreaterEqual,
  kLess,
  kLessEqual,
  kAnd,
  kOr,
  kXor,
  kAbs,
  kAcos,
  kAsin,
  kAtan2,
  kCos,
  kExp,
  kFix,
  kFup,
  kLn,
  kRound,
  kSin,
  kSqrt,
  kTan,
  kEnd
};

struct Instruction {
  Op op = Op::kEnd;
  std::uint32_t column = 0;
  union {
    double value = 0;
    std::int32_t index;
  };
};

/// Compiles values (number, #parameter, [expression], function) from a line into postfix code.
class ExpressionCompiler {
 public:
  ExpressionCompiler(Lexer& lexer, NameTable& names, std::vector<Instruction>& code)
      : lexer_(lexer), names_(names), code_(code) {}

  /// One value up to where it ends; returns where its code starts. BlockError on bad syntax.
  std::int32_t value();
  /// The same with the '[' already next: conditions and arguments of O-words.
  std::int32_t bracketed();
  /// What follows '#': leaves the parameter's number as an index, an expression or a name.
  struct Reference {
    Op op = Op::kNumbered;
    std::int32_t index = 0;
  };
  Reference reference();

  static constexpr int kMaxDepth = 100;

 private:
  void operand();
  void binary(int least_precedence);
  void function();
  void exists(std::uint32_t column);
  void expect(char c);
  void emit(Op op, std::uint32_t column) { code_.push_back(Instruction{op, column, {}}); }
  void emit_index(Op op, std::uint32_t column, std::int32_t index);
  void emit_value(double value, std::uint32_t column);
  void descend();

  Lexer& lexer_;
  NameTable& names_;
  std::vector<Instruction>& code_;
  int depth_ = 0;
};

/// Runs compiled expressions. Angles are in degrees; comparisons for equality allow 1e-4, as the dialect
/// does.
class Evaluator {
 public:
  Evaluator(Parameters& parameters, const StateValues& state) : parameters_(parameters), state_(state) {}

  /// BlockError on division by zero, unknown parameter and the like.
  double run(const std::vector<Instruction>& code, std::int32_t start) const;
  double numbered(int number, std::uint32_t column) const;
  /// Checks that `value` is a parameter number.
  static int parameter_number(double value, std::uint32_t column);
  /// EXISTS of a numbered parameter: there is one of this number.
  static bool exists(double value, std::uint32_t column);

  const Parameters& parameters() const { return parameters_; }

 private:
  double load(const Instruction& instruction, double top) const;
  const double* named(const Instruction& instruction) const;
  [[noreturn]] void unknown(const Instruction& instruction) const;

  Parameters& parameters_;
  const StateValues& state_;
};

}  // namespace trn
