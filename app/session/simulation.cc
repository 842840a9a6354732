#include "app/session/simulation.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <ctime>

#include "app/check/trace_reader.h"
#include "app/session/make_cycle.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/differencer.h"
#include "core/fault.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/signal_name.h"
#include "core/units.h"
#include "kernel/joint_map.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "kernel/safety_inputs.h"

namespace trn {

namespace {

constexpr double kAtLimit = 0.95;
constexpr double kStartMaxS = 600;  // for drives that come up and home
constexpr double kStuckS = 2;       // with a fault, and no drive that is still on its way to somewhere
constexpr std::uint64_t kLinesMax = 10 * Interpreter::kLoopedLinesMax;  // without any motion
constexpr double kPatienceS = 10;  // with a standing machine and an operator who has nothing left to do
constexpr double kSettleS = 60;    // at most, for offsets of corrections behind the path's end
constexpr double kStill = 0.02;    // of a joint's jerk: an offset that changes by less stands

constexpr double kFarMm = 0.05;  // from where a motion begins to its first sample

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double processor_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Differences of the setpoint stream, for the share of time at each limit.
class LimitClock {
 public:
  LimitClock(const Joints& joints, double period_s)
      : joints_(joints), period_s_(period_s), at_(joints.size()), q_(joints.size()) {}

  void row(const JointVec& q) {
    bool any = false;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const JointLimit& limit = joints_[i].limit;
      const Derivatives d = q_[i].next(q[static_cast<Eigen::Index>(i)], period_s_);
      any |= count(std::abs(d.velocity) / limit.velocity, at_[i].velocity);
      any |= count(std::abs(d.acceleration) / limit.acceleration, at_[i].acceleration);
      any |= count(std::abs(d.jerk) / limit.jerk, at_[i].jerk);
    }
    if (++rows_ < 4) return;  // the machine stands in the first periods, by no limit of its own
    if (!any) free_s += period_s_;
  }
  const std::vector<TimeAtLimit>& at() const { return at_; }
  double free_s = 0;

 private:
  bool count(double ratio, double& time_s) const {
    if (ratio < kAtLimit) return false;
    time_s += period_s_;
    return true;
  }
  const Joints& joints_;
  double period_s_;
  std::vector<TimeAtLimit> at_;
  std::vector<Differencer> q_;
  std::uint64_t rows_ = 0;
};

bool is_on_its_way(const CycleReport& report) {
  return report.drives == DriveState::kStarting || report.drives == DriveState::kHoming ||
         report.drives == DriveState::kQuickStop;
}

// How an input is switched where nobody stands at the machine.
std::string rehearsed_switch(const SignalName& name, const Machine& machine, bool on) {
  if (name.of_drive())
    return fmt::format(
        "in simulation that drive's [[drives.emulation.motor]] turns it {} where inputs_on {} {}",
        on ? "on" : "off", on ? "lists" : "does not list", name.number);
  const bool simulated = machine.root.table("io").text("type", "") == "simulated";
  return fmt::format("in simulation [[{}]] with at_s = 0, input = {}, value = {} turns it {}",
                     simulated ? "io.script" : "io.emulation.script", name.number, on ? 1 : 0,
                     on ? "on" : "off");
}

/// The safety input behind a fault, at its line; nullopt for every other fault.
std::optional<ConfigError> unsafe_input(const Assembly& assembly, const CycleReport& report) {
  for (std::size_t i = 0; i < assembly.safety.size(); ++i) {
    const SafetyInputs::Input& input = assembly.safety[i];
    if (SafetyInputs::fault_of(input.kind) != report.fault) continue;
    const bool on = input.from.of_drive() ? !input.safe_when_on : report.inputs >> input.from.number & 1u;
    if (on == input.safe_when_on) continue;
    const std::string text = fmt::format(
        "{}: {} is {}, safe_when = \"{}\", so the drives stay off; {}", fault_info(report.fault).name,
        to_string(input.from, assembly.machine), on ? "on" : "off", input.safe_when_on ? "on" : "off",
        rehearsed_switch(input.from, assembly.machine, input.safe_when_on));
    return assembly.machine.root.table("safety").tables_if("input")[i].error("from", text);
  }
  return std::nullopt;
}

/// One run: the machine, the program and everybody who watches.
class Simulation {
 public:
  Simulation(Assembly& assembly, Parameters& parameters, ToolTable& tools, const SimulationOptions& options)
      : assembly_(assembly),
        parameters_(parameters),
        tools_(tools),
        options_(options),
        period_s_(assembly.machine.period_s),
        queue_(1 << 14),
        cycle_(make_cycle(assembly, queue_, ProgramStops::kPass)),
        judge_(assembly.machine.joints, period_s_),
        meter_(*assembly.kinematics, options.histograms),
        clock_(assembly.machine.joints, period_s_) {}

