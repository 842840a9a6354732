#include "app/daemon/direction_jog.h"

#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "app/session/assembly.h"
#include "app/session/program_step.h"
#include "core/frames.h"
#include "core/units.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// A shipped machine that stands at these machine words, with the modes and offsets of its config.
struct Standing {
  Standing(const std::string& config, const Words& words)
      : assembly(assemble(source_dir() + "/configs/" + config + ".toml")),
        map(*assembly.kinematics),
        step(idle_step(assembly, Parameters(), ToolTable(), nullptr)) {
    EXPECT_EQ(assembly.kinematics->joints_from_words(words, q), KinStatus::kOk);
  }
  DirectionOrder order(const DirectionWish& wish) const {
    return plan_direction_jog(wish, {map, *assembly.kinematics, assembly.plan_joints, step}, q);
  }
  /// Where the program's G53 move leads, machine words; what it does not name stays.
  Words target(const DirectionOrder& order) const {
    Words to;
    EXPECT_EQ(assembly.kinematics->words_from_joints(q, to), KinStatus::kOk);
    static const std::regex word(" ([XYZABC])(-?[0-9.]+)");
    const std::string move = order.program.substr(order.program.find("G53 G1"));
    for (std::sregex_iterator it(move.begin(), move.end(), word), end; it != end; ++it) {
      const auto k = static_cast<Eigen::Index>(std::string_view(kWordLetters).find((*it)[1].str()));
      to[k] = std::stod((*it)[2]) * (k >= kA ? kRadPerDeg : 1);
    }
    return to;
  }
  Pose pose(const Words& words) const {
    JointVec joints;
    Pose X_BS;
    EXPECT_EQ(assembly.kinematics->joints_from_words(words, joints), KinStatus::kOk);
    EXPECT_EQ(assembly.kinematics->forward(joints, X_BS), KinStatus::kOk);
    return X_BS;
  }
  Words words() const {
    Words out;
    EXPECT_EQ(assembly.kinematics->words_from_joints(q, out), KinStatus::kOk);
    return out;
  }

  Assembly assembly;
  MachineJointMap map;
  ProgramStep step;
  JointVec q;
};

Words tilted(double x, double y, double z, double a_deg, double b_deg, double c_deg) {
  Words words;
  words << x, y, z, a_deg * kRadPerDeg, b_deg * kRadPerDeg, c_deg * kRadPerDeg;
  return words;
}

struct Place {
  const char* config;
  Words words;
};

const std::vector<Place>& places() {
  static const std::vector<Place> all = {{"cradle", tilted(10, -20, 30, -35, 0, 70)},
                                         {"head", tilted(5, 12, 40, 25, 0, -40)},
                                         {"head_table", tilted(5, 12, 40, 20, 0, 50)},
                                         {"hexapod", tilted(3, -4, 20, 4, -3, 0)},
                                         {"mill", tilted(10, 20, 30, 0, 0, 0)}};
  return all;
}

// The spindle moves along its own axes, in the table's frame, and does not turn.
TEST(DirectionJog, AlongTheToolTheSpindleMovesAlongItsOwnAxes) {
  for (const Place& place : places()) {
    const Standing machine(place.config, place.words);
    const Pose before = machine.pose(machine.words());
    for (int word = kX; word <= kZ; ++word)
      for (const double way : {2.0, -1.5}) {
        const DirectionOrder order = machine.order({JogFrame::kTool, word, way, 10});
        ASSERT_EQ(order.refusal + order.remark, "") << place.config;
        const Pose after = machine.pose(machine.target(order));
        EXPECT_LT((after.p - before.p - way * before.R.col(word)).norm(), 5e-6) << place.config << word;
        EXPECT_LT((after.R - before.R).norm(), 1e-9) << place.config << word;
      }
  }
}

TEST(DirectionJog, AlongTheMachineOnlyItsWordMoves) {
  for (const Place& place : places()) {
    const Standing machine(place.config, place.words);
    for (int word = kX; word <= kC; ++word) {
      const DirectionWish wish{JogFrame::kMachine, word, word < kA ? 1.0 : 0.01, 0};
      const DirectionOrder order = machine.order(wish);
      if ((machine.assembly.kinematics->word_mask() >> word & 1U) == 0) {
        EXPECT_NE(order.refusal, "") << place.config << word;
        continue;
      }
      Words expected = machine.words();
      expected[word] += wish.way;
      EXPECT_LT((machine.target(order) - expected).norm(), 2e-6) << place.config << word << order.program;
    }
  }
}

