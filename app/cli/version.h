#pragma once

#include <string>

namespace trn {

/// "trunnion 0.2.0 (commit 0bcd0264f1)", for the program of that name.
std::string version_text(const char* program);

}  // namespace trn
