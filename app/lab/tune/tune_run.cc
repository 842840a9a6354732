#include "app/lab/tune/tune_run.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <utility>

#include "app/lab/tune/stirred_drives.h"
#include "app/lab/tune/tune_fit.h"
#include "app/session/make_cycle.h"
#include "core/axes.h"
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
constexpr double kStirShare = 0.1;  // of the force of the joint's acceleration

/// A whole machine in this process, of which one joint is jogged.
class EmulatedBench {
 public:
  EmulatedBench(Assembly& assembly, int joint, StirredDrives& stirred)
      : assembly_(assembly),
        stirred_(stirred),
        joint_(joint),
        queue_(kTuneQueue),
        cycle_(make_cycle(assembly, queue_, ProgramStops::kPass)),
        recorder_(assembly.machine.period_s, assembly.drives->feedback_periods(), joint) {}

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
    recorder_.begin(number);
    post({RtCommand::Kind::kJog, stroke.way, stroke.speed, joint_});
    do tick();
    while (cycle_.last_report().motion != MotionState::kRest);
    for (int i = 0; i < kTuneRestPeriods; ++i) tick();
  }
  /// From now on, by so much force. What was seen up to now tells the mass.
  void stir() {
    const Joint& joint = assembly_.machine.joints[static_cast<std::size_t>(joint_)];
    const double inertia = fit_joint(recorder_.data(), joint).inertia.value;
    stirred_.stir(joint_, kStirShare * inertia * joint.limit.acceleration);
  }
  TuneData take() { return recorder_.take_data(); }

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
    recorder_.take(report, stirred_.told());
  }

  Assembly& assembly_;
  StirredDrives& stirred_;
  int joint_;
  MotionQueue queue_;
  Cycle cycle_;
  TuneRecorder recorder_;
  std::uint32_t last_id_ = 0;
};

}  // namespace

TuneRecorder::TuneRecorder(double period_s, int feedback_periods, int joint)
    : joint_(joint), lag_(static_cast<std::size_t>(feedback_periods)) {
  data_.period_s = period_s;
}

void TuneRecorder::take(const CycleReport& report, double stirred) {
  if (last_period_ != 0 && report.period != last_period_ + 1)
    throw std::runtime_error("periods were lost on the way; try again");
  last_period_ = report.period;
  setpoints_.emplace_back(report.q_setpoint[joint_], stirred);
  if (setpoints_.size() <= lag_) return;
  if (stroke_ >= 0) {
    data_.setpoint.push_back(setpoints_.front().first);
    data_.stirred.push_back(setpoints_.front().second);
    data_.measured.push_back(report.q_measured[joint_]);
    data_.force.push_back(report.force.size() > joint_ ? report.force[joint_] : std::nan(""));
    data_.stroke.push_back(stroke_);
  }
  setpoints_.pop_front();
}

TuneData tune_emulated(Assembly& assembly, int joint, const std::function<TunePlan(double)>& plan_of) {
  assembly.feed_forward.reset();
  auto drives = std::make_unique<StirredDrives>(std::move(assembly.drives));
  StirredDrives& stirred = *drives;
  assembly.drives = std::move(drives);
  EmulatedBench bench(assembly, joint, stirred);
  bench.get_ready();
  const TunePlan plan = plan_of(bench.stands());
  for (std::size_t i = 0; i < plan.strokes.size(); ++i) {
    if (i == plan.first_stirred) bench.stir();
    bench.move(plan.strokes[i], static_cast<int>(i));
  }
  TuneData data = bench.take();
  if (plan.first_stirred < plan.strokes.size()) data.first_stirred = static_cast<int>(plan.first_stirred);
  return data;
}

}  // namespace trn
