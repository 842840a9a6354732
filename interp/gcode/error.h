#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "interp/move.h"

namespace trn {

/// Every way a program can be refused; sentence and remedy of each are in one table (error.cc).
enum class GcodeErrorCode : std::uint8_t {
  kCannotOpen,
  kNotProgram,
  kUtf16,
  kMacLineEnds,
  kBinary,
  kLineTooLong,
  kNoProgramEnd,
  kLatePercent,
  kBadCharacter,
  kBadNumber,
  kMissingValue,
  kUnclosedComment,
  kNestedComment,
  kMissingBracket,
  kMissingEquals,
  kBadName,
  kBadExpression,
  kTooDeep,
  kLineNumber,
  kUnknownG,
  kUnknownM,
  kNotSupported,
  kGroupConflict,
  kRepeatedWord,
  kTooManyWords,
  kUnusedWord,
  kMissingWord,
  kBadValue,
  kNoSuchAxis,
  kUnknownParameter,
  kReadOnlyParameter,
  kParameterRange,
  kDivideByZero,
  kDomain,
  kNotInteger,
  kNoMotionMode,
  kMachineMove,
  kAxisWordsUnused,
  kAxisWordsConflict,
  kZeroFeed,
  kFeedModeCycle,
  kInverseFeedMissing,
  kNoSpindle,
  kSpindleDirection,
  kArcNoRadius,
  kArcRadius,
  kArcGap,
  kArcSamePoint,
  kArcMissing,
  kPlane,
  kCycle,
  kProbe,
  kSpline,
  kUnknownTool,
  kNoToolTable,
  kCompState,
  kCompGouge,
  kCompCorner,
  kNoRtcp,
  kRtcpState,
  kUnreachable,
  kTiltedPlane,
  kKnife,
  kKnifeStart,
  kSpindleAxis,
  kFlowSyntax,
  kFlowUnmatched,
  kFlowNoEnd,
  kNextProgram,
  kSubUnknown,
  kSubDepth,
  kSubArguments,
  kSubRepeated,
  kNotSeekable,
  kFromLine,
  kAbort,
  kPolar,
  kForeignBranch,
  kForeignLoop,
  kForeignJump,
  kForeignEquals,
  kForeignDollar,
  kForeignCode,
  kForeignWord,
  kForeignCorner,
  kOutsideBrackets,
  kDecimalComma,
  kLookalike,
  kCount
};

struct GcodeErrorInfo {
  std::string_view name;      ///< stable, for tests and documents
  std::string_view sentence;  ///< with {} for what varies
  std::string_view legal;     ///< what would be right
};
const GcodeErrorInfo& gcode_error_info(GcodeErrorCode code);

/// Where a block stands: 1-based, `file` as the interpreter counts the program and its sub-programs' files.
struct BlockPlace {
  std::uint32_t line = 0, column = 0;
  int file = 0;
};

/// Something found about an earlier block, in a sentence; `is_error`: as bad as the config has it, else a
/// warning.
struct GcodeReport {
  BlockPlace place;
  std::string sentence;
  bool is_error = true;
};

/// An error inside one block, before the interpreter knows file and line; column is 1-based, 0 unknown.
struct BlockError : std::runtime_error {
  BlockError(GcodeErrorCode code_in, std::uint32_t column_in, const std::string& sentence)
      : std::runtime_error(sentence), code(code_in), column(column_in) {}
  GcodeErrorCode code;
  std::uint32_t column;
};

/// Throws BlockError with the sentence of `code`, its placeholders filled in order.
template <typename... Args>
[[noreturn]] void fail(GcodeErrorCode code, std::uint32_t column, const Args&... args) {
  throw BlockError(code, column, fmt::format(fmt::runtime(gcode_error_info(code).sentence), args...));
}

/// The same with file and line; what() is "file:line:column: sentence: 'text'; legal", then one line for each
/// level of the sub-program stack.
struct GcodeError : ProgramError {
  GcodeError(GcodeErrorCode code_in, std::uint32_t line_in, std::uint32_t column_in,
             const std::string& message)
      : ProgramError(message), code(code_in), line(line_in), column(column_in) {}
  GcodeErrorCode code;
  std::uint32_t line;
  std::uint32_t column;
};

}  // namespace trn
