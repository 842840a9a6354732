#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/ports.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/flow/flow.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/text/expression.h"
#include "interp/gcode/text/line_reader.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// A warning or error with its place, as "file:line:column: text".
struct Diagnostic {
  std::string text;
  std::uint32_t line = 0;
};

/// Everything the interpreter works on; all must outlive it.
struct InterpreterParts {
  const ProgramConfig& config;
  Parameters& parameters;
  ToolTable& tools;
  const Kinematics* kinematics = nullptr;
  CanonSink& sink;
  std::function<void(const Diagnostic&)> on_warning;
  bool asks = false;  ///< as ExecutorParts::asks
  /// A program that M99 begins again in the very state in which it began a pass before goes round for ever,
  /// and ends there. Not for a machine, which goes on.
  bool ends_round = false;
  /// Behind each of the config's `held_lines`.
  std::function<void()> held_obeyed = {};
};

/// The RS274/NGC interpreter (LinuxCNC's dialect, with the five-axis words of ISO controls). Reads a program
/// of any length block by block and hands canonical functions to the sink. After the first few lines a step
/// allocates nothing.
class Interpreter {
 public:
  explicit Interpreter(const InterpreterParts& parts);

  /// Opens a program and emits the start state; `start` is where the machine stands (axis words, mm and
  /// degrees), `kept` the modes to begin with instead of the config's. GcodeError if it cannot be opened.
  void open(const std::string& path, const MachineWords& start = {});
  void open_text(std::string text, std::string name, const MachineWords& start = {},
                 const Settings* kept = nullptr);

  /// After `open`: passes over the program up to `line` of the main program as if it had been run, then
  /// gives the sink the modes, the tool and the approach from `at` to where the program stands there: away
  /// along the tool's axis, across, and down. Sub-programs and loops before it are run through. GcodeError if
  /// the line is not reached, or lies inside cutter compensation.
  void begin_at(std::uint32_t line, const MachineWords& at);
  /// The same up to the block that is run as the `block`th (`blocks`), in whatever pass of a loop or
  /// sub-program that is. `line`: of it, for messages. `on_move`: the approach leads to this place on the
  /// one move that the block makes, a straight feed or an arc, instead of to where it begins.
  void begin_at_block(std::uint64_t block, std::uint32_t line, const MachineWords& at,
                      const std::optional<EntryPlace>& on_move = std::nullopt);
  /// The next block is no part of a tool change that is under way.
  bool between_blocks() const { return held_.empty(); }

  /// Runs one block. False once the program has ended. GcodeError: of this block, which has had no motion
  /// then, or a gouge of a contour that has ended with it, at the line of its move. Stepping on is allowed
  /// after `recover`.
  bool step();
  /// After an error: true if going on with a later block makes sense, to find more errors.
  bool recover();

  /// The last block asks the machine (M6, M66, G38): no step before as many answers have come.
  bool waiting() const { return executor_.questions() > 0; }
  /// What it asks is whether the tool is in the spindle (M6); the answer is known beforehand.
  bool asks_for_tool() const { return executor_.asks_for_tool(); }
  void answer(const MachineAnswer& answer) { executor_.answer(answer); }

  std::uint32_t line() const { return flow_.line(); }
  /// "file:line:column" of a move of this line, at its word `letter` (0: the first axis word) if it has one;
  /// during a step.
  std::string place_of(std::uint32_t line, char letter) const;
  /// Lines run so far, every pass of a loop counted.
  std::uint64_t lines_run() const { return flow_.lines_run(); }
  /// So many of them were run again in loops and sub-programs that the end may never come.
  bool loops_long() const { return lines_run() > kLoopedLinesMax + line(); }
  static constexpr std::uint64_t kLoopedLinesMax = 10'000'000;

  /// It has ended because it goes round for ever.
  bool came_round() const { return came_round_; }