  SimulationResult run() {
    prepare_drives();
    check_start(assembly_, cycle_.last_report().q_plan);
    list_corrections();
    const auto wall = std::chrono::steady_clock::now();
    ProgramStart start{options_.program, options_.program_text, cycle_.last_report().q_plan};
    start.from_line = options_.from_line;
    start.switches = ProgramSwitches::of(assembly_);
    start.ends_round = true;
    pipeline_.emplace(assembly_, parameters_, tools_, start,
                      PipelineObservers{options_.on_warning,
                                        [this](const ProgramMove& move) { programmed(move); },
                                        options_.on_piece,
                                        options_.on_stretch,
                                        {},
                                        options_.on_message,
                                        options_.on_log});
    if (options_.log) options_.log->program(start);
    if (options_.single_block) post({RtCommand::Kind::kSingleBlock, 1});
    post({RtCommand::Kind::kStart});
    fill();
    watch(cycle_.last_report());  // the stream begins at rest
    drive();
    settle();
    if (failure_) std::rethrow_exception(failure_);
    finish(seconds_since(wall));
    return result_;
  }

 private:
  void post(RtCommand command) {
    command.id = ++last_id_;
    if (command.kind == RtCommand::Kind::kStop) result_.stopped_at = cycle_.last_report().line;
    if (options_.log) options_.log->posted(command);
    cycle_.post(command);
  }

  void tick() {
    cycle_.tick();
    if (options_.log) options_.log->report(cycle_.last_report());
  }

  double now_s() const { return static_cast<double>(result_.periods) * period_s_; }

  void stop_early() {
    stopped_ = true;
    const std::uint32_t line = cycle_.last_report().line;
    if (options_.on_warning)
      options_.on_warning({fmt::format("line {}: the run stops here, after {:g} s of motion (--stop-after)",
                                       line, options_.stop_after_s),
                           line});
    post({RtCommand::Kind::kStop});
  }

  // What the script asks for in this period. At its end nobody is left to wake a standing machine.
  void operate() {
    const CycleReport& report = cycle_.last_report();
    for (; next_action_ < options_.script.size() && options_.script[next_action_].time_s < now_s();
         ++next_action_) {
      post(options_.script[next_action_].command);
      standing_periods_ = 0;  // what it asks for needs its time
    }
    const bool paused = report.motion == MotionState::kPaused;
    if (paused && options_.single_block) return post({RtCommand::Kind::kResume});
    const bool stands = paused || (cycle_.rate().standing() && report.motion != MotionState::kRest);
    standing_periods_ = stands ? standing_periods_ + 1 : 0;
    if (standing_periods_ * period_s_ < kPatienceS || next_action_ < options_.script.size()) return;
    if (options_.on_warning)
      options_.on_warning({fmt::format("line {}: the machine stands, and the operator's script has nothing "
                                       "more to do; the run ends here",
                                       report.line),
                           report.line});
    post({RtCommand::Kind::kStop});
    standing_periods_ = 0;
  }

  void prepare_drives() {
    assembly_.drives->bring_up();
    const unsigned all = (1u << assembly_.machine.joints.size()) - 1;
    bool asked = false;
    double waited_s = 0, stuck_s = 0;
    const auto periods_max = static_cast<std::uint64_t>(std::ceil(kStartMaxS / period_s_));
    for (std::uint64_t i = 0; i < periods_max && stuck_s < kStuckS; ++i) {
      tick();
      const CycleReport& report = cycle_.last_report();
      const bool standing = report.drives == DriveState::kEnabled && report.motion == MotionState::kRest;
      watch_offset(report);
      // With power on, a correction moves to what it wants here; the record begins at rest.
      const bool ready = standing && (report.homed_mask & all) == all;
      waited_s += ready ? period_s_ : 0;
      if (ready && (!offset_moves_ || waited_s > kSettleS)) return;
      // A fault lasts until somebody resets it, and here is nobody.
      stuck_s = !ready && report.fault != Fault::kOk && !is_on_its_way(report) ? stuck_s + period_s_ : 0;
      if (standing && !ready && !asked) {
        asked = true;
        post({RtCommand::Kind::kHome, 0, 0, -1});
      }
    }
    throw not_ready(asked);
  }

