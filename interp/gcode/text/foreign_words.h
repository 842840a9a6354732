#pragma once

#include <string_view>

#include "interp/gcode/error.h"
#include "interp/gcode/text/block.h"

// Words and parameters of other controls' languages, so that messages name them.
namespace trn {

/// The line could not be read: throws the error that names the other control's word in it, if there is one
/// that explains `error`; else it returns. The error's sentence quotes nothing of the line.
void refuse_foreign_word(std::string_view line, const BlockError& error);

/// A parameter of the line that other controls give a meaning that it does not have here.
struct ForeignParameter {
  std::string_view warning;  ///< "": there is none
  std::uint32_t column = 1;
};
ForeignParameter foreign_parameter(const ParsedBlock& block);

}  // namespace trn
