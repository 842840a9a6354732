#include "app/import/import_linuxcnc.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "app/import/config_text.h"
#include "app/import/config_writer.h"
#include "app/import/hal_setup.h"
#include "app/import/import_place.h"
#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"
#include "app/import/machine_reader.h"
#include "app/import/variable_file.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"

namespace trn {

namespace {

/// The text of a file that the INI names; nothing, with a note, if it is not there.
std::optional<std::string> named_text(const IniFile& ini, const ImportReader& read, const char* section,
                                      const char* key, ImportedFiles& out, std::string& path) {
  const IniEntry* entry = ini.find(section, key);
  if (!entry) return std::nullopt;
  path = beside(folder_of(ini.path()), ini.text(section, key));
  std::optional<std::string> text = read(path);
  if (text)
    out.read.push_back(path);
  else
    out.machine.note(ImportSpot::kEnd, entry->value_place, fmt::format("{} = {}", key, entry->value),
                     "this file cannot be read; LinuxCNC begins an empty one then",
                     "nothing, or copy it and import again");
  return text;
}

/// The factor of #n: lengths and angles of offsets, homes and the probe's place.
double parameter_unit(int n, const ImportedMachine& machine) {
  int word = -1;
  for (const int first : {5061, 5161, 5181, 5211})
    if (n >= first && n < first + 9) word = n - first;
  if (n >= 5221 && n <= 5390 && (n - 5221) % 20 < 9) word = (n - 5221) % 20;
  if (word < 0) return 1;
  return word >= 3 && word < 6 ? machine.deg_per_unit : machine.mm_per_unit;
}

constexpr std::size_t kTold = 10;  // of the lines that a file has, each with a note

void note_lines(const std::vector<LeftOutLine>& lines, const std::string& path, ImportSpot spot,
                const std::string& more, const std::string& to_do, ImportedFiles& out) {
  for (std::size_t i = 0; i < std::min(lines.size(), kTold); ++i)
    out.machine.note(spot, {path, static_cast<int>(lines[i].line), static_cast<int>(lines[i].column)},
                     lines[i].text.substr(0, 80), lines[i].why, to_do);
  if (lines.size() > kTold)
    out.machine.note(spot, {path}, fmt::format("{} more lines of the file", lines.size() - kTold), more,
                     "look into the old file");
}

void convert_variables(const std::string& text, const std::string& path, ImportedFiles& out) {
  Parameters parameters;
  std::vector<LeftOutLine> left_out;
  parse_parameters(readable_variables(text, path, left_out), path, parameters);
  note_lines(left_out, path, ImportSpot::kEnd, "they are no parameters either",
             "nothing, or look whether a parameter was meant, and write it into the new file", out);
  bool own = false;
  for (int n = parameter::kUserFirst; n <= parameter::kMachineLast; ++n) {
    parameters[n] *= parameter_unit(n, out.machine);
    own = own || (n <= parameter::kUserLast && parameters[n] != 0);
  }
  out.variables = parameters_text(parameters);
  if (own && out.machine.mm_per_unit != 1)
    out.machine.note(ImportSpot::kEnd, {path}, "your own parameters #31 to #5000",
                     "nobody knows which of them are lengths; they were kept as they are",
                     "convert the lengths to mm");
}

/// Words U, V and W of the tools that were read: no axis here has them.
std::vector<LeftOutLine> lost_offsets(const std::string& text, const std::vector<LeftOutLine>& left_out) {
  std::vector<LeftOutLine> lost;
  std::istringstream stream(text);
  std::uint32_t number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    const auto is_this = [&](const LeftOutLine& one) { return one.line == number; };
    if (std::any_of(left_out.begin(), left_out.end(), is_this)) continue;
    const std::string words = line.substr(0, line.find(';'));
    if (words.find_first_of("Tt") == std::string::npos) continue;
    std::string found;
    std::size_t first = std::string::npos;
    for (std::size_t at = 0; (at = words.find_first_of("UVWuvw", at)) != std::string::npos; ++at) {
      char* end = nullptr;
      if (std::strtod(words.c_str() + at + 1, &end) == 0) continue;
      found +=
          fmt::format("{}{}", found.empty() ? "" : " ", trimmed(std::string_view(words.c_str() + at, end)));
      first = std::min(first, at);
    }
    if (found.empty()) continue;
    lost.push_back({number, static_cast<std::uint32_t>(first) + 1, std::string(trimmed(words)),
                    fmt::format("no machine here has axes U, V and W; {} was left out of this tool", found)});
  }
  return lost;
}

// LinuxCNC skips lines that it cannot read, and of two lines with one T it takes the first (tooldata_load and
// tooldata_find_index_for_tool of 2.9). So a machine that runs there comes over. A length as Z10,5, of which
// LinuxCNC reads 10, is left out as well: nobody knows which was meant.
void convert_tools(const std::string& text, const std::string& path, ImportedFiles& out) {
  std::vector<LeftOutLine> left_out;
  out.tools = ToolTable::parse_readable(text, path, out.machine.mm_per_unit, left_out).to_text();
  for (LeftOutLine& line : left_out) line.why += "; this tool was left out";
  const std::vector<LeftOutLine> lost = lost_offsets(text, left_out);
  note_lines(left_out, path, ImportSpot::kToolChange, "they cannot be read either; these tools were left out",
             "trunnion tool adds it with the number that it should have", out);
  note_lines(lost, path, ImportSpot::kToolChange, "they have offsets of U, V and W as well",
             "if it was the tool's length, write it as Z into the new table", out);
}

void convert_tables(const IniFile& ini, const ImportReader& read, ImportedFiles& out) {
  std::string path;
  out.variables = parameters_text(Parameters());
  if (const auto text = named_text(ini, read, "EMCIO", "TOOL_TABLE", out, path))
    convert_tools(*text, path, out);
  if (const auto text = named_text(ini, read, "RS274NGC", "PARAMETER_FILE", out, path))
    convert_variables(*text, path, out);
}

}  // namespace

