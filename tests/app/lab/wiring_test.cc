#include "app/lab/wiring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "core/config.h"
#include "tests/support/paths.h"

// The wiring of a machine as a table and as a drawing.
namespace trn {
namespace {

std::string attribute(const std::string& tag, const std::string& name) {
  const std::size_t at = tag.find(" " + name + "='");
  if (at == std::string::npos) return "";
  const std::size_t begin = at + name.size() + 3;
  return tag.substr(begin, tag.find('\'', begin) - begin);
}

/// Each line of the document is an element.
std::vector<std::string> elements(const std::string& svg, const std::string& name) {
  std::vector<std::string> out;
  std::istringstream lines(svg);
  for (std::string line; std::getline(lines, line);)
    if (line.rfind("<" + name, 0) == 0) out.push_back(line);
  return out;
}

/// A row of each kind, with names as long as a field bus makes them.
std::vector<WireRow> rows() {
  const std::string text(80, 'w');
  return {{WireRow::Kind::kSignal, "lamp", "machine.running", text, "inverted"},
          {WireRow::Kind::kSafety, "door", text, "fault guard_open", "safe when on"},
          {WireRow::Kind::kBrake, text, "drive of Z", "io.output.3", text}};
}

// What configs/gantry_router.toml says of safety inputs, signals and the brake, in the order of the header.
TEST(Wiring, IsWhatTheConfigSays) {
  const Assembly assembly = assemble(load_config(source_dir() + "/configs/gantry_router.toml"));
  std::vector<std::string> told;
  for (const WireRow& row : wiring_of(assembly))
    told.push_back(row.name + ": " + row.from + " > " + row.to + (row.how.empty() ? "" : "; " + row.how));
  EXPECT_EQ(told, (std::vector<std::string>{
                      "lamp: machine.running > drive.X.output.16",
                      "vacuum: machine.enabled > drive.X.output.17; on after 500 ms",
                      "emergency stop: drive.X.input.16 > fault emergency_input; safe when on",
                      "enable: drive.X.input.17 > fault enable_off; safe when on",
                      "door: drive.X.input.18 > fault door_open; safe when on, 20 ms debounce",
                      "air: drive.Z.input.16 > fault air_pressure; safe when on, 100 ms debounce",
                      "brake of Z: drive of Z > drive.Z.output.0; free after 80 ms, holds after 60 ms"}));
}

// [io] and [io.spindle] of configs/mill_modbus.toml.
TEST(Wiring, ShowsWhatHangsOnAFieldBus) {
  const Assembly assembly = assemble(load_config(source_dir() + "/configs/mill_modbus.toml"));
  std::vector<std::string> told;
  for (const WireRow& row : wiring_of(assembly))
    if (row.kind == WireRow::Kind::kFieldBus) told.push_back(row.name + ": " + row.from + " > " + row.to);
  EXPECT_EQ(told,
            (std::vector<std::string>{
                "spindle: spindle speed > inverter.speed", "spindle: spindle run > inverter.run",
                "spindle: spindle reverse > inverter.reverse", "spindle: inverter.actual > spindle actual",
                "spindle: inverter.at_speed > spindle at_speed", "spindle: inverter.fault > spindle fault",
                "coolant: flood > box.flood", "field bus: box.vacuum_ok > io.input.0",
                "field bus: io.output.0 > box.vacuum"}));
}

TEST(Wiring, IsDrawnInsideItsBoxesAndThePicture) {
  const std::string svg = wiring_svg("bench", rows());
  const double height = std::stod(attribute(svg, "height"));
  const auto frames = elements(svg, "rect x=");
  ASSERT_EQ(frames.size(), 2 * rows().size()) << "a box at each end";
  const double box = std::stod(attribute(frames[0], "width"));
  const double gap = std::stod(attribute(frames[1], "x")) - std::stod(attribute(frames[0], "x")) - box;
  for (const std::string& frame : frames) {
    EXPECT_EQ(std::stod(attribute(frame, "width")), box);
    EXPECT_LT(std::stod(attribute(frame, "y")) + std::stod(attribute(frame, "height")), height);
  }
  double lowest = 0;
  for (const std::string& text : elements(svg, "text")) {
    const std::size_t begin = text.find('>') + 1;
    const std::size_t letters = text.find("</text>") - begin;
    lowest = std::max(lowest, std::stod(attribute(text, "y")));
    // 0.6 of its size is the mean width of a letter; 80 of them are made small enough for the box, or for the
    // way between two.
    const double width = 0.6 * static_cast<double>(letters) * std::stod(attribute(text, "font-size"));
    const bool between = attribute(text, "x") == "450.0";
    EXPECT_TRUE(letters != 80 || width < (between ? gap : box)) << text;
  }
  EXPECT_LT(lowest, height);
  EXPECT_GT(lowest, height / 2) << "and the picture is no longer than its rows";
}

TEST(Wiring, EachRowIsAnArrowInTheColourOfItsKind) {
  const auto lines = elements(wiring_svg("bench", rows()), "path");
  ASSERT_EQ(lines.size(), 3 * rows().size()) << "a shaft and two barbs";
  std::map<std::string, int> colours;
  for (const std::string& line : lines) {
    ++colours[attribute(line, "stroke")];
    EXPECT_EQ(attribute(line, "stroke-width"), attribute(lines[0], "stroke-width")) << "one pen";
  }
  EXPECT_EQ(colours.size(), 3u);
  for (const auto& [colour, count] : colours) EXPECT_EQ(count, 3) << colour;
  EXPECT_NE(wiring_svg("bench", {}).find("nothing is wired"), std::string::npos);
}

}  // namespace
}  // namespace trn
