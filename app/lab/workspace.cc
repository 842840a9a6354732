#include "app/lab/workspace.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "compensation/fit/least_squares.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/units.h"
#include "kinematics/platform_kinematics.h"

namespace trn {

namespace {

constexpr int kAzimuths = 8;
constexpr double kStepMm = 1e-3, kStepRad = 1e-5;  // of the central differences
constexpr double kMmPerRad = 100.0;                // makes a turn comparable to a shift
constexpr double kRounding = 1e-9;
constexpr int kFloodSteps = 24;  // of the longest joint, in the search for the box
constexpr std::size_t kFloodPointsMax = 100000;

using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, 5, 0, kMaxJoints, 5>;

class Surveyor {
 public:
  Surveyor(const Machine& machine, const Kinematics& kinematics, const JointMap& map, double tool_length_mm)
      : joints_(machine.joints), kinematics_(kinematics), map_(map) {
    context_.rtcp = true;
    context_.tool_offset = Vec3(0, 0, tool_length_mm);
  }

  /// Tip at home, with the tool as it stands there.
  Vec3 home() const {
    Pose X_BS;
    if (const auto* platform = dynamic_cast<const PlatformKinematics*>(&kinematics_)) {
      X_BS = platform->spindle_from_platform(platform->home());
    } else {
      JointVec q(static_cast<Eigen::Index>(joints_.size()));
      for (std::size_t i = 0; i < joints_.size(); ++i)
        q[static_cast<Eigen::Index>(i)] = std::clamp(0.0, joints_[i].limit.min, joints_[i].limit.max);
      kinematics_.forward(q, X_BS);
    }
    return X_BS.p - X_BS.R * context_.tool_offset;
  }

  WorkspaceValue at(const Vec3& p, double tilt_rad) const {
    WorkspaceValue worst;
    const int azimuths = tilt_rad == 0 ? 1 : kAzimuths;
    for (int i = 0; i < azimuths; ++i) {
      const double azimuth = 2 * kPi * i / kAzimuths;
      const Vec3 u = R_home_ * Vec3(std::sin(tilt_rad) * std::cos(azimuth),
                                    std::sin(tilt_rad) * std::sin(azimuth), std::cos(tilt_rad));
      const WorkspaceValue value = along(p, u);
      if (value.reach == Reach::kNoTilt) continue;
      if (value.reach != Reach::kOk) return value;
      worst = worst.reach == Reach::kNoTilt ? value : worse(worst, value);
    }
    return worst;
  }

  Reach judge(const Vec3& p, const Vec3& abc, JointVec& q) const {
    Words y;
    y << p, abc;
    const KinStatus status = map_.map(y, context_, q);
    if (status != KinStatus::kOk) return static_cast<Reach>(status);
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const JointLimit& limit = joints_[i].limit;
      const double value = q[static_cast<Eigen::Index>(i)];
      if (value < limit.min - kRounding || value > limit.max + kRounding) return Reach::kJointRange;
    }
    return Reach::kOk;
  }

 private:
  static WorkspaceValue worse(const WorkspaceValue& a, const WorkspaceValue& b) {
    return {Reach::kOk, std::min(a.conditioning, b.conditioning), std::max(a.speed_gain, b.speed_gain),
            std::min(a.feed_mm_s_max, b.feed_mm_s_max), std::min(a.turn_rad_s_max, b.turn_rad_s_max)};
  }

  WorkspaceValue along(const Vec3& p, const Vec3& u) const {
    WorkspaceValue value;
    Vec3 abc;
    if (kinematics_.words_for_axis(u, Vec3::Zero(), abc) != KinStatus::kOk) return value;
    JointVec q;
    value.reach = judge(p, abc, q);
    if (value.reach == Reach::kOk) measure(p, u, abc, value);
    return value;
  }

  /// Joints with the tip and the tool axis a little beside the place; false if the machine has no such
  /// motion.
  bool beside(const Vec3& p, const Vec3& u, const Vec3& abc, JointVec& q) const {
    Vec3 turned;
    if (kinematics_.words_for_axis(u, abc, turned) != KinStatus::kOk) return false;
    Words y;
    y << p, turned;
    return map_.map(y, context_, q) == KinStatus::kOk;
  }

