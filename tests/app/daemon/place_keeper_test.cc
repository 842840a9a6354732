#include "app/daemon/place_keeper.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "app/session/place_record.h"
#include "interp/move.h"

namespace trn {
namespace {

PlaceRecord place(std::uint64_t block) {
  PlaceRecord out;
  out.program = "/nc/part.ngc";
  out.block = block;
  out.line = static_cast<std::uint32_t>(block);
  return out;
}

std::string new_folder(const std::string& name) {
  const std::string path = testing::TempDir() + name;
  std::filesystem::create_directory(path);
  return path;
}

TEST(PlaceKeeper, TheNewestOfManyIsOnDiskWhenTheWaitIsOver) {
  const std::string folder = new_folder("place_newest");
  const std::string path = folder + "/m.place";
  PlaceKeeper keeper(path);
  EXPECT_THROW(keeper.read(), ProgramError);
  for (std::uint64_t round = 1; round <= 3; ++round) {
    for (std::uint64_t block = 1; block <= 50; ++block) keeper.note(place(100 * round + block));
    EXPECT_EQ(keeper.read().block, 100 * round + 50) << "noted last, on disk or not";
    keeper.wait_until_kept();
    EXPECT_EQ(read_place(path).block, 100 * round + 50);
  }
}

// The wait may begin while the place is no longer the next one and not yet on the disk.
TEST(PlaceKeeper, TheWaitCoversWhatIsBeingWritten) {
  const std::string folder = new_folder("place_written");
  for (std::uint64_t round = 0; round < 60; ++round) {
    const std::string path = folder + "/m" + std::to_string(round) + ".place";
    PlaceKeeper keeper(path);
    keeper.note(place(round));
    std::this_thread::sleep_for(std::chrono::microseconds(20 * round));
    keeper.wait_until_kept();
    ASSERT_TRUE(std::filesystem::exists(path)) << "round " << round;
    EXPECT_EQ(read_place(path).block, round);
  }
}

TEST(PlaceKeeper, WhatWasNotedIsOnDiskBehindItsEnd) {
  const std::string folder = new_folder("place_end");
  const std::string path = folder + "/m.place";
  {
    PlaceKeeper keeper(path);
    keeper.note(place(1));
    keeper.wait_until_kept();
    keeper.note(place(2));
    keeper.note(place(3));
  }
  EXPECT_EQ(read_place(path).block, 3u);
  EXPECT_EQ(PlaceKeeper(path).read().block, 3u) << "another process goes on from it";
}

TEST(PlaceKeeper, ADiskThatTakesNothingKeepsNobody) {
  const std::string folder = new_folder("place_full");
  const std::string path = folder + "/none/m.place";
  PlaceKeeper keeper(path);
  keeper.note(place(1));
  keeper.wait_until_kept();
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_EQ(keeper.read().block, 1u);
  std::filesystem::create_directory(folder + "/none");
  keeper.note(place(2));
  keeper.wait_until_kept();
  EXPECT_EQ(read_place(path).block, 2u);
}

}  // namespace
}  // namespace trn
