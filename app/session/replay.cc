#include "app/session/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory_resource>
#include <utility>

#include "app/session/change_journal.h"
#include "app/session/inline_rate_plans.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/touch_probe.h"
#include "interp/gcode/settings.h"
#include "interp/move.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/retrace.h"

namespace trn {

namespace {

constexpr std::size_t kQueueBlocks = 8192;
constexpr std::uint64_t kPeriodsAfterMax = 100'000'000;
constexpr double kStillS = 1;  // far more than a motion from rest waits for an answer

/// Drives that do what the log says they did.
class RecordedDrives final : public Drives, public TouchDrives {
 public:
  RecordedDrives(Eigen::Index joints, int touch_periods)
      : q_(JointVec::Zero(joints)), touch_periods_(touch_periods) {}
  void bring_up() override {}
  void shut_down() noexcept override {}
  void reset_faults() override {}
  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override {
    if (state_ == DriveState::kEnabled && !returns_) q_ = setpoints.q;
    returns_ = false;
    feedback = {};
    feedback.q = q_;
    feedback.state = state_;
    feedback.homed_mask = ~0u;
    feedback.fault = fault_;
    feedback.fault_joint = fault_joint_;
    touch_ = {contact_, true, ~0u, q_};
    fault_ = Fault::kOk;
  }
  void request_home(unsigned) TRN_RT override {
    if (homes_) state_ = DriveState::kHoming;
  }
  void quick_stop() TRN_RT override { state_ = DriveState::kQuickStop; }
  int touch_periods() const TRN_RT override { return touch_periods_; }
  void arm_touch(bool) TRN_RT override {}
  void disarm_touch() TRN_RT override {}
  const TouchProbe& touch() const TRN_RT override { return touch_; }

  void stand(const JointVec& q, DriveState state) {
    q_ = q;
    state_ = state;
  }
  /// They obey from the next setpoint on, and are measured at q now.
  void come_back(const JointVec& q) {
    stand(q, DriveState::kEnabled);
    returns_ = true;
  }
  void leave(DriveState state) { state_ = state; }
  void set_contact(bool contact) { contact_ = contact; }
  void set_homes(bool homes) { homes_ = homes; }
  void report_fault(Fault fault, int joint) {
    fault_ = fault;
    fault_joint_ = joint;
  }

 private:
  JointVec q_;
  DriveState state_ = DriveState::kOff;
  Fault fault_ = Fault::kOk;
  int fault_joint_ = -1;
  int touch_periods_;
  bool contact_ = false, homes_ = true, returns_ = false;
  TouchProbe touch_;
};

/// Inputs that are what the log says they were.
class RecordedIo final : public MachineIo {
 public:
  void exchange(const IoOutputs&, const IoPlace&, IoInputs& inputs) TRN_RT override { inputs = inputs_; }
  void set(const IoInputs& inputs) { inputs_ = inputs; }

