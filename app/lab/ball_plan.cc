#include "app/lab/ball_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/units.h"
#include "kernel/joint_map.h"

namespace trn {

namespace {

/// Joints with the centre of the stylus' ball at `centre_B`, the tool turned as `abc_rad`. False: out of
/// reach.
bool joints_for(const Assembly& assembly, const BallTouches& touches, const Vec3& abc_rad,
                const Vec3& centre_B, JointVec& q) {
  MapContext context;
  context.rtcp = true;
  context.tool_offset = Vec3(0, 0, touches.length_mm);
  const Vec3 u = assembly.kinematics->orientation(abc_rad).col(2);
  Words words;
  words.head<3>() = centre_B - touches.tip_mm / 2 * u;
  words.tail<3>() = abc_rad;
  if (assembly.map->map(words, context, q) != KinStatus::kOk) return false;
  for (std::size_t i = 0; i < assembly.machine.joints.size(); ++i) {
    const double at = q[static_cast<Eigen::Index>(i)];
    if (at < assembly.machine.joints[i].limit.min || at > assembly.machine.joints[i].limit.max) return false;
  }
  return true;
}

/// Directions of the touches from the ball's centre, in the frame of the spindle.
std::vector<Vec3> directions_of(const BallTouches& touches) {
  std::vector<Vec3> out{Vec3::UnitZ()};
  for (int k = 0; k < touches.sides; ++k) {
    const double turn = 2 * kPi * k / touches.sides;
    const double c = std::cos(touches.latitude_rad);
    out.emplace_back(c * std::cos(turn), c * std::sin(turn), std::sin(touches.latitude_rad));
  }
  return out;
}

bool touch_all(const Assembly& assembly, const BallTouches& touches, BallPosition& position) {
  const Mat3 R = assembly.kinematics->orientation(position.abc_rad);
  // The tool must not come from below the ball, where its stem is.
  if (R(2, 2) < std::cos(touches.tilt_max_rad) - 1e-9) return false;
  const Vec3 ball_B = assembly.kinematics->home_X_BM() * touches.ball_M;
  const double reach = (touches.diameter_mm + touches.tip_mm) / 2;
  for (const Vec3& direction : directions_of(touches)) {
    BallContact contact;
    contact.stylus_S = Vec3(0, 0, touches.tip_mm / 2 - touches.length_mm);
    const Vec3 away = R * direction;
    if (!joints_for(assembly, touches, position.abc_rad, ball_B + (reach + touches.clearance_mm) * away,
                    contact.q) ||
        !joints_for(assembly, touches, position.abc_rad, ball_B + reach * away, contact.q))
      return false;
    position.contacts.push_back(contact);
  }
  return true;
}

/// The angles of one rotary word that are looked at, rad; of a word that the machine does not have, 0.
std::vector<double> angles_of(const Assembly& assembly, int word, double step_rad) {
  if (!(assembly.kinematics->word_mask() >> word & 1u)) return {0};
  const int half = static_cast<int>(std::floor(kPi / step_rad + 1e-9));
  std::vector<double> out;
  for (int k = -half + 1; k <= half; ++k) out.push_back(k * step_rad);
  return out;
}

}  // namespace

std::vector<BallPosition> ball_positions(const Assembly& assembly, const BallTouches& touches) {
  std::vector<BallPosition> out;
  for (const double a : angles_of(assembly, kA, touches.step_rad))
    for (const double b : angles_of(assembly, kB, touches.step_rad))
      for (const double c : angles_of(assembly, kC, touches.step_rad)) {
        BallPosition position;
        position.abc_rad = Vec3(a, b, c);
        if (touch_all(assembly, touches, position)) out.push_back(position);
      }
  return out;
}

std::vector<BallPosition> plan_ball(const std::vector<BallPosition>& positions, int count,
                                    BallInformation& information) {
  if (positions.empty()) throw std::runtime_error("the machine reaches the ball in no position");
  std::vector<BallPosition> out;
  for (int i = 0; i < count; ++i) {
    const BallPosition* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const BallPosition& position : positions) {
      const double axes_mm = information.axes_mm(position.contacts);
      // Equally good ones by rounding: the first of the grid, so that the plan does not depend on the
      // processor.
      if (axes_mm >= least * (1 - 1e-9)) continue;
      least = axes_mm;
      best = &position;
    }
    out.push_back(*best);
    out.back().axes_mm = least;
    information.add(best->contacts);
  }
  return out;
}

}  // namespace trn
