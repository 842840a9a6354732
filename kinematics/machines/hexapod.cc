#include "kinematics/machines/hexapod.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/units.h"
#include "kinematics/segment_distance.h"
#include "kinematics/serial/chain.h"

namespace trn {

namespace {

constexpr double kLegMin = 1e-6;  // mm; a leg without length has no direction

/// Equations of the forward problem: leg lengths of the pose minus the wanted ones.
struct LegEquations {
  const Hexapod& hexapod;
  const HexapodConfig& config;
  const JointVec& wanted;

  void evaluate(const Pose& X_RP, Eigen::Matrix<double, 6, 1>& e, Hexapod::Square& J) const TRN_RT {
    for (int i = 0; i < 6; ++i) e[i] = (X_RP * config.platform_P[i] - config.base_R[i]).norm() - wanted[i];
    J = hexapod.leg_jacobian(X_RP);
  }

  static Pose moved(const Pose& X_RP, const Eigen::Matrix<double, 6, 1>& step) TRN_RT {
    // The step's turn is a vector in the base frame, as in `leg_jacobian`, so it acts from the left. The
    // platform is turned about its own origin and its place is moved apart from that.
    const Vec3 turn = step.tail<3>();
    const double angle = turn.norm();
    const Mat3 R = angle > 0 ? rotation_about(turn / angle, angle) : Mat3::Identity();
    return {R * X_RP.R, X_RP.p + step.head<3>()};
  }
};

/// Squared length of a leg against the turn g about the tool: constant + cosine cos g + sine sin g.
/// Seen from the tool axis, turning the platform about the tool moves each of its joints on a circle. The
/// square of a leg's length is then a plain sine of the turn, where the length itself would be its root.
struct TurnedLeg {
  double cosine = 0, sine = 0, constant = 0;
  double at(double g) const TRN_RT { return constant + cosine * std::cos(g) + sine * std::sin(g); }
  double slope(double g) const TRN_RT { return sine * std::cos(g) - cosine * std::sin(g); }
  double bend(double g) const TRN_RT { return constant - at(g); }
};

/// leg = fixed + Rz(sense g) turning, in a frame whose Z is the tool axis.
/// With f fixed and t turning, |f + Rz t|^2 = f^2 + t^2 + 2 f . Rz t, and only the last term depends on the
/// turn.
TurnedLeg turned_leg(const Vec3& fixed, const Vec3& turning, double sense) TRN_RT {
  return {2 * (fixed.x() * turning.x() + fixed.y() * turning.y()),
          2 * sense * (fixed.y() * turning.x() - fixed.x() * turning.y()),
          fixed.squaredNorm() + turning.squaredNorm() + 2 * fixed.z() * turning.z()};
}

/// First and second derivative, mm^4/rad and mm^4/rad^2, of three times the variance of the squared lengths.
struct VarianceSlope {
  double slope = 0, bend = 0;
};

VarianceSlope variance_slope(const std::array<TurnedLeg, 6>& legs, double g) TRN_RT {
  VarianceSlope out;
  for (const TurnedLeg& leg : legs) {
    const double at = leg.at(g), slope = leg.slope(g);
    out.slope += at * slope;
    out.bend += slope * slope + at * leg.bend(g);
  }
  return out;
}

/// Turn, rad, at which the variance of the legs' squared lengths has its minimum next to 0; they are given
/// less their mean.
double least_variance(const std::array<TurnedLeg, 6>& legs) TRN_RT {
  constexpr int kIterationsMax = 40, kStridesMax = 10;
  constexpr double kStride = 0.3, kLastStep = 1e-9;  // rad
  VarianceSlope here = variance_slope(legs, 0);
  if (!(std::abs(here.slope) > 0)) return 0;  // no leg feels the turn, or 0 is the bottom
  // Downhill from 0 in strides of 0.3 rad (17 degrees), until the way goes up again: the valley's bottom lies
  // within the last stride.
  const double downhill = here.slope < 0 ? 1 : -1;
  double g = 0, near = 0, far = 0;
  for (int i = 0; i < kStridesMax && here.slope * downhill < 0; ++i) {
    near = far;
    far += downhill * kStride;
    here = variance_slope(legs, far);
    g = far;
  }
  if (here.slope * downhill < 0) return g;  // half a turn away; the bound holds it back in any case
  // Newton's step is taken where it stays between the two ends, and half their distance where it does not: a
  // valley may be so flat that the curvature at its rim is no guide, or negative.
  for (int i = 0; i < kIterationsMax; ++i) {
    (here.slope * downhill < 0 ? near : far) = g;
    const double newton = here.bend > 0 ? g - here.slope / here.bend : far;
    // The error behind so small a step is of the order of its square. A further step would be rounding.
    if (here.bend > 0 && std::abs(newton - g) < kLastStep) return newton;
    const bool inside = (newton - near) * downhill > 0 && (far - newton) * downhill > 0;
    g = inside ? newton : 0.5 * (near + far);
    here = variance_slope(legs, g);
  }
  return g;
}

}  // namespace

Hexapod::Hexapod(const HexapodConfig& config) : PlatformKinematics(config.platform, 6, 2), config_(config) {
  // A turn of the platform by 1 rad moves its joints by about this radius, in mm. `conditioning` divides by
  // it, so that turns and shifts have the same unit and the figure does not depend on mm or m.
  radius_ = 0;
  for (int i = 0; i < 6; ++i) {
    home_direction_[i] = leg(config_.platform.home_X_RP, i).normalized();
    radius_ += config_.platform_P[i].norm() / 6;
  }
}

Vec3 Hexapod::leg(const Pose& X_RP, int i) const TRN_RT {
  return X_RP * config_.platform_P[i] - config_.base_R[i];
}

KinStatus Hexapod::actuators(const Pose& X_RP, JointVec& q) const TRN_RT {
  q.resize(6);
  for (int i = 0; i < 6; ++i) q[i] = leg(X_RP, i).norm();
  if (!q.allFinite()) return KinStatus::kUnreachable;
  if (q.minCoeff() < kLegMin) return KinStatus::kSingular;
  if (std::isfinite(config_.joint_angle_max) && joint_angle(X_RP) > config_.joint_angle_max)
    return KinStatus::kLimit;
  if (config_.leg_distance_min > 0 && leg_distance(X_RP) < config_.leg_distance_min) return KinStatus::kLimit;
  const double conditioning_min = config_.platform.conditioning_min;
  if (conditioning_min > 0 && conditioning(X_RP) < conditioning_min) return KinStatus::kSingular;
  return KinStatus::kOk;
}

NewtonReport Hexapod::platform_from(const JointVec& q, Pose& X_RP) const TRN_RT {
  TRN_CHECK(q.size() == 6 && q.allFinite());
  return solve_newton<6>(LegEquations{*this, config_, q}, X_RP);
}

KinStatus Hexapod::platform(const JointVec& q, Pose& X_RP) const TRN_RT {
  if (q.minCoeff() < kLegMin) return KinStatus::kUnreachable;
  // The same start each time: the answer depends on the lengths alone, and the tick and the planner get the
  // same bits whatever they asked before.
  X_RP = config_.platform.home_X_RP;
  return platform_from(q, X_RP).status;
}

Hexapod::Square Hexapod::leg_jacobian(const Pose& X_RP) const TRN_RT {
  Square J;
  for (int i = 0; i < 6; ++i) {
    const Vec3 arm = X_RP.R * config_.platform_P[i];
    // A leg grows by the part of its end's velocity that points along the leg: n . (v + w x arm) = n . v +
    // (arm x n) . w.
    const Vec3 n = (X_RP.p + arm - config_.base_R[i]).normalized();
    J.row(i) << n.transpose(), arm.cross(n).transpose();
  }
  return J;
}

double Hexapod::conditioning(const Pose& X_RP) const TRN_RT {
  Square J = leg_jacobian(X_RP);
  J.rightCols<3>() /= radius_;
  return conditioning_of<6>(J);
}

double Hexapod::joint_angle(const Pose& X_RP) const TRN_RT {
  double least_cosine = 1.0;
  for (int i = 0; i < 6; ++i) {
    const Vec3 n = leg(X_RP, i).normalized();
    // The joint in the base swings against the base, the joint in the platform against the platform. So the
    // leg is compared with its home direction in both frames, and the worse of the two counts.
    least_cosine = std::min({least_cosine, n.dot(home_direction_[i]), n.dot(X_RP.R * home_direction_[i])});
  }
  return std::acos(std::max(least_cosine, -1.0));
}

double Hexapod::balancing_turn(const Pose& X_RP) const TRN_RT {
  const PlatformConfig& platform = config_.platform;
  std::array<TurnedLeg, 6> legs;
  TurnedLeg mean;
  for (int i = 0; i < 6; ++i) {
    const Vec3 A = config_.base_R[i], B = config_.platform_P[i], S = platform.spindle_mm;
    legs[i] = platform.carries_work ? turned_leg(S - A, X_RP * B - S, -1)
                                    : turned_leg(X_RP.R.transpose() * (X_RP.p - A) + S, B - S, 1);
    mean.cosine += legs[i].cosine / 6;
    mean.sine += legs[i].sine / 6;
    mean.constant += legs[i].constant / 6;
  }
  for (TurnedLeg& leg : legs) {
    leg.cosine -= mean.cosine;
    leg.sine -= mean.sine;
    leg.constant -= mean.constant;
  }
  const double limit = config_.free_turn_max;
  TRN_CHECK(limit >= 0);
  // A hard stop at the limit would leave a kink in the legs' speeds there, and the planner needs three
  // continuous derivatives. The hyperbolic tangent leaves small turns as they are and never reaches the
  // limit.
  return limit > 0 ? limit * std::tanh(least_variance(legs) / limit) : 0.0;
}

Pose Hexapod::turned(const Pose& X_RP) const TRN_RT {
  const Vec3& S = config_.platform.spindle_mm;
  const double turn = balancing_turn(X_RP);
  if (!std::isfinite(turn)) return X_RP;
  // The spindle's axis goes through S. A table turns about that axis as it stands in the base (from the
  // left), a spindle that is carried turns about its own (from the right). Tip and tool axis in the work
  // stay.
  if (config_.platform.carries_work)
    return translation(S) * Pose{rot_z(-turn), Vec3::Zero()} * translation(-S) * X_RP;
  return X_RP * translation(S) * Pose{rot_z(turn), Vec3::Zero()} * translation(-S);
}

double Hexapod::leg_distance(const Pose& X_RP) const TRN_RT {
  std::array<Vec3, 6> legs;
  for (int i = 0; i < 6; ++i) legs[i] = leg(X_RP, i);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 6; ++i)
    for (int j = i + 1; j < 6; ++j)
      least = std::min(least, segment_distance(config_.base_R[i], legs[i], config_.base_R[j], legs[j]));
  return least;
}

