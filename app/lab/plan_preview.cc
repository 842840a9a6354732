#include "app/lab/plan_preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <span>
#include <utility>

#include "app/check/deviation_meter.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/gcode/interpreter.h"
#include "interp/move.h"
#include "interp/plan/stages.h"
#include "kernel/joint_map.h"
#include "kernel/motion_queue.h"

namespace trn {

namespace {

constexpr float kLimits = 0.95F;             // from here on a joint counts as at its limit, as for a run
constexpr double kTurnMax = 0.06;            // rad of an arc, or of the rotary words, between two points
constexpr double kTimeMax_s = 0.05;          // between two points
constexpr double kDifference_s = 1e-3;       // of a joint's places, for its jerk
constexpr int kPartsMax = 256;               // points of a time segment
constexpr std::size_t kHeldMax = 6'000'000;  // points before any is left out
constexpr std::size_t kPiece = 1024;
constexpr double kColourShare = 0.02;  // the fastest speed counts as so much of the picture's size
constexpr double kFineShare = 1e-5, kFineMax_mm = 0.002;
constexpr std::uint64_t kLinesMax = 10 * Interpreter::kLoopedLinesMax;  // without any motion

/// The plan as it comes, turned into points.
class PreviewRun {
 public:
  PreviewRun(const Assembly& assembly, const ProgramStart& start, const PreviewOptions& options)
      : assembly_(assembly), options_(options), meter_(*assembly.kinematics, true), q_(start.q) {
    out_.q_min = out_.q_max = start.q;
    out_.limited_s.resize(assembly.machine.joints.size());
  }

  PlanPreview run(Parameters& parameters, ToolTable& tools, const ProgramStart& start) {
    PipelineObservers observers;
    observers.piece = [this](const PlanPiece& piece) {
      asked_.push_back({piece.source.step, piece.feed.tip_mm_s});
    };
    observers.move = [this](const ProgramMove& move) { meter_.programmed(move); };
    try {
      Pipeline pipeline(assembly_, parameters, tools, start, observers);
      drive(pipeline);
    } catch (const ProgramError& error) {
      end(error.what());
    }
    return std::move(out_);
  }

 private:
  struct Asked {
    std::uint32_t step;
    double feed_mm_s;
  };

  void drive(Pipeline& pipeline) {
    while (!full_) {
      MotionBlock block;
      if (next(pipeline, block))
        take(block);
      else if (pipeline.waiting())
        answer(pipeline);
      else
        return;
    }
  }

  void answer(Pipeline& pipeline) {
    const ProgramAnswer answer = guess();
    if (answer.probe) meter_.restart();
    pipeline.answer(answer);
  }

  // Behind an error come the blocks up to it.
  bool next(Pipeline& pipeline, MotionBlock& block) {
    try {
      return pipeline.next(block, nullptr, kLinesMax);
    } catch (const ProgramError& error) {
      end(error.what());
      return pipeline.next(block, nullptr, kLinesMax);
    }
  }

  void end(const std::string& why) {
    if (!out_.message.empty()) return;
    out_.message = why;
    out_.message_line = line_;
  }

  // The machine that all goes well for.
  ProgramAnswer guess() const {
    if (last_event_ == QueueEvent::Kind::kProbeEnd) return {0, true, q_, y_};
    return {last_event_ == QueueEvent::Kind::kToolChange ? 1.0 : 0.0, false, {}, {}};
  }

  void take(const MotionBlock& block) {
    ++out_.blocks;
    if (block.source.line) line_ = block.source.line;
    if (block.segment_count == 0) {
      last_event_ = block.event.kind;
      if (block.event.kind == QueueEvent::Kind::kDwell) out_.time_s += block.event.value;
      return;
    }
    while (asked_.size() > 1 && asked_[1].step <= block.source.step) asked_.pop_front();
    const double feed = asked_.empty() ? 0 : asked_.front().feed_mm_s;
    feed_mm_s_ = block.rapid || !std::isfinite(feed) ? 0 : feed;
    for (std::size_t i = 0; i < block.segment_count; ++i) segment(block, i);
    full_ = out_.time_s > options_.time_max_s || out_.points.size() > kHeldMax;
    if (full_) end(fmt::format("the picture ends here, after {:.1f} h of motion", out_.time_s / 3600));
  }

