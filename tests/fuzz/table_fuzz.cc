#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "tests/fuzz/require.h"

// Fuzz target: any bytes as a tool table (first byte even) or a file of variables. What is accepted is
// written and read again, and is the same; an error names file and line.
namespace {

using namespace trn;
using fuzz::require;

constexpr const char* kFile = "fuzz.tbl";

// Without the place in the table, which follows from the lines around.
std::map<int, Tool> tools_of(const ToolTable& table) {
  std::map<int, Tool> tools = table.tools();
  for (auto& [number, tool] : tools) tool.slot = 0;
  return tools;
}

void judge_tools(const std::map<int, Tool>& tools) {
  for (const auto& [number, tool] : tools) {
    require(number == tool.number && number > 0 && tool.pocket >= 0, "whole numbers");
    require(std::isfinite(tool.diameter) && std::isfinite(tool.front_deg) && std::isfinite(tool.back_deg),
            "a tool's sizes are numbers");
    for (int axis = 0; axis < 6; ++axis) require(std::isfinite(tool.offset[axis]), "offsets are numbers");
  }
}

void read_table(std::string_view text, double unit_mm) {
  const ToolTable table = ToolTable::parse(text, kFile, unit_mm);
  const std::map<int, Tool> tools = tools_of(table);
  judge_tools(tools);
  if (unit_mm != 1) return;  // only tables in millimetres are written
  require(tools_of(ToolTable::parse(table.to_text(), kFile)) == tools, "the same tools again");
  const std::string over = table.text_over(text);
  require(tools_of(ToolTable::parse(over, kFile)) == tools, "the same tools over the file's own lines");
  require(table.text_over(over) == over, "nothing to change the second time");
}

void read_variables(std::string_view text) {
  Parameters parameters, again;
  parse_parameters(text, kFile, parameters);
  for (int n = 1; n <= parameter::kMax; ++n) require(std::isfinite(parameters[n]), "variables are numbers");
  const std::string written = parameters_text(parameters);
  parse_parameters(written, kFile, again);
  require(parameters_text(again) == written, "the same variables again");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes in(data, size);
  const std::uint8_t what = in.byte();
  const auto left = in.some(size);
  const std::string_view text = fuzz::text_of(left.data(), left.size());
  try {
    what % 2 == 0 ? read_table(text, what % 4 == 0 ? 1 : 25.4) : read_variables(text);
    require(text.find('\0') == std::string_view::npos, "zeros are no text");
  } catch (const ProgramError& error) {
    fuzz::require_place(error.what(), kFile);
  }
  return 0;
}