  /// The text of the line that was run last, for people (ParsedBlock::text), and the name of its file.
  const std::string& text() const { return text_; }
  const std::string& file_name() const { return flow_.file_name(); }
  /// The motion code of the last line that moved.
  GCode motion() const { return executor_.motion_now(); }
  /// G40, G41 or G42.
  GCode cutter_comp() const { return executor_.cutter_comp_code(); }

  /// How many blocks were run.
  std::uint64_t blocks() const { return blocks_; }
  /// From the next block on, lines that begin with '/' are skipped, or run.
  void set_block_delete(bool on) { executor_.set_block_delete(on); }
  const Settings& settings() const { return executor_.settings(); }
  /// What the operator had measured (ProgramConfig::measured), where a line of the program would have set
  /// something else; and that line.
  const std::map<int, std::uint32_t>& kept_numbers() const { return kept_numbers_; }
  const std::map<int, std::uint32_t>& kept_tools() const { return kept_tools_; }

  /// While the program waits at a stop or for a tool: sets what the lines say, as if the machine stood at
  /// `stands`; the program goes on from where it is. `keep` is called when they have been carried out.
  /// ProgramError, also of `keep`: then all is as it was.
  void obey_held(const HeldLines& lines, const std::function<void()>& keep);

 private:
  void start(std::unique_ptr<ByteSource> source, const std::string& name, const std::string& folder,
             const MachineWords& at);
  void run_block(const ParsedBlock& parsed);
  void end_block(bool program_ends);
  void hold_for_tool(bool entry);
  void switch_block_delete();
  void obey_held_lines();
  void find_measured();
  void keep_measured();
  void obey_held_line(std::string_view line, const ProgramWords& stands);
  void pass_over(const std::function<bool()>& ahead, std::uint32_t line, const MachineWords& at,
                 const std::optional<EntryPlace>& on_move = std::nullopt);
  void run_rest();
  void assign(const ParsedBlock& parsed);
  bool carry_out(bool rest);
  void tell_gouges();
  void begin_pass();
  GcodeError located(const BlockError& error);

  /// Closed while a part of the program is passed over.
  struct Gate : CanonSink {
    explicit Gate(CanonSink& sink) : to(sink) {}
    void put(const CanonCommand& command, std::uint32_t line) override {
      if (open) to.put(command, line);
    }
    CanonSink& to;
    bool open = true;
  };

  /// A block, or the entry into a program further down, whose tool is not in the spindle yet.
  struct Held {
    ParsedBlock parsed;
    Block block;
    bool entry = false, called = false;
    int tool = 0;
    std::size_t depth = 0;  ///< of calls; deeper is the sub-program that changes the tool
  };

  InterpreterParts parts_;
  Gate gate_;
  ModalTable table_;
  Executor executor_;
  Evaluator evaluator_;
  Flow flow_;
  Block block_;
  std::vector<Held> held_;      ///< the innermost last
  Held rest_;                   ///< whose rest is being carried out
  std::vector<double> values_;  ///< of the assignments of one line
  std::string text_;
  std::uint64_t blocks_ = 0;
  std::size_t changes_ = 0;     ///< of the block delete, that have been made
  std::size_t held_lines_ = 0;  ///< of the config's, that have been obeyed
  std::map<int, std::uint32_t> kept_numbers_, kept_tools_;
  bool new_tool_in_ = false;  ///< since the program moves: the measured one is out
  bool ended_ = false, came_round_ = false;
  bool block_done_ = false;               ///< the last block has been carried out: what failed was another
  std::vector<std::string> gouges_told_;  ///< at most kGougesTold: a loop meets them in every pass
  static constexpr std::size_t kGougesTold = 100;
  std::uint64_t passes_ = 0;  ///< that M99 has begun
  /// All that a pass of the program depends on, where an earlier one began.
  struct PassStart {
    Settings settings;
    Parameters parameters;
    std::map<int, Tool> tools;
  };
  std::unique_ptr<PassStart> pass_;
};

}  // namespace trn
