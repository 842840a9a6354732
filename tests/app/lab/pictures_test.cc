#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

#include "app/lab/error_curves.h"
#include "app/lab/polar_plot.h"
#include "app/lab/text_file.h"
#include "app/lab/workspace.h"
#include "app/lab/workspace_svg.h"
#include "compensation/fit/ballbar.h"
#include "compensation/fit/joint_table_fit.h"
#include "core/frames.h"
#include "core/safe_file.h"
#include "core/units.h"

// The pictures of the laboratory have what they are about, and text inside their edges.
namespace trn {
namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t out = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++out;
  return out;
}

double attribute(std::string_view tag, const char* name) {
  const std::size_t value = tag.find('\'', tag.find(fmt::format(" {}='", name))) + 1;
  return std::stod(std::string(tag.substr(value, tag.find('\'', value) - value)));
}

/// Every text lies inside the picture, by 0.6 of its size a letter.
void expect_texts_inside(const std::string& svg) {
  const double width = attribute(svg, "width"), height = attribute(svg, "height");
  for (std::size_t at = svg.find("<text"); at != std::string::npos; at = svg.find("<text", at + 1)) {
    const std::string_view tag = std::string_view(svg).substr(at, svg.find("</text>", at) - at);
    const std::string_view words = tag.substr(tag.find('>') + 1);
    const double length = 0.6 * attribute(tag, "font-size") * static_cast<double>(words.size());
    const bool end = tag.find("'end'") != std::string::npos,
               middle = tag.find("'middle'") != std::string::npos;
    const double left = attribute(tag, "x") - (end ? length : middle ? length / 2 : 0);
    EXPECT_GE(left, -1) << words;
    EXPECT_LE(left + length, width + 1) << words;
    EXPECT_GE(attribute(tag, "y"), 8) << words;
    EXPECT_LE(attribute(tag, "y"), height - 2) << words;
  }
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

BallbarTrace trace(double amplitude_mm) {
  BallbarTrace out;
  for (int i = 0; i <= 360; ++i)
    out.readings.push_back({rad_from_deg(i), amplitude_mm * std::sin(rad_from_deg(2 * i))});
  return out;
}

TEST(PolarPlot, TellsScaleAndDeviation) {
  const BallbarTrace large = trace(0.012), none = trace(0);
  const std::string svg = polar_plot("Ball bar", {{&large, "without compensation"}, {&none, "with"}});
  EXPECT_EQ(count(svg, "<polyline"), 2u);
  EXPECT_NE(svg.find("5 µm from ring to ring"), std::string::npos) << "12 um in five rings";
  EXPECT_NE(svg.find("without compensation: deviation 24 µm"), std::string::npos);
  EXPECT_NE(svg.find("with: deviation 0 µm"), std::string::npos);
  expect_texts_inside(svg);
  expect_texts_inside(polar_plot(std::string(200, 'w'), {}));
}

TEST(ErrorCurves, ShowEveryMeasurementOfEveryJoint) {
  std::vector<AxisMeasurement> measured, after;
  for (int i = 0; i < 11; ++i) measured.push_back({10.0 * i, 10.001 * i});
  for (int i = 10; i >= 0; --i) measured.push_back({10.0 * i, 10.001 * i + 0.003});
  after = measured;
  for (AxisMeasurement& m : after) m.actual = m.commanded;
  const JointTableFit line = fit_joint_table(measured, 0), table = fit_joint_table(measured, 5);
  const std::string plain = error_curves({{"X", "mm", &measured, line, nullptr}});
  EXPECT_EQ(count(plain, "r='2.5'"), measured.size());
  EXPECT_EQ(count(plain, "<polyline"), 2u) << "the fit, forward and backward";
  EXPECT_EQ(plain.find("with correction"), std::string::npos);
  const std::string both =
      error_curves({{"X", "mm", &measured, line, &after}, {"A", "deg", &measured, table, &after}});
  EXPECT_EQ(count(both, "r='2'"), 2 * after.size());
  EXPECT_EQ(count(both, ">error, mm<"), 1u);
  EXPECT_EQ(count(both, ">error, deg<"), 1u);
  EXPECT_NE(both.find("with correction"), std::string::npos);
  expect_texts_inside(plain);
  expect_texts_inside(both);
}

Workspace box() {
  Workspace w{Vec3(0, 0, 50), Vec3(-100, -100, 0), 100, {3, 3, 2}, {0, 10}, {}};
  w.values.assign(36, {Reach::kOk, 0.5, 1.0, 100, 1.0});
  w.values[w.index(1, 1, 1, 1)].reach = Reach::kLimit;  // home, tilted
  return w;
}

// Four quantities, a scale of 16 shades each, two sections of 9 and 6 cells with two frames each, and the
// page. Home is in both sections, and out of reach for the three quantities that are those of the tilt.
TEST(WorkspaceSvg, HasACellForEveryPlaceThatIsReached) {
  const std::string svg = workspace_svg(box(), "Workspace of a box");
  EXPECT_EQ(count(svg, "<rect"), 1u + 4 * (16 + 2 * 2 + 9 + 6) - 3 * 2);
  for (const char* words : {">X, mm<", ">Y, mm<", ">Z, mm<", ">tilt reached<", "deg/s"})
    EXPECT_GE(count(svg, words), 1u) << words;
  expect_texts_inside(svg);
}

TEST(TextFile, IsWrittenOrSaysWhyNot) {
  const std::string path = testing::TempDir() + "/text_file.txt";
  write_text_file(path, "one\ntwo\n");
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  EXPECT_EQ(text.str(), "one\ntwo\n");
  EXPECT_THROW(write_text_file("/dev/null/x", "one"), OutputError);
  check_text_file(path);
  EXPECT_TRUE(std::filesystem::exists(path));
  EXPECT_EQ(std::filesystem::file_size(path), 8u) << "as it was";
  check_text_file(path + ".new");
  EXPECT_FALSE(std::filesystem::exists(path + ".new"));
  std::filesystem::remove(path);
  check_text_file("");
  for (const std::string wrong : {"/dev/null/x", "/", "/no/such/folder/x"})
    EXPECT_THROW(check_text_file(wrong), OutputError) << wrong;
}

}  // namespace
}  // namespace trn
