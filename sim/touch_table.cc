#include "sim/touch_table.h"

#include <limits>
#include <utility>

#include "compensation/geometric.h"
#include "compensation/rtcp.h"

namespace trn {

TouchTable::TouchTable(Config config, const Kinematics& kinematics)
    : config_(std::move(config)), kinematics_(kinematics), X_MB_(inverse(kinematics.home_X_BM())) {}

// The centre of the stylus' ball in B; `to_ball` leads from there to the spindle's nose, in its frame.
bool TouchTable::stylus(const JointVec& q, const Vec3& to_ball, Vec3& p_B) const TRN_RT {
  if (config_.actual) {
    ActualChain::Frames f;
    config_.actual->evaluate(q, f);
    const Vec3 p_M = f.X_MS.p - f.X_MS.A * to_ball;
    p_B = f.X_MB.A.inverse() * (p_M - f.X_MB.p);
    return true;
  }
  Pose X_BS;
  if (kinematics_.forward(q, X_BS) != KinStatus::kOk) return false;
  p_B = tip_from_spindle(X_BS, to_ball);
  return true;
}

double TouchTable::gap(const JointVec& q, const Vec3& tool_offset) const TRN_RT {
  const double r = config_.tip_radius_mm;
  Vec3 p_B;
  // Joints that no pose belongs to touch nothing.
  const Vec3 tool = config_.length_mm ? Vec3(0, 0, *config_.length_mm) : tool_offset;
  if (empty() || !stylus(q, tool - Vec3(0, 0, r), p_B)) return std::numeric_limits<double>::infinity();
  // Shapes lie in machine coordinates, as the program sees them with every offset at zero, also when the
  // table carries the work.
  return distance(config_.shapes, X_MB_ * p_B) - r;
}

bool TouchSwitch::closed(double gap_mm) TRN_RT {
  // A new place for the next touch only where the tip is well clear: one that is drawn right behind a touch
  // could be a touch again.
  if (used_ && gap_mm > closes_at_mm_ + 10 * config_.noise_mm) {
    draw();
    used_ = false;
  }
  const bool closed = gap_mm <= closes_at_mm_;
  used_ = used_ || closed;
  return closed;
}

TouchTable::Config read_touch_table(const Machine& machine, const ConfigTable& table) {
  TouchTable::Config config;
  config.shapes = read_touch_shapes(table);
  if (const auto probe = table.table_if("probe"))
    config.tip_radius_mm = probe->number("tip_diameter_mm", 0, kNotNegative) / 2;
  if (const auto errors = table.table_if("errors")) {
    config.actual = read_chain(machine);
    read_axis_errors(machine, *errors, *config.actual);
  }
  return config;
}

TouchSwitch::Config read_touch_switch(const ConfigTable& table) {
  TouchSwitch::Config config;
  const auto probe = table.table_if("probe");
  if (!probe) return config;
  config.noise_mm = probe->number("noise_mm", 0, Range{0, 1});
  config.seed = static_cast<std::uint32_t>(probe->integer("seed", 1, Range{0, 4294967295.0}));
  return config;
}

}  // namespace trn
