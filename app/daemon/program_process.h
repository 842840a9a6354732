#pragma once

#include <sys/types.h>

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "app/daemon/program_source.h"
#include "app/daemon/program_wire.h"
#include "app/daemon/program_worker.h"
#include "app/daemon/shared_memory.h"
#include "app/session/feature_recorder.h"
#include "app/session/machine_memory.h"
#include "app/session/machine_outputs.h"
#include "app/session/pipeline.h"
#include "app/session/place_record.h"
#include "app/session/program_step.h"
#include "app/session/program_time.h"
#include "app/session/session_log.h"
#include "core/axes.h"
#include "core/config.h"
#include "interp/gcode/program_config.h"
#include "kernel/motion_queue.h"
#include "kernel/retrace.h"

namespace trn {

/// Programs are read, interpreted and planned in a process of their own, with a limit of memory and next to
/// no rights; the queue to the tick lies in memory that both have. Whatever happens to that process - a
/// defect, too much memory, a file that hangs - is a named failure here, and the next call begins with a new
/// one, which reads from the files what the machine must not forget.
///
/// The constructor makes a process that waits, knows the machine and makes the others: it must be called
/// before this process has threads, sockets or locked memory, for the others have what it has.
class ProgramProcess final : public ProgramSource {
 public:
  /// Of a config that `assemble` takes. std::system_error.
  ProgramProcess(const ConfigTable& config, const MemoryFiles& files, std::size_t queue_blocks);
  ~ProgramProcess() override;
  ProgramProcess(const ProgramProcess&) = delete;
  ProgramProcess& operator=(const ProgramProcess&) = delete;

  MotionQueue& queue() { return *queue_; }
  /// Null: nobody. Before the first call.
  void tell(SessionLog* log, FeatureRecorder* features, const ProgramSwitches& switches);

  std::string load(const std::string& path, const JointVec& q) override { return load_from(path, q, 0); }
  std::string load_from(const std::string& path, const JointVec& q, std::uint32_t line) override;
  std::string load_place(const PlaceRecord& place, const JointVec& q, double before_mm) override;
  void load_mdi(const std::string& text, const JointVec& q) override;
  void confirm_tool(int number) override;
  std::string tool_name(int number) const override;
  void set_switches(const ProgramSwitches& switches) override;
  ProgramSwitches switches() const override { return switches_; }
  void set_outputs(const MachineOutputs& outputs) override;
  ReadingPlace switch_block_delete(bool on) override;
  void check_place(const PlaceRecord& place, const JointVec& q) override;
  void delete_tool(int number, const std::string& path, const JointVec& q) override;
  HeldLines obey_held(const std::string& text, const JointVec& q) override;
  void abandon() override;
  void close() override;
  std::string take_failure() override;
  std::vector<ProgramMessage> take_messages() override;
  bool take_tables(trunnion::tables_t& tables) override;
  std::vector<Measured> take_measured() override;
  bool take_program_time(ProgramTime& time) override;
  void show() override;
  void check_files() override;
  void starts() override;
  void gave_up_at(std::uint64_t block) override;
  const ProgramStep* step(std::uint32_t number) override;
  void hand_on_moves() override;
  bool lost() override { return lost_.exchange(false); }

  /// Ends the preparation and keeps all that programs have left behind. FileError.
  void settle();
  /// Of the process that is at work; 0: none.
  pid_t worker() const { return worker_; }

 private:
  using Go = std::function<void(const ProgramReply&)>;  ///< the program starts

  std::string call(const ProgramCall& call, const Go& go = {});
  ProgramReply answer_to(const ProgramCall& call, const Go& go);
  ProgramReply ask(const ProgramCall& call, const Go& go);
  void begin_worker();
  void hear(const ProgramReply& said);
  std::string look_for_end();
  void end_worker(const std::string& why);
  void start(const ProgramStart& start);

  SharedMemory memory_;
  MotionQueue* queue_;
  SharedProgramState* shared_;
  int calls_ = -1, control_ = -1;
  pid_t maker_ = -1;
  std::atomic<pid_t> worker_ = 0;
  std::string ended_why_;  ///< why this side ended the worker; "": it did not
  std::mutex mutex_;       ///< of a call
  std::mutex moves_mutex_;
  std::mutex said_mutex_;
  std::vector<ProgramMessage> said_;          ///< guarded by said_mutex_
  std::optional<trunnion::tables_t> tables_;  ///< the same
  std::vector<Measured> measured_;            ///< the same
  std::optional<ProgramTime> time_;           ///< the same
  static constexpr std::size_t kStepsKept = Retrace::kBlocksKept;
  std::deque<NumberedStep> steps_;  ///< the last that were taken
  ProgramStep stands_;              ///< SharedProgramState::stands
  bool stands_known_ = false;
  mutable std::mutex names_mutex_;
  std::map<int, std::string> tool_names_;  ///< guarded by names_mutex_
  std::atomic<ProgramSwitches> switches_;
  std::mutex outputs_mutex_;
  MachineOutputs outputs_;  ///< guarded by outputs_mutex_
  std::atomic<std::uint32_t> abandons_ = 0;
  std::atomic<bool> lost_ = false;
  SessionLog* log_ = nullptr;
  FeatureRecorder* features_ = nullptr;
};

}  // namespace trn
