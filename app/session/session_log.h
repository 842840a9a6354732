#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/feature_meter.h"
#include "app/session/line_file.h"
#include "app/session/pipeline.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/ports.h"
#include "interp/gcode/program_config.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"

namespace trn {

/// One thing that reached the tick from outside, in the period in which it did.
struct SessionEntry {
  enum class Kind : std::uint8_t {
    kProgram,      ///< `program` was prepared, before the tick of its period
    kCommand,      ///< `command` took effect
    kLow,          ///< little motion was queued: the tick saw `blocks` blocks of the program
    kStands,       ///< the drives are powered: told `program.q`, and measured at `q_measured`
    kFault,        ///< the drives reported `fault`
    kInputs,       ///< the inputs are now `inputs`
    kAnswer,       ///< the program was given `answer`
    kSensor,       ///< the corrections heard `sensor`
    kRatePlans,    ///< the rate planner's answers are `late` from now on, or come again
    kFeatures,     ///< a program ended, and the tool's bending made `features` of it; a result, not replayed
    kDrives,       ///< the drives follow no setpoints any more: they are in state `drives`
    kHeld,         ///< the operator has set offsets or tools while the program waited: `held`
    kBlockDelete,  ///< switched for what is read of the program behind `change`
    kTakenBack,   ///< the program was given up in its block `taken_back`; what is behind that has set nothing
    kDeleteTool,  ///< the tool with the number `tool` has left the table
    kGap          ///< `lost` entries before it, from the period `since` on, could not be written
  };
  Kind kind = Kind::kCommand;
  std::uint64_t period = 0;
  RtCommand command;
  ProgramStart program;
  std::uint32_t blocks = 0;
  bool late = false;
  Fault fault = Fault::kOk;
  int joint = -1;
  JointVec q_measured;
  DriveState drives = DriveState::kOff;
  IoInputs inputs;  ///< digital, probe, spindle_ready
  ProgramAnswer answer;
  SensorSample sensor;
  std::vector<FeatureDeflection> features;
  BlockDeleteChange change;
  HeldLines held;
  std::uint64_t taken_back = 0;
  int tool = 0;
  std::uint64_t since = 0, lost = 0;
};

/// What a session was made with; paths as given.
struct SessionHead {
  std::string machine, tools, vars;
  bool run = false;  ///< of `trunnion run`: program stops are passed, the trace begins with the program
  std::string tools_text = {}, vars_text = {};  ///< of the files, as they were when the session began
};

/// Makes the file for a new session's log and returns its path: `path`, or, where a session is kept there,
/// `path`.1, `path`.2 and so on: no session is written over. std::runtime_error if none can be made.
std::string make_log_file(const std::string& path);

/// With what the files hold now; "": there is none.
SessionHead session_head(const std::string& machine, const std::string& tools, const std::string& vars,
                         bool run);

/// Records a session as JSON lines: a head, then its entries in order. With the program files it gives the
/// setpoints again, bit for bit (`trunnion replay`). What a full disk does not take is lost; where there is
/// room again, the log goes on behind a mark that says so.
class SessionLog {
 public:
  /// std::runtime_error if the file cannot be written.
  SessionLog(const std::string& path, const SessionHead& head);
  /// Marks a gap that is open, if there is room.
  ~SessionLog();
  SessionLog(const SessionLog&) = delete;
  SessionLog& operator=(const SessionLog&) = delete;

  /// From any thread, before the program's first block.
  void program(const ProgramStart& start);
  /// From any thread, behind the program that it is for.
  void block_delete(const BlockDeleteChange& change);
  void held(const HeldLines& lines);
  void tool_deleted(int number);
  void taken_back(std::uint64_t block);
  /// Every command, before the tick can have it, and every report: from one thread.
  void posted(const RtCommand& command);
  void report(const CycleReport& report);
  /// From the same thread, behind the report with the program's end.
  void features(const std::vector<FeatureDeflection>& features);

  /// Why entries are being lost, once for each gap; "": none are, or it was told. From any thread.
  std::string take_trouble();

 private:
  void write(const SessionEntry& entry);
  void write_now(SessionEntry& entry);
  void begin_gap(std::uint64_t period);
  bool end_gap(std::uint64_t period);
  void report_drives(const CycleReport& report);
  void report_io(const CycleReport& report);

  std::mutex mutex_;
  LineFile file_;
  std::string head_;                 ///< that is still to be written; "": it is
  std::optional<SessionEntry> gap_;  ///< entries are being lost since then
  std::string trouble_;
  std::chrono::steady_clock::time_point next_try_;
  std::deque<RtCommand> open_;  ///< posted, not yet obeyed
  CycleReport last_;
  std::uint64_t next_period_ = 0;  ///< the first one of which no report has come
};

/// A log as a whole.
struct Session {
  SessionHead head;
  std::vector<SessionEntry> entries;
  int torn_line = 0;  ///< the last one, cut off as by a power cut, and left out; 0: it is whole
};
/// As `SessionLog` writes it.
std::string session_text(const Session& session);
/// Reads a log, `text` of the file `name`. ProgramError "file:line: what" where it is not one. A last line
/// that is cut off is no error.
Session parse_session(std::string_view text, const std::string& name);
/// The same from the file itself; ProgramError if it cannot be read.
Session read_session(const std::string& path);

}  // namespace trn
