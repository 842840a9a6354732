#include "core/ring.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>

namespace trn {
namespace {

TEST(Ring, GivesBackInOrderAndKnowsItsFront) {
  Ring<int> ring(4);
  EXPECT_EQ(ring.front(), nullptr);
  EXPECT_FALSE(ring.pop());
  for (int i = 1; i <= 3; ++i) EXPECT_TRUE(ring.try_push(i));
  EXPECT_EQ(ring.size_approx(), 3u);
  ASSERT_NE(ring.front(), nullptr);
  EXPECT_EQ(*ring.front(), 1) << "looking takes nothing";
  int item = 0;
  EXPECT_TRUE(ring.try_pop(item));
  EXPECT_EQ(item, 1);
  EXPECT_TRUE(ring.pop());
  EXPECT_TRUE(ring.try_pop(item));
  EXPECT_EQ(item, 3);
  EXPECT_FALSE(ring.try_pop(item));
  EXPECT_EQ(item, 3) << "an empty ring changes nothing";
}

// The capacity is a promise to the tick: more may fit, but a full ring says so and never grows.
TEST(Ring, AFullRingRefusesAndLosesNothing) {
  constexpr std::size_t kCapacity = 100;
  Ring<std::size_t> ring(kCapacity);
  std::size_t pushed = 0;
  while (pushed < 10 * kCapacity && ring.try_push(pushed)) ++pushed;
  EXPECT_GE(pushed, kCapacity);
  EXPECT_LT(pushed, 2 * kCapacity);
  EXPECT_FALSE(ring.try_push(7));
  std::size_t item = 0;
  for (std::size_t i = 0; i < pushed; ++i) {
    ASSERT_TRUE(ring.try_pop(item));
    ASSERT_EQ(item, i);
  }
  EXPECT_TRUE(ring.try_push(7)) << "there is room again";
}

// A writer and a reader in threads of their own: everything arrives, whole and in order.
TEST(Ring, CrossesThreads) {
  struct Item {
    std::uint64_t number, square;
  };
  constexpr std::uint64_t kItems = 200'000;
  Ring<Item> ring(64);
  std::thread writer([&] {
    for (std::uint64_t i = 0; i < kItems; ++i)
      while (!ring.try_push({i, i * i})) std::this_thread::yield();
  });
  Item item{};
  for (std::uint64_t i = 0; i < kItems; ++i) {
    while (!ring.try_pop(item)) std::this_thread::yield();
    ASSERT_EQ(item.number, i);
    ASSERT_EQ(item.square, i * i);
  }
  writer.join();
  EXPECT_EQ(ring.size_approx(), 0u);
}

}  // namespace
}  // namespace trn
