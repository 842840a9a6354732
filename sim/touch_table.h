#pragma once

#include <cstdint>
#include <optional>
#include <random>

#include "compensation/actual_chain.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "sim/touch_shapes.h"

namespace trn {

/// The shapes on the table of a simulated machine, and the tip that meets them.
class TouchTable {
 public:
  struct Config {
    TouchShapes shapes;
    std::optional<double> length_mm;    ///< of what is in the spindle; none: what the program says of it
    double tip_radius_mm = 0;           ///< of the stylus' ball, which stands on the tool's tip
    std::optional<ActualChain> actual;  ///< where the machine's axes really lie; none: where they should
  };

  /// `kinematics` must outlive this.
  TouchTable(Config config, const Kinematics& kinematics);

  /// Air between the stylus' ball and the nearest shape, mm; negative where it is inside. Infinite where
  /// joints have no pose.
  double gap(const JointVec& q, const Vec3& tool_offset) const TRN_RT;
  bool touches(const JointVec& q, const Vec3& tool_offset) const TRN_RT { return gap(q, tool_offset) <= 0; }
  bool empty() const TRN_RT { return config_.shapes.empty(); }

 private:
  bool stylus(const JointVec& q, const Vec3& to_ball, Vec3& p_B) const TRN_RT;

  Config config_;
  const Kinematics& kinematics_;
  Pose X_MB_;  ///< table in M, at zero
};

/// The switch of a probe: it closes at a gap that is a little different at every touch.
class TouchSwitch {
 public:
  struct Config {
    double noise_mm = 0;  ///< standard deviation of where it closes
    std::uint32_t seed = 1;
  };

  explicit TouchSwitch(const Config& config) : config_(config), random_(config.seed) { draw(); }

  /// Whether it is closed at this gap, mm; once a period.
  bool closed(double gap_mm) TRN_RT;

 private:
  void draw() TRN_RT { closes_at_mm_ = config_.noise_mm > 0 ? config_.noise_mm * normal_(random_) : 0; }

  Config config_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double closes_at_mm_ = 0;
  bool used_ = false;  ///< it has closed since the last draw
};

/// The shapes of `table`, [probe] tip_diameter_mm and [errors]; ConfigError as ConfigTable.
TouchTable::Config read_touch_table(const Machine& machine, const ConfigTable& table);
/// Its keys [probe] noise_mm and seed.
TouchSwitch::Config read_touch_switch(const ConfigTable& table);

}  // namespace trn