  // What the drives wait for.
  ConfigError not_ready(bool asked_home) const {
    const CycleReport& report = cycle_.last_report();
    const ConfigTable& root = assembly_.machine.root;
    if (const auto input = unsafe_input(assembly_, report)) return *input;
    std::string unhomed;
    for (std::size_t i = 0; i < assembly_.machine.joints.size(); ++i)
      if ((report.homed_mask >> i & 1u) == 0)
        unhomed += (unhomed.empty() ? "" : ", ") + assembly_.machine.joints[i].name;
    if (report.fault != Fault::kOk) {
      const FaultInfo& info = fault_info(report.fault);
      const std::string detail = assembly_.drives->explain_fault(report.fault_joint);
      const std::string joint =
          report.fault_joint < 0
              ? ""
              : fmt::format("joint {}: ",
                            assembly_.machine.joints[static_cast<std::size_t>(report.fault_joint)].name);
      const std::string what = unhomed.empty() || !asked_home
                                   ? "the simulated drives do not come up"
                                   : fmt::format("homing does not end ({})", unhomed);
      return root.error("drives",
                        fmt::format("{}: fault {}: {}{}; {}", what, info.name, joint,
                                    detail.empty() ? std::string(info.meaning) : detail, info.remedy));
    }
    if (report.drives == DriveState::kEnabled || report.drives == DriveState::kHoming)
      return root.error("drives",
                        fmt::format("homing does not end within {:g} s: {}; check homing speeds and "
                                    "switches in [drives]",
                                    kStartMaxS, unhomed));
    return root.error("drives", fmt::format("the simulated drives have no power after {:g} s and tell no "
                                            "fault; check the times in [drives], as start_up_s",
                                            kStartMaxS));
  }

  // Keeps the queue ahead of the tick, as the planner's thread of the daemon does.
  void fill() {
    const double start_s = processor_s();
    while (!planned_ && queue_.buffered_s() < assembly_.planner.buffer_s) {
      if (pipeline_->waiting() && !take_answer()) break;
      if (!has_block_ && !(has_block_ = next_block())) break;
      if (!queue_.push(block_)) break;
      has_block_ = false;
    }
    result_.planning_s += processor_s() - start_s;
  }

  bool next_block() {
    try {
      if (pipeline_->next(block_, nullptr, kLinesMax)) return true;
    } catch (const ProgramError&) {
      failure_ = std::current_exception();
      if (pipeline_->next(block_)) return true;
    }
    planned_ = !pipeline_->waiting();
    return false;
  }

  // Everything before the question has been driven.
  bool take_answer() {
    ProgramAnswer answer;
    if (!queue_.take_answer(answer)) return false;
    if (answer.probe) meter_.restart();
    pipeline_->answer(answer);
    return true;
  }

  void drive() {
    do {
      if (queue_.buffered_s() < assembly_.planner.buffer_s) fill();
      if (!options_.script.empty() || options_.single_block) operate();
      if (now_s() >= options_.stop_after_s && !stopped_) stop_early();
      tick();
      for (const auto& work : assembly_.corrections.background) work();
      watch(cycle_.last_report());
    } while (goes_on());
  }

  // When the path ends, a correction behind the plan may still be on its way. A record that broke off there
  // would show a jerk that no drive ever sees.
  void settle() {
    motion_periods_ = result_.periods;
    settling_ = true;
    const auto still_s = [&] { return static_cast<double>(result_.periods - motion_periods_) * period_s_; };
    while (offset_moves_ && result_.fault == Fault::kOk && !failure_ && still_s() < kSettleS) {
      tick();
      for (const auto& work : assembly_.corrections.background) work();
      watch(cycle_.last_report());
    }
  }

  void watch_offset(const CycleReport& report) {
    if (report.q_setpoint.size() != report.q_plan.size()) return;
    const JointVec offset = report.q_setpoint - report.q_plan;
    offset_moves_ = false;
    for (std::size_t i = 0; offset_.size() == offset.size() && i < assembly_.machine.joints.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const double still = kStill * assembly_.machine.joints[i].limit.jerk * std::pow(period_s_, 3);
      offset_moves_ |= std::abs(offset[k] - offset_[k]) > still;
    }
    offset_ = offset;
  }

  // A fault is followed to the standstill.
  bool goes_on() const {
    const MotionState motion = cycle_.last_report().motion;
    return motion != MotionState::kRest && (result_.fault == Fault::kOk || motion != MotionState::kPaused);
  }

