#include "kernel/overrides.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

using Kind = RtCommand::Kind;

RtCommand set(Kind kind, double value) {
  RtCommand command;
  command.kind = kind;
  command.value = value;
  return command;
}

TEST(Overrides, FeedMovesFollowTheFeedOverrideAndRapidsTheirOwn) {
  Overrides overrides;
  MotionBlock feed, rapid;
  rapid.rapid = true;
  EXPECT_EQ(overrides.motion(nullptr), 1);
  EXPECT_TRUE(overrides.obey(set(Kind::kOverride, 1.5)));
  EXPECT_TRUE(overrides.obey(set(Kind::kRapidOverride, 0.25)));
  EXPECT_EQ(overrides.motion(&feed), 1.5);
  EXPECT_EQ(overrides.motion(&rapid), 0.25);
}

TEST(Overrides, AreKeptInTheirRanges) {
  Overrides overrides;
  MotionBlock feed, rapid;
  rapid.rapid = true;
  overrides.obey(set(Kind::kOverride, 9));
  overrides.obey(set(Kind::kRapidOverride, 9));
  EXPECT_EQ(overrides.motion(&feed), 2);
  EXPECT_EQ(overrides.motion(&rapid), 1);
  overrides.obey(set(Kind::kOverride, -1));
  EXPECT_EQ(overrides.motion(&feed), 0);
}

TEST(Overrides, ActOnlyWhereTheProgramLetsThem) {
  Overrides overrides;
  overrides.obey(set(Kind::kOverride, 0.5));
  overrides.obey(set(Kind::kAdaptiveFeed, 0.5));
  overrides.obey(set(Kind::kSpindleOverride, 0.8));
  MotionBlock block;
  EXPECT_EQ(overrides.motion(&block), 0.5) << "adaptive feed acts after M52 only";
  block.overrides.adaptive = true;
  EXPECT_EQ(overrides.motion(&block), 0.25);
  block.overrides.feed = false;
  EXPECT_EQ(overrides.motion(&block), 0.5);
  EXPECT_EQ(overrides.spindle(false), 0.8);
  EXPECT_EQ(overrides.spindle(true), 1) << "a tap leaves its spindle alone";
  OverrideMode mode;
  mode.spindle = false;
  overrides.set_mode(mode);
  EXPECT_EQ(overrides.spindle(false), 1);
  overrides.reset_mode();
  EXPECT_EQ(overrides.spindle(false), 0.8);
}

// G95: 0.1 mm a turn stay 0.1 mm a turn when the operator makes the spindle faster.
TEST(Overrides, FeedPerTurnFollowsTheSpindlesOverride) {
  Overrides overrides;
  overrides.obey(set(Kind::kSpindleOverride, 1.2));
  MotionBlock block;
  EXPECT_EQ(overrides.motion(&block), 1) << "G94 does not";
  block.overrides.per_turn = true;
  EXPECT_EQ(overrides.motion(&block), 1.2);
  block.overrides.feed = false;
  EXPECT_EQ(overrides.motion(&block), 1.2) << "M50 P0 is of the feed override only";
  block.overrides.spindle = false;
  EXPECT_EQ(overrides.motion(&block), 1) << "after M51 P0 the spindle turns as programmed";
  block.overrides = {};
  block.overrides.per_turn = true;
  overrides.obey(set(Kind::kOverride, 2));
  overrides.obey(set(Kind::kSpindleOverride, 2));
  EXPECT_EQ(overrides.motion(&block), Overrides::kMax);
  overrides.obey(set(Kind::kSpindleOverride, 0));
  EXPECT_EQ(overrides.motion(&block), 0);
  block.rapid = true;
  EXPECT_EQ(overrides.motion(&block), 1);
}

TEST(Overrides, LeaveOtherCommandsToOthers) {
  Overrides overrides;
  for (const Kind kind :
       {Kind::kStart, Kind::kHold, Kind::kResume, Kind::kStop, Kind::kJog, Kind::kHome, Kind::kQuickStop,
        Kind::kEmergencyStop, Kind::kCorrection, Kind::kResetFault, Kind::kSingleBlock})
    EXPECT_FALSE(overrides.obey(set(kind, 0)));
  EXPECT_EQ(overrides.feed(), 1);
}

}  // namespace
}  // namespace trn
