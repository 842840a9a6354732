#include "app/session/plausibility.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "app/session/word_directions.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/units.h"
#include "kinematics/factory.h"
#include "tests/support/paths.h"

// What is legal in a config and hardly meant so.
namespace trn {
namespace {

using Edits = std::vector<std::pair<std::string, std::string>>;

std::vector<std::string> questions_of(const std::string& name, const Edits& edits = {}) {
  const std::string path = source_dir() + "/configs/" + name;
  std::ifstream in(path);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const auto& [from, to] : edits) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  const Machine machine = read_machine(parse_config(text, path));
  return implausible(machine, *make_kinematics(machine));
}

/// The only question there is.
std::string only_question(const std::string& name, const Edits& edits) {
  const std::vector<std::string> questions = questions_of(name, edits);
  EXPECT_EQ(questions.size(), 1u) << (questions.empty() ? "none" : questions.back());
  return questions.empty() ? "" : questions[0];
}

TEST(Plausibility, NothingIsAskedOfShippedMachines) {
  int machines = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() + "/configs")) {
    if (entry.path().extension() != ".toml") continue;
    ++machines;
    for (const std::string& question : questions_of(entry.path().filename().string()))
      ADD_FAILURE() << question;
  }
  EXPECT_GT(machines, 12);
}

TEST(Plausibility, AsksWhatWouldBeRight) {
  const std::string fast = only_question("mill.toml", {{"velocity_mm_s = 400.0", "velocity_mm_s = 22900.0"}});
  EXPECT_NE(fast.find("mill.toml:13:17:"), std::string::npos) << fast;
  EXPECT_NE(fast.find("1374 m/min"), std::string::npos) << fast;
  EXPECT_NE(fast.find("mm/min, 381.7 would be right"), std::string::npos) << fast;
  const std::string jerk = only_question("mill.toml", {{"jerk_mm_s3 = 80000.0", "jerk_mm_s3 = 6e12"}});
  EXPECT_NE(jerk.find("acceleration / 0.05 s = 8e+04"), std::string::npos) << jerk;
  const std::string slow =
      only_question("mill.toml", {{"acceleration_mm_s2 = 4000.0", "acceleration_mm_s2 = 4.0"},
                                  {"jerk_mm_s3 = 80000.0", "jerk_mm_s3 = 80.0"}});
  EXPECT_NE(slow.find("m/s^2, 4000 would be right"), std::string::npos) << slow;
}

TEST(Plausibility, AsksForTwoAxesOnOneLine) {
  const std::vector<std::string> questions =
      questions_of("mill.toml", {{"direction = [0.0, 0.0, 1.0]", "direction = [-1.0, 0.0, 0.0]"}});
  ASSERT_FALSE(questions.empty());
  EXPECT_NE(questions[0].find("joints X and Z move along the same line"), std::string::npos) << questions[0];
}

TEST(Plausibility, AsksForAWordThatGoesTheWrongWay) {
  const std::string text = only_question("mill.toml", {{"sense = -1", "sense = 1"}});
  EXPECT_NE(text.find("a positive word Y the tool goes towards -Y of the work"), std::string::npos) << text;
}

// By hand: the cradle's table carries A and C, so that the work turns the other way than the words say.
TEST(WordDirections, AreSeenFromTheWork) {
  const Machine machine = read_machine(load_config(source_dir() + "/configs/cradle.toml"));
  const auto kinematics = make_kinematics(machine);
  Words tilted = Words::Zero();
  tilted[kA] = rad_from_deg(30);
  const std::vector<WordDirection> upright = word_directions(*kinematics, Words::Zero());
  const std::vector<WordDirection> now = word_directions(*kinematics, tilted);
  ASSERT_EQ(upright.size(), 5u);
  for (const WordDirection& direction : upright) EXPECT_EQ(direction.as_iso_841(), direction.word <= kZ);
  // The head's Y lies in the table's Y and Z when the table is tilted.
  EXPECT_NEAR(now[1].tip.norm(), 1, 1e-9);
  EXPECT_NEAR(std::abs(now[1].tip.y()), std::cos(rad_from_deg(30)), 1e-6);
  EXPECT_NEAR(upright[4].turn.z(), -1, 1e-6);
}

}  // namespace
}  // namespace trn
