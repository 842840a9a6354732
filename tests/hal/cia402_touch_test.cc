#include "hal/can/cia402_touch.h"

#include <gtest/gtest.h>

// Words as in the object descriptions of 0x60B8 and 0x60B9 (CiA 402-2).
namespace trn {
namespace {

TEST(Cia402Touch, WaitsForARiseAndTakesItsPosition) {
  Cia402Touch touch;
  EXPECT_EQ(touch.function(), 0);
  touch.arm(true);
  EXPECT_EQ(touch.function(), 0) << "what an earlier use has left is cleared first";
  touch.take_status(0x0003);
  EXPECT_EQ(touch.function(), 0) << "not yet cleared";
  touch.take_status(0);
  EXPECT_EQ(touch.function(), 0x0011);  // on, at the positive edge, first event, input 1
  EXPECT_FALSE(touch.armed());
  touch.take_status(0x0001);
  EXPECT_TRUE(touch.armed());
  touch.take_position(true, 5);
  EXPECT_FALSE(touch.latched()) << "a position without an edge is an old one";
  touch.take_status(0x0003);
  EXPECT_TRUE(touch.triggered());
  touch.take_position(false, 6);
  EXPECT_FALSE(touch.latched()) << "of the other edge";
  touch.take_position(true, -1234);
  EXPECT_TRUE(touch.latched());
  EXPECT_EQ(touch.counts(), -1234);
  touch.take_position(true, 7);
  EXPECT_EQ(touch.counts(), -1234) << "the first one counts";
}

TEST(Cia402Touch, OrForAFall) {
  Cia402Touch touch;
  touch.arm(false);
  touch.take_status(0);
  EXPECT_EQ(touch.function(), 0x0021);
  touch.take_status(0x0001);
  touch.take_status(0x0003);  // a rise is not what it waits for
  EXPECT_FALSE(touch.triggered());
  touch.take_status(0x0005);
  touch.take_position(false, 99);
  EXPECT_TRUE(touch.latched());
  touch.disarm();
  EXPECT_EQ(touch.function(), 0);
  EXPECT_FALSE(touch.armed());
}

}  // namespace
}  // namespace trn
