#include "panel/server/program_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace trn {

namespace {

constexpr std::array<std::string_view, 5> kEndings{".ngc", ".nc", ".cnc", ".tap", ".gcode"};
constexpr std::size_t kListedMax = 1000, kLookedAtMax = 10000;

bool is_program_name(const std::string& name) {
  return !name.starts_with('.') &&
         std::any_of(kEndings.begin(), kEndings.end(),
                     [&](std::string_view ending) { return name.ends_with(ending); });
}

}  // namespace

// What lies elsewhere and what is not there get the same answer: a page must not learn what files the host
// has.
std::string program_path(const std::string& folder, const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code failed;
  const fs::path home = fs::canonical(folder, failed);
  const fs::path real = failed ? fs::path() : fs::canonical(home / name, failed);
  const bool below = !failed && real != home &&
                     std::mismatch(home.begin(), home.end(), real.begin(), real.end()).first == home.end();
  if (!below || !fs::is_regular_file(real, failed))
    throw NoProgram(fmt::format("there is no program '{}' in the folder of this panel", name));
  return real;
}

std::optional<OpenFile> open_program(const std::string& path) {
  const std::filesystem::path file(path);
  return PageFolder(file.parent_path()).open(file.filename().string());
}

std::vector<ProgramFile> list_programs(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<ProgramFile> out;
  std::error_code failed;
  fs::directory_iterator entry(folder, failed);
  for (std::size_t seen = 0; !failed && entry != fs::directory_iterator() && seen < kLookedAtMax; ++seen) {
    const std::string name = entry->path().filename();
    if (is_program_name(name) && out.size() < kListedMax) {
      try {
        struct stat info {};
        if (stat(program_path(folder, name).c_str(), &info) == 0)
          out.push_back({name, static_cast<std::uint64_t>(info.st_size), info.st_mtime});
      } catch (const NoProgram&) {
        // It leads elsewhere, or went meanwhile.
      }
    }
    entry.increment(failed);
  }
  std::sort(out.begin(), out.end(), [](const auto& one, const auto& other) { return one.name < other.name; });
  return out;
}

}  // namespace trn