  void segment(const MotionBlock& block, std::size_t index) {
    const TimeSegment& law = block.segments[index];
    const double lasts_s = law.duration_s;
    if (lasts_s <= 0) return;
    const int parts = parts_of(block, law);
    const bool jump = !out_.points.empty() && !(block.context == context_);
    context_ = block.context;
    if (out_.points.empty() || jump) begin_way(block, law);
    double from = 0;
    for (int i = 1; i <= parts; ++i) {
      const double t = lasts_s * i / parts;
      PlanPoint shares;
      judge(block, index, from, t, shares);
      point(block, law.s_at(t), law.v_at(t), shares, t - from);
      from = t;
    }
  }

  void begin_way(const MotionBlock& block, const TimeSegment& law) {
    PlanPoint out;
    out.jump = true;
    point(block, law.s, law.v, out, 0);
  }

  // Points so close that the way between them is straight and the speed changes evenly.
  static int parts_of(const MotionBlock& block, const TimeSegment& law) {
    const double s0 = law.s, s1 = law.s_at(law.duration_s);
    double turn = std::abs(block.piece.omega * (s1 - s0));
    turn = std::max(turn, (block.piece.at(s1) - block.piece.at(s0)).tail<3>().cwiseAbs().maxCoeff());
    if (block.piece.kind == PathPiece::Kind::kPolynomial)
      turn = std::max(turn, bend(block.piece.derivatives(s0), block.piece.derivatives(s1)));
    const double parts = std::max(turn / kTurnMax, law.duration_s / kTimeMax_s);
    return std::clamp(static_cast<int>(std::ceil(parts)), 1, kPartsMax);
  }

  static double bend(const PathPoint& from, const PathPoint& to) {
    const Vec3 a = from.d1.head<3>(), b = to.d1.head<3>();
    const double lengths = a.norm() * b.norm();
    return lengths > 0 ? std::acos(std::clamp(a.dot(b) / lengths, -1.0, 1.0)) : 0;
  }

  // Uses of the joints' limits from time t0 to t1 of a segment.
  void judge(const MotionBlock& block, std::size_t index, double t0, double t1, PlanPoint& out) const {
    const JointMotion& motion = block.joints[index];
    const JointVec jerks = jerks_at(block, block.segments[index], (t0 + t1) / 2);
    float worst = 0;
    for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
      const JointLimit& limit = assembly_.plan_joints[i].limit;
      const double a0 = motion.a[i], rise = (motion.a_end[i] - a0) / block.segments[index].duration_s;
      const auto v = [&](double t) { return std::abs(motion.v[i] + t * (a0 + t * rise / 2)); };
      const auto a = [&](double t) { return std::abs(a0 + rise * t); };
      const auto velocity = static_cast<float>(std::max(v(t0), v(t1)) * limit.jerk / limit.velocity);
      const auto acceleration = static_cast<float>(std::max(a(t0), a(t1)) * limit.jerk / limit.acceleration);
      const auto jerk = static_cast<float>(std::abs(jerks[static_cast<Eigen::Index>(i)]) / limit.jerk);
      const float most = std::max({velocity, acceleration, jerk});
      if (most <= worst) continue;
      worst = most;
      out.velocity = velocity;
      out.acceleration = acceleration;
      out.jerk = jerk;
      out.joint = most >= kLimits ? static_cast<int>(i) : -1;
    }
  }

