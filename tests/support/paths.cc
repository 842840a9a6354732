#include "tests/support/paths.h"

#include <algorithm>
#include <filesystem>

namespace trn {

std::string source_dir() { return TRN_SOURCE_DIR; }
std::string build_dir() { return TRN_BINARY_DIR; }

std::vector<std::string> shipped_configs() {
  std::vector<std::string> out;
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() + "/configs"))
    if (entry.path().extension() == ".toml") out.push_back(entry.path().string());
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace trn
