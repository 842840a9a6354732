#include "interp/gcode/interpreter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <string_view>

#include "core/utf8.h"
#include "interp/gcode/error.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/text/parser.h"
#include "interp/move.h"

namespace trn {

namespace {

// What a terminal would obey is '?', and what is no UTF-8.
std::string printable(std::string text) {
  const bool letters = !find_encoding_flaw(text);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (letters && byte == 0xC2 && static_cast<unsigned char>(text[i + 1]) < 0xA0)
      text.replace(i, 2, "?");
    else if (byte < 0x20 || byte == 0x7F || (byte >= 0x80 && !letters))
      text[i] = '?';
  }
  return text;
}

// The word at the column, for the message: up to the next white space, at most 24 bytes.
std::string offending(const std::string& line, std::uint32_t column) {
  if (column == 0 || column > line.size()) return {};
  const std::size_t start = column - 1;
  const std::size_t end = std::min(line.find_first_of(" \t", start), line.size());
  return printable(std::string(first_letters(std::string_view(line).substr(start, end - start), 24)));
}

// The G-code word at its start, if there is one: letter and number.
std::string leading_word(const std::string& text) {
  std::size_t end = 1;
  while (end < std::min(text.size(), std::size_t{12}) && std::strchr("+-.0123456789", text[end])) ++end;
  const bool word = !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) && end > 1;
  return word ? text.substr(0, end) : "";
}

// G7: every X word of the block is a diameter.
void halve_diameter(bool diameter, Block& block) {
  const GCode code = block.any_g ? block.code(GGroup::kDiameter) : kNoGCode;
  if (block.has('X') && (code != kNoGCode ? code == 7_g : diameter)) block.value['X' - 'A'] /= 2;
}

}  // namespace

Interpreter::Interpreter(const InterpreterParts& parts)
    : parts_(parts),
      gate_(parts.sink),
      executor_({parts.config, parts.parameters, parts.tools, parts.kinematics, gate_,
                 [this](std::uint32_t column, std::string_view text) {
                   if (parts_.on_warning)
                     parts_.on_warning(
                         {fmt::format("{}:{}:{}: warning: {}", flow_.file_name(), flow_.line(), column, text),
                          flow_.line()});
                 },
                 parts.asks}),
      evaluator_(parts.parameters, executor_),
      flow_(parts.config, parts.parameters, evaluator_, executor_) {
  executor_.map_words(table_);
  for (const UserCode& user : parts_.config.user_m) table_.map_m(user.code, MGroup::kUser);
  for (const SwitchCode& code : parts_.config.switches) table_.map_m(code.m_code, MGroup::kUser);
}

void Interpreter::start(std::unique_ptr<ByteSource> source, const std::string& name,
                        const std::string& folder, const MachineWords& at) {
  flow_.load(std::move(source), name, folder);
  ended_ = block_done_ = came_round_ = false;
  pass_.reset();
  passes_ = 0;
  blocks_ = 0;
  changes_ = 0;
  held_lines_ = 0;
  find_measured();
  gouges_told_.clear();
  held_.clear();
  executor_.begin(at);
}

void Interpreter::open(const std::string& path, const MachineWords& at) {
  std::unique_ptr<ByteSource> source;
  try {
    source = parts_.config.open(path, false);
  } catch (const BlockError& error) {
    throw GcodeError(error.code, 0, 0,
                     fmt::format("{}; legal: {}", error.what(), gcode_error_info(error.code).legal));
  }
  start(std::move(source), path, std::filesystem::path(path).parent_path().string(), at);
}

void Interpreter::open_text(std::string text, std::string name, const MachineWords& at,
                            const Settings* kept) {
  start(text_source(std::move(text)), name, ".", at);
  if (kept) executor_.resume(*kept);
}

void Interpreter::begin_at(std::uint32_t line, const MachineWords& at) {
  pass_over([this, line] { return flow_.next_main_line() < line; }, line, at);
}

void Interpreter::begin_at_block(std::uint64_t block, std::uint32_t line, const MachineWords& at,
                                 const std::optional<EntryPlace>& on_move) {
  pass_over([this, block] { return blocks_ + 1 < block; }, line, at, on_move);
}

