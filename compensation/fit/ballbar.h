#pragma once

#include <string>
#include <vector>

#include "compensation/actual_chain.h"
#include "core/axes.h"
#include "core/frames.h"

namespace trn {

/// One ball-bar test: a bar between a ball on the table and a cup in the spindle, of which only one rotary
/// axis turns. Source: docs/sources.md S1.6.
struct BallbarTest {
  std::string name;
  int joint = 0;        ///< the axis that turns
  Vec3 ball_B, cup_M;   ///< centres, mm; the cup is the tool tip, the linear axes stand there
  double bar_mm = 100;  ///< nominal length
  double from_rad = 0, to_rad = 0;
  double overrun_rad = 0;  ///< driven beyond both ends, without readings
  double step_rad = 0;     ///< between readings
};

struct BallbarReading {
  double angle_rad = 0;   ///< of the axis as programmed
  double reading_mm = 0;  ///< distance of the centres less the nominal length
};

struct BallbarTrace {
  BallbarTest test;
  std::vector<BallbarReading> readings;
  double peak_to_peak_mm() const;
};

/// What is wrong with the set-up: centres beside their nominal places, mm.
struct BallbarSetup {
  Vec3 ball_offset_B = Vec3::Zero(), cup_offset_M = Vec3::Zero();
};

/// The tests of a machine whose table turns about A (parallel X) and C (parallel Z): a, a_extended, c,
/// c_extended identify all eight errors; a_left, a_right (550 mm apart in x) and c_low, c_high (78 mm apart
/// in z) are the circles of the planar method. `surface` is the height of the table frame B over A's axis
/// (M).
std::vector<BallbarTest> ballbar_tests(const ActualChain& chain);

/// The bar's reading at joints q of the machine `chain`.
double ballbar_reading(const ActualChain& chain, const BallbarTest& test, const BallbarSetup& setup,
                       const JointVec& q);

/// Joints of an uncompensated test: the linear joints at the cup, the turning axis at `angle`.
JointVec ballbar_joints(const ActualChain& chain, const BallbarTest& test, double angle_rad);

}  // namespace trn
