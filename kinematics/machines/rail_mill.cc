#include "kinematics/machines/rail_mill.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kTurnOnly = 1e-9;  // a platform that is asked to turn about y or z by more cannot
constexpr double kSquare = 1e-6;    // sqrt/l below this: a link square to its rail

constexpr int kLeadSteps = 16;  // from home to a pose that plain Newton misses

struct PlatformState {
  Vec3 p;
  double alpha;
};

/// Link vector's base part: v_i = p + Rx(alpha) b_i - a_i.
Vec3 v_of(const Rail& rail, const Pose& X_RP) TRN_RT { return X_RP * rail.platform_P - rail.rail_R; }

/// l^2 minus the square of v's part across the rail; the link reaches if it is positive.
double along2_of(const Rail& rail, const Vec3& v) TRN_RT {
  const Vec3 across = v - rail.direction_R * rail.direction_R.dot(v);
  return rail.link_mm * rail.link_mm - across.squaredNorm();
}

/// Equations of the forward problem: (|v_i - d_i (q_i + c_i)|^2 - l_i^2) / 2 l_i, in mm.
/// The squares of the lengths are used, not the lengths themselves: they are polynomials in the slider's
/// place, and a link of length zero in between does no harm. Over 2 l the residual is still about the error
/// in mm.
struct LinkEquations {
  const std::array<Rail, 4>& rails;
  const JointVec& q;

  void evaluate(const PlatformState& at, Eigen::Vector4d& e, RailMill::Square& J) const TRN_RT {
    const Pose X_RP{rot_x(at.alpha), at.p};
    for (int i = 0; i < 4; ++i) {
      const Rail& rail = rails[i];
      const Vec3 arm = X_RP.R * rail.platform_P;
      const Vec3 link = at.p + arm - rail.rail_R - rail.direction_R * (q[i] + rail.offset_mm);
      e[i] = (link.squaredNorm() - rail.link_mm * rail.link_mm) / (2 * rail.link_mm);
      // The derivative of |link|^2 / 2 by the platform's place is the link itself, and by alpha it is what
      // the turn moves the link's end along it.
      J.row(i) << link.transpose(), Vec3::UnitX().cross(arm).dot(link);
      J.row(i) /= rail.link_mm;
    }
  }

  static PlatformState moved(const PlatformState& at, const Eigen::Vector4d& step) TRN_RT {
    return {at.p + step.head<3>(), at.alpha + step[3]};
  }
};

Rail read_rail(const ConfigTable& table) {
  Rail rail;
  rail.rail_R = table.vec3("rail_mm");
  rail.direction_R = table.vec3("direction");
  const double length = rail.direction_R.norm();
  if (!(length > 1e-9)) throw table.error("direction", "a direction must not be zero");
  rail.direction_R.normalize();
  rail.platform_P = table.vec3("platform_mm");
  rail.link_mm = table.number("link_mm", kPositive);
  rail.offset_mm = table.number("offset_mm", 0.0, kAnyNumber);
  rail.sign = table.number("sign", Range{-1.0, 1.0});
  if (rail.sign != 1.0 && rail.sign != -1.0) throw table.error("sign", "sign is 1 or -1");
  return rail;
}

}  // namespace

RailMill::RailMill(const RailMillConfig& config)
    : PlatformKinematics(config.platform, 4, 1), config_(config) {
  radius_ = 0;
  for (const Rail& rail : config_.rails) radius_ += rail.platform_P.norm() / 4;
  actuators(config_.platform.home_X_RP, home_q_);
  TRN_CHECK(radius_ > 0);
}

KinStatus RailMill::actuators(const Pose& X_RP, JointVec& q) const TRN_RT {
  q.resize(4);
  // The parallelogram links keep the platform from turning about y and z. A pose that asks for it, such as a
  // word B, has no solution with any sliders.
  if ((X_RP.R.col(0) - Vec3::UnitX()).norm() > kTurnOnly) return KinStatus::kUnreachable;
  bool square = false;
  for (int i = 0; i < 4; ++i) {
    const Rail& rail = config_.rails[i];
    const Vec3 v = v_of(rail, X_RP);
    const double along2 = along2_of(rail, v);
    if (!(along2 >= 0)) return KinStatus::kUnreachable;
    const double along = std::sqrt(along2);
    // With a link square to its rail the slider's speed for a finite speed of the platform grows without
    // bound, since q has a square root that comes to 0 there. It is the edge of the reach.
    square = square || along < kSquare * rail.link_mm;
    q[i] = -rail.offset_mm + rail.direction_R.dot(v) + rail.sign * along;
  }
  const double conditioning_min = config_.platform.conditioning_min;
  const bool ill = conditioning_min > 0 && conditioning(X_RP) < conditioning_min;
  return square || ill ? KinStatus::kSingular : KinStatus::kOk;
}