 private:
  IoInputs inputs_;
};

int touch_periods_of(const Drives& drives) {
  const auto* touch = dynamic_cast<const TouchDrives*>(&drives);
  return touch ? touch->touch_periods() : 0;
}

// What the tick takes for granted of its drives, sensors and commands, a log has only if it is this
// machine's. What of an entry is not; "": all is.
std::string foreign_part(const SessionEntry& entry, const Assembly& assembly) {
  using Kind = SessionEntry::Kind;
  const int joints = static_cast<int>(assembly.machine.joints.size());
  const auto is_place = [&](const JointVec& q) { return q.size() == joints; };
  const RtCommand& command = entry.command;
  const bool of_joint = command.kind == RtCommand::Kind::kJog || command.kind == RtCommand::Kind::kHome;
  const bool of_chain = command.kind == RtCommand::Kind::kCorrection;
  const int most = of_joint ? joints : of_chain ? assembly.corrections.setpoint->size() : 1;
  const int least = command.kind == RtCommand::Kind::kHome ? -1 : 0;
  const bool place = entry.kind == Kind::kProgram || entry.kind == Kind::kStands;
  if (entry.program.began.size() > 0 && !is_place(entry.program.began))
    return fmt::format("a beginning of {} joints", entry.program.began.size());
  if (entry.kind == Kind::kStands && !is_place(entry.q_measured))
    return fmt::format("a place of {} joints", entry.q_measured.size());
  if (place && !is_place(entry.program.q)) return fmt::format("a place of {} joints", entry.program.q.size());
  if (entry.kind == Kind::kAnswer && entry.answer.probe && !is_place(entry.answer.q_contact))
    return fmt::format("a contact of {} joints", entry.answer.q_contact.size());
  if (entry.kind == Kind::kCommand && (of_joint || of_chain) &&
      (command.joint < least || command.joint >= most))
    return fmt::format("a command for {} {}", of_joint ? "joint" : "correction", command.joint);
  if (entry.kind == Kind::kFault && (entry.joint < -1 || entry.joint >= joints))
    return fmt::format("a fault of joint {}", entry.joint);
  const auto channels = static_cast<int>(assembly.corrections.sensors->names().size());
  if (entry.kind == Kind::kSensor && entry.sensor.channel >= channels)
    return fmt::format("a reading of sensor {}", entry.sensor.channel);
  return "";
}

void refuse_foreign(const Session& session, const Assembly& assembly) {
  for (const SessionEntry& entry : session.entries) {
    const std::string part = foreign_part(entry, assembly);
    if (part.empty()) continue;
    throw ProgramError(
        fmt::format("the log is not of the machine '{}', which has {} joints: in period {} it has {}; replay "
                    "it with the config "
                    "that the session had",
                    assembly.machine.name, assembly.machine.joints.size(), entry.period, part));
  }
}

class Replay {
 public:
  Replay(const Session& session, const Assembly& assembly, Parameters& parameters, ToolTable& tools,
         ReportSink& sink)
      : head_(session.head),
        entries_(session.entries),
        assembly_(assembly),
        parameters_(parameters),
        tools_(tools),
        journal_(parameters, tools),
        sink_(sink),
        drives_(static_cast<Eigen::Index>(assembly.machine.joints.size()),
                touch_periods_of(*assembly.drives)),
        plans_(assembly.plan_joints, assembly.machine.period_s),
        queue_(kQueueBlocks + Retrace::kBlocksKept, std::pmr::get_default_resource(), Retrace::kBlocksKept),
        cycle_(make_replay_cycle(assembly, queue_,
                                 session.head.run ? ProgramStops::kPass : ProgramStops::kWait, drives_,
                                 assembly.io ? &io_ : nullptr, plans_)) {}

  ReplayResult run() {
    const std::uint64_t last = entries_.empty() ? 0 : entries_.back().period, first = first_period();
    const auto is_gap = [](const SessionEntry& entry) { return entry.kind == Kind::kGap; };
    const auto gap = std::find_if(entries_.begin(), entries_.end(), is_gap);
    const bool whole = gap == entries_.end();
    const std::uint64_t most = last + kPeriodsAfterMax, end = whole ? most : std::min(most, gap->since);
    if (!whole) result_.gap = *gap;
    for (std::uint64_t period = 0; period < end && (period <= last || goes_on()); ++period) {
      obey(period);
      fill(period);
      cycle_.tick();
      for (const auto& work : assembly_.corrections.background) work();
      result_.periods = period + 1;
      const CycleReport& report = cycle_.last_report();
      if (report.drives == DriveState::kEnabled && period >= first) sink_.write(report);
      if (report.drives != DriveState::kEnabled) sink_.power_lost();
      see_rest(report);
    }
    result_.starvations = cycle_.last_report().starvations;
    result_.fault = cycle_.last_report().fault;
    return result_;
  }

 private:
  using Kind = SessionEntry::Kind;

