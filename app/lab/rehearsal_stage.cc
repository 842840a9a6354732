#include "app/lab/rehearsal_stage.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "core/motion.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

namespace {

constexpr int kRestPeriods = 20;
constexpr double kRestPatience_s = 20, kHomePatience_s = 300;

}  // namespace

int RehearsalStage::periods(double time_s) const {
  return static_cast<int>(std::ceil(time_s / assembly_.machine.period_s));
}

void RehearsalStage::tick(int count) {
  for (int i = 0; i < count; ++i) one_period();
}

int RehearsalStage::until(const std::function<bool()>& done, int limit) {
  for (int i = 0; i <= limit; ++i) {
    if (done()) return i;
    tick();
  }
  return -1;
}

bool RehearsalStage::homed() const {
  const unsigned all = (1u << assembly_.machine.joints.size()) - 1;
  return (report().homed_mask & all) == all;
}

void RehearsalStage::home() {
  if (!homed()) cycle_->post({RtCommand::Kind::kHome, 0, 0, -1});
  require(until([&] { return ready() && homed() && report().motion == MotionState::kRest; },
                periods(kHomePatience_s)) >= 0);
}

void RehearsalStage::start_program(const std::string& text) {
  Parameters parameters;
  ToolTable tools;
  Pipeline pipeline(assembly_, parameters, tools, {"rehearsal", text, report().q_plan}, PipelineObservers{});
  queue_.begin_generation();
  MotionBlock block;
  while (pipeline.next(block))
    if (!queue_.push(block)) throw std::runtime_error("the rehearsal's motion does not fit into the queue");
  cycle_->post({RtCommand::Kind::kStart});
}

double RehearsalStage::moves_in(int count) {
  const JointVec before = places();
  tick(count);
  return (places() - before).cwiseAbs().maxCoeff();
}

int RehearsalStage::wait_for_rest(double still, const std::function<void()>& each_period) {
  int resting = 0;
  for (int i = 1; i <= periods(kRestPatience_s); ++i) {
    if (each_period) each_period();
    resting = moves_in(1) < still ? resting + 1 : 0;
    if (resting == kRestPeriods) return i - resting;
  }
  return -1;
}

void RehearsalStage::require(bool good) const {
  if (good) return;
  const std::string why = explain();
  const FaultInfo& info = fault_info(report().fault);
  throw std::runtime_error("the emulated machine does not get ready: " +
                           (why.empty() ? fmt::format("fault {}: {}", info.name, info.meaning) : why));
}

}  // namespace trn
