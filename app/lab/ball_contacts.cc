#include "app/lab/ball_contacts.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>

#include "compensation/geometric.h"
#include "core/config.h"
#include "core/motion.h"
#include "core/plain_file.h"
#include "core/ports.h"
#include "core/units.h"
#include "kernel/joint_map.h"

namespace trn {

namespace {

const std::vector<std::string> kColumns = {"x_mm",  "y_mm",  "z_mm",      "a_deg",
                                           "b_deg", "c_deg", "length_mm", "tip_mm"};
constexpr std::size_t kLength = 6, kTip = 7;

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',' || c == ';' || c == '\t')
      cells.emplace_back();
    else if (c != ' ' && c != '\r' && c != '"')
      cells.back() += c;
  }
  return cells;
}

/// The file's columns by number, as in kColumns.
std::vector<std::size_t> read_headline(const std::string& line, const std::string& place) {
  std::vector<std::size_t> columns;
  for (const std::string& cell : cells_of(line)) {
    const auto found = std::find(kColumns.begin(), kColumns.end(), cell);
    if (found == kColumns.end())
      throw std::runtime_error(
          fmt::format("{}: unknown column '{}'; legal: {}", place, cell, fmt::join(kColumns, ", ")));
    columns.push_back(static_cast<std::size_t>(found - kColumns.begin()));
  }
  for (std::size_t k = 0; k < 3; ++k)
    if (std::find(columns.begin(), columns.end(), k) == columns.end())
      throw std::runtime_error(fmt::format("{}: a column {} is missing", place, kColumns[k]));
  return columns;
}

double number_of(const std::string& cell, const std::string& place) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
    throw std::runtime_error(fmt::format("{}: '{}' is no number", place, cell));
  return value;
}

BallContact contact_at(const std::vector<std::optional<double>>& row, const Assembly& assembly,
                       std::uint8_t corrections_off, const std::string& place) {
  const double length = *row[kLength], tip = *row[kTip];
  MapContext context;
  context.rtcp = false;
  context.tool_offset = Vec3(0, 0, length);
  context.corrections_off = corrections_off;
  // The axes as G53 has them are those of the spindle; the words of the map are the axes less the tool.
  Words words = Words::Zero();
  const Vec3 tool = assembly.kinematics->tool_in_words(context.tool_offset);
  for (int k = 0; k < 3; ++k) words[k] = row[static_cast<std::size_t>(k)].value_or(0) - tool[k];
  for (int k = 3; k < 6; ++k) words[k] = row[static_cast<std::size_t>(k)].value_or(0) * kRadPerDeg;
  BallContact contact;
  if (assembly.map->map(words, context, contact.q) != KinStatus::kOk)
    throw std::runtime_error(fmt::format("{}: the machine cannot stand there", place));
  contact.stylus_S = Vec3(0, 0, tip / 2 - length);
  return contact;
}

}  // namespace

std::vector<BallContact> read_ball_contacts(const std::string& path, const Assembly& assembly,
                                            std::uint8_t corrections_off, const BallProbe& probe) {
  std::istringstream in(read_named_file(path));
  std::vector<std::size_t> columns;
  std::vector<BallContact> contacts;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string place = fmt::format("{}:{}", path, number);
    if (line.empty() || line[0] == '#' || line == "\r") continue;
    if (columns.empty()) {
      columns = read_headline(line, place);
      continue;
    }
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() != columns.size())
      throw std::runtime_error(
          fmt::format("{}: {} columns, but the headline has {}", place, cells.size(), columns.size()));
    std::vector<std::optional<double>> row(kColumns.size());
    row[kLength] = probe.length_mm;
    row[kTip] = probe.tip_mm;
    for (std::size_t i = 0; i < cells.size(); ++i) row[columns[i]] = number_of(cells[i], place);
    for (const std::size_t k : {kLength, kTip})
      if (!row[k])
        throw std::runtime_error(fmt::format("{}: no column {}; give --{}", place, kColumns[k],
                                             k == kLength ? "length-mm" : "tip-mm"));
    contacts.push_back(contact_at(row, assembly, corrections_off, place));
  }
  return contacts;
}

ActualChain known_chain(const Machine& machine) {
  const auto corrections = machine.root.table_if("corrections");
  const auto table = corrections ? corrections->table_if("geometric") : std::nullopt;
  return table ? read_geometric(machine, *table).chain : read_chain(machine);
}

std::string ball_config_section(const BallFit& fit, const Machine& machine) {
  std::string out = "[corrections.geometric]\nenabled = true\nmode = \"full\"\n";
  int joint = -1;
  for (const BallParameter& p : fit.parameters) {
    const bool tilt = p.kind == BallParameter::Kind::kTilt;
    if (!tilt && p.kind != BallParameter::Kind::kOffset) continue;
    if (p.joint != joint)
      out += fmt::format("\n[[corrections.geometric.axis]]\njoint = \"{}\"\n",
                         machine.joints[static_cast<std::size_t>(p.joint)].name);
    joint = p.joint;
    out += fmt::format("{}_{} = {:.9g}\n", p.name.substr(p.name.find('.') + 1), tilt ? "arcsec" : "mm",
                       tilt ? p.value * kDegPerRad * 3600 : p.value);
  }
  return out;
}

}  // namespace trn
