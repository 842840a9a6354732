#include "interp/gcode/text/expression.h"

#include <cmath>
#include <string>
#include <string_view>

#include "core/check.h"
#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/gcode/text/lexer.h"

namespace trn {

namespace {

struct BinaryOperator {
  std::string_view text;
  Op op;
  int precedence;
};

// Longer spellings first where one begins with another. All operators associate to the left.
constexpr BinaryOperator kBinary[] = {
    {"**", Op::kPower, 5},   {"*", Op::kMultiply, 4},      {"/", Op::kDivide, 4}, {"mod", Op::kModulo, 4},
    {"+", Op::kAdd, 3},      {"-", Op::kSubtract, 3},      {"eq", Op::kEqual, 2}, {"ne", Op::kNotEqual, 2},
    {"gt", Op::kGreater, 2}, {"ge", Op::kGreaterEqual, 2}, {"lt", Op::kLess, 2},  {"le", Op::kLessEqual, 2},
    {"and", Op::kAnd, 1},    {"or", Op::kOr, 1},           {"xor", Op::kXor, 1}};

struct UnaryFunction {
  std::string_view text;
  Op op;
};
constexpr UnaryFunction kFunctions[] = {{"abs", Op::kAbs}, {"acos", Op::kAcos}, {"asin", Op::kAsin},
                                        {"cos", Op::kCos}, {"exp", Op::kExp},   {"fix", Op::kFix},
                                        {"fup", Op::kFup}, {"ln", Op::kLn},     {"round", Op::kRound},
                                        {"sin", Op::kSin}, {"sqrt", Op::kSqrt}, {"tan", Op::kTan}};

// Numbers in programs come from sums of decimals: "#1 EQ 0.3" after three times 0.1 shall be true.
constexpr double kEqualTolerance = 1e-4;
constexpr double kIntegerTolerance = 1e-4;
// Each level of brackets keeps at most a left operand while its right one is computed.
constexpr int kStackSize = 2 * ExpressionCompiler::kMaxDepth + 8;

double modulo(double left, double right, std::uint32_t column) {
  if (right == 0) fail(GcodeErrorCode::kDivideByZero, column);
  // RS274/NGC's MOD is never negative: -1 MOD 360 is 359.
  const double rest = std::fmod(left, right);
  return rest < 0 ? rest + std::fabs(right) : rest;
}

double power(double base, double exponent, std::uint32_t column) {
  if (base < 0 && exponent != std::floor(exponent))
    fail(GcodeErrorCode::kDomain, column, "a broken power", base);
  if (base == 0 && exponent < 0) fail(GcodeErrorCode::kDivideByZero, column);
  return std::pow(base, exponent);
}

double truth(bool value) { return value ? 1.0 : 0.0; }

double apply_binary(Op op, double a, double b, std::uint32_t column) {
  switch (op) {
    case Op::kAdd:
      return a + b;
    case Op::kSubtract:
      return a - b;
    case Op::kMultiply:
      return a * b;
    case Op::kDivide:
      if (b == 0) fail(GcodeErrorCode::kDivideByZero, column);
      return a / b;
    case Op::kModulo:
      return modulo(a, b, column);
    case Op::kPower:
      return power(a, b, column);
    case Op::kEqual:
      return truth(std::fabs(a - b) < kEqualTolerance);
    case Op::kNotEqual:
      return truth(std::fabs(a - b) >= kEqualTolerance);
    case Op::kGreater:
      return truth(a > b);
    case Op::kGreaterEqual:
      return truth(a >= b);
    case Op::kLess:
      return truth(a < b);
    case Op::kLessEqual:
      return truth(a <= b);
    case Op::kAnd:
      return truth(a != 0 && b != 0);
    case Op::kOr:
      return truth(a != 0 || b != 0);
    case Op::kXor:
      return truth((a != 0) != (b != 0));
    default:
      return deg_from_rad(std::atan2(a, b));
  }
}

double arc_function(Op op, double a, std::uint32_t column) {
  if (a < -1 || a > 1) fail(GcodeErrorCode::kDomain, column, op == Op::kAcos ? "ACOS" : "ASIN", a);
  return deg_from_rad(op == Op::kAcos ? std::acos(a) : std::asin(a));
}

double apply_unary(Op op, double a, std::uint32_t column) {
  switch (op) {
    case Op::kNegate:
      return -a;
    case Op::kAbs:
      return std::fabs(a);
    case Op::kAcos:
    case Op::kAsin:
      return arc_function(op, a, column);
    case Op::kCos:
      return std::cos(rad_from_deg(a));
    case Op::kSin:
      return std::sin(rad_from_deg(a));
    case Op::kTan:
      return std::tan(rad_from_deg(a));
    case Op::kExp:
      return std::exp(a);
    // FIX rounds down and not towards zero: FIX[-2.8] is -3 (RS274/NGC).
    case Op::kFix:
      return std::floor(a);
    case Op::kFup:
      return std::ceil(a);
    case Op::kRound:
      return std::round(a);
    case Op::kLn:
      if (a <= 0) fail(GcodeErrorCode::kDomain, column, "LN", a);
      return std::log(a);
    default:
      if (a < 0) fail(GcodeErrorCode::kDomain, column, "SQRT", a);
      return std::sqrt(a);
  }
}

bool is_binary(Op op) { return (op >= Op::kAdd && op <= Op::kXor) || op == Op::kAtan2; }

}  // namespace

void ExpressionCompiler::emit_index(Op op, std::uint32_t column, std::int32_t index) {
  Instruction instruction{op, column, {}};
  instruction.index = index;
  code_.push_back(instruction);
}

void ExpressionCompiler::emit_value(double value, std::uint32_t column) {
  Instruction instruction{Op::kConstant, column, {}};
  instruction.value = value;
  code_.push_back(instruction);
}

void ExpressionCompiler::descend() {
  if (++depth_ > kMaxDepth) fail(GcodeErrorCode::kTooDeep, lexer_.column(), kMaxDepth);
}

void ExpressionCompiler::expect(char c) {
  if (!lexer_.accept(c)) fail(GcodeErrorCode::kMissingBracket, lexer_.column(), c);
}

std::int32_t ExpressionCompiler::value() {
  const auto start = static_cast<std::int32_t>(code_.size());
  operand();
  emit(Op::kEnd, lexer_.column());
  return start;
}

std::int32_t ExpressionCompiler::bracketed() {
  if (lexer_.peek() != '[') fail(GcodeErrorCode::kMissingBracket, lexer_.column(), '[');
  return value();
}

void ExpressionCompiler::operand() {
  descend();
  const char c = lexer_.peek();
  const std::uint32_t column = lexer_.column();
  if (c == '[') {
    lexer_.skip();
    binary(1);
    expect(']');
  } else if (c == '#') {
    lexer_.skip();
    const Reference r = reference();
    if (r.op == Op::kIndirect)
      emit(Op::kIndirect, column);
    else
      emit_index(r.op, column, r.index);
  } else if (c == '+' || c == '-') {
    lexer_.skip();
    operand();
    if (c == '-') emit(Op::kNegate, column);
  } else if (Lexer::is_letter(c)) {
    function();
  } else {
    emit_value(lexer_.number(), column);
  }
  --depth_;
}

ExpressionCompiler::Reference ExpressionCompiler::reference() {
  const char c = lexer_.peek();
  const std::uint32_t column = lexer_.column();
  if (c == '<') {
    lexer_.skip();
    const std::string name = lexer_.name('>');
    // Names that begin with an underscore are global, all others belong to the sub-program.
    if (name[0] != '_') return {Op::kLocal, names_.intern(name)};
    const int predefined = find_predefined(name);
    if (predefined >= 0) return {Op::kPredefined, predefined};
    return {Op::kGlobal, names_.intern(name)};
  }
  // "#5" is found while the line is read and costs no computation when it runs.
  if (Lexer::is_digit(c)) {
    const double value = lexer_.number();
    const auto number = static_cast<std::int64_t>(value);
    if (static_cast<double>(number) != value)
      fail(GcodeErrorCode::kNotInteger, column, "the parameter number", value);
    if (number < 1 || number > parameter::kMax) fail(GcodeErrorCode::kParameterRange, column, number);
    return {Op::kNumbered, static_cast<std::int32_t>(number)};
  }
  if (c != '#' && c != '[' && !Lexer::is_letter(c)) fail(GcodeErrorCode::kBadName, column);
  operand();
  return {Op::kIndirect, 0};
}

void ExpressionCompiler::binary(int least_precedence) {
  descend();
  operand();
  for (;;) {
    const std::uint32_t column = lexer_.column();
    const char c = lexer_.peek();
    if (c == ']' || c == '\0') break;
    const char* mark = lexer_.mark();
    const BinaryOperator* found = nullptr;
    for (const BinaryOperator& candidate : kBinary) {
      if (!lexer_.accept_word(candidate.text)) continue;
      found = &candidate;
      break;
    }
    if (!found) {
      lexer_.back_to(mark);
      fail(GcodeErrorCode::kBadExpression, lexer_.column(), show_byte(c));
    }
    // The operator belongs to an expression further out: in "2 * 3 + 4" the plus ends the product.
    if (found->precedence < least_precedence) {
      lexer_.back_to(mark);
      break;
    }
    // One higher, so that operators of the same rank are taken from the left: 8 / 4 / 2 is 1.
    binary(found->precedence + 1);
    // Behind both operands: the code is in postfix order and needs no brackets when it runs.
    emit(found->op, column);
  }
  --depth_;
}

void ExpressionCompiler::exists(std::uint32_t column) {
  expect('[');
  if (!lexer_.accept('#')) fail(GcodeErrorCode::kBadName, lexer_.column());
  // A number exists if it lies in range; only names can be unknown.
  if (lexer_.peek() != '<') {
    operand();
    emit(Op::kExistsIndirect, column);
    return expect(']');
  }
  const Reference r = reference();
  switch (r.op) {
    case Op::kLocal:
      emit_index(Op::kExistsLocal, column, r.index);
      break;
    case Op::kGlobal:
      emit_index(Op::kExistsGlobal, column, r.index);
      break;
    default:
      emit_index(Op::kExistsPredefined, column, r.index);
  }
  expect(']');
}

void ExpressionCompiler::function() {
  const std::uint32_t column = lexer_.column();
  // EXISTS asks whether there is such a parameter, so its argument must not be loaded.
  if (lexer_.accept_word("exists")) return exists(column);
  const auto argument = [&] {
    expect('[');
    binary(1);
    expect(']');
  };
  if (lexer_.accept_word("atan")) {
    argument();
    // ATAN[y]/[x] has two arguments with a slash between them, which is no division.
    expect('/');
    argument();
    return emit(Op::kAtan2, column);
  }
  for (const UnaryFunction& candidate : kFunctions) {
    if (!lexer_.accept_word(candidate.text)) continue;
    argument();
    return emit(candidate.op, column);
  }
  fail(GcodeErrorCode::kBadExpression, column, show_byte(lexer_.peek()));
}

int Evaluator::parameter_number(double value, std::uint32_t column) {
  const double rounded = std::round(value);
  // "#[#1 + 0.1 * 10]" is meant as a whole number though it may miss it by rounding.
  if (!(std::fabs(value - rounded) <= kIntegerTolerance))
    fail(GcodeErrorCode::kNotInteger, column, "the parameter number", value);
  if (!(rounded >= 1 && rounded <= parameter::kMax)) fail(GcodeErrorCode::kParameterRange, column, rounded);
  return static_cast<int>(rounded);
}

bool Evaluator::exists(double value, std::uint32_t column) {
  const double rounded = std::round(value);
  if (!(std::fabs(value - rounded) <= kIntegerTolerance))
    fail(GcodeErrorCode::kNotInteger, column, "the parameter number", value);
  return rounded >= 1 && rounded <= parameter::kMax;
}

double Evaluator::numbered(int number, std::uint32_t column) const {
  if (number < 1 || number > parameter::kMax) fail(GcodeErrorCode::kParameterRange, column, number);
  // #5420 to #5425 are not stored: they are where the machine stands when the expression is computed.
  if (number >= parameter::kPosition && number < parameter::kPosition + 6)
    return state_.position(number - parameter::kPosition);
  return parameters_[number];
}

const double* Evaluator::named(const Instruction& i) const {
  return i.op == Op::kLocal || i.op == Op::kExistsLocal ? parameters_.local(i.index)
                                                        : parameters_.global(i.index);
}

void Evaluator::unknown(const Instruction& i) const {
  const std::string& name = parameters_.names().name(i.index);
  const bool ini = name.rfind("_ini[", 0) == 0;
  if (ini || name.rfind("_hal[", 0) == 0)
    fail(GcodeErrorCode::kNotSupported, i.column, "#<" + name + ">",
         ini ? "it asks LinuxCNC's INI file, and no such file is read here"
             : "it asks a pin of LinuxCNC's HAL, and there is none here; M66 asks an input");
  fail(GcodeErrorCode::kUnknownParameter, i.column, "#<" + name + ">");
}

double Evaluator::load(const Instruction& i, double top) const {
  switch (i.op) {
    case Op::kConstant:
      return i.value;
    case Op::kNumbered:
      return numbered(i.index, i.column);
    case Op::kIndirect:
      return numbered(parameter_number(top, i.column), i.column);
    case Op::kPredefined:
      return state_.predefined(i.index);
    case Op::kExistsPredefined:
      return 1.0;
    case Op::kExistsIndirect:
      return truth(exists(top, i.column));
    case Op::kExistsLocal:
    case Op::kExistsGlobal:
      return truth(named(i) != nullptr);
    default: {
      const double* value = named(i);
      if (!value) unknown(i);
      return *value;
    }
  }
}

double Evaluator::run(const std::vector<Instruction>& code, std::int32_t start) const {
  std::array<double, kStackSize> stack;
  std::size_t top = 0;
  TRN_CHECK(start >= 0 && static_cast<std::size_t>(start) < code.size());
  for (const Instruction* i = code.data() + start; i->op != Op::kEnd; ++i) {
    // Codes below kNegate put a value on the stack, or replace the number on top by what it names.
    if (i->op < Op::kNegate) {
      if (i->op == Op::kIndirect || i->op == Op::kExistsIndirect) {
        stack[top - 1] = load(*i, stack[top - 1]);
      } else {
        TRN_CHECK(top < kStackSize);
        stack[top++] = load(*i, 0);
      }
    } else if (is_binary(i->op)) {
      TRN_CHECK(top >= 2);
      --top;
      stack[top - 1] = apply_binary(i->op, stack[top - 1], stack[top], i->column);
    } else {
      TRN_CHECK(top >= 1);
      stack[top - 1] = apply_unary(i->op, stack[top - 1], i->column);
    }
    if (!std::isfinite(stack[top - 1]))  // at once: OR and EQ would make a number of it again
      fail(GcodeErrorCode::kDomain, i->column, "the expression", stack[top - 1]);
  }
  TRN_CHECK(top == 1);
  return stack[0];
}

}  // namespace trn
