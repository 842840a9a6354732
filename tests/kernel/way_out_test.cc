#include "kernel/way_out.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/axes.h"

namespace trn {
namespace {

Joints two_linear_one_rotary() {
  Joints joints(3);
  joints[2].kind = JointKind::kRotary;
  return joints;
}

JointVec place(double x, double y, double c) {
  JointVec q(3);
  q << x, y, c;
  return q;
}

/// In zones of the way back.
double zones(const JointVec& way) {
  return std::hypot(std::hypot(way[0], way[1]) / WayOut::kZone_mm, way[2] / WayOut::kZone_rad);
}

class WayOutTest : public testing::Test {
 protected:
  WayOutTest() { way_.begin(q_); }
  void go(const JointVec& to, int steps = 400) {
    const JointVec from = q_;
    for (int i = 1; i <= steps; ++i) {
      q_ = from + (to - from) * (static_cast<double>(i) / steps);
      way_.visit(q_);
      visited_.push_back(q_);
    }
  }
  /// The farthest that the way back is from all places where the machine has been, zones.
  double strays() {
    double worst = 0;
    for (JointVec from = q_; from != way_.last() || way_.count() > 1; way_.go_back()) {
      const JointVec to = way_.last();
      for (int i = 0; i <= 200; ++i) {
        const JointVec there = from + (to - from) * (i / 200.0);
        double nearest = 1e9;
        for (const JointVec& was : visited_) nearest = std::min(nearest, zones(there - was));
        worst = std::max(worst, nearest);
      }
      from = to;
    }
    return worst;
  }
  WayOut way_{two_linear_one_rotary()};
  JointVec q_ = place(3, 4, 0.5);
  std::vector<JointVec> visited_ = {q_};
};

TEST_F(WayOutTest, AStraightHasNoCornerButItsBeginning) {
  go(place(53, 4, 0.5));
  EXPECT_EQ(way_.count(), 1);
  EXPECT_EQ(way_.last(), place(3, 4, 0.5));
  go(place(23, 4, 0.5));
  EXPECT_EQ(way_.count(), 1) << "half of it back again";
}

TEST_F(WayOutTest, EveryTurnIsACorner) {
  go(place(53, 4, 0.5));
  go(place(53, 24, 0.5));
  go(place(53, 24, 0.9));
  ASSERT_EQ(way_.count(), 3);
  EXPECT_LE(zones(way_.last() - place(53, 24, 0.5)), 1);
  way_.go_back();
  EXPECT_LE(zones(way_.last() - place(53, 4, 0.5)), 1);
  way_.go_back();
  EXPECT_EQ(way_.last(), place(3, 4, 0.5)) << "to the bit";
  way_.go_back();
  EXPECT_EQ(way_.count(), 1) << "the place of the hold stays";
}

TEST_F(WayOutTest, WhatIsDrivenBackByHandIsForgotten) {
  go(place(53, 4, 0.5));
  go(place(53, 24, 0.5));
  go(place(53, 4, 0.5));
  go(place(13, 4, 0.5));
  EXPECT_EQ(way_.count(), 1);
}

TEST_F(WayOutTest, TheWayBackIsWhereTheMachineHasBeen) {
  std::mt19937_64 rng(11);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 12; ++i) {
    // As two joints that are jogged one a little after the other.
    const JointVec from = q_, way = place(4 * any(rng), 4 * any(rng), 0.02 * any(rng));
    for (int k = 1; k <= 600; ++k) {
      const double a = std::min(1.0, k / 400.0), b = std::max(0.0, k / 400.0 - 0.5);
      q_ = from + place(way[0] * a * a * (3 - 2 * a), way[1] * b * b * (3 - 2 * b), way[2] * a);
      way_.visit(q_);
      visited_.push_back(q_);
    }
  }
  EXPECT_GT(way_.count(), 12);
  EXPECT_FALSE(way_.full());
  EXPECT_LE(strays(), 3);
  EXPECT_EQ(way_.last(), place(3, 4, 0.5));
}

TEST_F(WayOutTest, SaysInTimeThatNoRoomIsLeft) {
  double x = 3;
  for (int i = 0; i < 1000 && !way_.full(); ++i) {
    x += 1;
    go(place(x, 4 + i % 2, 0.5), 20);
  }
  EXPECT_TRUE(way_.full());
  const int then = way_.count();
  for (int i = 0; i < 40; ++i) {
    x += 1;
    go(place(x, 4 + i % 2, 0.5), 20);
  }
  EXPECT_EQ(way_.count(), then + 40) << "jogs that slow down still have room";
  EXPECT_LE(strays(), 3);
}

}  // namespace
}  // namespace trn
