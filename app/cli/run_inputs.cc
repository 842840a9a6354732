#include "app/cli/run_inputs.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

#include "app/cli/named_files.h"
#include "core/letter_case.h"
#include "interp/gcode/error.h"
#include "interp/move.h"

namespace trn {

namespace {

namespace fs = std::filesystem;

constexpr int kHeadLines = 20;
constexpr std::size_t kLineMax = 1000;

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

/// What a line's comment says behind "key:".
struct HeadValue {
  std::string value;       ///< "" if it is none
  std::string unusable;    ///< what stands there instead
  std::size_t column = 0;  ///< of the key, from 1; 0: it is not there
};

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  return first == text.npos ? std::string_view()
                            : text.substr(first, text.find_last_not_of(" \t\r") + 1 - first);
}

// Names may have spaces in them; quotes and the file's ending say where they end, and else a ';' does.
std::string file_in(std::string_view text, std::string_view ending) {
  const char quote = text.empty() ? ' ' : text[0];
  if (quote == '"' || quote == '\'') {
    const std::size_t close = text.find(quote, 1);
    const std::string_view inside = trimmed(text.substr(1, close == text.npos ? close : close - 1));
    return close != text.npos && inside.ends_with(ending) ? std::string(inside) : std::string();
  }
  for (std::size_t at = text.find(ending); at != text.npos; at = text.find(ending, at + 1)) {
    const std::size_t end = at + ending.size();
    const bool ends =
        end == text.size() || std::string_view(";,) \t\r").find(text[end]) != std::string_view::npos;
    if (at > 0 && ends && text.substr(0, at).find(';') == std::string_view::npos)
      return std::string(text.substr(0, end));
  }
  return {};
}

// "(machine: configs/mill.toml, a mill)", "; Tools : my tools.tbl". A word of the same name in a sentence is
// passed over, unless a file stands behind it.
HeadValue value_in(std::string_view line, std::string_view key, std::string_view ending) {
  const std::size_t comment = line.find_first_of("(;");
  if (comment == std::string_view::npos) return {};
  const std::string lower = lower_case(line);
  HeadValue out;
  for (std::size_t at = lower.find(key, comment); at != std::string::npos; at = lower.find(key, at + 1)) {
    const std::size_t colon = lower.find_first_not_of(" \t", at + key.size());
    if (colon == std::string::npos || lower[colon] != ':' ||
        std::isalnum(static_cast<unsigned char>(lower[at - 1])))
      continue;
    std::string_view behind = line.substr(colon + 1);
    if (line[comment] == '(') behind = behind.substr(0, behind.find(')'));
    behind = trimmed(behind);
    const std::string value = file_in(behind, ending);
    const std::size_t before = lower.find_last_not_of(" \t", at - 1);
    const bool alone =
        before != std::string::npos && std::string_view("(;,").find(lower[before]) != std::string_view::npos;
    if (!value.empty()) return {value, "", at + 1};
    if (alone && out.column == 0)
      out = {"", std::string(trimmed(behind.substr(0, behind.find(';')))), at + 1};
  }
  return out;
}

std::string read_line(std::ifstream& in) {
  std::string line(kLineMax, '\0');
  in.getline(line.data(), static_cast<std::streamsize>(line.size()));
  line.resize(static_cast<std::size_t>(in.gcount()));
  while (!line.empty() && line.back() == '\0') line.pop_back();  // where the line's end was
  return line;
}

void read_head(RunInputs& inputs) {
  if (!is_file(inputs.program)) return;  // a pipe is read once, by the interpreter
  std::ifstream in(inputs.program, std::ios::binary);
  const fs::path folder = fs::path(inputs.program).parent_path();
  // "(machine: mill)", and in capitals where the whole program is.
  const auto machine_of = [&](const HeadValue& found) -> std::string {
    const std::string name(trimmed(std::string_view(found.unusable).substr(0, found.unusable.find(','))));
    for (const std::string& spelled : {name, lower_case(name)})
      if (const auto file = machine_of_name(spelled, folder)) return *file;
    return "";
  };
  const auto take = [&](std::string_view line, int number, std::string_view key, std::string_view ending,
                        std::string& to) {
    if (!to.empty()) return;
    const HeadValue found = value_in(line, key, ending);
    if (!found.value.empty())
      to = (folder / found.value).lexically_normal().string();
    else if (key == "machine")
      to = machine_of(found);
    if (to.empty() && found.column > 0)
      inputs.remarks.push_back(fmt::format("{}:{}:{}: warning: '{}:' names no {} file: '{}'", inputs.program,
                                           number, found.column, key, ending, found.unusable));
  };
  for (int number = 1; number <= kHeadLines && in; ++number) {
    const std::string line = read_line(in);
    take(line, number, "machine", ".toml", inputs.machine);
    take(line, number, "tools", ".tbl", inputs.tools);
  }
}

void check_program_file(const std::string& path) {
  std::error_code none;
  const fs::file_status status = fs::status(path, none);
  const char* const why = !fs::exists(status)        ? "No such file or directory"
                          : fs::is_directory(status) ? "it is a folder"
                                                     : nullptr;
  if (!why) return;
  const GcodeErrorInfo& info = gcode_error_info(GcodeErrorCode::kCannotOpen);
  throw ProgramError(fmt::format(fmt::runtime(info.sentence), fmt::format("'{}': {}", path, why)) +
                     fmt::format("; legal: {}", info.legal));
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

void check_inputs(const RunInputs& inputs) {
  for (const std::string& remark : inputs.remarks) fmt::print(stderr, "{}\n", remark);
  if (!inputs.machine.empty()) return;
  // A program that is not there could have named no machine.
  check_program_file(inputs.program);
  throw CLI::RequiredError("--machine, or a comment (machine: FILE.toml) in the program's first lines,");
}

}  // namespace trn
