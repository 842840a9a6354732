#include "app/cli/run_inputs.h"

#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

namespace trn {

namespace {

namespace fs = std::filesystem;

constexpr int kHeadLines = 20;
constexpr std::size_t kLineMax = 1000;

bool is_file(const fs::path& path) {
  std::error_code none;
  return fs::is_regular_file(path, none);
}

// The first of the places that is a file; else the path as it was given.
std::string first_file(const std::string& given, const std::vector<fs::path>& places) {
  std::error_code none;
  if (fs::exists(given, none) || fs::path(given).is_absolute()) return given;
  for (const fs::path& place : places)
    if (is_file(place)) return place.string();
  return given;
}

std::vector<fs::path> places_of_program(const std::string& program, const fs::path& project) {
  const fs::path examples = project / "examples";
  return {project / program, examples / program, examples / (program + ".ngc")};
}

// What stands behind "key:" in a comment, if it ends so: "(machine: configs/mill.toml, a mill)".
std::string value_in(std::string_view line, std::string_view key, std::string_view ending) {
  const std::size_t comment = line.find('(');
  const std::size_t found = comment == std::string_view::npos ? comment : line.find(key, comment);
  if (found == std::string_view::npos) return {};
  const std::size_t start = line.find_first_not_of(' ', found + key.size());
  if (start == std::string_view::npos) return {};
  const std::string_view value = line.substr(start, line.find_first_of(";,) \r", start) - start);
  const bool fits = value.size() > ending.size() && value.substr(value.size() - ending.size()) == ending;
  return fits ? std::string(value) : std::string();
}

std::string read_line(std::ifstream& in) {
  std::string line(kLineMax, '\0');
  in.getline(line.data(), static_cast<std::streamsize>(line.size()));
  line.resize(static_cast<std::size_t>(in.gcount()));
  return line;
}

void read_head(RunInputs& inputs) {
  if (!is_file(inputs.program)) return;  // a pipe is read once, by the interpreter
  std::ifstream in(inputs.program, std::ios::binary);
  const fs::path folder = fs::path(inputs.program).parent_path();
  const auto take = [&](const std::string& value, std::string& to) {
    if (to.empty() && !value.empty()) to = (folder / value).lexically_normal().string();
  };
  for (int i = 0; i < kHeadLines && in; ++i) {
    const std::string line = read_line(in);
    take(value_in(line, "machine:", ".toml"), inputs.machine);
    take(value_in(line, "tools:", ".tbl"), inputs.tools);
  }
}

}  // namespace

RunInputs complete_inputs(RunInputs inputs, const std::string& project) {
  const fs::path root = project;
  if (!project.empty()) {
    if (inputs.program.empty()) inputs.program = (root / "examples/impeller.ngc").string();
    inputs.program = first_file(inputs.program, places_of_program(inputs.program, root));
    if (!inputs.machine.empty()) inputs.machine = first_file(inputs.machine, {root / inputs.machine});
    if (!inputs.tools.empty()) inputs.tools = first_file(inputs.tools, {root / inputs.tools});
  }
  read_head(inputs);
  if (!project.empty() && inputs.machine.empty()) inputs.machine = (root / "configs/cradle.toml").string();
  return inputs;
}

std::string with_examples(const std::string& program) {
  if (program.empty() || program.find('/') != std::string::npos) return program;
  std::error_code none;
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe", none).parent_path();
  for (const char* folder : {"../share/trunnion/examples", "../../examples"}) {
    const std::filesystem::path found = (here / folder / (program + ".ngc")).lexically_normal();
    if (!std::filesystem::exists(program, none) && std::filesystem::is_regular_file(found, none))
      return found;
  }
  return program;
}

}  // namespace trn
