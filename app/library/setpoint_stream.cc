#include "app/library/setpoint_stream.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "app/session/program_time.h"
#include "core/check.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/gcode/interpreter.h"
#include "kernel/joint_map.h"

namespace trn {

namespace {
constexpr std::uint64_t kLinesMax = 10 * Interpreter::kLoopedLinesMax;  // without any motion
}

SetpointStream::SetpointStream(const Assembly& assembly, const ProgramStart& start, Parameters parameters,
                               ToolTable tools, double period_s)
    : assembly_(assembly),
      parameters_(std::move(parameters)),
      tools_(std::move(tools)),
      pipeline_(assembly, parameters_, tools_, start, {}),
      period_s_(period_s),
      q_(start.q),
      qd_(JointVec::Zero(start.q.size())),
      qdd_(qd_) {}

bool SetpointStream::next(trunnion::Setpoint& setpoint) {
  if (ended_) return false;
  if (periods_ == 0)
    take_block();
  else
    in_element_s_ += period_s_;
  while (!ended_ && in_element_s_ > element_s()) {
    in_element_s_ -= element_s();
    if (!dwells_ && segment_ + 1 < block_.segment_count)
      ++segment_;
    else
      take_block();
  }
  place();
  write(setpoint);
  ++periods_;
  return true;
}

// Plan time of the segment, or of the dwell, in which the motion is.
double SetpointStream::element_s() const {
  return dwells_ ? dwell_s_ : block_.segments[static_cast<std::size_t>(segment_)].duration_s;
}

// The next block that takes time, or the end.
void SetpointStream::take_block() {
  ended_ = true;  // also if the program turns out to be wrong here
  for (MotionBlock next;;) {
    if (!pipeline_.next(next, nullptr, kLinesMax)) {
      if (!pipeline_.waiting()) return;
      pipeline_.answer(guessed_answer(asked_, *assembly_.map, block_));
      continue;
    }
    asked_ = next.event;
    dwells_ = next.event.kind == QueueEvent::Kind::kDwell;
    if (dwells_) dwell_s_ = next.event.value;
    if (next.segment_count > 0) {
      block_ = next;
      segment_ = 0;
    }
    if (dwells_ || next.segment_count > 0) break;
  }
  ended_ = false;
}

// Joints and words of now. In a dwell and behind the end the motion stands where the last block ends.
void SetpointStream::place() {
  if (block_.segment_count == 0) return;
  const bool stands = ended_ || dwells_;
  const std::size_t k = static_cast<std::size_t>(stands ? block_.segment_count - 1 : segment_);
  const TimeSegment& segment = block_.segments[k];
  const double time_s = stands ? segment.duration_s : std::min(in_element_s_, segment.duration_s);
  words_ = block_.piece.at(segment.s_at(time_s));
  TRN_CHECK(assembly_.map->map(words_, block_.context, q_) == KinStatus::kOk);
  derive(block_.joints[k], time_s, segment.duration_s);
}

// Velocity and acceleration as the planner judged them: a linear acceleration over each segment.
void SetpointStream::derive(const JointMotion& motion, double time_s, double duration_s) {
  for (Eigen::Index i = 0; i < q_.size(); ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const double jerk = assembly_.plan_joints[k].limit.jerk;
    const double a = motion.a[k], rise = motion.a_end[k] - motion.a[k];
    const double share = duration_s > 0 ? time_s / duration_s : 0;
    qdd_[i] = jerk * (a + share * rise);
    qd_[i] = jerk * (motion.v[k] + time_s * (a + share * rise / 2));
  }
}

void SetpointStream::write(trunnion::Setpoint& setpoint) const {
  setpoint.time_s = static_cast<double>(periods_) * period_s_;
  setpoint.position.assign(q_.data(), q_.data() + q_.size());
  setpoint.velocity.assign(qd_.data(), qd_.data() + qd_.size());
  setpoint.acceleration.assign(qdd_.data(), qdd_.data() + qdd_.size());
  std::copy_n(words_.data(), setpoint.words.size(), setpoint.words.begin());
  setpoint.line = block_.source.line;
}

}  // namespace trn
