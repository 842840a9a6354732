#include "app/lab/ballbar_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "compensation/fit/ballbar.h"

// Traces of a ball bar as files.
namespace trn {
namespace {

class BallbarFile : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  static std::vector<BallbarTest> tests() {
    std::vector<BallbarTest> out(2);
    out[0].name = "a";
    out[1].name = "c_low";
    return out;
  }
  BallbarTrace read(const std::string& text, const std::string& name = "") const {
    std::ofstream(path_, std::ios::binary) << text;
    return read_ballbar_csv(path_, name, tests());
  }
  std::string refusal(const std::string& text, const std::string& name = "") const {
    try {
      read(text, name);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  std::string path_ = testing::TempDir() + "/trace.csv";
};

TEST_F(BallbarFile, ComesBackAsItWasWritten) {
  BallbarTrace trace;
  trace.test.name = "c_low";
  for (int i = 0; i < 5; ++i) trace.readings.push_back({0.1 * i, 0.001 * i * i});
  write_ballbar_csv(path_, trace, false);
  const BallbarTrace again = read_ballbar_csv(path_, "", tests());
  EXPECT_EQ(again.test.name, "c_low");
  ASSERT_EQ(again.readings.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(again.readings[i].angle_rad, trace.readings[i].angle_rad, 1e-12);
    EXPECT_NEAR(again.readings[i].reading_mm, trace.readings[i].reading_mm, 1e-12);
  }
  write_ballbar_csv(path_, trace, true);
  EXPECT_THROW(read_ballbar_csv(path_, "", tests()), std::runtime_error) << "nothing is left to identify";
}

// Another system's ends of lines, and blanks behind the name.
TEST_F(BallbarFile, TheTestsNameStandsInTheFileOrIsGiven) {
  EXPECT_EQ(read("# test c_low \r\n1,0.5\r\n").test.name, "c_low");
  EXPECT_EQ(read("# test a\n1,0.5\n").test.name, "a");
  EXPECT_EQ(read("# test a\n1,0.5\n", "c_low").test.name, "c_low") << "what is given counts";
  EXPECT_NEAR(read("180,0.5\n", "a").readings.at(0).angle_rad, M_PI, 1e-12);
  EXPECT_NE(refusal("1,0.5\n").find("NAME one of a c_low"), std::string::npos) << refusal("1,0.5\n");
  EXPECT_NE(refusal("1,0.5\n1;0.5;x\n", "a").find(":2: expected angle"), std::string::npos);
}

}  // namespace
}  // namespace trn