  void measure(const Vec3& p, const Vec3& u, const Vec3& abc, WorkspaceValue& value) const {
    Jacobian J = Jacobian::Zero(static_cast<Eigen::Index>(joints_.size()), 5);
    const Vec3 e = u.unitOrthogonal(), f = u.cross(e);
    int turns = 0;
    for (int i = 0; i < 5; ++i) {
      const bool turn = i >= 3;
      const double h = turn ? kStepRad : kStepMm;
      const Vec3 dp = turn ? Vec3(Vec3::Zero()) : Vec3(h * Vec3::Unit(i));
      const Vec3 du = turn ? Vec3(h * (i == 3 ? e : f)) : Vec3(Vec3::Zero());
      JointVec up, down;
      if (!beside(p + dp, (u + du).normalized(), abc, up)) continue;
      if (!beside(p - dp, (u - du).normalized(), abc, down)) continue;
      J.col(turn ? 3 + turns++ : i) = (up - down) / (2 * h);
    }
    rate(J, turns, value);
  }

  void rate(const Jacobian& J, int turns, WorkspaceValue& value) const {
    Eigen::MatrixXd scaled = J.leftCols(3 + turns);
    value.feed_mm_s_max = std::numeric_limits<double>::infinity();
    value.turn_rad_s_max = turns > 0 ? std::numeric_limits<double>::infinity() : 0.0;
    for (Eigen::Index i = 0; i < J.rows(); ++i) {
      const Joint& joint = joints_[static_cast<std::size_t>(i)];
      const double shift = J.row(i).head<3>().norm(), turn = J.row(i).tail<2>().norm();
      value.feed_mm_s_max = std::min(value.feed_mm_s_max, joint.limit.velocity / shift);
      value.turn_rad_s_max = std::min(value.turn_rad_s_max, joint.limit.velocity / turn);
      if (joint.kind == JointKind::kLinear) value.speed_gain = std::max(value.speed_gain, shift);
      if (joint.kind == JointKind::kRotary) scaled.row(i) *= kMmPerRad;
    }
    scaled.rightCols(turns) /= kMmPerRad;
    value.conditioning = 1 / LeastSquares(scaled).condition();
  }

  const Joints& joints_;
  const Kinematics& kinematics_;
  const JointMap& map_;
  const Mat3 R_home_ = kinematics_.orientation(Vec3::Zero());  // tilts count from how the tool stands there
  MapContext context_;
};

double coarse_step(const Joints& joints) {
  double longest = 0;
  for (const Joint& joint : joints)
    if (joint.kind == JointKind::kLinear) longest = std::max(longest, joint.limit.max - joint.limit.min);
  return longest / kFloodSteps;
}

/// The box around what is reached upright, found by walking from home in coarse steps.
Eigen::AlignedBox3d find_box(const Surveyor& surveyor, const Vec3& home, double step) {
  std::set<std::array<int, 3>> seen{{0, 0, 0}};
  std::vector<std::array<int, 3>> open{{0, 0, 0}};
  Eigen::AlignedBox3d box(home);
  JointVec q;
  while (!open.empty() && seen.size() < kFloodPointsMax) {
    const std::array<int, 3> at = open.back();
    open.pop_back();
    for (int i = 0; i < 6; ++i) {
      std::array<int, 3> next = at;
      next[static_cast<std::size_t>(i / 2)] += i % 2 ? 1 : -1;
      const Vec3 p = home + step * Vec3(next[0], next[1], next[2]);
      if (!seen.insert(next).second || surveyor.judge(p, Vec3::Zero(), q) != Reach::kOk) continue;
      box.extend(p);
      open.push_back(next);
    }
  }
  return box;
}

/// Grid over the box and a coarse step around it, with home on a grid point.
void lay_grid(const Eigen::AlignedBox3d& box, double margin, int points, Workspace& out) {
  const Vec3 size = box.sizes() + 2 * Vec3::Constant(margin);
  out.step_mm = size.maxCoeff() / (points - 1);
  for (int i = 0; i < 3; ++i) {
    const double below = out.home_B[i] - box.min()[i] + margin, above = box.max()[i] + margin - out.home_B[i];
    const double first = std::ceil(below / out.step_mm);
    out.min_B[i] = out.home_B[i] - first * out.step_mm;
    out.count[static_cast<std::size_t>(i)] = static_cast<int>(first + std::ceil(above / out.step_mm)) + 1;
  }
}

}  // namespace

