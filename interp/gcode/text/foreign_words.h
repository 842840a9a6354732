#pragma once

#include <string_view>

#include "interp/gcode/error.h"
#include "interp/gcode/text/block.h"

// Words and parameters of other controls' languages, and other slips of those who write programs, so that
// messages name them.
namespace trn {

/// The line could not be read: throws the error that names the slip in it, if there is one that explains
/// `error`; else it returns. A slip is another control's word, an operator outside brackets, a decimal comma,
/// or a character that looks like another one. The error's sentence quotes no more than a character of the
/// line.
void refuse_slip(std::string_view line, const BlockError& error);

/// A parameter of the line that other controls give a meaning that it does not have here.
struct ForeignParameter {
  std::string_view warning;  ///< "": there is none
  std::uint32_t column = 1;
};
ForeignParameter foreign_parameter(const ParsedBlock& block);

}  // namespace trn