void Interpreter::pass_over(const std::function<bool()>& ahead, std::uint32_t line, const MachineWords& at,
                            const std::optional<EntryPlace>& on_move) {
  // Everything before the line is carried out, but nothing of it leaves: modes, offsets and parameters are
  // then what they would be.
  gate_.open = false;
  const int in_spindle = executor_.settings().current_tool;
  while (ahead() || !held_.empty()) {
    if (loops_long())
      throw GcodeError(GcodeErrorCode::kFromLine, line, 0,
                       fmt::format("{}:{}: a loop at line {} before it goes on, perhaps for ever; legal: {}",
                                   flow_.file_name(), line, flow_.line(),
                                   gcode_error_info(GcodeErrorCode::kFromLine).legal));
    if (!step())
      throw GcodeError(
          GcodeErrorCode::kFromLine, line, 0,
          fmt::format("{}:{}: the program ends before this line is reached; legal: {}", flow_.file_name(),
                      line, gcode_error_info(GcodeErrorCode::kFromLine).legal));
    // A tool change before the line counts as done. The tool that would be in the spindle by then is asked
    // for once, in `enter`.
    if (asks_for_tool()) executor_.answer({});
    if (waiting())
      throw GcodeError(GcodeErrorCode::kFromLine, line, 0,
                       fmt::format("{}:{}: line {} before it asks the machine (M66, G38), and what it would "
                                   "answer is not known; legal: {}",
                                   flow_.file_name(), line, flow_.line(),
                                   gcode_error_info(GcodeErrorCode::kFromLine).legal));
  }
  gate_.open = true;
  try {
    executor_.enter(at, in_spindle, on_move);
    if (executor_.tool_wait() == Executor::ToolWait::kNone)
      executor_.enter_rest();
    else
      hold_for_tool(true);
  } catch (const BlockError& error) {
    throw GcodeError(error.code, line, 0, fmt::format("{}:{}: {}", flow_.file_name(), line, error.what()));
  }
}

GcodeError Interpreter::located(const BlockError& error) {
  const std::string line = flow_.current_text();
  const std::string text = offending(line, error.column);
  // The daemon shows no more of a file than one G-code word, so that its messages cannot be used to read
  // other people's files.
  const std::string word = parts_.config.quote_lines ? text : leading_word(text);
  std::string message =
      fmt::format("{}:{}:{}: {}", flow_.file_name(), flow_.line(), error.column, error.what());
  if (!word.empty()) message += fmt::format(": '{}'", word);
  const std::string_view legal = gcode_error_info(error.code).legal;
  if (!legal.empty() && legal != "{}") message += fmt::format("; legal: {}", legal);
  for (const std::string& caller : flow_.stack()) message += "\n  " + caller;
  return GcodeError(error.code, flow_.line(), error.column, message);
}

void Interpreter::assign(const ParsedBlock& parsed) {
  values_.clear();  // index and value of each: none of them sees what the line assigns
  for (const Assignment& a : parsed.assignments) {
    const bool computed = a.target == Assignment::Target::kExpression;
    values_.push_back(computed ? evaluator_.run(parsed.code, a.index) : a.index);
    values_.push_back(evaluator_.run(parsed.code, a.value));
  }
  for (std::size_t i = 0; i < parsed.assignments.size(); ++i) {
    const Assignment& a = parsed.assignments[i];
    const double value = values_[2 * i + 1];
    int number = a.index;
    switch (a.target) {
      case Assignment::Target::kLocal:
        parts_.parameters.set_local(a.index, value);
        continue;
      case Assignment::Target::kGlobal:
        parts_.parameters.set_global(a.index, value);
        continue;
      case Assignment::Target::kReadOnly:
        fail(GcodeErrorCode::kReadOnlyParameter, a.column,
             fmt::format("#<{}>", predefined_names()[static_cast<std::size_t>(a.index)]));
      case Assignment::Target::kExpression:
        number = Evaluator::parameter_number(values_[2 * i], a.column);
        break;
      default:
        break;
    }
    if (Parameters::is_read_only(number))
      fail(GcodeErrorCode::kReadOnlyParameter, a.column, fmt::format("#{}", number));
    parts_.parameters[number] = value;
  }
}

// A line that ends the program ends it even if something else of it is wrong.
bool Interpreter::carry_out(bool rest) {
  try {
    return rest ? executor_.execute_rest(block_) : executor_.execute(block_);
  } catch (const BlockError&) {
    executor_.pass_over(block_);
    const int stop = block_.code(MGroup::kStop);
    ended_ = stop == 2 || stop == 30;
    throw;
  }
}

