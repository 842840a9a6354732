#include "app/cli/version.h"

namespace trn {

std::string version_text(const char* program) {
  return std::string(program) + " " + TRN_VERSION + " (" + TRN_COMMIT + ")";
}

}  // namespace trn
