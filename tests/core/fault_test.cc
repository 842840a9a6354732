#include "core/fault.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

Fault fault(int i) { return static_cast<Fault>(i); }
constexpr int kCount = static_cast<int>(Fault::kCount);

TEST(FaultTable, EveryFaultHasANameOfItsOwnAndACure) {
  for (int i = 0; i < kCount; ++i) {
    const FaultInfo& info = fault_info(fault(i));
    EXPECT_EQ(fault_named(info.name), fault(i));
    EXPECT_EQ(find_fault(info.name), &info);
    EXPECT_FALSE(info.meaning.empty()) << info.name;
    EXPECT_EQ(info.remedy.empty(), i == 0) << info.name;
  }
  EXPECT_EQ(find_fault("no such fault"), nullptr);
  EXPECT_EQ(fault_named("no such fault"), Fault::kOk);
}

// A row that slips would give a fault another's text; these are written a second time, by hand.
TEST(FaultTable, NamesAndReactionsStandWhereTheyBelong) {
  EXPECT_EQ(fault_info(Fault::kFollowingError).name, "following_error");
  EXPECT_EQ(fault_info(Fault::kFollowingError).reaction, Reaction::kQuickStop);
  EXPECT_EQ(fault_info(Fault::kBusOverload).name, "bus_overload");
  EXPECT_EQ(fault_info(Fault::kCycleOverrun).reaction, Reaction::kPathStop);
  EXPECT_EQ(fault_info(Fault::kStarved).reaction, Reaction::kNone);
  EXPECT_EQ(fault_info(Fault::kSpindle).name, "spindle");
}

TEST(FaultTable, TheWorseFaultIsTheFirstOneUnlessALaterOneAsksForMore) {
  for (int i = 0; i < kCount; ++i) {
    EXPECT_EQ(worse(Fault::kOk, fault(i)), fault(i));
    EXPECT_EQ(worse(fault(i), Fault::kOk), fault(i));
    for (int k = 1; k < kCount; ++k) {
      if (i == 0) continue;
      const bool more = fault_info(fault(k)).reaction > fault_info(fault(i)).reaction;
      EXPECT_EQ(worse(fault(i), fault(k)), more ? fault(k) : fault(i));
    }
  }
}

}  // namespace
}  // namespace trn