  void programmed(const ProgramMove& move) {
    if (options_.on_move) options_.on_move(move);
    meter_.programmed(move);
    if (assembly_.corrections.setpoint->deflection()) features_.programmed(move);
  }

  void watch(const CycleReport& report) {
    const QueueEvent& event = report.event;
    if (event.kind == QueueEvent::Kind::kToolChange && event.value != kToolByNobody && options_.on_tool)
      options_.on_tool(report.line, event.argument);
    if (options_.trace) options_.trace->write(report);
    if (assembly_.screws) assembly_.screws->step(report.q_plan, report.q_setpoint);
    row_.t_s = static_cast<double>(result_.periods) * period_s_;
    row_.q.assign(report.q_setpoint.data(), report.q_setpoint.data() + report.q_setpoint.size());
    row_.digits.assign(row_.q.size(), WrittenDigits{17, 17});
    row_.line = report.line;
    judge_.row(row_);
    if (!settling_) clock_.row(report.q_setpoint);
    if (!settling_ && report.reads_encoder) result_.geared_s += period_s_;
    watch_offset(report);
    measure(report);
    features_.sample(report);
    ++result_.periods;
    result_.starvations = report.starvations;
    result_.fault = report.fault;
    result_.fault_joint = report.fault_joint;
    result_.failed_check = report.failed_check;
    if (options_.progress && result_.periods % 20000 == 0) options_.progress(report.line, row_.t_s);
  }

  void note(CorrectionSummary& summary, const JointVec& offset) const {
    for (std::size_t i = 0; i < assembly_.machine.joints.size(); ++i) {
      const bool rotary = assembly_.machine.joints[i].kind == JointKind::kRotary;
      double& peak = rotary ? summary.peak_rad : summary.peak_mm;
      peak = std::max(peak, std::abs(offset[static_cast<Eigen::Index>(i)]));
    }
  }

  // What the corrections in the plan leave of the machine's errors.
  DeviationMeter::Left measure_corrections(const CycleReport& report) {
    MachineJointMap::Parts parts;
    if ((assembly_.map->has_pose() || assembly_.map->has_joint()) && report.on_path &&
        assembly_.map->parts(report.y, report.context, parts) == KinStatus::kOk) {
      if (assembly_.map->has_pose()) {
        CorrectionSummary& summary = result_.corrections[0];
        note(summary, parts.pose);
        summary.left_tip_mm = std::max(summary.left_tip_mm, parts.left_tip_mm);
        summary.left_axis_rad = std::max(summary.left_axis_rad, parts.left_axis_rad);
      }
      if (assembly_.map->has_joint())
        note(result_.corrections[assembly_.map->has_pose() ? 1 : 0], parts.joint);
    }
    std::size_t k = (assembly_.map->has_pose() ? 1 : 0) + (assembly_.map->has_joint() ? 1 : 0);
    for (int i = 0; i < assembly_.corrections.setpoint->size(); ++i, ++k) {
      const CorrectionReport& link = report.corrections[static_cast<std::size_t>(i)];
      note(result_.corrections[k], link.offset);
      if (*link.warning) result_.corrections[k].warning = link.warning;
    }
    if (!report.context.rtcp) return {};  // the words themselves are compared
    return {parts.left_tip_mm, parts.left_axis_rad * kDegPerRad};
  }

  void list_corrections() {
    if (assembly_.map->has_pose()) result_.corrections.push_back({"geometric", 0, 0, 0, 0, ""});
    if (assembly_.map->has_joint()) result_.corrections.push_back({"joint_table", 0, 0, 0, 0, ""});
    for (int i = 0; i < assembly_.corrections.setpoint->size(); ++i)
      result_.corrections.push_back({assembly_.corrections.setpoint->budget(i).name, 0, 0, 0, 0, ""});
  }

  // Tip and tool axis as the program speaks of them; false where the machine has no such place.
  bool programmed_place(const JointVec& q, const MapContext& context, Vec3& p, Vec3& u) const {
    if (context.rtcp) {
      ToolPose pose;
      if (tool_pose(*assembly_.map, q, context, pose) != KinStatus::kOk) return false;
      p = pose.p_B;
      u = pose.u_B;
      return true;
    }
    Words words;
    if (assembly_.map->words_at(q, context, words) != KinStatus::kOk) return false;
    p = words.head<3>();
    u = assembly_.kinematics->orientation(words.tail<3>()).col(2);
    return true;
  }

