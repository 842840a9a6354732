#include "tests/support/paths.h"

namespace trn {

std::string source_dir() { return TRN_SOURCE_DIR; }
std::string build_dir() { return TRN_BINARY_DIR; }

}  // namespace trn
