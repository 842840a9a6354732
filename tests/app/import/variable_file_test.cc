#include "app/import/variable_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "app/import/import_place.h"

namespace trn {
namespace {

// LinuxCNC asks the C library for "%d %lf" of each line: the library is the judge here.
TEST(VariableFile, TheLibraryReadsTheSameNumbers) {
  std::mt19937 random(5);
  const std::string signs = "0123456789 \t.+-e#;z";
  int read = 0, passed_over = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string line = i % 2 == 0 ? std::to_string(random() % 6000) + " " : "";
    for (auto n = random() % 8; n > 0; --n) line += signs[random() % signs.size()];
    int number = 0;
    double value = 0;
    const bool takes = std::sscanf(line.c_str(), "%d %lf", &number, &value) == 2;
    // What is too great or too small for a double is left out, and told.
    if (takes && (!std::isfinite(value) || (value == 0 && line.find('e') != std::string::npos))) continue;
    std::vector<LeftOutLine> left_out;
    const std::string text = readable_variables(line + "\n", "v", left_out);
    int own_number = 0;
    double own_value = 0;
    const bool own = std::sscanf(text.c_str(), "%d %lf", &own_number, &own_value) == 2;
    ASSERT_EQ(own, takes) << line;
    if (takes) {
      EXPECT_EQ(own_number, number) << line;
      EXPECT_EQ(own_value, value) << line;
    }
    ++(takes ? read : passed_over);
    if (!takes && line.find_first_not_of(" \t") != std::string::npos) {
      EXPECT_EQ(left_out.size(), 1u) << line;
    }
  }
  EXPECT_GT(read, 3000);
  EXPECT_GT(passed_over, 3000);
}

TEST(VariableFile, LinesKeepTheirNumbers) {
  std::vector<LeftOutLine> left_out;
  EXPECT_EQ(readable_variables("# a\n\n31 2\r\nfoo\n32 3 x", "v", left_out), "\n\n31\t2\n\n32\t3\n");
  ASSERT_EQ(left_out.size(), 3u);
  EXPECT_EQ(left_out[1].line, 4u);
  EXPECT_EQ(left_out[1].text, "foo");
}

TEST(VariableFile, NumbersMustRise) {
  std::vector<LeftOutLine> left_out;
  EXPECT_THROW(readable_variables("32 1\n31 1\n", "v", left_out), ImportError);
  EXPECT_THROW(readable_variables("32 1\n32 1\n", "v", left_out), ImportError);
}

}  // namespace
}  // namespace trn
