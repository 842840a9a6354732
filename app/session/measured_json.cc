#include "app/session/measured_json.h"

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "app/session/json_numbers.h"
#include "core/axes.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

namespace {

nlohmann::json tool_json(const Tool& tool) {
  nlohmann::json offset = nlohmann::json::array();
  for (int i = kX; i <= kC; ++i) offset.push_back(tool.offset[i]);
  return {{"number", tool.number}, {"pocket", tool.pocket},           {"slot", tool.slot},
          {"offset", offset},      {"diameter", tool.diameter},       {"front", tool.front_deg},
          {"back", tool.back_deg}, {"orientation", tool.orientation}, {"remark", tool.comment}};
}

Tool tool_from(const nlohmann::json& json) {
  Tool tool;
  tool.number = whole<int>(json.at("number"));
  tool.pocket = whole<int>(json.at("pocket"));
  tool.slot = whole<int>(json.at("slot"));
  for (int i = kX; i <= kC; ++i) tool.offset[i] = json.at("offset").at(static_cast<std::size_t>(i));
  tool.diameter = json.at("diameter");
  tool.front_deg = json.at("front");
  tool.back_deg = json.at("back");
  tool.orientation = whole<int>(json.at("orientation"));
  tool.comment = json.at("remark").get<std::string>();
  return tool;
}

}  // namespace

nlohmann::json measured_json(const MeasuredValues& measured) {
  nlohmann::json numbers = nlohmann::json::array(), tools = nlohmann::json::array();
  for (const auto& [number, set] : measured.numbers) numbers.push_back({number, set.value, set.until_block});
  for (const auto& [number, row] : measured.tools)
    tools.push_back({number, row.tool ? tool_json(*row.tool) : nlohmann::json(), row.until_block});
  return {{"numbers", numbers}, {"tools", tools}};
}

MeasuredValues measured_from(const nlohmann::json& json) {
  MeasuredValues out;
  for (const nlohmann::json& entry : json.at("numbers")) {
    const int number = whole<int>(entry.at(0));
    if (number < parameter::kG28 || number > parameter::kTool)
      throw std::runtime_error("no offset of the machine");
    out.numbers[number] = {entry.at(1), whole<std::uint64_t>(entry.at(2))};
  }
  for (const nlohmann::json& entry : json.at("tools")) {
    const int number = whole<int>(entry.at(0));
    if (number <= 0) throw std::runtime_error("no tool");
    MeasuredValues::ToolRow& row = out.tools[number];
    if (!entry.at(1).is_null()) row.tool = tool_from(entry.at(1));
    row.until_block = whole<std::uint64_t>(entry.at(2));
  }
  return out;
}

}  // namespace trn
