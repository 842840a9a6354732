#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "app/daemon/program_file.h"
#include "app/daemon/program_source.h"
#include "app/daemon/read_files.h"
#include "app/daemon/time_pass.h"
#include "app/session/assembly.h"
#include "app/session/change_journal.h"
#include "app/session/feature_recorder.h"
#include "app/session/machine_memory.h"
#include "app/session/machine_outputs.h"
#include "app/session/pipeline.h"
#include "app/session/place_record.h"
#include "app/session/program_log.h"
#include "app/session/program_step.h"
#include "app/session/program_time.h"
#include "app/session/session_log.h"
#include "core/axes.h"
#include "core/motion.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "kernel/motion_queue.h"

namespace trn {

/// Who looks on; each may be empty.
struct PlannerListeners {
  std::function<void(const ProgramStart&)> starts;  ///< before its first block
  std::function<void(const ProgramMove&)> move;     ///< before it is driven
  /// What a program says to people (MSG, DEBUG, PRINT), when its line is read; not all of one that says very
  /// much.
  std::function<void(std::string_view text, std::uint32_t line)> message;
  std::function<void()> begins;                  ///< steps of a new program are counted from 1
  std::function<void(const ProgramStep&)> step;  ///< before its first block is in the queue
  /// Offsets and tools, when the next program would begin.
  std::function<void(const Parameters&, const ToolTable&)> tables;
  /// How long the program takes, a little after it `begins`, in a thread of its own; not of MDI lines.
  std::function<void(const ProgramTime&)> time;
  /// What the operator has just set (typed in, or at a program stop); `begins`: what a program that begins
  /// finds.
  std::function<void(const MeasuredValues&, bool begins)> measured;
  std::function<void(std::uint64_t block)> taken_back;  ///< as ProgramSource::gave_up_at
  std::function<void(const ProgramStep&)> stands;  ///< with which modes, offsets and tool the next one begins
};

/// A session's log and a recorder of features as listeners; null: without. Both must outlive them.
PlannerListeners planner_listeners(SessionLog* log, FeatureRecorder* features);

/// Told from elsewhere: the program is given up; the same, and for all those that come later; M1 stops.
struct PlannerFlags {
  std::atomic<bool>&abandoned, &closed, &optional_stop;
};

/// Keeps the tick's queue filled from one program at a time, in a thread of its own. The queue must have been
/// cleared by the tick before each load. Owns the parameters and tools that programs change, keeps them on
/// disk (MachineMemory), and owns the modes that MDI lines hand on: a line goes on where the one before
/// ended; a program begins with the config's modes and ends that; a line that fails or is stopped hands
/// nothing on.
class PlannerThread final : public ProgramSource {
 public:
  PlannerThread(const Assembly& assembly, MotionQueue& queue, Parameters parameters, ToolTable tools,
                PlannerListeners listeners = {}, MemoryFiles files = {});
  /// With flags of somebody else, who must outlive this.
  PlannerThread(const Assembly& assembly, MotionQueue& queue, Parameters parameters, ToolTable tools,
                PlannerListeners listeners, MemoryFiles files, PlannerFlags flags);
  ~PlannerThread() override;

  std::string load(const std::string& path, const JointVec& q) override;
  std::string load_from(const std::string& path, const JointVec& q, std::uint32_t line) override;
  std::string load_place(const PlaceRecord& place, const JointVec& q, double before_mm) override;
  void load_mdi(const std::string& text, const JointVec& q) override;
  void check_place(const PlaceRecord& place, const JointVec& q) override;
  void delete_tool(int number, const std::string& path, const JointVec& q) override;
  void confirm_tool(int number) override;
  std::string tool_name(int number) const override { return memory_.tool_name(number); }
  std::map<int, std::string> tool_names() const { return memory_.tool_names(); }
  void set_switches(const ProgramSwitches& switches) override {
    switches_ = switches;
    optional_stop_ = switches.optional_stop;
  }
  ProgramSwitches switches() const override { return switches_; }
  void set_outputs(const MachineOutputs& outputs) override { outputs_ = outputs; }
  ReadingPlace switch_block_delete(bool on) override;
  HeldLines obey_held(const std::string& text, const JointVec& q) override;
  void abandon() override { abandoned_ = true; }
  void close() override {
    closed_ = true;
    abandoned_ = true;
  }
  void check_files() override;
  void starts() override;
  void gave_up_at(std::uint64_t block) override;
  std::string take_failure() override;

