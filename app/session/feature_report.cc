#include "app/session/feature_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "app/session/json_numbers.h"

namespace trn {

std::string features_text(const std::vector<FeatureDeflection>& features, std::size_t more) {
  constexpr std::size_t kShownMax = 20;
  std::string out;
  for (std::size_t i = 0; i < std::min(features.size(), kShownMax); ++i) {
    const FeatureDeflection& f = features[i];
    if (out.empty()) out = "  what the tool's bending makes of the program\n";
    const std::string lines = f.last_line > f.line ? fmt::format("lines {}-{}", f.line, f.last_line)
                                                   : fmt::format("line {}", f.line);
    if (f.circle)
      out += fmt::format("    {:<14} circle {:9.4f} mm   bends {:+.4f} mm outward   predicted {:9.4f} mm",
                         lines, f.size_mm, f.bending_mm, f.predicted_mm());
    else
      out += fmt::format("    {:<14} cut    {:9.4f} mm   bends {:+.4f} mm to the left   off by {:+.4f} mm",
                         lines, f.size_mm, f.bending_mm, f.offset_mm);
    if (f.unknown > 0) out += fmt::format("   ({:.0f} % of it unknown)", 100 * f.unknown);
    out += "\n";
  }
  more += features.size() - std::min(features.size(), kShownMax);
  if (more > 0) out += fmt::format("    and {} more\n", more);
  return out;
}

nlohmann::json features_json(const std::vector<FeatureDeflection>& features) {
  nlohmann::json out = nlohmann::json::array();
  for (const FeatureDeflection& f : features)
    out.push_back({{"line", f.line},
                   {"last_line", f.last_line},
                   {"feature", f.circle ? "circle" : "cut"},
                   {"size_mm", f.size_mm},
                   {"bending_mm", f.bending_mm},
                   {"offset_mm", f.offset_mm},
                   {"predicted_mm", f.predicted_mm()},
                   {"unknown_share", f.unknown}});
  return out;
}

std::vector<FeatureDeflection> features_from(const nlohmann::json& json) {
  std::vector<FeatureDeflection> out;
  for (const nlohmann::json& entry : json) {
    FeatureDeflection f;
    f.line = whole<std::uint32_t>(entry.at("line"));
    f.last_line = whole<std::uint32_t>(entry.at("last_line"));
    const std::string kind = entry.at("feature");
    if (kind != "circle" && kind != "cut") throw std::runtime_error(fmt::format("'{}' is no feature", kind));
    f.circle = kind == "circle";
    f.size_mm = entry.at("size_mm");
    f.bending_mm = entry.at("bending_mm");
    f.offset_mm = entry.at("offset_mm");
    f.unknown = entry.at("unknown_share");
    out.push_back(f);
  }
  return out;
}

}  // namespace trn
