#include "app/client/running_daemons.h"

#include <gtest/gtest.h>

#include <cctype>
#include <fstream>

#include "app/client/daemon_line.h"

namespace trn {
namespace {

TEST(RunningDaemons, AMarkTellsOneContentFromAnother) {
  const std::string path = testing::TempDir() + "mark.toml";
  const auto mark_of = [&](const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
    return file_mark(path);
  };
  const std::string mark = mark_of("name = \"mill\"\n");
  EXPECT_EQ(mark.size(), 16u);
  for (const char c : mark) EXPECT_TRUE(std::isxdigit(static_cast<unsigned char>(c)));
  EXPECT_NE(mark_of("name = \"mill\"\n "), mark);
  EXPECT_NE(mark_of(""), mark);
  EXPECT_EQ(mark_of("name = \"mill\"\n"), mark);
  EXPECT_EQ(file_mark(testing::TempDir() + "none.toml"), "");
}

TEST(RunningDaemons, AMachineThatNobodyRunsIsNoConfig) {
  EXPECT_THROW(config_of_daemon("no such machine"), NoAnswer);
}

}  // namespace
}  // namespace trn
