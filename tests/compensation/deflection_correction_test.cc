#include "compensation/micromill/deflection_correction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "compensation/micromill/deflection_estimator.h"
#include "compensation/micromill/friction_network.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/ports.h"
#include "tests/support/allocation_counter.h"

namespace trn {
namespace {

constexpr char kSection[] = R"(
gain = 0.5
lag_s = 0.02
rate_mm_s = 2.0
stiffness_N_mm = [50.0, 40.0]
[X]
gain_mm_s2_A = 2010.0
damping_1_s = 3.89
mass_kg = 2.0
sigma_current_A = 0.0164
sigma_load_rate_N_s = 130.0
sigma_position_mm = 0.000162
[Y]
gain_mm_s2_A = 689.0
damping_1_s = 10.2
mass_kg = 6.0
sigma_current_A = 0.0092
sigma_load_rate_N_s = 92.8
sigma_position_mm = 0.000186
)";

// A network that knows of no friction at all.
FrictionNetwork silent() {
  FrictionNetwork::Shape shape;
  shape.position_scale_mm = 30;
  return {shape, std::vector<double>(static_cast<std::size_t>(shape.weight_count()))};
}

DeflectionCorrection::Config config() {
  const ConfigTable table = parse_config(kSection, "test.toml");
  DeflectionCorrection::Config out = read_deflection(table, 0.001);
  table.finish();
  out.trained = true;
  for (DeflectionEstimator::Axis& axis : out.estimator.axes) {
    axis.network = silent();
    axis.innovation_rms_max_mm = 0.002;
  }
  return out;
}

/// A stage that stands while a force on the tool is held by the motors.
struct Standing {
  Feedback feedback;
  JointVec q = JointVec::Zero(3), offset = JointVec::Zero(3);
  Standing() {
    feedback.state = DriveState::kEnabled;
    feedback.q = feedback.current_A = q;
  }
  void run(DeflectionCorrection& correction, double force_x_N, double force_y_N, int periods) {
    // 0 = J i + (1000 / M) F
    feedback.current_A[0] = -1000 / 2.0 * force_x_N / 2010;
    feedback.current_A[1] = -1000 / 6.0 * force_y_N / 689;
    for (int k = 0; k < periods; ++k) correction.wanted({q, feedback}, offset);
  }
};

TEST(DeflectionCorrection, MovesThePathAgainstTheBending) {
  DeflectionCorrection correction(config());
  Standing stage;
  stage.run(correction, 5, -3, 3000);
  EXPECT_NEAR(correction.estimate().force_N.x(), 5, 1e-3);
  EXPECT_NEAR(correction.estimate().deflection_mm.y(), -3.0 / 40, 1e-4);
  EXPECT_NEAR(stage.offset[0], -0.5 * 5 / 50, 1e-4);
  EXPECT_NEAR(stage.offset[1], 0.5 * 3 / 40, 1e-4);
  EXPECT_EQ(stage.offset[2], 0);
  EXPECT_STREQ(correction.warning(), "");
}

TEST(DeflectionCorrection, IsLimitedInRateAndRunsBackToZero) {
  DeflectionCorrection correction(config());
  Standing stage;
  double last = 0;
  for (int k = 0; k < 4000; ++k) {
    stage.run(correction, k < 2000 ? 400 : 0, 0, 1);
    ASSERT_LE(std::abs(stage.offset[0] - last), 2.0 * 0.001 + 1e-12);
    last = stage.offset[0];
    if (k == 1999) {
      EXPECT_LT(last, -2);
    }
  }
  stage.feedback.state = DriveState::kOff;
  stage.run(correction, 0, 0, 3000);
  EXPECT_NEAR(stage.offset[0], 0, 1e-6);
}

TEST(DeflectionCorrection, GainZeroOnlyEstimates) {
  DeflectionCorrection::Config off = config();
  off.gain = 0;
  DeflectionCorrection correction(off);
  Standing stage;
  stage.run(correction, 5, 5, 2000);
  EXPECT_EQ(stage.offset.norm(), 0);
  EXPECT_NEAR(correction.estimate().force_N.x(), 5, 1e-3);
}

// A loose encoder: jumps that no load explains.
TEST(DeflectionCorrection, TheAlarmTellsThatTheModelNoLongerFits) {
  DeflectionCorrection correction(config());
  Standing stage;
  stage.run(correction, 5, 0, 1000);
  EXPECT_FALSE(correction.estimate().alarm);
  for (int k = 0; k < 100; ++k) {
    stage.feedback.q[0] = k % 2 ? 0.005 : 0;
    stage.run(correction, 5, 0, 1);
  }
  EXPECT_TRUE(correction.estimate().alarm);
  EXPECT_NE(std::string(correction.warning()).find("no longer fits"), std::string::npos);
}

TEST(DeflectionCorrection, UnknownWithoutCurrentOrTraining) {
  DeflectionCorrection correction(config());
  Standing stage;
  stage.feedback.current_A.resize(0);
  for (int k = 0; k < 10; ++k) correction.wanted({stage.q, stage.feedback}, stage.offset);
  EXPECT_EQ(stage.offset.norm(), 0);
  EXPECT_NE(std::string(correction.warning()).find("current"), std::string::npos);
  DeflectionCorrection::Config raw = config();
  raw.trained = false;
  DeflectionCorrection untrained(raw);
  Standing other;
  other.run(untrained, 5, 5, 500);
  EXPECT_EQ(other.offset.norm(), 0);
  EXPECT_NE(std::string(untrained.warning()).find("micromill train"), std::string::npos);
}

TEST(DeflectionCorrection, DoesNotAllocate) {
  DeflectionCorrection correction(config());
  Standing stage;
  const long before = allocation_count();
  stage.run(correction, 5, 5, 1000);
  EXPECT_EQ(allocation_count(), before);
}

// The loop gain never exceeds process times gain times the servo's own overshoot.
TEST(CorrectionMargins, AreStated) {
  DeflectionCorrection::Config full = config();
  full.gain = 1;
  const CorrectionMargins margins = correction_margins(full, 0, 0.02, 250, 0.5);
  EXPECT_GT(margins.loop_gain_max, 0.49);
  EXPECT_LT(margins.loop_gain_max, 0.56);
  EXPECT_NEAR(margins.gain_margin * margins.loop_gain_max, 1, 1e-12);
  EXPECT_TRUE(std::isinf(margins.phase_margin_rad));
  full.gain = 0;
  EXPECT_TRUE(std::isinf(correction_margins(full, 0, 0.02, 250, 0.5).gain_margin));
  full.gain = 1.2;  // more than infinitely stiff work bears
  const CorrectionMargins beyond = correction_margins(full, 0, 0.02, 250, 1);
  EXPECT_LT(beyond.gain_margin, 1);
  EXPECT_LT(beyond.phase_margin_rad, 0.05);
}

// The cutting process closes the loop: the tool dips by `process` of what the path goes deeper. Below the
// margin the depth settles at the sum of the geometric series, beyond it the depth grows without end.
TEST(CorrectionMargins, TheLoopIsStableBelowAndUnstableBeyond) {
  constexpr double kDepthMm = 0.01, kStiffness = 50;
  for (const double process : {0.5, 0.9, 1.0}) {
    for (const double gain : {0.5, 0.9, 1.05, 1.2}) {
      DeflectionCorrection::Config closed = config();
      closed.gain = gain;
      closed.rate_mm_s = 1e6;
      closed.estimator.axes[0].innovation_rms_max_mm = 1e9;  // the alarm would end it
      DeflectionCorrection correction(closed);
      Standing stage;
      double depth_mm = kDepthMm, before_mm = 0;
      for (int k = 0; k < 6000; ++k) {
        before_mm = depth_mm;
        depth_mm = kDepthMm - stage.offset[0];
        stage.run(correction, process * kStiffness * depth_mm, 0, 1);
      }
      const CorrectionMargins margins = correction_margins(closed, 0, 0, 1e6, process);
      if (process * gain < 1) {
        EXPECT_GT(margins.gain_margin, 1);
        EXPECT_NEAR(depth_mm, kDepthMm / (1 - process * gain), 0.01 * kDepthMm) << process << " " << gain;
      } else {
        EXPECT_LT(margins.gain_margin, 1);
        EXPECT_GT(depth_mm, 10 * kDepthMm) << process << " " << gain;
        EXPECT_GT(depth_mm, before_mm);  // and still grows
      }
    }
  }
}

TEST(DeflectionConfig, SaysWhatIsWrong) {
  const auto error_of = [](std::string from, const std::string& to) {
    std::string text = kSection;
    text.replace(text.find(from), from.size(), to);
    try {
      const ConfigTable table = parse_config(text, "test.toml");
      read_deflection(table, 0.001);
      table.finish();
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(error_of("[50.0, 40.0]", "[50.0]").find("test.toml:5:"), std::string::npos);
  EXPECT_NE(error_of("lag_s", "lagg_s").find("did you mean 'lag_s'"), std::string::npos);
  EXPECT_NE(error_of("gain = 0.5", "gain = 2").find("out of range"), std::string::npos);
  EXPECT_NE(error_of("gain = 0.5", "networks = \"gone.toml\"").find("gone.toml"), std::string::npos);
  // Positions may come once in 1 to 100 periods; both ends count.
  const auto measured_every = [&](int periods) {
    return error_of("gain = 0.5", "gain = 0.5\nmeasure_every = " + std::to_string(periods));
  };
  EXPECT_EQ(measured_every(1), "");
  EXPECT_EQ(measured_every(100), "");
  EXPECT_NE(measured_every(0).find("test.toml"), std::string::npos);
  EXPECT_NE(measured_every(101).find("measure_every"), std::string::npos);
}

}  // namespace
}  // namespace trn
