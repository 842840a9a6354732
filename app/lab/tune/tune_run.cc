#include "app/lab/tune/tune_run.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <deque>
#include <stdexcept>

#include "app/lab/tune/tune_fit.h"
#include "app/session/make_cycle.h"
#include "core/fault.h"
#include "core/ports.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"

namespace trn {

namespace {

constexpr int kTuneReadyMax = 600'000;
constexpr int kTuneRestPeriods = 150;  // between two strokes
constexpr std::size_t kTuneQueue = 16;

/// A whole machine in this process, of which one joint is jogged.
class EmulatedBench {
 public:
  EmulatedBench(Assembly& assembly, int joint)
      : assembly_(assembly),
        joint_(joint),
        lag_(static_cast<std::size_t>(assembly.drives->feedback_periods())),
        queue_(kTuneQueue),
        cycle_(make_cycle(assembly, queue_, ProgramStops::kPass)) {
    data_.period_s = assembly.machine.period_s;
  }

  void get_ready() {
    assembly_.drives->bring_up();
    const unsigned all = (1u << assembly_.machine.joints.size()) - 1;
    bool asked = false;
    for (int i = 0; i < kTuneReadyMax; ++i) {
      tick();
      const CycleReport& report = cycle_.last_report();
      const bool stands = report.drives == DriveState::kEnabled && report.motion == MotionState::kRest;
      if (stands && (report.homed_mask & all) == all) return;
      if (stands && !asked) post({RtCommand::Kind::kHome, 0, 0, -1});
      asked |= stands;
    }
    throw std::runtime_error("the emulated drives do not get ready; check the section [drives]");
  }
  double stands() const {
    const CycleReport& report = cycle_.last_report();
    const bool told = report.force.size() > joint_ && std::isfinite(report.force[joint_]);
    if (!told) throw NoTorque(assembly_.machine.joints[static_cast<std::size_t>(joint_)]);
    return report.q_measured[joint_];
  }

  void move(const TuneStroke& stroke, int number) {
    stroke_ = number;
    post({RtCommand::Kind::kJog, stroke.way, stroke.speed, joint_});
    do tick();
    while (cycle_.last_report().motion != MotionState::kRest);
    for (int i = 0; i < kTuneRestPeriods; ++i) tick();
  }
  TuneData take() { return std::move(data_); }

 private:
  void post(RtCommand command) {
    command.id = ++last_id_;
    cycle_.post(command);
  }

  void tick() {
    cycle_.tick();
    const CycleReport& report = cycle_.last_report();
    if (report.fault != Fault::kOk)
      throw std::runtime_error(fmt::format("the machine faulted: {}; {}", fault_info(report.fault).meaning,
                                           assembly_.drives->explain_fault(report.fault_joint)));
    setpoints_.push_back(report.q_setpoint[joint_]);
    if (setpoints_.size() <= lag_) return;
    if (stroke_ >= 0) {
      data_.setpoint.push_back(setpoints_.front());
      data_.measured.push_back(report.q_measured[joint_]);
      data_.force.push_back(report.force.size() > joint_ ? report.force[joint_] : std::nan(""));
      data_.stroke.push_back(stroke_);
    }
    setpoints_.pop_front();
  }

  Assembly& assembly_;
  int joint_;
  std::size_t lag_;
  MotionQueue queue_;
  Cycle cycle_;
  TuneData data_;
  std::deque<double> setpoints_;
  std::uint32_t last_id_ = 0;
  int stroke_ = -1;
};

}  // namespace

TuneData tune_emulated(Assembly& assembly, int joint, const std::function<TunePlan(double)>& plan_of) {
  assembly.feed_forward.reset();
  EmulatedBench bench(assembly, joint);
  bench.get_ready();
  const TunePlan plan = plan_of(bench.stands());
  for (std::size_t i = 0; i < plan.strokes.size(); ++i) bench.move(plan.strokes[i], static_cast<int>(i));
  return bench.take();
}

}  // namespace trn
