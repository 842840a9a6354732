#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "hal/loopback.h"
#include "kernel/cycle.h"
#include "kernel/daemon/program_feeder.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/paths.h"

// A planner that cannot keep up: the daemon's own feeder in its own thread, on a machine whose kinematics
// take their time. Time is counted in ticks: so many evaluations a tick, and no more.
namespace trn {
namespace {

/// Another machine's kinematics, rationed while the planner's thread asks.
class SlowKinematics final : public Kinematics {
 public:
  explicit SlowKinematics(std::unique_ptr<Kinematics> inner) : inner_(std::move(inner)) {}

  int joint_count() const TRN_RT override { return inner_->joint_count(); }
  unsigned word_mask() const TRN_RT override { return inner_->word_mask(); }
  Pose home_X_BM() const TRN_RT override { return inner_->home_X_BM(); }
  Mat3 orientation(const Vec3& abc) const TRN_RT override { return inner_->orientation(abc); }
  KinStatus words_for_axis(const Vec3& u_B, const Vec3& seed_abc, Vec3& abc) const TRN_RT override {
    return inner_->words_for_axis(u_B, seed_abc, abc);
  }
  KinStatus forward(const JointVec& q, Pose& X_BS) const TRN_RT override { return inner_->forward(q, X_BS); }
  KinStatus inverse(const Pose& X_BS, const JointVec& seed, JointVec& q) const TRN_RT override {
    count();
    return inner_->inverse(X_BS, seed, q);
  }
  KinStatus joints_from_words(const Words& words, JointVec& q) const TRN_RT override {
    count();
    return inner_->joints_from_words(words, q);
  }
  KinStatus words_from_joints(const JointVec& q, Words& words) const TRN_RT override {
    return inner_->words_from_joints(q, words);
  }

  void allow(double calls) { allowed_ = allowed_ + calls; }
  void allow_no_more() { allowed_ = calls_.load(); }
  double calls() const { return calls_; }

 private:
  void count() const {
    calls_ = calls_ + 1;
    while (calls_ > allowed_) std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
  std::unique_ptr<Kinematics> inner_;
  mutable std::atomic<double> calls_ = 0;
  std::atomic<double> allowed_ = 1e18;
};

std::string waves() {
  std::string program = "G21 G94 G64 P0.01 F5000\nG90\n";
  char line[80];
  for (int i = 1; i <= 2500; ++i) {
    const double x = 0.2 * i;
    std::snprintf(line, sizeof line, "G1 X%.4f Y%.4f A%.4f\n", x - 200, 20 * std::sin(x / 15), x / 20);
    program += line;
  }
  return program + "M2\n";
}

class StarvedPlanner : public testing::Test {
 protected:
  static std::string config() { return source_dir() + "/configs/cradle.toml"; }

  StarvedPlanner() : fast_(assemble(config())), slow_(assemble(config())), queue_(1 << 14) {
    auto kinematics = std::make_unique<SlowKinematics>(std::move(slow_.kinematics));
    kinematics_ = kinematics.get();
    slow_.kinematics = std::move(kinematics);
    slow_.map = std::make_unique<MachineJointMap>(*kinematics_, nullptr, nullptr);
  }

  void SetUp() override {
    // How many evaluations a period of motion takes, without any hurry.
    Parameters parameters;
    ToolTable tools;
    JointVec q = JointVec::Zero(5);
    q[0] = -200;
    Pipeline pipeline(slow_, parameters, tools, {"test", waves(), q}, {});
    MotionBlock block;
    while (pipeline.next(block)) {
      if (block.segment_count == 0) continue;
      for (int i = 0; i < block.segment_count; ++i)
        plan_s_ += block.segments[static_cast<std::size_t>(i)].duration_s;
    }
    calls_per_period_ = kinematics_->calls() / (plan_s_ / fast_.machine.period_s);
    start_ = q;
  }

  Assembly fast_, slow_;
  SlowKinematics* kinematics_ = nullptr;
  MotionQueue queue_;
  double plan_s_ = 0, calls_per_period_ = 0;
  JointVec start_;
};

TEST_F(StarvedPlanner, SlowsOnThePathToThePlannersPaceAndNeverJerks) {
  LoopbackDrives drives(start_);
  drives.bring_up();
  const double T = fast_.machine.period_s;
  Cycle cycle({T, fast_.machine.joints, false, 8, fast_.plan_joints}, *fast_.map, queue_, drives);
  for (int i = 0; i < 3; ++i) cycle.tick();
  ProgramFeeder feeder(slow_, queue_, {}, {});
  feeder.load_mdi(waves(), start_);  // primed in full
  kinematics_->allow_no_more();
  cycle.post({RtCommand::Kind::kStart});

  constexpr int kGoneFrom = 5000, kGoneUntil = 9000;
  constexpr double kPace = 0.5;
  JointJudge judge(fast_.machine.joints, T);
  judge(cycle.last_report().q_setpoint);
  double slowest = 1, slowest_gone = 1, sum = 0, rate_before = 0, largest_step = 0;
  int counted = 0, periods = 0;
  for (; periods < 60000 && (periods < 3 || cycle.last_report().motion != MotionState::kRest); ++periods) {
    const bool gone = periods >= kGoneFrom && periods < kGoneUntil;
    if (!gone) kinematics_->allow(kPace * calls_per_period_);
    cycle.tick();
    const CycleReport& report = cycle.last_report();
    ASSERT_EQ(report.fault, Fault::kOk) << "period " << periods;
    judge(report.q_setpoint);
    if (periods > 1) largest_step = std::max(largest_step, std::abs(report.override_now - rate_before));
    rate_before = report.override_now;
    if (gone) slowest_gone = std::min(slowest_gone, report.override_now);
    if (periods > 2000 && periods < kGoneFrom) {
      slowest = std::min(slowest, report.override_now);
      sum += report.override_now;
      ++counted;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(60));
  }
  std::string where;
  const double worst = judge.worst(&where);
  std::printf(
      "%.2f s of plan took %.2f s at half the pace; rate between 2 s and 5 s: mean %.3f, least %.3f; least "
      "while "
      "the planner was gone %.5f; %u times late; worst ratio %.6f (%s)\n",
      plan_s_, periods * T, sum / counted, slowest, slowest_gone, cycle.last_report().starvations, worst,
      where.c_str());
  EXPECT_EQ(cycle.last_report().motion, MotionState::kRest);
  EXPECT_LE(worst, LimitJudge::kRatioMax);
  EXPECT_GT(cycle.last_report().starvations, 0u);
  EXPECT_GT(slowest, 0.1) << "it stopped though the planner went on";
  EXPECT_LT(slowest_gone, 0.05) << "the planner was gone, and the machine was not slow";
  EXPECT_LT(largest_step, 0.05) << "of the rate in a period";
}

}  // namespace
}  // namespace trn
