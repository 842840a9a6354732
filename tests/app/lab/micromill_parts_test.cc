#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app/lab/micromill/experiment.h"
#include "app/lab/micromill/programs.h"
#include "app/lab/micromill/stage_lab.h"
#include "sim/micromill/part_surface.h"

// What the micro-mill's experiment writes for others to read: its programs and its pictures.
namespace trn {
namespace {

// The speeds are those that the experiment asks for, in mm/s; a program's F is in mm a minute.
TEST(MicroMillPrograms, ValidateAtTheSpeedsAskedFor) {
  const LabProgram program = validation_program();
  std::istringstream lines(program.text);
  std::vector<std::string> all;
  for (std::string line; std::getline(lines, line);) all.push_back(line);
  std::multiset<double> feeds;
  for (const std::uint32_t number : program.lines) {
    ASSERT_LE(number, all.size());
    const std::string& line = all[number - 1];
    const std::size_t at = line.find('F');
    ASSERT_NE(at, std::string::npos) << line;
    feeds.insert(std::stod(line.substr(at + 1)));
  }
  EXPECT_EQ(feeds, (std::multiset<double>{8 * 60, 5 * 60, 3.5 * 60, 5 * 60, 7 * 60}));
}

/// The points of the last curve of a chart, in pixels.
std::vector<std::pair<double, double>> last_curve(const std::string& path) {
  std::ifstream file(path);
  const std::string svg((std::istreambuf_iterator<char>(file)), {});
  const std::size_t begin = svg.find("points='", svg.rfind("<polyline"));
  const std::string points = svg.substr(begin + 8, svg.find('\'', begin + 8) - begin - 8);
  std::vector<std::pair<double, double>> out;
  const std::regex point("([-0-9.]+),([-0-9.]+)");
  for (std::sregex_iterator at(points.begin(), points.end(), point); at != std::sregex_iterator(); ++at)
    out.emplace_back(std::stod((*at)[1]), std::stod((*at)[2]));
  return out;
}

// Each distance of a surface is that of the middle of its bin: of four, the first lies at 45 degrees.
TEST(MicroMillPictures, DrawASurfaceWhereItWasMeasured) {
  const std::string folder = testing::TempDir() + "/contour";
  StageRun run;
  const Eigen::Vector2d none = Eigen::Vector2d::Zero();
  StageRow row{none, none, none, none, none, none, none, none, none, none, none, none};
  row.counts = true;
  for (int i = 0; i < 8; ++i) {
    row.plan_mm = Eigen::Vector2d(i % 2 ? 12 : -12, i % 4 < 2 ? 12 : -12);
    run.rows.push_back(row);
  }
  run.surface_mm.assign(4, kPartSizeMm / 2);
  draw_part(folder, PartSurface::Shape::kRound, run);
  const auto curve = last_curve(folder + "/deflection_round.svg");
  ASSERT_EQ(curve.size(), 4u);
  const double width = curve[0].first - curve[1].first, height = curve[2].second - curve[1].second;
  EXPECT_GT(width, 10);
  EXPECT_NEAR(width, height, 0.2);
  EXPECT_NEAR(curve[0].second, curve[1].second, 0.2);
  EXPECT_NEAR(curve[1].first, curve[2].first, 0.2);
  EXPECT_NEAR(curve[2].second, curve[3].second, 0.2);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace trn
