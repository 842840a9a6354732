#include "app/client/remote_line.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace trn {
namespace {

std::int64_t unix_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

TEST(RisingCounter, IsTheClockAndRises) {
  RisingCounter counter(::testing::TempDir() + "no-such-folder/counter");
  const std::int64_t before = unix_us();
  std::int64_t last = counter.next();
  EXPECT_GE(last, before);
  EXPECT_LE(last, unix_us());
  for (int i = 0; i < 100'000; ++i) {
    const std::int64_t next = counter.next();
    ASSERT_GT(next, last);
    last = next;
  }
  counter.keep();  // cannot, and goes on
}

TEST(RisingCounter, GoesOnBehindItsLastWhenTheClockWentBack) {
  const std::string path = ::testing::TempDir() + "counter";
  const std::int64_t ahead = unix_us() + 3'600'000'000;
  std::ofstream(path) << ahead << "\n";
  RisingCounter counter(path);
  EXPECT_EQ(counter.next(), ahead + 1);
  EXPECT_EQ(counter.next(), ahead + 2);
  counter.keep();
  EXPECT_EQ(RisingCounter(path).next(), ahead + 3);
  std::ofstream(path) << "noise";
  const std::int64_t anew = RisingCounter(path).next();
  EXPECT_LE(anew, unix_us());
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace trn