std::unique_ptr<Kinematics> make_hexapod(const Machine& machine, const ConfigTable& section) {
  HexapodConfig config;
  config.platform = read_platform(section);
  const auto legs = section.tables("leg");
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const std::size_t place = std::min<std::size_t>(i, 5);  // a seventh is no misspelt key: counted below
    config.base_R[place] = legs[i].vec3("base_mm");
    config.platform_P[place] = legs[i].vec3("platform_mm");
  }
  if (section.has("joint_angle_deg_max"))
    config.joint_angle_max = kRadPerDeg * section.number("joint_angle_deg_max", Range{1e-3, 180.0});
  config.leg_distance_min = section.number("leg_distance_mm_min", 0.0, kNotNegative);
  config.free_turn_max = kRadPerDeg * section.number("free_turn_deg_max", 0.0, Range{0.0, 45.0});
  section.finish();  // a misspelt key explains a missing leg better than what follows
  if (legs.size() != 6) throw section.error("leg", fmt::format("a hexapod has 6 legs, not {}", legs.size()));
  if (machine.joints.size() != 6) throw section.error("type", "a hexapod has six linear joints, one a leg");
  for (const Joint& joint : machine.joints)
    if (joint.kind != JointKind::kLinear)
      throw section.error("type", fmt::format("joint '{}' of a hexapod must be linear", joint.name));
  auto made = std::make_unique<Hexapod>(config);
  if (made->conditioning(config.platform.home_X_RP) < 1e-6)
    throw section.error("home_mm", "the platform is singular at home; choose another home or geometry");
  return made;
}

}  // namespace trn
