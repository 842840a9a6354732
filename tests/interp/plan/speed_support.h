#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/plan/speed/speed_options.h"
#include "interp/plan/speed/speed_planner.h"
#include "interp/plan/stages.h"

// What the tests of the speed stage share: machines in closed form, paths, and a judge that looks at the
// mapped setpoints only.
namespace trn::speed_test {

/// Joints are the first words as they stand.
class IdentityMap : public JointMap {
 public:
  explicit IdentityMap(std::vector<int> words) : words_(std::move(words)) {}
  int joint_count() const TRN_RT override { return static_cast<int>(words_.size()); }
  KinStatus map(const Words& y, const MapContext&, JointVec& q) const TRN_RT override {
    q.resize(joint_count());
    for (int i = 0; i < joint_count(); ++i) q[i] = y[words_[static_cast<size_t>(i)]];
    return KinStatus::kOk;
  }

 private:
  std::vector<int> words_;
};

/// Table tilting about X (A), turning about Z (C), surface 75 mm below the crossing; the tip given in the
/// table.
class TrunnionMap : public JointMap {
 public:
  int joint_count() const TRN_RT override { return 5; }
  KinStatus map(const Words& y, const MapContext&, JointVec& q) const TRN_RT override {
    const double ca = std::cos(y[kA]), sa = std::sin(y[kA]), cc = std::cos(y[kC]), sc = std::sin(y[kC]);
    const double x = cc * y[kX] - sc * y[kY], yy = sc * y[kX] + cc * y[kY], z = y[kZ] - 75;
    q.resize(5);
    q << x, ca * yy - sa * z, sa * yy + ca * z + 100, y[kA], y[kC];
    return KinStatus::kOk;
  }
};

inline Joint joint(const char* name, JointKind kind, double range, double v, double a, double j) {
  return {name, kind, {-range, range, v, a, j}};
}

inline Joints linear_joints(int count) {
  Joints joints;
  for (int i = 0; i < count; ++i)
    joints.push_back(joint(i == 0 ? "X" : i == 1 ? "Y" : "Z", JointKind::kLinear, 20000, 500, 5000, 100000));
  return joints;
}

inline Joints cradle_joints() {
  const double d = kRadPerDeg;
  return {joint("X", JointKind::kLinear, 400, 500, 5000, 100000),
          joint("Y", JointKind::kLinear, 400, 500, 5000, 100000),
          joint("Z", JointKind::kLinear, 500, 400, 4000, 80000),
          joint("A", JointKind::kRotary, 120 * d, 120 * d, 800 * d, 16000 * d),
          joint("C", JointKind::kRotary, 36000 * d, 240 * d, 1500 * d, 30000 * d)};
}

struct Collector : BlockSink {
  std::vector<MotionBlock> blocks;
  void block(const MotionBlock& b) override { blocks.push_back(b); }
};

inline PlanPiece plan(const PathPiece& piece, double feed_mm_s, bool ends = false, std::uint32_t line = 1) {
  PlanPiece p;
  p.piece = piece;
  p.context.rtcp = true;
  p.feed.tip_mm_s = feed_mm_s;
  p.feed.rotary_rad_s = 1e9;
  p.ends_stretch = ends;
  p.source.line = line;
  return p;
}

struct Verdict {
  double velocity = 0, acceleration = 0, jerk = 0;  ///< worst ratios to the limits
  double feed = 0;                                  ///< worst ds/dt over what the feed allows
  double join = 0;                                  ///< worst jump of s, v, a between segments (relative)
  double time_s = 0;
  bool ends_well = true;  ///< every stretch ends at its last piece's end, standing still
};

inline void judge_differences(const std::vector<JointVec>& q, double dt, const Joints& joints, Verdict& v) {
  for (size_t i = 3; i < q.size(); ++i)
    for (int j = 0; j < q[i].size(); ++j) {
      const JointLimit& limit = joints[static_cast<size_t>(j)].limit;
      const double d1 = q[i][j] - q[i - 1][j], d2 = d1 - (q[i - 1][j] - q[i - 2][j]),
                   d3 = d2 - (q[i - 1][j] - 2 * q[i - 2][j] + q[i - 3][j]);
      const double noise =
          1e-15 * 4 * std::max(100.0, std::abs(q[i][j]));  // of the differences' own rounding
      v.velocity = std::max(v.velocity, (std::abs(d1) - noise) / dt / limit.velocity);
      v.acceleration = std::max(v.acceleration, (std::abs(d2) - 2 * noise) / dt / dt / limit.acceleration);
      v.jerk = std::max(v.jerk, (std::abs(d3) - 4 * noise) / dt / dt / dt / limit.jerk);
    }
}

/// Mapped setpoints of the whole motion each dt, held at both ends for three samples.
inline std::vector<JointVec> sample_joints(const std::vector<MotionBlock>& blocks, const JointMap& map,
                                           double dt) {
  std::vector<JointVec> out;
  JointVec q;
  double due = 0;
  for (const MotionBlock& b : blocks)
    for (int i = 0; i < b.segment_count; ++i) {
      const TimeSegment& g = b.segments[static_cast<size_t>(i)];
      for (; due < g.duration_s; due += dt) {
        map.map(b.piece.at(g.s_at(due)), b.context, q);
        if (out.empty()) out.assign(3, q);
        out.push_back(q);
      }
      due -= g.duration_s;
    }
  for (size_t i = blocks.size(); i-- > 0;)
    if (blocks[i].segment_count > 0) {
      const TimeSegment& g = blocks[i].segments[static_cast<size_t>(blocks[i].segment_count - 1)];
      map.map(blocks[i].piece.at(g.s_at(g.duration_s)), blocks[i].context, q);
      out.insert(out.end(), 4, q);
      break;
    }
  return out;
}

inline double feed_ratio(const MotionBlock& b, const TimeSegment& g, double t, double feed) {
  return b.piece.derivatives(g.s_at(t)).d1.head<3>().norm() * g.v_at(t) / feed;
}

/// Judges blocks: all limits on differences each `dt` and each millisecond, continuity, ends.
inline Verdict judge(const std::vector<MotionBlock>& blocks, const JointMap& map, const Joints& joints,
                     double dt, double feed = 1e18) {
  Verdict v;
  judge_differences(sample_joints(blocks, map, dt), dt, joints, v);
  judge_differences(sample_joints(blocks, map, 1e-3), 1e-3, joints, v);
  double s = 0, speed = 0, a = 0, length = 0;
  bool fresh = true;
  for (const MotionBlock& b : blocks) {
    for (int i = 0; i < b.segment_count; ++i) {
      const TimeSegment& g = b.segments[static_cast<size_t>(i)];
      if (i == 0 && !fresh && std::abs(s - length) < 1e-6 * length && g.s < 0.5 * b.piece.length) s -= length;
      if (fresh) s = speed = a = 0;
      fresh = false;
      v.join = std::max(
          {v.join, std::abs(g.s - s), std::abs(g.v - speed) / (1 + speed), std::abs(g.a - a) / 5000});
      if (!(g.duration_s > 0) || g.v < -1e-9) v.ends_well = false;
      s = g.s_at(g.duration_s);
      speed = g.v_at(g.duration_s);
      a = g.a_at(g.duration_s);
      v.time_s += g.duration_s;
      for (int k = 0; k <= 4; ++k) v.feed = std::max(v.feed, feed_ratio(b, g, g.duration_s * k / 4, feed));
    }
    length = b.piece.length;
    if (b.ends_at_rest && b.segment_count > 0) {
      fresh = true;
      if (std::abs(s - length) > 1e-9 * (1 + length) || std::abs(speed) > 1e-6 || std::abs(a) > 1e-3)
        v.ends_well = false;
    }
  }
  return v;
}

/// Time of the fastest jerk-limited motion over L from rest to rest (seven segments and their degenerate
/// forms).
inline double s_curve_time(double L, double V, double A, double J) {
  const auto ramp = [&](double v) { return v >= A * A / J ? v / A + A / J : 2 * std::sqrt(v / J); };
  double low = 0, high = V;
  if (ramp(V) * V <= L) return 2 * ramp(V) + (L - ramp(V) * V) / V;
  for (int i = 0; i < 200; ++i) {
    const double mid = (low + high) / 2;
    (ramp(mid) * mid > L ? high : low) = mid;
  }
  return 2 * ramp(low);
}

/// Corners of `vertices` (words) replaced by degree-7 blends that begin `reach` before and end after them;
/// the straight parts stay. All pieces join with continuous value and three derivatives.
inline std::vector<PathPiece> blended(const std::vector<Words>& vertices, double reach) {
  std::vector<PathPiece> out;
  std::vector<PathPiece> lines;
  for (size_t i = 0; i + 1 < vertices.size(); ++i) lines.push_back(make_line(vertices[i], vertices[i + 1]));
  std::vector<double> cutoff(lines.size() + 1, 0);
  for (size_t i = 1; i < lines.size(); ++i)
    cutoff[i] = std::min({reach, 0.45 * lines[i - 1].length, 0.45 * lines[i].length});
  for (size_t i = 0; i < lines.size(); ++i) {
    const double s0 = cutoff[i], s1 = lines[i].length - cutoff[i + 1];
    out.push_back(cut(lines[i], s0, s1));
    if (i + 1 == lines.size()) break;
    const PathPoint a = lines[i].derivatives(s1), b = lines[i + 1].derivatives(cutoff[i + 1]);
    out.push_back(make_hermite(a, b, 2 * cutoff[i + 1]));
  }
  return out;
}

inline std::vector<Words> random_vertices(std::mt19937_64& rng, int count, double step_mm, double turn_rad) {
  std::normal_distribution<double> g;
  std::vector<Words> out{Words::Zero()};
  Vec3 heading(1, 0, 0);
  for (int i = 0; i < count; ++i) {
    heading = (heading + 0.7 * Vec3(g(rng), g(rng), g(rng))).normalized();
    Words w = out.back();
    w.head<3>() += step_mm * (0.3 + std::abs(g(rng))) * heading;
    w[kA] = std::clamp(w[kA] + turn_rad * g(rng), -1.2, 1.2);
    w[kC] += turn_rad * g(rng);
    w.head<3>() = w.head<3>().cwiseMin(150).cwiseMax(-150);
    if (path_norm(w - out.back()) > 0.05 * step_mm) out.push_back(w);
  }
  return out;
}

inline std::vector<PathPiece> circle(double radius, double turns) {
  Words from = Words::Zero();
  from[kX] = radius;
  return {make_arc(from, from, Vec3(0, 0, 0), Vec3(0, 0, 1), turns * 2 * kPi)};
}

struct Planned {
  std::vector<MotionBlock> blocks;
  SpeedStats stats;
};

inline Planned run(const std::vector<PathPiece>& pieces, const Joints& joints, const JointMap& map,
                   double feed, SpeedOptions options = {}) {
  Collector out;
  SpeedPlanner planner(joints, map, options, out);
  for (size_t i = 0; i < pieces.size(); ++i)
    planner.piece(plan(pieces[i], feed, i + 1 == pieces.size(), static_cast<std::uint32_t>(i + 1)));
  planner.finish();
  return {std::move(out.blocks), planner.stats()};
}

inline SpeedOptions full_shares() {
  SpeedOptions options;
  options.acceleration_share = options.jerk_share = 1;
  return options;
}

}  // namespace trn::speed_test