// With RTCP the work's axes are those of the table, without it those of the machine; a tilted plane turns
// both.
TEST(DirectionJog, AlongTheWorkItGoesAsTheProgramCounts) {
  for (const bool rtcp : {false, true}) {
    Standing machine("cradle", places()[0].words);
    machine.step.context.rtcp = rtcp;
    machine.step.frame.X_TP.R = rot_z(0.4) * rot_x(0.7);
    const Pose before = machine.pose(machine.words());
    const DirectionOrder order = machine.order({JogFrame::kWork, kY, 3, 10});
    ASSERT_EQ(order.refusal, "");
    const Words to = machine.target(order);
    const Vec3 moved = rtcp ? Vec3(machine.pose(to).p - before.p) : Vec3((to - machine.words()).head<3>());
    EXPECT_LT((moved - 3 * (rot_z(0.4) * rot_x(0.7)).col(1)).norm(), 5e-6) << rtcp;
  }
}

TEST(DirectionJog, EndsWhereTheFirstJointIsAtItsLimit) {
  for (const Place& place : places()) {
    const Standing machine(place.config, place.words);
    for (int word = kX; word <= kZ; ++word)
      for (const double way : {1.0, -1.0}) {
        DirectionWish wish{JogFrame::kTool, word, way, 10};
        wish.held = true;
        const DirectionOrder held = machine.order(wish);
        ASSERT_EQ(held.refusal + held.remark, "") << place.config;
        JointVec q;
        ASSERT_EQ(machine.assembly.kinematics->joints_from_words(machine.target(held), q), KinStatus::kOk);
        double nearest = 1e9;
        for (std::size_t i = 0; i < machine.assembly.plan_joints.size(); ++i) {
          const JointLimit& limit = machine.assembly.plan_joints[i].limit;
          const double left = std::min(q[static_cast<Eigen::Index>(i)] - limit.min,
                                       limit.max - q[static_cast<Eigen::Index>(i)]);
          nearest = std::min(nearest, left);
        }
        EXPECT_GE(nearest, 0) << place.config << word << way;
        // A hexapod's leg may meet the limit of its own joints' angles before that of its length.
        if (std::string(place.config) != "hexapod") {
          EXPECT_LT(nearest, 1e-5) << place.config << word << way;
        }
        wish.held = false;
        wish.way = 1e4 * way;
        EXPECT_NE(machine.order(wish).remark.find("stops where a joint is at its limit"), std::string::npos);
      }
  }
}

TEST(DirectionJog, StandingAtALimitOnlyTheWayBackIsFree) {
  Words words = Words::Zero();
  words[kZ] = 0;
  Standing machine("mill", words);
  machine.q[2] = machine.assembly.plan_joints[2].limit.max;
  const bool up_is_plus = machine.target(machine.order({JogFrame::kMachine, kX, 1, 0}))[kZ] > 0;
  const double up = up_is_plus ? 1 : -1;
  EXPECT_NE(machine.order({JogFrame::kTool, kZ, up, 0}).refusal, "");
  EXPECT_EQ(machine.order({JogFrame::kTool, kZ, -up, 0}).refusal, "");
  EXPECT_NE(machine.order({JogFrame::kTool, kA, 1, 0}).refusal, "") << "a rotary axis has no direction";
}

TEST(DirectionJog, TheSpeedIsAtMostWhatTheFirstJointBears) {
  const Standing machine("mill", Words::Zero());
  const auto feed = [&](DirectionWish wish) {
    const std::string program = machine.order(wish).program;
    return std::stod(program.substr(program.find(" F") + 2)) / 60;
  };
  const double greatest = machine.assembly.plan_joints[0].limit.velocity;
  EXPECT_NEAR(feed({JogFrame::kTool, kX, 1, 7}), 7, 1e-3);
  EXPECT_NEAR(feed({JogFrame::kTool, kX, 1, 1e6}), greatest, 1e-3 * greatest);
  EXPECT_NEAR(feed({JogFrame::kTool, kX, 1, 0}), 0.1 * greatest, 1e-3 * greatest);
  EXPECT_NEAR(feed({JogFrame::kTool, kX, 1, 0, 0.5}), 0.5 * greatest, 1e-3 * greatest);
}

}  // namespace
}  // namespace trn
