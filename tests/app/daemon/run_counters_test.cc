#include "app/daemon/run_counters.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "core/config.h"
#include "interp/gcode/parameter_file.h"

namespace trn {
namespace {

std::string fresh(const std::string& name) {
  std::string path = testing::TempDir() + "/" + name;
  std::remove(path.c_str());
  return path;
}

void until(RunCounters& counters, const std::function<bool()>& wanted) {
  for (int i = 0; i < 5000 && !wanted(); ++i) {
    counters.poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_TRUE(wanted());
}

TEST(RunCounters, ShowAPartOnlyWhenItIsOnDisk) {
  const std::string file = fresh("a.counters");
  RunCounters counters(file);
  counters.program_begins();
  counters.program_ran(3.5);
  counters.part_made();
  EXPECT_EQ(counters.parts(), 0);
  until(counters, [&] { return counters.parts() == 1; });
  EXPECT_EQ(read_text_file(file), "parts 1\nrun_s 3.500\n");
  EXPECT_EQ(counters.program_s(), 3.5);
  counters.set_parts(0);
  until(counters, [&] { return counters.parts() == 0; });
}

TEST(RunCounters, GoOnAfterARestart) {
  const std::string file = fresh("b.counters");
  {
    RunCounters counters(file);
    counters.set_parts(41);
    counters.program_ran(1.25);
  }
  RunCounters counters(file);
  EXPECT_EQ(counters.parts(), 41);
  EXPECT_EQ(counters.run_s(), 1.25);
  EXPECT_EQ(counters.program_s(), 0);
  EXPECT_EQ(counters.take_trouble(), "");
}

TEST(RunCounters, KeepRunTimeNowAndThen) {
  const std::string file = fresh("c.counters");
  RunCounters counters(file);
  counters.program_ran(RunCounters::kRunSlack_s / 2);
  for (int i = 0; i < 20; ++i) counters.poll();
  EXPECT_NE(access(file.c_str(), F_OK), 0) << "not at every period";
  counters.program_ran(RunCounters::kRunSlack_s / 2);
  until(counters, [&] { return access(file.c_str(), F_OK) == 0; });
}

TEST(RunCounters, LeaveAloneWhatTheyDoNotUnderstand) {
  for (const char* text : {"", "parts -1\nrun_s 2\n", "parts 1\nrun_s nan\n", "parts 1\nrun_s -2\n",
                           "pieces 1\nrun_s 2\n", "parts 1\nhours 2\n", "G0 X1\n"}) {
    const std::string file = fresh("d.counters");
    std::ofstream(file) << text;
    {
      RunCounters counters(file);
      EXPECT_NE(counters.take_trouble().find("has no counters"), std::string::npos) << text;
      EXPECT_EQ(counters.take_trouble(), "");
      counters.part_made();
      counters.poll();
      EXPECT_EQ(counters.parts(), 1) << "in memory";
    }
    EXPECT_EQ(read_text_file(file), text);
  }
}

// Opened as a file, it would wait for somebody who writes there.
TEST(RunCounters, DoNotWaitAtAPipe) {
  const std::string file = fresh("f.counters");
  ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
  {
    RunCounters counters(file);
    const std::string trouble = counters.take_trouble();
    EXPECT_EQ(trouble.find(file + ": this is no regular file but a pipe"), 0u) << trouble;
    counters.part_made();
    counters.poll();
    EXPECT_EQ(counters.parts(), 1) << "in memory";
  }
  std::remove(file.c_str());
}

TEST(RunCounters, TellADiskThatTakesNothing) {
  RunCounters counters(testing::TempDir() + "/no/such/folder/x.counters");
  counters.part_made();
  std::string trouble;
  until(counters, [&] {
    if (trouble.empty()) trouble = counters.take_trouble();
    return !trouble.empty();
  });
  EXPECT_NE(trouble.find("x.counters"), std::string::npos) << trouble;
  EXPECT_EQ(counters.parts(), 0);
}

}  // namespace
}  // namespace trn
