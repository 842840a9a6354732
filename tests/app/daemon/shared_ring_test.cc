#include "app/daemon/shared_ring.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <memory_resource>
#include <new>

#include "app/daemon/shared_memory.h"

namespace trn {
namespace {

struct Numbers {
  std::array<int, 16> copies{};  // of one number: a torn item has two
};

Numbers copies_of(int number) {
  Numbers out;
  out.copies.fill(number);
  return out;
}

TEST(SharedRing, IsFullAtItsCapacityAndEmptyBehindItsEnd) {
  SharedRing<int> ring(3, std::pmr::get_default_resource());
  EXPECT_EQ(ring.front(), nullptr);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(ring.try_push(i));
  EXPECT_FALSE(ring.try_push(3));
  for (int i = 0; i < 3; ++i, ring.pop()) {
    ASSERT_NE(ring.front(), nullptr);
    EXPECT_EQ(*ring.front(), i);
  }
  EXPECT_EQ(ring.front(), nullptr);
  EXPECT_TRUE(ring.try_push(4));
  ring.clear();
  EXPECT_EQ(ring.front(), nullptr);
}

TEST(SharedRing, BringsEveryItemWholeAndInOrderFromOneProcessToAnother) {
  constexpr int kItems = 200'000;
  using Ring = SharedRing<Numbers>;
  SharedMemory memory(Ring::bytes(64) + sizeof(Ring) + 4096);
  Ring& ring = *new (memory.allocate(sizeof(Ring), alignof(Ring))) Ring(64, &memory);
  const pid_t writer = fork();
  ASSERT_GE(writer, 0);
  if (writer == 0) {
    for (int i = 0; i < kItems;)
      if (ring.try_push(copies_of(i))) ++i;
    _exit(0);
  }
  for (int i = 0; i < kItems;) {
    const Numbers* item = ring.front();
    if (!item) continue;
    ASSERT_EQ(item->copies, copies_of(i).copies);
    ring.pop();
    ++i;
  }
  int status = 0;
  ASSERT_EQ(waitpid(writer, &status, 0), writer);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace trn
