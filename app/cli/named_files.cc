#include "app/cli/named_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <system_error>

#include "core/config.h"

namespace trn {

namespace {

namespace fs = std::filesystem;

// Where a folder of the source is while one works in it, and where it is once installed.
std::vector<fs::path> shipped(const char* folder) {
  std::error_code none;
  const fs::path here = fs::read_symlink("/proc/self/exe", none).parent_path();
  return {(here / "../share/trunnion" / folder).lexically_normal(),
          (here / "../.." / folder).lexically_normal()};
}

std::vector<fs::path> machine_folders(const fs::path& folder) {
  std::vector<fs::path> out = {folder, folder / "configs", "/etc/trunnion"};
  for (const fs::path& place : shipped("configs")) out.push_back(place);
  return out;
}

// What is wrong with the value of a --machine, or "". A name becomes the config's path.
std::string find_machine(std::string& given) {
  std::error_code none;
  const bool a_file = fs::exists(given, none) && !fs::is_directory(given, none);
  if (a_file || given.empty() || given.find_first_of("/.") != std::string::npos) return "";
  if (const auto found = machine_of_name(given)) {
    given = *found;
    return "";
  }
  const std::vector<std::string> names = machine_names();
  const std::string near = nearest_word(given, names);
  if (names.empty())
    return fmt::format("no machine has the name '{}'; give a config: --machine FILE.toml", given);
  return fmt::format("no machine has the name '{}'{} Known: {}; or give a config: --machine FILE.toml", given,
                     near.empty() ? "." : fmt::format("; did you mean '{}'?", near), fmt::join(names, ", "));
}

}  // namespace

bool is_file(const fs::path& path) {
  std::error_code none;
  return fs::is_regular_file(path, none);
}

std::string with_examples(const std::string& program) {
  std::error_code none;
  if (program.empty() || program.find('/') != std::string::npos || fs::exists(program, none)) return program;
  for (const fs::path& folder : shipped("examples"))
    if (is_file(folder / (program + ".ngc"))) return folder / (program + ".ngc");
  return program;
}

std::optional<std::string> machine_of_name(const std::string& name, const fs::path& folder) {
  if (name.empty() || name.find_first_of("/.") != std::string::npos) return std::nullopt;
  const std::string file = name + ".toml";
  if (is_file(folder / name / file)) return folder / name / file;
  for (const fs::path& place : machine_folders(folder))
    if (is_file(place / file)) return place / file;
  return std::nullopt;
}

std::vector<std::string> machine_names() {
  std::set<std::string> out;
  for (const fs::path& folder : machine_folders("")) {
    if (folder.empty()) continue;  // here lie other .toml files, too
    std::error_code none;
    for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none))
      if (entry->path().extension() == ".toml") out.insert(entry->path().stem().string());
  }
  return {out.begin(), out.end()};
}

void take_machine_names(CLI::App& app) {
  for (CLI::Option* option : app.get_options())
    if (option->check_lname("machine") && option->get_description() != kMachineHelp)
      option->transform(CLI::Validator(find_machine, ""));
  for (CLI::App* command : app.get_subcommands({}))
    if (command->get_name() != "commission") take_machine_names(*command);
}

}  // namespace trn