  // Third differences; the bounds that come with a block hold for the whole segment, and are too wide here.
  JointVec jerks_at(const MotionBlock& block, const TimeSegment& law, double t) const {
    std::array<JointVec, 4> q;
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double s = law.s_at(t + (static_cast<double>(i) - 1.5) * kDifference_s);
      if (assembly_.map->map(block.piece.at(s), block.context, q[i]) != KinStatus::kOk) return 0 * q_;
    }
    return (q[3] - 3 * (q[2] - q[1]) - q[0]) / (kDifference_s * kDifference_s * kDifference_s);
  }

  void point(const MotionBlock& block, double s, double v, PlanPoint out, double dt) {
    const PathPoint path = block.piece.derivatives(s);
    y_ = path.y;
    if (assembly_.map->map(path.y, block.context, q_) == KinStatus::kOk) {
      out_.q_min = out_.q_min.cwiseMin(q_);
      out_.q_max = out_.q_max.cwiseMax(q_);
    }
    ToolPose tool;
    out.p_B = path.y.head<3>();
    const bool own_axes = !block.context.rtcp;
    if (own_axes && tool_pose(*assembly_.kinematics, q_, block.context, tool) == KinStatus::kOk)
      out.p_B = tool.p_B;
    meter_.enter(block.context);
    meter_.sample(path.y.head<3>(), assembly_.kinematics->orientation(path.y.tail<3>()).col(2),
                  block.source.line);
    out.deviation_mm = static_cast<float>(meter_.tip_mm());
    const double way = out.jump ? 0 : (out.p_B - out_.points.back().p_B).norm();
    const bool turns = path.d1.tail<3>().norm() > 0;
    out.speed_mm_s = own_axes && turns && dt > 0 ? way / dt : path.d1.head<3>().norm() * v;
    out.time_s = out_.time_s += dt;
    out.feed_mm_s = feed_mm_s_;
    out.line = block.source.line;
    out.rapid = block.rapid;
    (out.rapid ? out_.rapid_mm : out_.cut_mm) += way;
    (out.joint < 0 ? out_.free_s : out_.limited_s[static_cast<std::size_t>(out.joint)]) += dt;
    out_.points.push_back(out);
  }

  const Assembly& assembly_;
  const PreviewOptions& options_;
  PlanPreview out_;
  DeviationMeter meter_;
  JointVec q_;
  Words y_ = Words::Zero();
  std::deque<Asked> asked_;
  MapContext context_;
  double feed_mm_s_ = 0;
  bool full_ = false;
  std::uint32_t line_ = 0;
  QueueEvent::Kind last_event_ = QueueEvent::Kind::kNone;
};

std::array<Vec3, 2> box_of(const std::vector<PlanPoint>& points, bool cuts_only) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::array<Vec3, 2> box{Vec3::Constant(kFar), Vec3::Constant(-kFar)};
  for (std::size_t i = 0; i < points.size(); ++i) {
    // A cut begins where the rapid before it has ended.
    const bool of_cut = !points[i].rapid || (i + 1 < points.size() && !points[i + 1].rapid);
    if (cuts_only && !of_cut) continue;
    box[0] = box[0].cwiseMin(points[i].p_B);
    box[1] = box[1].cwiseMax(points[i].p_B);
  }
  return box;
}

// How far the point is from the straight way between two others, in place and speed.
double distance(const PlanPoint& point, const PlanPoint& from, const PlanPoint& to, double mm_per_mm_s) {
  const auto four = [&](const PlanPoint& p) {
    return Eigen::Vector4d(p.p_B[0], p.p_B[1], p.p_B[2], mm_per_mm_s * p.speed_mm_s);
  };
  const Eigen::Vector4d way = four(to) - four(from), off = four(point) - four(from);
  const double length = way.squaredNorm();
  const double share = length > 0 ? std::clamp(off.dot(way) / length, 0.0, 1.0) : 0;
  return (off - share * way).norm();
}

