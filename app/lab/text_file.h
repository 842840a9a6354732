#pragma once

#include <string>

namespace trn {

/// Writes a result of the laboratory: a picture, a table, a section of a config. OutputError
/// "PATH: cannot write this file" where that fails.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace trn