KinStatus RailMill::follow(const JointVec& q, Pose& X_RP) const TRN_RT {
  TRN_CHECK(q.size() == 4 && q.allFinite());
  PlatformState state{X_RP.p, std::atan2(X_RP.R(2, 1), X_RP.R(1, 1))};
  const KinStatus status = solve_newton<4>(LinkEquations{config_.rails, q}, state).status;
  if (status != KinStatus::kOk) return status;
  X_RP = {rot_x(state.alpha), state.p};
  for (int i = 0; i < 4; ++i) {
    const Rail& rail = config_.rails[i];
    // The equations have squared lengths and do not know on which side of the platform the slider sits.
    // Newton may end in the mirror image of the machine, which nobody could have assembled.
    const double along = q[i] + rail.offset_mm - rail.direction_R.dot(v_of(rail, X_RP));
    if (along * rail.sign < 0) return KinStatus::kUnreachable;
  }
  return KinStatus::kOk;
}

KinStatus RailMill::platform(const JointVec& q, Pose& X_RP) const TRN_RT {
  X_RP = config_.platform.home_X_RP;
  if (follow(q, X_RP) == KinStatus::kOk) return KinStatus::kOk;
  // Far from home a straight Newton may fall into another assembly: lead the sliders there in small steps.
  X_RP = config_.platform.home_X_RP;
  KinStatus status = KinStatus::kOk;
  for (int i = 1; i <= kLeadSteps && status == KinStatus::kOk; ++i) {
    const double part = static_cast<double>(i) / kLeadSteps;
    // Each small step starts from the pose of the step before, near enough that Newton stays with the
    // assembly of the home pose.
    status = follow(home_q_ + part * (q - home_q_), X_RP);
  }
  return status;
}

RailMill::Square RailMill::rail_jacobian(const Pose& X_RP) const TRN_RT {
  Square J;
  for (int i = 0; i < 4; ++i) {
    const Rail& rail = config_.rails[i];
    const Vec3 v = v_of(rail, X_RP), arm = X_RP.R * rail.platform_P;
    const double along = rail.sign * std::sqrt(std::max(along2_of(rail, v), 0.0));
    const Vec3 across = v - rail.direction_R * rail.direction_R.dot(v);
    const Vec3 dq = rail.direction_R - across / along;
    J.row(i) << dq.transpose(), Vec3::UnitX().cross(arm).dot(dq);
  }
  return J;
}

double RailMill::conditioning(const Pose& X_RP) const TRN_RT {
  Square J = rail_jacobian(X_RP);
  J.col(3) /= radius_;
  return J.allFinite() ? conditioning_of<4>(J) : 0.0;
}

double RailMill::reach(const Pose& X_RP) const TRN_RT {
  double least = 1.0;
  for (const Rail& rail : config_.rails) {
    const double along2 = along2_of(rail, v_of(rail, X_RP));
    // A negative number under the root keeps its sign: the figure goes on falling beyond the edge of the
    // reach, and a search for the edge has a slope to follow on both sides.
    least = std::min(least, std::copysign(std::sqrt(std::abs(along2)), along2) / rail.link_mm);
  }
  return least;
}

std::unique_ptr<Kinematics> make_rail_mill(const Machine& machine, const ConfigTable& section) {
  RailMillConfig config;
  config.platform = read_platform(section);
  const auto rails = section.tables("rail");
  for (std::size_t i = 0; i < rails.size(); ++i)  // a fifth is no misspelt key: it is counted below
    config.rails[std::min<std::size_t>(i, 3)] = read_rail(rails[i]);
  section.finish();  // a misspelt key explains a missing rail better than what follows
  if (rails.size() != 4)
    throw section.error("rail", fmt::format("a rail mill has 4 rails, not {}", rails.size()));
  const auto at_origin = [](const Rail& rail) { return rail.platform_P.norm() < 1e-9; };
  if (std::all_of(config.rails.begin(), config.rails.end(), at_origin))
    throw section.error("rail", "every platform_mm is zero, so the rails could not turn the platform");
  if (machine.joints.size() != 4)
    throw section.error("type", "a rail mill has four linear joints, one a rail");
  for (const Joint& joint : machine.joints)
    if (joint.kind != JointKind::kLinear)
      throw section.error("type", fmt::format("joint '{}' of a rail mill must be linear", joint.name));
  auto made = std::make_unique<RailMill>(config);
  JointVec q;
  if (made->actuators(config.platform.home_X_RP, q) != KinStatus::kOk)
    throw section.error("home_mm", "the platform cannot reach its home, or is singular there");
  return made;
}

}  // namespace trn