  void see_rest(const CycleReport& report) {
    const bool same = report.q_plan.size() == q_before_.size() && report.q_plan == q_before_;
    still_periods_ = same ? still_periods_ + 1 : 0;
    q_before_ = report.q_plan;
  }

  // Behind the log's end, to the end of the motion. A rate planner that was late there never answers: then
  // the machine stands on its path for ever.
  bool goes_on() const {
    const CycleReport& report = cycle_.last_report();
    const bool moves = report.motion == MotionState::kMoving || report.motion == MotionState::kJogging;
    const bool stands = report.rate_plan_late && still_periods_ * assembly_.machine.period_s > kStillS;
    return moves && !stands;
  }

  // The state of the drives acts on the setpoints a period after it is read, so it is announced one earlier.
  void obey(std::uint64_t period) {
    for (std::size_t i = next_; i < entries_.size() && entries_[i].period <= period + 1; ++i)
      if (entries_[i].kind == Kind::kStands && entries_[i].period == period + 1)
        drives_.stand(entries_[i].program.q, DriveState::kStarting);
    for (; next_ < entries_.size() && entries_[next_].period <= period; ++next_) {
      const SessionEntry& entry = entries_[next_];
      if (entry.kind == Kind::kProgram) begin(entry.program);
      if (entry.kind == Kind::kTakenBack) give_up_at(entry.taken_back);
      if (entry.kind == Kind::kDeleteTool) {
        forget_unstarted();
        tools_.remove(entry.tool);
      }
      if (entry.kind == Kind::kCommand) {
        started_ |= entry.command.kind == RtCommand::Kind::kStart;
        drives_.set_homes(shows_homing());
        cycle_.post(entry.command);
      }
      if (entry.kind == Kind::kRatePlans) plans_.set_late(entry.late);
      if (entry.kind == Kind::kStands) drives_.come_back(entry.q_measured);
      if (entry.kind == Kind::kDrives) drives_.leave(entry.drives);
      if (entry.kind == Kind::kInputs) {
        io_.set(entry.inputs);
        drives_.set_contact(entry.inputs.probe);
      }
      if (entry.kind == Kind::kSensor)
        assembly_.corrections.sensors->publish(entry.sensor.channel, entry.sensor.value);
      if (entry.kind == Kind::kFault) drives_.report_fault(entry.fault, entry.joint);
    }
  }

  // Drives that always know their position do not leave for homing: the log then has no return of theirs.
  bool shows_homing() const {
    for (std::size_t i = next_ + 1; i < entries_.size() && entries_[i].kind != Kind::kProgram; ++i)
      if (entries_[i].kind == Kind::kStands || entries_[i].kind == Kind::kFault) return true;
    return false;
  }

  // Nothing more is read of it. One that was given up before its first motion had started, too.
  void give_up_at(std::uint64_t block) {
    started_ = true;
    journal_.take_back_to(block);
    ended_ = true;
  }

  void forget_unstarted() {
    if (std::exchange(started_, true)) return;
    journal_.take_back();
    ended_ = true;
  }

  void begin(ProgramStart start) {
    forget_unstarted();
    start.ends_round = head_.run;
    for (std::size_t i = next_ + 1; i < entries_.size() && entries_[i].kind != Kind::kProgram; ++i)
      if (entries_[i].kind == Kind::kBlockDelete)
        start.block_delete_changes.push_back(entries_[i].change);
      else if (entries_[i].kind == Kind::kHeld)
        start.held_lines.push_back(entries_[i].held);
    if (start.outputs) adopt_outputs(*start.outputs, assembly_, parameters_, tools_, mdi_);
    if (start.text)
      start.kept = mdi_;
    else
      mdi_.reset();
    sound_ = true;
    let_go_of_the_last();
    journal_.begin();
    PipelineObservers observers;
    observers.journal = &journal_;
    pipeline_.emplace(assembly_, parameters_, tools_, start, observers);
    started_ = head_.run || start.text.has_value();
    is_mdi_ = start.text.has_value();
    ended_ = has_block_ = false;
    pushed_ = 0;
    queue_.begin_generation();
  }

