#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory_resource>
#include <optional>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/retrace.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/paths.h"

// A program in the whole tick, which the test holds, and what it does meanwhile.
namespace trn {

inline constexpr const char* kPath =
    "G21 G90 G64 P0.02\nM3 S3000\nM8\nG1 X30 F3000\nY20\nG2 X50 Y40 I20\nG1 Z-10\nX0 Y0\nM2\n";

class HeldMachine {
 public:
  static constexpr std::size_t kPast = Retrace::kBlocksKept;

  explicit HeldMachine(const std::string& machine = "mill", const std::string& program = kPath)
      : assembly_(assemble(source_dir() + "/configs/" + machine + ".toml")),
        queue_((1 << 14) + kPast, std::pmr::get_default_resource(), kPast),
        cycle_(make_cycle(assembly_, queue_, ProgramStops::kWait)),
        judge_(assembly_.machine.joints, assembly_.machine.period_s) {
    assembly_.drives->bring_up();
    for (int i = 0; i < 20000 && now().drives != DriveState::kEnabled; ++i) cycle_.tick();
    for (int i = 0; i < 4; ++i) judge_(now().q_setpoint);  // it stands
    start(program);
  }
  /// At rest, from where it stands.
  void start(const std::string& program) {
    queue_.begin_generation();
    pipeline_.emplace(assembly_, parameters_, tools_, ProgramStart{"test", program, now().q_plan},
                      PipelineObservers{});
    ended_ = false;
    post({RtCommand::Kind::kStart});
  }
  void tick() {
    while (!ended_ && queue_.buffered_s() < assembly_.planner.buffer_s) {
      if (!pipeline_->next(block_))
        ended_ = true;
      else
        queue_.push(block_);
    }
    const DetourState was = now().detour;
    const JointVec q_was = now().q_plan;
    const long before = allocation_count();
    cycle_.tick();
    allocations_ += allocation_count() - before;
    judge_(now().q_setpoint);
    if (now().on_path && now().detour == DetourState::kNone) path_.push_back(now().q_plan);
    if (was == DetourState::kNone && now().detour != was) q_left_ = q_was;
    if (was != DetourState::kNone && now().detour == DetourState::kNone &&
        now().motion != MotionState::kRest) {
      ++returns_;
      wrong_returns_ += now().q_plan != q_left_;
    }
    CycleReport taken;
    while (cycle_.next_report(taken)) {
    }
  }
  /// False if that has not come after so many periods.
  bool until(const std::function<bool()>& wanted, int periods = 20000) {
    for (int i = 0; i < periods && !wanted(); ++i) tick();
    return wanted();
  }
  void run(int periods) {
    for (int i = 0; i < periods; ++i) tick();
  }
  void post(const RtCommand& command) { cycle_.post(command); }
  void tell(const RtCommand& command) {
    post(command);
    tick();
  }
  bool held_at(std::uint32_t line) {
    return until([&] { return now().line == line && now().speed_mm_s > 1; }) && hold();
  }
  bool hold() {
    post({RtCommand::Kind::kHold});
    return until([this] { return now().stands_in_hold; });
  }
  bool jogged(int joint, double way, double speed = 0) {
    tell({RtCommand::Kind::kJog, way, speed, joint});
    return until([this] { return now().detour == DetourState::kAway && now().stands_in_hold; });
  }
  bool ended() {
    return until([this] { return now().motion == MotionState::kRest; });
  }
  const CycleReport& now() const { return cycle_.last_report(); }
  const std::vector<JointVec>& path() const { return path_; }
  double worst(std::string& where) const { return judge_.worst(&where); }
  long allocations() const { return allocations_; }
  int returns() const { return returns_; }
  int wrong_returns() const { return wrong_returns_; }

 private:
  Assembly assembly_;
  Parameters parameters_;
  ToolTable tools_;
  MotionQueue queue_;
  Cycle cycle_;
  JointJudge judge_;
  std::optional<Pipeline> pipeline_;
  MotionBlock block_;
  bool ended_ = false;
  long allocations_ = 0;
  JointVec q_left_;
  int returns_ = 0, wrong_returns_ = 0;
  std::vector<JointVec> path_;
};

inline double distance(const JointVec& q, const JointVec& a, const JointVec& b) {
  const JointVec way = b - a;
  const double t = way.squaredNorm() > 0 ? std::clamp((q - a).dot(way) / way.squaredNorm(), 0.0, 1.0) : 0;
  return (q - a - t * way).norm();
}

/// How far the places of `path` are from the polyline `truth` at most, both in the order of the motion.
inline double strays(const std::vector<JointVec>& path, const std::vector<JointVec>& truth) {
  double worst = 0;
  for (const JointVec& q : path) {
    double nearest = 1e9;
    for (std::size_t i = 1; i < truth.size(); ++i)
      nearest = std::min(nearest, distance(q, truth[i - 1], truth[i]));
    worst = std::max(worst, nearest);
  }
  return worst;
}

}  // namespace trn
