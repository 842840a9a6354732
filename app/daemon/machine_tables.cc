#include "app/daemon/machine_tables.h"

#include <array>
#include <string>
#include <vector>

#include "core/axes.h"
#include "core/units.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/g_code.h"

namespace trn {

namespace {

constexpr std::size_t kToolsMax = 250, kRemarkBytesMax = 60;  // one packet has 64 KiB

/// X to C of the rows of one table, a list for each axis.
using Columns = std::array<std::vector<double>*, 6>;

void put(const MmWords& words, const Columns& columns) {
  const Words si = in_radians(words);
  for (int i = 0; i < 6; ++i) columns[static_cast<std::size_t>(i)]->push_back(si[i]);
}

MmWords stored(const Parameters& parameters, int first, double unit_mm) {
  TableWords words;
  for (int i = 0; i < 6; ++i) words[i] = parameters[first + i];
  return in_mm(words, unit_mm);
}

void add_offsets(const Parameters& parameters, double unit_mm, trunnion::tables_t& out) {
  const Columns columns{&out.offset_x, &out.offset_y, &out.offset_z,
                        &out.offset_a, &out.offset_b, &out.offset_c};
  const auto add = [&](const std::string& name, int first, double rotation_deg) {
    out.offset_name.push_back(name);
    put(stored(parameters, first, unit_mm), columns);
    out.offset_rotation.push_back(rad_from_deg(rotation_deg));
  };
  for (std::size_t i = 0; i < kWorkOffsetCodes.size(); ++i) {
    const int first = parameter::kFirstOffset + static_cast<int>(i) * parameter::kOffsetStride;
    add(g_name(kWorkOffsetCodes[i]), first, parameters[first + parameter::kOffsetRotation]);
  }
  add("G92", parameter::kG92, 0);
  add("G28", parameter::kG28, 0);
  add("G30", parameter::kG30, 0);
  out.offset_count = static_cast<std::int32_t>(out.offset_name.size());
}

}  // namespace

trunnion::tables_t tables_of(const Parameters& parameters, const ToolTable& tools, double unit_mm) {
  trunnion::tables_t out{};
  add_offsets(parameters, unit_mm, out);
  const Columns columns{&out.tool_x, &out.tool_y, &out.tool_z, &out.tool_a, &out.tool_b, &out.tool_c};
  for (const auto& [number, tool] : tools.tools()) {
    if (out.tool_number.size() == kToolsMax) break;
    out.tool_number.push_back(number);
    out.tool_pocket.push_back(tool.pocket);
    put(tool.offset, columns);
    out.tool_diameter.push_back(tool.diameter);
    out.tool_remark.push_back(tool.comment.substr(0, kRemarkBytesMax));
  }
  out.tool_count = static_cast<std::int32_t>(out.tool_number.size());
  out.tools_more = static_cast<std::int32_t>(tools.tools().size() - out.tool_number.size());
  return out;
}

}  // namespace trn