  /// Ends the preparation and keeps all that programs have left behind; when no load is under way. FileError.
  void settle();
  /// Tells the listener how the next program begins; when no load is under way.
  void show() override;

 private:
  ProgramSummary begin(ProgramStart start);
  ProgramSummary checked(const ProgramStart& start);
  ProgramStart start_at(const PlaceRecord& place, const JointVec& q, double before_mm, PlaceEntry& entry);
  OpenFile opener(const std::string& program = "");
  PipelineObservers observers();
  void say(std::string_view text, std::uint32_t line);
  void wait_until_cleared();
  void wait_until_primed();
  /// False if the program failed or was abandoned.
  bool feed(Pipeline& pipeline);
  void push(Pipeline& pipeline, const MotionBlock& block);
  /// The program asks the machine. False if it was abandoned meanwhile.
  bool wait_for_answer(Pipeline& pipeline);
  void wait_at_stop(Pipeline& pipeline, QueueEvent::Kind kind);
  void take_wish(Pipeline& pipeline);
  void take_log(const canon::Log& log, std::uint32_t line);
  void keep_started();
  void end_thread();
  void end_reading();
  void forget_unstarted();
  void take_held(Pipeline& pipeline);
  void check_held(const HeldLines& lines);
  void tell_measured(const Parameters& before, const ToolTable& tools_before, std::uint64_t until_block);
  void join();
  void show_idle();
  void adopt_outputs();

  const Assembly& assembly_;
  MotionQueue& queue_;
  Parameters parameters_;
  ToolTable tools_;
  MachineMemory memory_;   ///< of the two
  ChangeJournal journal_;  ///< the same
  PlannerListeners listeners_;
  ProgramLog program_log_;
  /// What a program's lines set while they are read before its start is its own: it is not kept, and
  /// forgotten where another one is loaded instead. Typed lines start at once.
  std::atomic<bool> started_ = true;
  std::atomic<bool> kept_ = true;  ///< what was set before the start
  std::vector<std::pair<canon::Log, std::uint32_t>> logs_before_start_;
  int said_ = 0;  ///< messages of the present program
  std::atomic<bool> own_abandoned_ = false, own_closed_ = false, own_optional_stop_ = true;
  std::atomic<bool>&abandoned_, &closed_, &optional_stop_;
  std::atomic<bool> ended_ = true;
  ProgramFiles files_;
  std::atomic<ProgramSwitches> switches_;
  std::optional<MachineOutputs> outputs_;  ///< none: nobody tells
  ReadFiles read_;                         ///< sub-programs of the file that was loaded last
  std::atomic<bool> waits_ = false;        ///< for the machine's answer
  std::atomic<bool> at_stop_ = false;      ///< reads on when the tick has passed a program stop
  /// Of the block delete, until the planner's thread takes it.
  static constexpr int kNoWish = -1;
  std::atomic<int> wish_ = kNoWish;
  std::atomic<std::uint64_t> blocks_read_ = 0;
  /// Lines that the operator gives while the program waits: from the wish on until it is taken back, they and
  /// the answer are the planner's thread's.
  struct HeldWish {
    std::string text;
    JointVec q;
    HeldLines obeyed;
    std::string refusal;
  };
  HeldWish held_;
  enum class HeldState : int { kNone, kWished, kTaken, kDone };
  std::atomic<HeldState> held_state_ = HeldState::kNone;
  /// The present program as it began.
  ProgramStart start_;
  Parameters start_parameters_;
  ToolTable start_tools_;
  std::mutex mutex_;
  std::string failure_;                     ///< guarded by mutex_
  std::optional<ReadingPlace> taken_;       ///< the same: where the wish was taken
  std::vector<BlockDeleteChange> changes_;  ///< the same: of the present program
  std::optional<Settings>
      mdi_;  ///< what the last MDI line left; the planner's thread writes it as its last act
  std::thread thread_;
  TimePass time_pass_;
};

}  // namespace trn