// Gouges are known when their contour has ended; the blocks have been carried out.
void Interpreter::tell_gouges() {
  for (const GcodeReport& gouge : executor_.take_gouges()) {
    const bool refused = gouge.is_error && parts_.config.gouge_check == GougeCheckMode::kError;
    std::string text = fmt::format("{}:{}:{}: {}{}", flow_.file_name(gouge.place.file), gouge.place.line,
                                   gouge.place.column, refused ? "" : "warning: ", gouge.sentence);
    if (refused) text += fmt::format("; legal: {}", gcode_error_info(GcodeErrorCode::kCompGouge).legal);
    if (std::find(gouges_told_.begin(), gouges_told_.end(), text) != gouges_told_.end()) continue;
    if (gouges_told_.size() < kGougesTold) gouges_told_.push_back(text);
    if (refused) throw GcodeError(GcodeErrorCode::kCompGouge, gouge.place.line, gouge.place.column, text);
    if (parts_.on_warning) parts_.on_warning({text, gouge.place.line});
  }
}

void Interpreter::run_block(const ParsedBlock& parsed) {
  executor_.at_line(flow_.line(), flow_.file_number());
  text_ = parsed.text;
  evaluate_block(parsed, evaluator_, table_, block_);
  // Before the words are looked at: a code that the config ignores must not make its words unused.
  executor_.drop_ignored(block_);
  halve_diameter(executor_.settings().modal.diameter, block_);
  block_.line = flow_.line();
  // Behind the values of the words: "#1 = 5 X#1" goes to the old #1 (RS274/NGC).
  if (!parsed.assignments.empty()) assign(parsed);
  const bool program_ends = carry_out(false);
  if (executor_.tool_wait() == Executor::ToolWait::kNone)
    end_block(program_ends);
  else
    hold_for_tool(false);
}

void Interpreter::end_block(bool program_ends) {
  if (program_ends) {
    ended_ = true;
    flow_.check_closed();
  }
  const int sub = block_.code(MGroup::kSub);
  if (sub == 98)
    flow_.call_numbered(block_);
  else if (sub == 99 && flow_.return_numbered(block_) && parts_.ends_round)
    begin_pass();
  else if (block_.any_m && block_.has(MGroup::kUser))
    flow_.call_user(block_);
}

// What is kept is that of the pass 1, 2, 4, 8 and so on, so that a round of any number of passes is found
// (Brent 1980) and a program that counts its passes is not copied at each.
void Interpreter::begin_pass() {
  const bool whole = executor_.between_features() && executor_.questions() == 0;
  if (whole && pass_ && pass_->settings == executor_.settings() &&
      pass_->parameters.same_values(parts_.parameters) && pass_->tools == parts_.tools.tools()) {
    executor_.warn(
        block_.at(MGroup::kSub),
        "a pass begins here just as an earlier one did, so that the program goes round for ever; it is "
        "followed up to here");
    executor_.end_program();
    ended_ = came_round_ = true;
    return;
  }
  ++passes_;
  if (whole && (passes_ & (passes_ - 1)) == 0)
    pass_ =
        std::make_unique<PassStart>(PassStart{executor_.settings(), parts_.parameters, parts_.tools.tools()});
}

// The flow fetches no further line before the rest has been carried out.
void Interpreter::hold_for_tool(bool entry) {
  Held held;
  held.entry = entry;
  if (!entry) held.block = block_;
  if (!entry) held.parsed = *block_.parsed;
  held.called = executor_.tool_wait() == Executor::ToolWait::kCall;
  held.tool = executor_.incoming_tool();
  held.depth = flow_.depth();
  held_.push_back(std::move(held));
  if (held_.back().called) flow_.call_between(parts_.config.tool_call, executor_.tool_call_arguments());
}

void Interpreter::run_rest() {
  rest_ = std::move(held_.back());
  held_.pop_back();
  if (rest_.called) executor_.end_tool_call(rest_.tool);
  if (rest_.entry) return executor_.enter_rest();
  block_ = rest_.block;
  block_.parsed = &rest_.parsed;
  end_block(carry_out(true));
}

// As the operator did while the program ran before.
void Interpreter::switch_block_delete() {
  const std::vector<BlockDeleteChange>& changes = parts_.config.block_delete_changes;
  for (; changes_ < changes.size() && changes[changes_].after_block <= blocks_; ++changes_)
    executor_.set_block_delete(changes[changes_].on);
}

// Before the first line; what the program has read ahead of the place where it was given up does not count.
void Interpreter::find_measured() {
  new_tool_in_ = false;
  kept_numbers_.clear();
  kept_tools_.clear();
  const MeasuredValues& measured = parts_.config.measured;
  for (const auto& [number, row] : measured.tools)
    if (!row.tool)
      parts_.tools.remove(number);
    else if (const Tool* const now = parts_.tools.find(number); !now || *now != *row.tool)
      parts_.tools.at_or_new(number) = *row.tool;
  for (const auto& [number, set] : measured.numbers)
    if (number != parameter::kTool)
      parts_.parameters[number] = set.value;
    else
      set_spindle_tool(parts_.parameters, parts_.tools, static_cast<int>(set.value),
                       parts_.config.parameter_unit_mm);
}