std::string_view to_string(Reach reach) {
  static constexpr std::string_view kNames[] = {"ok",    "unreachable", "singular",
                                                "limit", "joint_range", "no_tilt"};
  return kNames[static_cast<std::size_t>(reach)];
}

std::size_t Workspace::index(std::size_t tilt, int x, int y, int z) const {
  const auto place = static_cast<std::size_t>((z * count[1] + y) * count[0] + x);
  return tilt * static_cast<std::size_t>(count[0] * count[1] * count[2]) + place;
}

Workspace survey_workspace(const Machine& machine, const Kinematics& kinematics, const JointMap& map,
                           const WorkspaceOptions& options, const std::function<void(double)>& progress) {
  const Surveyor surveyor(machine, kinematics, map, options.tool_length_mm);
  Workspace out;
  out.tilts_deg = options.tilts_deg;
  out.home_B = surveyor.home();
  JointVec q;
  if (const Reach reach = surveyor.judge(out.home_B, Vec3::Zero(), q); reach != Reach::kOk)
    throw std::runtime_error(fmt::format("the machine cannot stand upright at home ({})", to_string(reach)));
  const double coarse = coarse_step(machine.joints);
  if (coarse <= 0)
    throw machine.root.error(
        "joint",
        "every joint is rotary, so the tip cannot be sent to a place: there is no box to "
        "measure. `trunnion kin forward` tells where the tip stands at given angles; a machine "
        "with a linear joint can be surveyed");
  lay_grid(find_box(surveyor, out.home_B, coarse), coarse, options.points, out);
  const std::size_t layers = out.tilts_deg.size() * static_cast<std::size_t>(out.count[2]);
  for (const double tilt_deg : out.tilts_deg)
    for (int z = 0; z < out.count[2]; ++z) {
      for (int y = 0; y < out.count[1]; ++y)
        for (int x = 0; x < out.count[0]; ++x)
          out.values.push_back(surveyor.at(out.point(x, y, z), rad_from_deg(tilt_deg)));
      const auto done =
          static_cast<double>(out.values.size() / static_cast<std::size_t>(out.count[0] * out.count[1]));
      if (progress) progress(done / static_cast<double>(layers));
    }
  return out;
}

std::string workspace_csv(const Workspace& w) {
  std::string out = "x_mm,y_mm,z_mm,tilt_deg,reach,conditioning,speed_gain,feed_mm_s_max,turn_deg_s_max\n";
  for (std::size_t tilt = 0; tilt < w.tilts_deg.size(); ++tilt)
    for (int z = 0; z < w.count[2]; ++z)
      for (int y = 0; y < w.count[1]; ++y)
        for (int x = 0; x < w.count[0]; ++x) {
          const WorkspaceValue& v = w.values[w.index(tilt, x, y, z)];
          const Vec3 p = w.point(x, y, z);
          out += fmt::format("{:.3f},{:.3f},{:.3f},{:g},{}", p.x(), p.y(), p.z(), w.tilts_deg[tilt],
                             to_string(v.reach));
          out += v.reach == Reach::kOk
                     ? fmt::format(",{:.6g},{:.6g},{:.6g},{:.6g}\n", v.conditioning, v.speed_gain,
                                   v.feed_mm_s_max, deg_from_rad(v.turn_rad_s_max))
                     : ",,,,\n";
        }
  return out;
}

}  // namespace trn