  // Where a motion begins is on no sample of it. A long period goes far before the first one, and the meter
  // searches beside the last place that it knows.
  void show_beginning(const CycleReport& report, const Vec3& first, const DeviationMeter::Left& left) {
    Vec3 p, u;
    const bool begins = !metered_ || !(*metered_ == report.context);
    metered_ = report.context;
    if (!begins || q_before_.size() != report.q_plan.size()) return;
    if (!programmed_place(q_before_, report.context, p, u) || (p - first).norm() < kFarMm) return;
    meter_.sample(p, u, report.line, left);
  }

  void measure(const CycleReport& report) {
    const DeviationMeter::Left left = measure_corrections(report);
    ToolPose pose;
    Vec3 p, u;
    if (report.on_path && tool_pose(*assembly_.map, report.q_plan, report.context, pose) == KinStatus::kOk &&
        programmed_place(report.q_plan, report.context, p, u)) {
      meter_.enter(report.context);
      show_beginning(report, p, left);
      meter_.sample(p, u, report.line, left);
      if (measured_) result_.path_mm += (pose.p_W - p_last_).norm();
      p_last_ = pose.p_W;
      measured_ = true;
    }
    q_before_ = report.q_plan;
  }

  void finish(double wall_s) {
    judge_.finish();
    result_.joints = judge_.verdicts();
    result_.within_limits = judge_.within_limits();
    result_.at_limit = clock_.at();
    result_.free_s = clock_.free_s;
    result_.deviation = meter_.report();
    if (assembly_.screws) result_.screws = assembly_.screws->reports();
    result_.features = features_.features();
    if (options_.log && !result_.features.empty()) options_.log->features(result_.features);
    result_.lines = pipeline_->line();
    result_.speed = pipeline_->speed_stats();
    result_.periods = motion_periods_;
    result_.cycle_time_s = static_cast<double>(result_.periods) * period_s_;
    result_.wall_s = wall_s;
  }

  Assembly& assembly_;
  Parameters& parameters_;
  ToolTable& tools_;
  const SimulationOptions& options_;
  double period_s_;
  MotionQueue queue_;
  Cycle cycle_;
  LimitJudge judge_;
  DeviationMeter meter_;
  FeatureMeter features_;
  LimitClock clock_;
  std::optional<Pipeline> pipeline_;
  MotionBlock block_;
  bool has_block_ = false, planned_ = false, measured_ = false, stopped_ = false;
  bool settling_ = false, offset_moves_ = false;
  JointVec q_before_;                  ///< the plan's, of the last period
  std::optional<MapContext> metered_;  ///< what the meter's last sample belongs to
  JointVec offset_;                    ///< of the last period, of all corrections behind the plan
  std::uint64_t motion_periods_ = 0;
  std::exception_ptr failure_;
  TraceRow row_;
  Vec3 p_last_ = Vec3::Zero();
  std::uint32_t last_id_ = 0;
  std::size_t next_action_ = 0;
  int standing_periods_ = 0;
  SimulationResult result_;
};

}  // namespace

void check_start(const Assembly& assembly, const JointVec& q) {
  Words words;
  const std::uint8_t off = ProgramSwitches::of(assembly).corrections_off;
  const KinStatus status = assembly.map->words_at(q, off, words);
  if (status == KinStatus::kOk) return;
  const ConfigTable& root = assembly.machine.root;
  if (assembly.map->words_at(q, kPlannedBits, words) == KinStatus::kOk)
    throw root.error("corrections",
                     "where the machine starts, [corrections] would move a joint by more than its limit_mm "
                     "or limit_deg; check the numbers");
  std::string places;
  for (std::size_t i = 0; i < assembly.machine.joints.size(); ++i) {
    const Joint& joint = assembly.machine.joints[i];
    const double unit = joint.kind == JointKind::kRotary ? kDegPerRad : 1;
    places += fmt::format(" {} {:.4g}", joint.name, unit * q[static_cast<Eigen::Index>(i)]);
  }
  throw root.error("kinematics", fmt::format("the machine starts at{}, where it cannot stand ({}); check the "
                                             "lengths in [kinematics], or start it elsewhere in [drives]",
                                             places, to_string(status)));
}

SimulationResult simulate(Assembly& assembly, Parameters& parameters, ToolTable& tools,
                          const SimulationOptions& options) {
  return Simulation(assembly, parameters, tools, options).run();
}

}  // namespace trn
