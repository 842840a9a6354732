#include "core/motion.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

TEST(OutputChanges, TheLastChangeOfAnOutputCounts) {
  OutputChanges first, later;
  first.put(0, true);
  first.put(1, true);
  first.put(2, false);
  later.put(1, false);
  later.put(2, true);
  later.put(63, true);
  first.add(later);
  EXPECT_EQ(first.set, 1u | 4u | std::uint64_t{1} << 63);
  EXPECT_EQ(first.clear, 2u);
  first.put(0, false);
  EXPECT_EQ(first.set & 1u, 0u);
  EXPECT_EQ(first.clear & 1u, 1u);
}

TEST(OutputChanges, FourAnalogOutputsHaveRoom) {
  OutputChanges changes;
  EXPECT_FALSE(changes.any());
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(changes.put(10 + i, 0.5 * i));
  EXPECT_TRUE(changes.any());
  EXPECT_FALSE(changes.put(20, 1.0));
  EXPECT_TRUE(changes.put(12, 7.0)) << "one of them again takes no room";
  EXPECT_EQ(changes.analog_count, 4);
  EXPECT_EQ(changes.analog[2].value, 7.0);
  EXPECT_EQ(changes.analog[3].index, 13);
}

TEST(InputArgument, ComesBackAsItWasPacked) {
  for (const int index : {0, 7, 255})
    for (const InputWait wait : {InputWait::kNow, InputWait::kRise, InputWait::kLow})
      for (const bool analog : {false, true}) {
        const InputArgument back = InputArgument::unpack(InputArgument{index, wait, analog}.packed());
        EXPECT_EQ(back.index, index);
        EXPECT_EQ(back.wait, wait);
        EXPECT_EQ(back.analog, analog);
      }
}

TEST(TimeSegment, ItsDerivativesAreThoseOfItsPlace) {
  const TimeSegment segment{2, 1, 2, 3, 6};  // 1 + 2 t + 1.5 t^2 + t^3
  EXPECT_DOUBLE_EQ(segment.s_at(2), 1 + 4 + 6 + 8);
  EXPECT_DOUBLE_EQ(segment.v_at(2), 2 + 6 + 12);
  EXPECT_DOUBLE_EQ(segment.a_at(2), 3 + 12);
}

}  // namespace
}  // namespace trn
