#pragma once

#include <string>
#include <vector>

namespace trn {

/// The top of the source tree and of the build tree, absolute, without a slash at the end.
std::string source_dir();
std::string build_dir();

/// The paths of all machine configs in configs/, sorted.
std::vector<std::string> shipped_configs();

}  // namespace trn
