#include "panel/server/program_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "core/safe_file.h"

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

std::optional<OpenFile> open_file(const std::string& path) {
  const std::filesystem::path file(path);
  return PageFolder(file.parent_path()).open(file.filename().string());
}

void keep_program(const std::string& folder, const std::string& name, const std::string& text) {
  constexpr std::size_t kNameMax = 120;
  const bool letters = std::all_of(name.begin(), name.end(), [](unsigned char letter) {
    return std::isalnum(letter) ||
           std::string_view(" ._-").find(static_cast<char>(letter)) != std::string_view::npos;
  });
  if (!letters || name.size() > kNameMax || !is_program_name(name))
    throw NoProgram(
        fmt::format("'{}' is no name for a program: letters, digits, space, . _ - and one of the endings "
                    "{}",
                    name, fmt::join(kEndings, " ")));
  const std::filesystem::path path = std::filesystem::path(folder) / name;
  try {
    write_file_safely(path, text);
  } catch (const FileError& error) {
    throw NoProgram(error.what());
  }
  // The daemon may be another user, and a program is no secret on its host.
  using std::filesystem::perms;
  std::error_code none;
  std::filesystem::permissions(
      path, perms::owner_read | perms::owner_write | perms::group_read | perms::others_read, none);
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
