#include "app/daemon/telemetry.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "app/daemon/supervisor.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/motion.h"
#include "interp/gcode/g_code.h"

// Messages made of reports whose every number is another one: none may stand in another's place.
namespace trn {
namespace {

Machine bench() {
  Machine made{parse_config("", "none"), "bench", 0.002, {}};
  made.joints.push_back({"X", JointKind::kLinear, {-100, 100, 50, 500, 6000}});
  made.joints.push_back({"A", JointKind::kRotary, {-1, 2, 1, 10, 200}});
  made.joints.push_back({"Y", JointKind::kLinear, {-100, 100, 50, 500, 6000}});
  return made;
}

std::vector<FeatureDeflection> some_features(int count) {
  std::vector<FeatureDeflection> out;
  for (int i = 0; i < count; ++i) {
    FeatureDeflection f;
    f.line = static_cast<std::uint32_t>(10 + 2 * i);
    f.last_line = f.line + 1;
    f.circle = i % 3 == 0;
    f.size_mm = 20 + i;
    f.offset_mm = 0.01 * i;
    f.bending_mm = 0.5 + 0.001 * i;
    f.unknown = 0.02 * i;
    out.push_back(f);
  }
  return out;
}

trunnion::status_t told(const std::vector<FeatureDeflection>& features) {
  trunnion::status_t status{};
  add_features(features, status);
  return status;
}

// A clock that began anew with every boot would let in what was held back over one.
TEST(DaemonClock, BeginsWithTheTimeOfDayAndRunsForward) {
  const std::int64_t first = daemon_clock_us();
  EXPECT_LT(std::abs(first - unix_time_us()), 60'000'000);
  for (std::int64_t before = first, i = 0; i < 1000; ++i) {
    const std::int64_t now = daemon_clock_us();
    EXPECT_GE(now, before);
    before = now;
  }
}

TEST(Features, ComeBackAsTheyWere) {
  for (const int count : {0, 1, 7, 20}) {
    const std::vector<FeatureDeflection> features = some_features(count);
    const trunnion::status_t status = told(features);
    EXPECT_EQ(status.feature_count, count);
    EXPECT_EQ(status.features_more, 0);
    const std::vector<FeatureDeflection> back = features_of(status);
    ASSERT_EQ(back.size(), features.size());
    for (std::size_t i = 0; i < back.size(); ++i) {
      EXPECT_EQ(back[i].line, features[i].line);
      EXPECT_EQ(back[i].last_line, features[i].last_line);
      EXPECT_EQ(back[i].circle, features[i].circle);
      EXPECT_EQ(back[i].size_mm, features[i].size_mm);
      EXPECT_EQ(back[i].offset_mm, features[i].offset_mm);
      EXPECT_EQ(back[i].bending_mm, features[i].bending_mm);
      EXPECT_EQ(back[i].unknown, features[i].unknown);
    }
  }
}

// A message has an end: twenty are told, and how many are not.
TEST(Features, MoreThanTwentyAreCounted) {
  const trunnion::status_t status = told(some_features(25));
  EXPECT_EQ(status.feature_count, 20);
  EXPECT_EQ(status.features_more, 5);
  EXPECT_EQ(features_of(status).size(), 20u);
  EXPECT_EQ(features_of(status).back().line, 48u);
}

// Of a circle of 23 mm that is cut 0.03 mm further out all round, 23.06 mm; a cut keeps its length.
TEST(Features, ACirclesDiameterGrowsByTwiceTheOffset) {
  const trunnion::status_t status = told(some_features(5));
  EXPECT_NEAR(status.feature_predicted_mm[3], 23.06, 1e-12);
  EXPECT_NEAR(status.feature_predicted_mm[4], 24, 1e-12);
}

TEST(Status, HasWhatTheDaemonAndTheTickKnow) {
  trunnion::status_t view = first_status(bench(), "0.9", {"one", "two"});
  view.program = "part.ngc";
  view.message = "a message";
  view.waits_for = "a tool";
  view.program_failed = true;
  view.override_wanted = 0.1;
  view.rapid_override = 0.2;
  view.spindle_override = 0.3;
  view.adaptive_feed = 0.4;
  CycleReport report;
  report.line = 17;
  report.spindle_rpm = 8000;
  report.single_block = true;
  report.override_now = 0.5;
  report.starvations = 3;
  report.homed_mask = 0b101;
  report.limit_switch_mask = 0b010;
  LoopStatistics statistics;
  statistics.periods = 1000;
  statistics.overruns = 7;
  trunnion::status_t status = view;
  fill_status(bench(), MachineState::kRunning, report, statistics, status);
  EXPECT_EQ(status.pid, getpid());
  EXPECT_EQ(status.machine, "bench");
  EXPECT_EQ(status.state, "running");
  EXPECT_EQ(status.fault, "ok");
  EXPECT_EQ(status.fault_joint, "");
  EXPECT_EQ(status.program, "part.ngc");
  EXPECT_EQ(status.message, "a message");
  EXPECT_EQ(status.waits_for, "a tool");
  EXPECT_TRUE(status.program_failed);
  EXPECT_EQ(status.override_wanted, 0.1);
  EXPECT_EQ(status.rapid_override, 0.2);
  EXPECT_EQ(status.spindle_override, 0.3);
  EXPECT_EQ(status.adaptive_feed, 0.4);
  EXPECT_EQ(status.warnings, view.warnings);
  EXPECT_EQ(status.warning_count, 2);
  EXPECT_FALSE(status.realtime);
  EXPECT_EQ(status.line, 17);
  EXPECT_EQ(status.spindle_rpm, 8000);
  EXPECT_TRUE(status.single_block);
  EXPECT_EQ(status.override_now, 0.5);
  EXPECT_EQ(status.starvations, 3);
  EXPECT_EQ(status.period_s, 0.002);
  EXPECT_EQ(status.periods, 1000);
  EXPECT_EQ(status.overruns, 7);
  EXPECT_EQ(status.joint_count, 3);
  EXPECT_EQ(status.joint_name, (std::vector<std::string>{"X", "A", "Y"}));
  EXPECT_EQ(status.joint_unit, (std::vector<std::string>{"mm", "rad", "mm"}));
  const std::vector<bool> homed(status.joint_homed.begin(), status.joint_homed.end());
  const std::vector<bool> on_switch(status.joint_limit_switch.begin(), status.joint_limit_switch.end());
  EXPECT_EQ(homed, (std::vector<bool>{true, false, true}));
  EXPECT_EQ(on_switch, (std::vector<bool>{false, true, false}));
}

TEST(Status, NamesTheFaultAndItsJoint) {
  CycleReport report;
  const LoopStatistics statistics;
  trunnion::status_t status = first_status(bench(), "", {});
  EXPECT_TRUE(status.realtime) << "nothing was refused";
  EXPECT_EQ(status.override_wanted, 1);
  report.fault = Fault::kDriveFault;
  report.fault_joint = 2;
  fill_status(bench(), MachineState::kFault, report, statistics, status);
  EXPECT_EQ(status.fault, "drive_fault");
  EXPECT_EQ(status.fault_joint, "Y");
  status = first_status(bench(), "", {});
  fill_status(bench(), MachineState::kEstop, report, statistics, status);
  EXPECT_EQ(status.fault, "drive_fault") << "the first cause stays";
  report.fault = Fault::kOk;
  status = first_status(bench(), "", {});
  fill_status(bench(), MachineState::kEstop, report, statistics, status);
  EXPECT_EQ(status.fault, fault_info(Fault::kEmergencyStop).name)
      << "pressed, before the tick has heard of it";
}

std::string waits(QueueEvent::Kind kind, double value, int argument,
                  MotionState motion = MotionState::kMoving, const ProgramStep* step = nullptr) {
  CycleReport report;
  report.motion = motion;
  report.waits_at.kind = kind;
  report.waits_at.value = value;
  report.waits_at.argument = argument;
  return waits_text(report, step, [](int tool) { return "tool " + std::to_string(tool); });
}

TEST(WaitsText, SaysWhatTheMachineStandsForAndWhoGoesOn) {
  using Kind = QueueEvent::Kind;
  EXPECT_EQ(waits(Kind::kNone, 0, 0), "");
  EXPECT_EQ(waits(Kind::kDwell, 1, 0), "") << "ends by itself";
  EXPECT_EQ(waits(Kind::kToolChange, kToolByOperator, 7), "tool 7: put it into the spindle, then 'resume'");
  EXPECT_EQ(waits(Kind::kToolChange, kToolByOperator, 0),
            "tool 0: take the tool out of the spindle, then 'resume'");
  EXPECT_EQ(waits(Kind::kToolChange, 3, 7), "tool 7: put it into the spindle; input 3 confirms it");
  EXPECT_NE(waits(Kind::kProgramStop, 0, 0).find("M0"), std::string::npos);
  EXPECT_NE(waits(Kind::kOptionalStop, 0, 0).find("M1"), std::string::npos);
  const InputArgument digital{5, InputWait::kRise, false}, analog{6, InputWait::kNow, true};
  EXPECT_EQ(waits(Kind::kWaitInput, 1, digital.packed()), "digital input 5 (M66)");
  EXPECT_EQ(waits(Kind::kWaitInput, 1, analog.packed()), "analog input 6 (M66)");
  EXPECT_EQ(waits(Kind::kSpindle, -1000, 0), "the spindle to reach 1000 rpm");
  EXPECT_EQ(waits(Kind::kSpindleOrient, 90, 0), "the spindle to stand at 90 degrees");
  EXPECT_NE(waits(Kind::kNone, 0, 0, MotionState::kPaused).find("single block"), std::string::npos);
  EXPECT_NE(waits(Kind::kToolChange, 3, 7, MotionState::kHeld).find("hold"), std::string::npos)
      << "what was commanded comes first";
}

ProgramStep step_with(std::string_view text) {
  ProgramStep step;
  std::copy(text.begin(), text.end(), step.text.begin());
  return step;
}

TEST(WaitsText, HasTheWordsOfTheProgramsStop) {
  using Kind = QueueEvent::Kind;
  const ProgramStep step = step_with("N10 M0 (turn the part) ; and clamp it");
  EXPECT_EQ(waits(Kind::kProgramStop, 0, 0, MotionState::kPaused, &step),
            "program stop (M0): turn the part; and clamp it; 'resume' goes on");
  const ProgramStep silent = step_with("M1 ( )");
  EXPECT_EQ(waits(Kind::kOptionalStop, 0, 0, MotionState::kPaused, &silent),
            "optional stop (M1): 'resume' goes on");
  EXPECT_EQ(remark_of("G1 X1"), "");
  EXPECT_EQ(remark_of("G1 (never closed"), "never closed");
}

TEST(WaitsText, KnowsAProbeMove) {
  ProgramStep step = step_with("G38.2 Z-10");
  step.moves = true;
  step.settings.motion = 38.2_g;
  using Kind = QueueEvent::Kind;
  EXPECT_EQ(waits(Kind::kNone, 0, 0, MotionState::kMoving, &step),
            "contact of the probe (G38.2), or the end of the move");
  EXPECT_EQ(waits(Kind::kProbeStart, 0, 0, MotionState::kMoving, &step), "the probe to be armed");
  EXPECT_EQ(waits(Kind::kNone, 0, 0, MotionState::kRest, &step), "");
}

TEST(Motion, HasThePeriodsNumbers) {
  CycleReport report;
  report.period = 123456789012;
  report.line = 9;
  report.q_setpoint = JointVec::LinSpaced(3, 1, 3);
  report.q_measured = JointVec::LinSpaced(3, 11, 13);
  report.y << 21, 22, 23, 24, 25, 26;
  report.speed_mm_s = 31;
  report.override_now = 0.75;
  report.tool_load.known = true;
  report.tool_load.force_N = {41, 42};
  report.tool_load.deflection_mm = {0.51, 0.52};
  const trunnion::motion_t motion = make_motion(report);
  EXPECT_EQ(motion.period, 123456789012);
  EXPECT_EQ(motion.line, 9);
  EXPECT_EQ(motion.joint_count, 3);
  EXPECT_EQ(motion.q_setpoint, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(motion.q_measured, (std::vector<double>{11, 12, 13}));
  EXPECT_EQ(std::vector<double>(motion.word, motion.word + 6), (std::vector<double>{21, 22, 23, 24, 25, 26}));
  EXPECT_EQ(motion.speed_mm_s, 31);
  EXPECT_EQ(motion.override_now, 0.75);
  EXPECT_TRUE(motion.tool_load_known);
  EXPECT_FALSE(motion.tool_load_alarm);
  EXPECT_EQ(std::vector<double>(motion.tool_force_N, motion.tool_force_N + 2), (std::vector<double>{41, 42}));
  EXPECT_EQ(std::vector<double>(motion.tool_deflection_mm, motion.tool_deflection_mm + 2),
            (std::vector<double>{0.51, 0.52}));
  report.tool_load.known = false;
  report.tool_load.alarm = true;
  EXPECT_FALSE(make_motion(report).tool_load_known);
  EXPECT_TRUE(make_motion(report).tool_load_alarm);
}

}  // namespace
}  // namespace trn