  // The daemon's planner begins when the tick has let go of what a stop has dropped. Here more may lie there,
  // for no stop ends the pushing: in front of the new program it would decide at which rate that begins.
  void let_go_of_the_last() {
    for (std::size_t i = 0; i < kQueueBlocks && (queue_.holds_stop() || queue_.buffered_s() > 0); ++i) {
      queue_.look();
      queue_.front();
    }
  }

  // As many blocks as are due by plan time, but never more than a later period with little ahead has seen.
  void fill(std::uint64_t period) {
    std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
    bool exact = false;
    std::size_t i = next_;
    while (i > 0 && entries_[i - 1].period == period) --i;
    for (; i < entries_.size(); ++i) {
      if (entries_[i].kind == Kind::kProgram && i >= next_) break;
      if (entries_[i].kind != Kind::kLow || entries_[i].period < period) continue;
      most = entries_[i].blocks;
      exact = entries_[i].period == period;
      break;
    }
    while (pipeline_ && !ended_ && pushed_ < most &&
           (exact || queue_.buffered_s() < assembly_.planner.buffer_s)) {
      if (pipeline_->waiting() && !take_answer()) break;
      if (!has_block_ && !(has_block_ = next_block())) break;
      if (!queue_.push(block_)) break;
      has_block_ = false;
      ++pushed_;
    }
  }

  // The tick's answer tells when; what it was stands in the log, for the joints' measured places do not.
  bool take_answer() {
    ProgramAnswer answer;
    if (!queue_.take_answer(answer)) return false;
    while (next_answer_ < entries_.size() && entries_[next_answer_].kind != Kind::kAnswer) ++next_answer_;
    if (next_answer_ < entries_.size()) answer = entries_[next_answer_++].answer;
    pipeline_->answer(answer);
    return true;
  }

  bool next_block() {
    try {
      if (pipeline_->next(block_)) return true;
      if (pipeline_->waiting()) return false;
      if (is_mdi_ && sound_) mdi_ = pipeline_->settings();
    } catch (const std::exception&) {  // the end of the program still follows, as it did
      sound_ = false;
      if (pipeline_->next(block_)) return true;
    }
    ended_ = true;
    return false;
  }

  // A run's trace begins with the last period at rest before its start.
  std::uint64_t first_period() const {
    for (const SessionEntry& entry : entries_)
      if (head_.run && entry.kind == Kind::kCommand && entry.command.kind == RtCommand::Kind::kStart)
        return entry.period - 1;
    return 0;
  }

  const SessionHead& head_;
  const std::vector<SessionEntry>& entries_;
  const Assembly& assembly_;
  Parameters& parameters_;
  ToolTable& tools_;
  ChangeJournal journal_;
  ReportSink& sink_;
  RecordedDrives drives_;
  InlineRatePlans plans_;
  MotionQueue queue_;
  RecordedIo io_;
  Cycle cycle_;
  std::optional<Pipeline> pipeline_;
  std::optional<Settings> mdi_;
  MotionBlock block_;
  bool has_block_ = false, ended_ = true, is_mdi_ = false, sound_ = true;
  bool started_ = true;       ///< as PlannerThread
  std::uint32_t pushed_ = 0;  ///< of the program
  JointVec q_before_;         ///< the plan's, of the last period
  int still_periods_ = 0;     ///< that it has been the same
  std::size_t next_ = 0, next_answer_ = 0;
  ReplayResult result_;
};

}  // namespace

ReplayResult replay(const Session& session, const Assembly& assembly, Parameters& parameters,
                    ToolTable& tools, ReportSink& sink) {
  refuse_foreign(session, assembly);
  return Replay(session, assembly, parameters, tools, sink).run();
}

}  // namespace trn
