#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "interp/gcode/executor.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/text/expression.h"
#include "interp/gcode/text/line_reader.h"
#include "interp/gcode/text/parser.h"

namespace trn {

/// Where a line of a program lies: which file (0: the main program) and where in it.
struct CodePlace {
  int file = 0;
  LinePlace at;
};

/// Fetches lines in program order, jumps for O-words and sub-programs, and keeps the blocks of loops and
/// sub-programs in compiled form, so that they are read once. The main program itself is not kept: memory
/// does not grow with its length.
class Flow {
 public:
  Flow(const ProgramConfig& config, Parameters& parameters, Evaluator& evaluator, Executor& executor);

  /// Starts at the beginning of `source`; `name` for messages, `folder` to look for sub-program files.
  void load(std::unique_ptr<ByteSource> source, std::string name, std::string folder);

  /// The next block to carry out, O-words already obeyed; null at the end of the program. After many O-words
  /// in a row an empty block, so that an endless loop of them does not keep the caller. BlockError.
  const ParsedBlock* next();

  /// M98 P L: calls the sub-program O<P>, L times.
  void call_numbered(const Block& block);
  /// M99: returns from a sub-program; in the main program begins it again from its first line, and then is
  /// true.
  bool return_numbered(const Block& block);
  /// An M code that the config maps to a sub-program, with P and Q as #1 and #2.
  void call_user(const Block& block);
  /// A sub-program in the middle of the present block: `next` gives an empty block when it is over.
  void call_between(const std::string& name, std::array<double, 4> arguments);
  /// Calls that are open.
  std::size_t depth() const { return frames_.size(); }

  /// Line, in its own file, of the block that was last fetched.
  std::uint32_t line() const { return current_.at.line; }
  /// Lines run so far, every pass of a loop counted.
  std::uint64_t lines_run() const { return lines_run_; }
  /// Line of the main program that comes next; 0 inside a sub-program.
  std::uint32_t next_main_line() const { return frames_.empty() ? next_.at.line : 0; }
  /// At the program's end: every loop and branch that is open must be closed further down. BlockError.
  void check_closed();
  /// After an error: text of the line that was last fetched (empty if it cannot be read again).
  std::string current_text();
  /// The file of the line that was last fetched, and the name of any that was.
  int file_number() const { return current_.file; }
  const std::string& file_name(int file) const { return files_[static_cast<std::size_t>(file)]->name; }
  const std::string& file_name() const { return file_name(current_.file); }
  /// "called from file:line", innermost first; of many the first ones, and how many more there are.
  std::vector<std::string> stack() const;
  /// After an error inside a sub-program or loop: goes on behind the outermost call or loop. False if there
  /// is no sound place.
  bool recover();

  /// Blocks kept in compiled form before the store is emptied.
  static constexpr std::size_t kMaxKept = 50'000;
  /// O-words obeyed in one call of `next`.
  static constexpr int kMaxWordsAtOnce = 1000;

 private:
  struct File {
    std::string name, folder;
    std::unique_ptr<LineReader> reader;
    bool indexed = false;
    bool percent_seen = false;        ///< the file began with %
    bool any = false, began = false;  ///< a line that is not empty has been read; before the present one
    bool number_seen = false;         ///< the program's own number, as O1234
    std::unordered_map<std::int32_t, LinePlace> subs;  ///< label -> the line after its sub word
  };
  /// A kept block; next and jump are its successors in the store, -1 unknown.
  struct Node {
    ParsedBlock block;
    CodePlace place, after;
    std::int32_t next = -1;
    std::int32_t jump = -1;      ///< where a false condition goes: the next branch
    std::int32_t jump_end = -1;  ///< the end of the loop or of all branches
    std::int32_t& jump_to(bool end) { return end ? jump_end : jump; }
  };
  struct Loop {
    FlowKind kind;
    std::int32_t label;
    CodePlace start;  ///< the line of the loop word itself, or after it (do, repeat)
    std::int32_t start_node;
    std::int64_t left = 0;   ///< repeat
    std::size_t ifs = 0;     ///< open when it began
    std::uint32_t line = 0;  ///< of the loop word
  };
  struct Branch {
    std::int32_t label;
    std::uint32_t line;  ///< of its `if`
  };
  struct Frame {
    std::int32_t label = -1;
    CodePlace back;
    std::int32_t back_node = -1;
    std::uint32_t called_line = 0;
    int called_file = 0;
    std::size_t loops = 0;  ///< loops_ outside this call
    std::size_t ifs = 0;
    bool numbered = false;  ///< M98
    std::int64_t repeats_left = 0;
    CodePlace start;
    bool between = false;  ///< goes back into the middle of the block at `called`
    CodePlace called;
  };

