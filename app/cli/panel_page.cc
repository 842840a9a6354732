#include "app/cli/panel_page.h"

#include <filesystem>
#include <system_error>
#include <vector>

namespace trn {

std::string own_program() {
  std::error_code none;
  return std::filesystem::read_symlink("/proc/self/exe", none);
}

std::string find_panel_page(const std::string& named) {
  namespace fs = std::filesystem;
  std::error_code none;
  const fs::path here = fs::path(own_program()).parent_path();
  const std::vector<fs::path> places =
      named.empty() ? std::vector<fs::path>{here / "panel", here / "../share/trunnion/panel"}
                    : std::vector<fs::path>{named};
  for (const fs::path& place : places)
    if (fs::is_regular_file(place / "index.html", none)) return place;
  return "";
}

}  // namespace trn