// Behind a block that may have set it otherwise. A tool that the operator is asked for is the newer one.
void Interpreter::keep_measured() {
  const MeasuredValues& measured = parts_.config.measured;
  new_tool_in_ |=
      gate_.open && block_.any_m && block_.has(MGroup::kToolChange) && block_.code(MGroup::kToolChange) == 6;
  MeasuredValues lost;
  for (const auto& [number, row] : measured.tools) {
    const Tool* const now = parts_.tools.find(number);
    if (!row.tool || blocks_ > row.until_block || (now && *now == *row.tool)) continue;
    lost.tools[number] = row;
    kept_tools_[number] = flow_.line();
  }
  for (const auto& [number, set] : measured.numbers) {
    if (blocks_ > set.until_block || std::as_const(parts_.parameters)[number] == set.value) continue;
    if (number == parameter::kTool && new_tool_in_) continue;
    lost.numbers[number] = set;
    kept_numbers_[number] = flow_.line();
  }
  if (!lost.empty()) executor_.set_measured(lost);
}

void Interpreter::obey_held_lines() {
  const std::vector<HeldLines>& lines = parts_.config.held_lines;
  for (; held_lines_ < lines.size() && lines[held_lines_].after_block <= blocks_; ++held_lines_) {
    obey_held(lines[held_lines_], [] {});
    if (parts_.held_obeyed) parts_.held_obeyed();
  }
}

void Interpreter::obey_held(const HeldLines& lines, const std::function<void()>& keep) {
  const Parameters parameters = parts_.parameters;
  const ToolTable tools = parts_.tools;
  const Settings settings = executor_.settings();
  ProgramWords stands;
  for (int i = 0; i < 6; ++i) stands[i] = lines.stands[static_cast<std::size_t>(i)];
  try {
    std::istringstream text(lines.text);
    for (std::string line; std::getline(text, line);) obey_held_line(line, stands);
    keep();
  } catch (const ProgramError&) {
    parts_.parameters = parameters;
    parts_.tools = tools;
    executor_.put_back(settings);
    throw;
  }
}

void Interpreter::obey_held_line(std::string_view line, const ProgramWords& stands) {
  NameTable names, labels;
  ParsedBlock parsed;
  Block block;
  try {
    if (line.substr(0, line.find('(')).find_first_of("#[<") != std::string_view::npos)
      fail(GcodeErrorCode::kNotSupported, 1, "an expression", "plain numbers while a program waits");
    Parser(names, labels, parts_.config.words).parse(line, parsed);
    evaluate_block(parsed, evaluator_, table_, block);
    halve_diameter(executor_.settings().modal.diameter, block);
    executor_.obey_held(block, stands);
  } catch (const BlockError& error) {
    throw GcodeError(error.code, flow_.line(), error.column, fmt::format("'{}': {}", line, error.what()));
  }
}

bool Interpreter::step() {
  if (ended_) return false;
  switch_block_delete();
  obey_held_lines();
  block_done_ = false;
  try {
    if (!held_.empty() && flow_.depth() == held_.back().depth) {
      run_rest();
    } else if (const ParsedBlock* parsed = flow_.next()) {
      ++blocks_;
      run_block(*parsed);
    } else {
      ended_ = true;
    }
  } catch (const BlockError& error) {
    throw located(error);
  }
  if (!parts_.config.measured.empty()) keep_measured();
  block_done_ = true;
  tell_gouges();
  return !ended_;
}

// A move of an earlier line (cutter compensation holds moves back) has lost its columns.
std::string Interpreter::place_of(std::uint32_t line, char letter) const {
  std::uint32_t column = 1;
  if (block_.parsed && line == block_.line) {
    column = block_.motion_column();
    for (const char word : std::string_view(kWordLetters))
      if (block_.has(word) && (column == block_.motion_column() || block_.at(word) < column))
        column = block_.at(word);
    if (letter != 0 && block_.has(letter)) column = block_.at(letter);
  }
  return fmt::format("{}:{}:{}", flow_.file_name(), line, column);
}

bool Interpreter::recover() {
  if (ended_ || block_done_) return !ended_;
  held_.clear();
  executor_.forget_tool_change();
  return flow_.recover();
}

}  // namespace trn