  static std::uint64_t key_of(const CodePlace& place) {
    return static_cast<std::uint64_t>(place.file) << 48 | place.at.offset;
  }
  void parse(std::string_view line);
  const ParsedBlock* fetch();
  const ParsedBlock* fetch_kept();
  const ParsedBlock* fetch_scratch();
  bool keeping() const { return !loops_.empty() || !frames_.empty(); }
  bool read_line(std::string_view& line);
  void go(const CodePlace& place, std::int32_t node = -1);
  File& file() { return *files_[static_cast<std::size_t>(current_.file)]; }
  void at_file_end();
  void refuse_open();
  void begin_again();

  void obey(const ParsedBlock& block);
  std::int32_t label_of(const ParsedBlock& block);
  std::int32_t label_passed(const ParsedBlock& block);
  double argument(const ParsedBlock& block, std::size_t index) const;
  bool percent();
  bool condition(const ParsedBlock& block) const { return argument(block, 0) != 0; }
  void obey_while(const ParsedBlock& block, std::int32_t label);
  void obey_repeat(const ParsedBlock& block, std::int32_t label);
  void end_loop(FlowKind kind, std::int32_t label);
  void break_loop(std::int32_t label, bool again);
  void program_number(const ParsedBlock& block);
  void obey_if(const ParsedBlock& block, std::int32_t label);
  void skip_definition(std::int32_t label);
  void call(const ParsedBlock& block, std::int32_t label);
  void enter(std::int32_t label, std::span<const double> arguments, bool numbered, std::int64_t repeats);
  void leave(const ParsedBlock* with_value);
  FlowKind skip_to(std::int32_t label, std::initializer_list<FlowKind> wanted);
  const ParsedBlock* skip_fetch();
  void remember_jump(std::int32_t from_node, bool to_end);
  bool find_sub(std::int32_t label, CodePlace& place);
  void index_file(std::size_t index);
  bool open_sub_file(const std::string& name, CodePlace& place, std::int32_t label);
  void close_if(std::int32_t label, std::string_view word);
  bool in_loop(FlowKind kind, std::int32_t label) const;
  void drop_store_if_full();

  const ProgramConfig& config_;
  Parameters& parameters_;
  Evaluator& evaluator_;
  Executor& executor_;
  NameTable labels_;
  Parser parser_;
  std::vector<std::unique_ptr<File>> files_;
  ParsedBlock scratch_, skipped_;
  const ParsedBlock nothing_{};
  std::deque<Node> store_;
  std::unordered_map<std::uint64_t, std::int32_t> kept_at_;
  std::vector<Loop> loops_;
  std::vector<Frame> frames_;
  std::vector<Branch> ifs_;  ///< the branches being run
  CodePlace current_;        ///< of the block last fetched
  CodePlace next_;           ///< of the block to fetch
  std::int32_t current_node_ = -1, next_node_ = -1;
  bool between_over_ = false;  ///< the call in the middle of a block has come back
  bool reader_there_ = true;   ///< the file's reader stands at next_
  bool ended_ = false;
  std::uint64_t lines_run_ = 0;
  bool told_again_ = false;                        ///< the warning about M99 in the main program
  std::vector<std::string_view> told_parameters_;  ///< warnings about other controls' parameters
};

}  // namespace trn