// A point stays where the picture begins anew, and where cuts and rapids meet.
bool changes(const PlanPoint& one, const PlanPoint& next) {
  return one.rapid != next.rapid || one.jump || next.jump;
}

// What is left out adds its greatest values to the point that stays behind it.
void keep_points(std::vector<PlanPoint>& points, double fine) {
  std::size_t kept = 0;
  PlanPoint worst;
  float farthest_mm = 0;
  for (const PlanPoint& point : points) {
    farthest_mm = std::max(farthest_mm, point.deviation_mm);
    const float most = std::max({point.velocity, point.acceleration, point.jerk});
    if (most > std::max({worst.velocity, worst.acceleration, worst.jerk})) worst = point;
    if (static_cast<double>(point.significance) < fine) continue;
    PlanPoint out = point;
    out.velocity = std::max(out.velocity, worst.velocity);
    out.acceleration = std::max(out.acceleration, worst.acceleration);
    out.jerk = std::max(out.jerk, worst.jerk);
    out.joint = worst.joint;
    out.deviation_mm = std::exchange(farthest_mm, 0.0F);
    points[kept++] = out;
    worst = {};
  }
  points.resize(kept);
}

void simplify(PlanPreview& preview, std::size_t points_max) {
  const std::array<Vec3, 2> box = box_of(preview.points, false);
  const double size = preview.points.empty() ? 0 : (box[1] - box[0]).norm();
  double fastest = 0;
  for (const PlanPoint& point : preview.points) fastest = std::max(fastest, point.speed_mm_s);
  const double mm_per_mm_s = fastest > 0 ? kColourShare * size / fastest : 0;
  rate_points(preview.points, mm_per_mm_s, kPiece);
  double fine = std::min(kFineMax_mm, kFineShare * size);
  keep_points(preview.points, fine);
  // Its pieces' ends stay, one in a thousand: the loop ends before those alone are left.
  for (int i = 0; preview.points.size() > points_max && i < 64; ++i) keep_points(preview.points, fine *= 2);
}

}  // namespace

void rate_points(std::vector<PlanPoint>& points, double mm_per_mm_s, std::size_t piece) {
  struct Part {
    std::size_t from, to;
    float most;
  };
  std::vector<Part> parts;
  constexpr float kAlways = std::numeric_limits<float>::infinity();
  for (std::size_t from = 0; from + 1 < points.size(); from += piece) {
    const std::size_t to = std::min(from + piece, points.size() - 1);
    points[from].significance = points[to].significance = kAlways;
    parts.push_back({from, to, kAlways});
    while (!parts.empty()) {
      const Part part = parts.back();
      parts.pop_back();
      if (part.to - part.from < 2) continue;
      std::size_t farthest = part.from + 1;
      double most = -1;
      for (std::size_t i = part.from + 1; i < part.to; ++i) {
        const double off = changes(points[i], points[i + 1])
                               ? std::numeric_limits<double>::infinity()
                               : distance(points[i], points[part.from], points[part.to], mm_per_mm_s);
        if (off > most) most = off, farthest = i;
      }
      // A point is never needed before the one that it hangs on.
      points[farthest].significance = std::min(part.most, static_cast<float>(most));
      parts.push_back({part.from, farthest, points[farthest].significance});
      parts.push_back({farthest, part.to, points[farthest].significance});
    }
  }
  if (points.size() == 1) points[0].significance = kAlways;
}

PlanPreview preview_plan(const Assembly& assembly, Parameters& parameters, ToolTable& tools,
                         const ProgramStart& start, const PreviewOptions& options) {
  PlanPreview preview = PreviewRun(assembly, start, options).run(parameters, tools, start);
  preview.box_B = box_of(preview.points, true);
  if (!(preview.box_B[0].array() <= preview.box_B[1].array()).all())
    preview.box_B = box_of(preview.points, false);
  simplify(preview, options.points_max);
  return preview;
}

}  // namespace trn