ImportedFiles import_linuxcnc(const std::string& path, const ImportReader& read, const std::string& library) {
  const IniFile ini = IniFile::load(path, read);
  const HalSetup hal = HalSetup::load(ini, read, library);
  // They are asked for here, so that they are not told as left out.
  ini.find("EMCIO", "TOOL_TABLE");
  ini.find("RS274NGC", "PARAMETER_FILE");
  ImportedFiles out;
  out.machine = read_linuxcnc_machine(ini, hal);
  out.read = ini.files();
  out.read.insert(out.read.end(), hal.files().begin(), hal.files().end());
  try {
    convert_tables(ini, read, out);
  } catch (const ProgramError& error) {
    throw ImportError(error.what());
  }
  out.config = config_text(out.machine);
  return out;
}

nlohmann::ordered_json import_json(const ImportedFiles& files) {
  using Json = nlohmann::ordered_json;
  Json joints = Json::array();
  for (const ImportedJoint& joint : files.machine.joints)
    joints.push_back({{"name", plain_text(joint.name)},
                      {"type", joint.rotary ? "rotary" : "linear"},
                      {"joint", joint.number},
                      {"min", joint.min},
                      {"max", joint.max},
                      {"velocity", joint.velocity},
                      {"acceleration", joint.acceleration},
                      {"jerk", joint.jerk}});
  Json notes = Json::array();
  for (const ImportNote& note : files.machine.notes)
    notes.push_back({{"file", plain_text(note.place.file)},
                     {"line", note.place.line},
                     {"column", note.place.column},
                     {"what", plain_text(note.what)},
                     {"why", plain_text(note.why)},
                     {"to_do", plain_text(note.to_do)}});
  Json read = Json::array();
  for (const std::string& path : files.read) read.push_back(plain_text(path));
  return {{"machine", plain_text(files.machine.name)},
          {"kinematics", plain_text(files.machine.kinematics)},
          {"joints", joints},
          {"read", read},
          {"notes", notes}};
}

}  // namespace trn
