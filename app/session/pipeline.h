#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/change_journal.h"
#include "app/session/dry_run.h"
#include "app/session/machine_outputs.h"
#include "app/session/plan_time.h"
#include "app/session/program_step.h"
#include "core/axes.h"
#include "core/check.h"
#include "core/motion.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/line_reader.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/speed/speed_options.h"
#include "interp/plan/speed/speed_planner.h"
#include "interp/plan/stages.h"
#include "kernel/joint_map.h"
#include "kernel/motion_queue.h"

namespace trn {

/// What the operator has switched before a program begins.
struct ProgramSwitches {
  /// MapContext's, where the program does not switch them itself. Aligned so that all is one word.
  alignas(4) std::uint8_t corrections_off = 0;
  bool block_delete = false;  ///< lines that begin with '/' are skipped
  bool optional_stop = true;  ///< what a program finds in #<_optional_stop>
  bool dry_run = false;       ///< DryRun

  /// As the config has them.
  static ProgramSwitches of(const Assembly& assembly);
  bool operator==(const ProgramSwitches&) const = default;
};

/// A program, as a file or as text, and where the machine stands when it begins.
struct ProgramStart {
  std::string path;                 ///< file; or the name that stands for `text`
  std::optional<std::string> text;  ///< MDI
  JointVec q;                       ///< motor joints at rest
  std::uint32_t from_line = 0;      ///< begin here instead of at the first line; 0: at the first
  std::optional<Settings> kept =
      std::nullopt;  ///< MDI: the modes that the line before left, instead of the config's
  std::optional<MachineOutputs> outputs = std::nullopt;  ///< MDI: what is on, as `kept` has it
  OpenFile open =
      {};  ///< for the program's files, if not the system's own; errors then quote none of their lines
  ProgramSwitches switches = {};
  bool ends_round = false;       ///< as InterpreterParts
  std::uint64_t from_block = 0;  ///< as from_line, by the number of the block (ProgramStep::block); 0: not
  /// With from_block: a place on the move of that block to begin at.
  std::optional<EntryPlace> from_place = std::nullopt;
  /// Where they stood when the program ran before, for what it does in relation to that; empty: at q.
  JointVec began = {};
  /// As ProgramConfig has them: what the operator switches while the program runs, or did when it ran before.
  std::vector<BlockDeleteChange> block_delete_changes = {};
  std::vector<HeldLines> held_lines = {};  ///< the same
  MeasuredValues measured = {};            ///< the same
};

/// Who looks on while a program passes; each may be empty.
struct PipelineObservers {
  std::function<void(const Diagnostic&)> warning;
  std::function<void(const ProgramMove&)> move;
  std::function<void(const PlanPiece&)> piece;
  std::function<void(double time_s)> stretch;  ///< after its last piece: how long its motion takes
  /// After every line, before anything that it made is handed out; `event`: there was more than motion in it.
  /// FileError: what the line changed cannot be kept; the program ends before it.
  std::function<void(bool event)> line_done;
  /// What the program says to people: (MSG,), (DEBUG,), (PRINT,); when its line is read, not when it moves.
  std::function<void(std::string_view text, std::uint32_t line)> message;
  /// (LOG,) and its kin. ProgramError: the log cannot be written; the program ends here.
  std::function<void(const canon::Log& log, std::uint32_t line)> log;
  bool steps = false;                ///< `Pipeline::step` is asked for
  ChangeJournal* journal = nullptr;  ///< of its parameters and tools; told of every line before `line_done`
};

/// One program from text to motion blocks: interpreter, lowering, geometry stage, speed stage in a row.
/// Pulled by whoever needs blocks; what comes out depends on the program only.
class Pipeline {
 public:
  /// `assembly`, `parameters` and `tools` must outlive the pipeline; the last two are changed by the program.
  /// ProgramError if the program cannot be opened.
  Pipeline(const Assembly& assembly, Parameters& parameters, ToolTable& tools, const ProgramStart& start,
           PipelineObservers observers);
  ~Pipeline();

  /// The next block; false while it is `waiting`, after the last one, which is a kProgramEnd event, and when
  /// `abandoned` has become true, in a program that loops without end or motion. ProgramError also where
  /// `lines_max` lines have been run for this one block.
  /// ProgramError "file:line:...": the blocks handed out so far end at rest; one kProgramEnd event still
  /// follows.
  bool next(MotionBlock& block, const std::atomic<bool>* abandoned = nullptr,
            std::uint64_t lines_max = std::numeric_limits<std::uint64_t>::max());

  /// What the block that `next` gave last was made for; null: the same as the block before, or nobody asks.
  const ProgramStep* step() const { return step_ ? &*step_ : nullptr; }

  /// The program asks the machine (M6, M66, G38): `next` gives no more before the answer has come.
  bool waiting() const;
  /// Answers it; from whoever drives the blocks, in the order of the events that ask.
  void answer(const ProgramAnswer& answer);

