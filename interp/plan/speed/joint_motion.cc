#include "interp/plan/speed/joint_motion.h"

#include <algorithm>
#include <cmath>

#include "interp/plan/speed/path_sampler.h"

namespace trn::speed {

namespace {

constexpr double kSameS = 1e-9;         // of the segment's length: one place
constexpr double kTimeAccuracy = 1e-6;  // of the segment's duration
constexpr float kJerkVerified =
    0.999F;  // use of the jerk limit that verification allows, between samples too

/// What the joints do at one moment, mm or rad.
struct JointState {
  PerJoint v, a, j;
};

// The chain rule: (P4) to (P6) with ds/dt, d2s/dt2 and d3s/dt3.
JointState joint_state(const PathSample& p, const PathState& at, double jerk, int count) {
  JointState m{};
  const double vv = at.v * at.v, va3 = 3 * at.v * at.a, vvv = vv * at.v;
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    m.v[i] = p.d1[i] * at.v;
    m.a[i] = p.d1[i] * at.a + p.d2[i] * vv;
    m.j[i] = p.d1[i] * jerk + p.d2[i] * va3 + p.d3[i] * vvv;
  }
  return m;
}

/// The joints' motion over a part of a segment, gathered sample by sample in the order of time. The range of
/// the jerk is that of the samples, widened by what a parabola through three of them may have between.
class Part {
 public:
  Part(const LawSegment& segment, const JointRates& rates) : segment_(segment), rates_(rates) {}

  void begin(const PathSample& p, double t) {
    const PerJoint j = evaluate(p, t);
    for (size_t i = 0; i < count(); ++i) {
      motion_.v[i] = static_cast<float>(v_[i] * rates_.jerk_inverse[i]);
      motion_.a[i] = motion_.a_end[i];
      motion_.j_min[i] = motion_.j_max[i] = static_cast<float>(j[i]);
    }
    before_ = last_ = j;
  }
  void add(const PathSample& p, double t) {
    const PerJoint j = evaluate(p, t);
    for (size_t i = 0; i < count(); ++i) {
      // A parabola through three even samples leaves their range by at most an eighth of their second
      // difference.
      const double bulge = std::abs(j[i] - 2 * last_[i] + before_[i]) / 8;
      const auto low = static_cast<float>(std::min(j[i], last_[i])),
                 high = static_cast<float>(std::max(j[i], last_[i]));
      motion_.j_min[i] =
          std::min({motion_.j_min[i], low, std::max(low - static_cast<float>(bulge), -kJerkVerified)});
      motion_.j_max[i] =
          std::max({motion_.j_max[i], high, std::min(high + static_cast<float>(bulge), kJerkVerified)});
    }
    before_ = last_;
    last_ = j;
  }
  const JointMotion& motion() const { return motion_; }

 private:
  size_t count() const { return static_cast<size_t>(rates_.count); }
  /// The jerks at the sample. Velocity and acceleration are kept as those of the end so far.
  PerJoint evaluate(const PathSample& p, double t) {
    const JointState m = joint_state(p, segment_.at(t), segment_.jerk, rates_.count);
    PerJoint j{};
    for (size_t i = 0; i < count(); ++i) {
      motion_.a_end[i] = static_cast<float>(m.a[i] * rates_.jerk_inverse[i]);
      j[i] = m.j[i] * rates_.jerk_inverse[i];
    }
    v_ = m.v;
    return j;
  }

  const LawSegment& segment_;
  const JointRates& rates_;
  JointMotion motion_;
  PerJoint v_{}, before_{}, last_{};  ///< jerks of the two samples before
};

// The sample at s of the interval, on the parabola through three of its samples if it lies between.
PathSample sample_at(const std::vector<PathSample>& samples, double s, double tolerance, int count) {
  size_t i = 0;
  while (i + 1 < samples.size() && samples[i + 1].s <= s + tolerance) ++i;
  if (i + 1 == samples.size() || samples[i].s >= s - tolerance) return samples[i];
  if (i > 0 && samples[i - 1].s < samples[i].s) --i;
  if (i + 2 >= samples.size() || samples[i + 1].s >= samples[i + 2].s) return samples[i];
  return interpolate(&samples[i], s, count);
}

}  // namespace

JointMotion joint_motion(const LawSegment& segment, const std::deque<GridInterval>& grid,
                         const JointRates& rates, double from_s, double to_s) {
  const double s0 = segment.at(from_s).s, s1 = segment.at(to_s).s, same = kSameS * (s1 - s0);
  size_t first = segment.first, last = segment.last;
  while (first + 1 < last && grid[first + 1].s <= s0 + same) ++first;
  while (last > first + 1 && grid[last - 1].s >= s1 - same) --last;
  Part part(segment, rates);
  part.begin(sample_at(grid[first].samples, s0, same, rates.count), from_s);
  for (size_t k = first; k < last; ++k)
    for (const PathSample& p : grid[k].samples)
      if (p.s > s0 + same && p.s < s1 - same) part.add(p, segment.time_at(p.s, kTimeAccuracy));
  part.add(sample_at(grid[last - 1].samples, s1, same, rates.count), to_s);
  return part.motion();
}

}  // namespace trn::speed
