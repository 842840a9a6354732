#pragma once

#include <string>

namespace trn {

/// The top of the source tree and of the build tree, absolute, without a slash at the end.
std::string source_dir();
std::string build_dir();

}  // namespace trn