  /// From the next block that is read; between calls of `next`.
  void set_block_delete(bool on) { interpreter_.set_block_delete(on); }

  /// Lines that the operator gives here, for a machine that stands at q (mm, rad). ProgramError.
  HeldLines held_lines(const std::string& text, const JointVec& q) const;
  /// As Interpreter; between calls of `next`, while all that was read has been handed out.
  void obey_held(const HeldLines& lines, const std::function<void()>& keep) {
    interpreter_.obey_held(lines, keep);
    if (journal_) journal_->adopt();
  }
  /// How the program stands behind that: the last step, with what is in force now. Null: nobody asks.
  const ProgramStep* held_step();

  /// The line that was read last, and the name of its file.
  std::uint32_t line() const { return interpreter_.line(); }
  const std::string& file_name() const { return interpreter_.file_name(); }
  std::uint64_t blocks_read() const { return interpreter_.blocks(); }
  /// The modes that the program has left, once `next` has given false.
  const Settings& settings() const { return interpreter_.settings(); }
  const SpeedStats& speed_stats() const { return speed_.stats(); }

 private:
  struct MoveTap;
  struct PieceObserver;
  struct BlockQueue;
  struct MessageTap;

  void fill();
  bool run_line();
  void finish_stages();
  void end_program();
  void refuse_failed_check() const;
  [[noreturn]] void give_up();
  std::function<void(SourceLine, const ProgramMove*)> step_recorder(bool wanted);
  void find_step(const MotionBlock& block);

  std::string name_;
  ProgramConfig program_;
  std::unique_ptr<BlockQueue> blocks_;
  SpeedPlanner speed_;
  std::unique_ptr<PieceObserver> pieces_;
  GeometryPlanner geometry_;
  std::unique_ptr<DryRun> dry_run_;  ///< null: it is none
  std::unique_ptr<MoveTap> moves_;
  Lowering lowering_;
  std::unique_ptr<MessageTap> messages_;
  Interpreter interpreter_;
  const MachineJointMap& map_;
  const ToolTable& tools_;
  std::deque<ProgramStep> steps_;  ///< on their way through the planner
  std::optional<ProgramStep> step_, last_step_;
  PlanTime handed_out_;  ///< of all blocks
  std::function<void(bool)> line_done_;
  ChangeJournal* journal_;
  CheckFailure failed_check_;
  bool ended_ = false;
};

/// Reads a program without driving it; its moves go to `sink`. Tool changes count as done.
class ProgramReader {
 public:
  /// All must outlive it; parameters and tools are changed by the program. ProgramError as Pipeline.
  ProgramReader(const Assembly& assembly, Parameters& parameters, ToolTable& tools, const ProgramStart& start,
                MoveSink& sink);
  /// As Interpreter::step. ProgramError "file:line:..." for a defect.
  bool step();
  const Interpreter& interpreter() const { return interpreter_; }
  /// What words of a move of the last step are in the program.
  ProgramFrame frame() const { return lowering_.frame(); }
  /// Where the program stands, in its own coordinates.
  MmWords stands() const;
  /// Words of a move of the last step, in the program's coordinates.
  MmWords program_of(const Words& words) const { return lowering_.frame().mm_of(words); }

 private:
  std::string name_;
  ProgramConfig program_;
  Lowering lowering_;
  Interpreter interpreter_;
};

/// What a dry run of a whole program found.
struct ProgramSummary {
  std::uint64_t lines = 0, moves = 0;
  std::uint32_t asks_at = 0;  ///< the line that asks the machine; what follows depends on it. 0: none
  std::uint64_t endless = 0;  ///< lines that were run when the check gave up in a loop. 0: it came to the end
  std::uint32_t round_at = 0;   ///< the line of the M99 from which it goes round for ever. 0: it does not
  std::vector<Words> approach;  ///< ends of the moves to where a program begun further down stands
};

/// How far the check came if not to the end, in words for people; "" if it did.
std::string remark_on(const ProgramSummary& summary);

/// The way to where a program begun further down goes on, in words for people.
std::string approach_text(std::uint32_t line, const std::vector<Words>& approach);

/// Interprets a program to its end on copies of parameters and tools, and follows its moves through the
/// joint map: every place must be reachable and inside the joints' position limits. Nothing moves.
/// ProgramError for the first defect, with file, line and what would be right. Ends where the program asks
/// the machine, and in a loop that goes on for very long (Interpreter::loops_long). `progress` is told the
/// line now and then; the check ends with a ProgramError when `given_up` has become true.
ProgramSummary check_program(const Assembly& assembly, Parameters parameters, ToolTable tools,
                             const ProgramStart& start, const std::function<void(std::uint32_t)>& progress,
                             const std::atomic<bool>* given_up = nullptr);

}  // namespace trn
