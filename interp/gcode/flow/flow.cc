#include "interp/gcode/flow/flow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.h"
#include "interp/gcode/error.h"
#include "interp/gcode/text/foreign_words.h"

namespace trn {

Flow::Flow(const ProgramConfig& config, Parameters& parameters, Evaluator& evaluator, Executor& executor)
    : config_(config),
      parameters_(parameters),
      evaluator_(evaluator),
      executor_(executor),
      parser_(parameters.names(), labels_, config.words) {}

void Flow::load(std::unique_ptr<ByteSource> source, std::string name, std::string folder) {
  TRN_CHECK(source != nullptr);
  auto made = std::make_unique<File>();
  made->name = std::move(name);
  made->folder = std::move(folder);
  made->reader = std::make_unique<LineReader>(std::move(source), config_.line_length_max);
  files_.clear();
  files_.push_back(std::move(made));
  store_.clear();
  kept_at_.clear();
  loops_.clear();
  frames_.clear();
  ifs_.clear();
  current_ = next_ = {};
  current_node_ = next_node_ = -1;
  reader_there_ = true;
  ended_ = told_again_ = between_over_ = false;
}

const ParsedBlock* Flow::next() {
  // A loop without any move, such as "o1 while [1]" around nothing, must not hang the planner: after so many
  // O-words in a row an empty block is handed out, and the caller may stop.
  for (int words = 0; !ended_;) {
    const ParsedBlock* block = fetch();
    ++lines_run_;
    if (!block) {
      at_file_end();
      continue;
    }
    if (block->block_delete && executor_.block_delete()) continue;
    if (block->percent) {
      if (percent()) return nullptr;
      continue;
    }
    if (!block->is_flow()) return block;
    obey(*block);
    if (std::exchange(between_over_, false)) return &nothing_;
    if (++words == kMaxWordsAtOnce) return &nothing_;
  }
  return nullptr;
}

// True at the closing one. A file is framed by two of them, or has none.
bool Flow::percent() {
  File& f = file();
  if (!f.percent_seen) {
    if (f.began) fail(GcodeErrorCode::kLatePercent, 1);
    f.percent_seen = true;
    return false;
  }
  if (!frames_.empty()) {
    at_file_end();
    return false;
  }
  refuse_open();
  ended_ = true;
  executor_.end_program();
  return true;
}

// Told once: whoever goes on in spite of it comes to the end.
void Flow::refuse_open() {
  if (!loops_.empty()) {
    const Loop loop = loops_.back();
    loops_.clear();
    fail(GcodeErrorCode::kFlowNoEnd, 1, "end of the loop", "o" + labels_.name(loop.label), loop.line);
  }
  if (!ifs_.empty()) {
    const Branch branch = ifs_.back();
    ifs_.clear();
    fail(GcodeErrorCode::kFlowNoEnd, 1, "endif", "o" + labels_.name(branch.label), branch.line);
  }
}

void Flow::at_file_end() {
  if (!frames_.empty()) {
    const Frame& frame = frames_.back();
    // A sub-program of M98 in a file of its own may end with its file, as on other controls.
    if (frame.numbered && current_.file != 0) return leave(nullptr);
    // The line behind the word that begins it is kept; a file without one begins with its first line.
    const std::uint32_t line = std::max(frame.start.at.line, 2U) - 1;
    fail(GcodeErrorCode::kFlowNoEnd, 1, frame.numbered ? "M99" : "endsub",
         (frame.numbered ? "O" : "o") + labels_.name(frame.label), line);
  }
  refuse_open();
  ended_ = true;
  const bool empty = config_.end == ProgramEnd::kExpected && !file().any;
  if (config_.end == ProgramEnd::kRequired || empty) fail(GcodeErrorCode::kNoProgramEnd, 1);
  // A file that was cut off on its way here looks just like this.
  if (config_.end == ProgramEnd::kExpected)
    executor_.warn(1, fmt::format("{}; it ends here, perhaps cut off ([program] end_required)",
                                  gcode_error_info(GcodeErrorCode::kNoProgramEnd).sentence));
  executor_.end_program();
}

// The program's place and its open loops and branches are forgotten; modes, offsets and parameters stay.
void Flow::begin_again() {
  File& main = *files_[0];
  main.percent_seen = main.any = main.began = main.number_seen = false;
  loops_.clear();
  ifs_.clear();
  go(CodePlace{});
}

bool Flow::read_line(std::string_view& line) {
  TRN_CHECK(next_.file >= 0 && static_cast<std::size_t>(next_.file) < files_.size());
  File& f = *files_[static_cast<std::size_t>(next_.file)];
  if (!reader_there_) {
    if (!f.reader->seek(next_.at)) fail(GcodeErrorCode::kNotSeekable, 1, "a loop or a sub-program");
    reader_there_ = true;
  }
  current_ = {next_.file, f.reader->place()};
  current_node_ = -1;
  f.began = f.began || f.any;
  bool more = false;
  try {
    more = f.reader->next(line);
  } catch (...) {
    // The line behind the one that cannot be read: whoever goes on in spite of the error does not meet it
    // again.
    next_.at = f.reader->place();
    throw;
  }
  next_.at = f.reader->place();
  f.any = f.any || line.find_first_not_of(" \t") != std::string_view::npos;
  return more;
}

void Flow::parse(std::string_view line) {
  parser_.parse(line, scratch_);
  if (scratch_.code.empty()) return;
  const ForeignParameter foreign = foreign_parameter(scratch_);
  const auto told = std::find(told_parameters_.begin(), told_parameters_.end(), foreign.warning);
  // Once for each kind, however often the program has it.
  if (foreign.warning.empty() || told != told_parameters_.end()) return;
  told_parameters_.push_back(foreign.warning);
  executor_.warn(foreign.column, foreign.warning);
}

// Inside loops and sub-programs blocks come out of the store, elsewhere each line is parsed into the one
// scratch block.
const ParsedBlock* Flow::fetch() { return keeping() ? fetch_kept() : fetch_scratch(); }

const ParsedBlock* Flow::fetch_scratch() {
  std::string_view line;
  next_node_ = -1;
  if (!read_line(line)) return nullptr;
  parse(line);
  return &scratch_;
}

// The block at next_, from the store or parsed into it. Where the block before is kept too, its link `next`
// is set, so that the next pass needs neither the reader nor a look-up by place.
const ParsedBlock* Flow::fetch_kept() {
  std::int32_t node = next_node_;
  const std::int32_t before = current_node_;
  const std::uint64_t key = key_of(next_);
  if (node < 0) {
    const auto found = kept_at_.find(key);
    if (found != kept_at_.end()) node = found->second;
  }
  if (node < 0) {
    drop_store_if_full();
    std::string_view line;
    const CodePlace place = next_;
    if (!read_line(line)) return nullptr;
    parse(line);
    node = static_cast<std::int32_t>(store_.size());
    store_.push_back(Node{scratch_, place, next_, -1, -1, -1});
    kept_at_.emplace(key, node);
  } else {
    reader_there_ = false;
  }
  TRN_CHECK(node >= 0 && static_cast<std::size_t>(node) < store_.size());
  Node& kept = store_[static_cast<std::size_t>(node)];
  if (before >= 0 && static_cast<std::size_t>(before) < store_.size()) {
    Node& previous = store_[static_cast<std::size_t>(before)];
    if (previous.next < 0 && previous.after.file == kept.place.file &&
        previous.after.at.offset == kept.place.at.offset)
      previous.next = node;
  }
  current_ = kept.place;
  current_node_ = node;
  next_ = kept.after;
  next_node_ = kept.next;
  return &kept.block;
}

// Nodes are named by their number in the store, so every number kept elsewhere is forgotten with it.
void Flow::drop_store_if_full() {
  if (store_.size() < kMaxKept) return;
  store_.clear();
  kept_at_.clear();
  current_node_ = next_node_ = -1;
  for (Loop& loop : loops_) loop.start_node = -1;
  for (Frame& frame : frames_) frame.back_node = -1;
}

void Flow::go(const CodePlace& place, std::int32_t node) {
  TRN_CHECK(place.file >= 0 && static_cast<std::size_t>(place.file) < files_.size());
  TRN_CHECK(node < static_cast<std::int32_t>(store_.size()));
  next_ = place;
  next_node_ = node;
  reader_there_ = false;
}

std::int32_t Flow::label_of(const ParsedBlock& block) {
  if (block.flow.label >= 0) return block.flow.label;
  const double value = evaluator_.run(block.code, block.flow.label_expression);
  if (value < 0 || std::fabs(value - std::round(value)) > 1e-4)
    fail(GcodeErrorCode::kNotInteger, block.flow.column, "the label", value);
  return labels_.intern(fmt::format("{:.0f}", value));
}

// Of a line that is passed over. A computed label whose parameters have no value there is nobody's: -1.
std::int32_t Flow::label_passed(const ParsedBlock& block) {
  try {
    return label_of(block);
  } catch (const BlockError&) {
    return -1;
  }
}

double Flow::argument(const ParsedBlock& block, std::size_t index) const {
  TRN_CHECK(index < block.flow.arguments.size());
  return evaluator_.run(block.code, block.flow.arguments[index]);
}

void Flow::obey(const ParsedBlock& block) {
  const std::int32_t label = label_of(block);
  switch (block.flow.kind) {
    case FlowKind::kSub:
      return skip_definition(label);
    case FlowKind::kEndSub:
    case FlowKind::kReturn:
      if (frames_.empty()) {
        if (block.flow.kind == FlowKind::kReturn)
          fail(GcodeErrorCode::kFlowUnmatched, block.flow.column, "return", "call");
        fail(GcodeErrorCode::kFlowUnmatched, block.flow.column, "endsub", "sub");
      }
      return leave(&block);
    case FlowKind::kCall:
      return call(block, label);
    case FlowKind::kWhile:
      return obey_while(block, label);
    case FlowKind::kDo:
      loops_.push_back({FlowKind::kDo, label, next_, -1, 0, ifs_.size(), line()});
      return;
    case FlowKind::kRepeat:
      return obey_repeat(block, label);
    case FlowKind::kEndWhile:
      return end_loop(FlowKind::kWhile, label);
    case FlowKind::kEndRepeat:
      return end_loop(FlowKind::kRepeat, label);
    case FlowKind::kIf:
      return obey_if(block, label);
    case FlowKind::kElseIf:
    case FlowKind::kElse:
      // Reached by running on, so the branch before it has run. The rest is passed over.
      close_if(label, block.flow.kind == FlowKind::kElse ? "else" : "elseif");
      skip_to(label, {FlowKind::kEndIf});
      return;
    case FlowKind::kEndIf:
      return close_if(label, "endif");
    case FlowKind::kBreak:
      return break_loop(label, false);
    case FlowKind::kContinue:
      return break_loop(label, true);
    default:
      return program_number(block);
  }
}

// O1234 alone gives the program its number, once. Another one is where the next program of the file begins:
// running on into it would carry out a sub-program that nobody has called.
void Flow::program_number(const ParsedBlock& block) {
  if (!frames_.empty()) {
    const Frame& frame = frames_.back();
    const bool found_by_file = current_.file != 0 && frame.start.at.offset == 0;  // whatever number it has
    if (frame.numbered && !found_by_file) fail(GcodeErrorCode::kNextProgram, block.flow.column);
    return;
  }
  if (file().number_seen) fail(GcodeErrorCode::kNextProgram, block.flow.column);
  file().number_seen = true;
}

bool Flow::in_loop(FlowKind kind, std::int32_t label) const {
  const std::size_t outside = frames_.empty() ? 0 : frames_.back().loops;
  return loops_.size() > outside && loops_.back().kind == kind && loops_.back().label == label;
}

// `while` stands at the head of a while loop and at the end of a do loop; the innermost open loop of the
// label says which.
void Flow::obey_while(const ParsedBlock& block, std::int32_t label) {
  const bool again = condition(block);
  if (in_loop(FlowKind::kDo, label)) {  // the end of a do loop
    if (again)
      go(loops_.back().start, loops_.back().start_node);
    else
      loops_.pop_back();
    return;
  }
  if (again) {
    if (!in_loop(FlowKind::kWhile, label))
      loops_.push_back({FlowKind::kWhile, label, current_, current_node_, 0, ifs_.size(), line()});
    return;
  }
  // A condition that is false at once never opened the loop, and there is none to close.
  const bool was_inside = in_loop(FlowKind::kWhile, label);
  skip_to(label, {FlowKind::kEndWhile});
  if (was_inside) loops_.pop_back();
}

void Flow::obey_repeat(const ParsedBlock& block, std::int32_t label) {
  const double count = std::nearbyint(argument(block, 0));
  if (count < 1) {
    skip_to(label, {FlowKind::kEndRepeat});
    return;
  }
  loops_.push_back({FlowKind::kRepeat, label, next_, -1, static_cast<std::int64_t>(std::min(count, 1e15)),
                    ifs_.size(), line()});
}

void Flow::end_loop(FlowKind kind, std::int32_t label) {
  if (!in_loop(kind, label)) {
    const bool is_while = kind == FlowKind::kWhile;
    fail(GcodeErrorCode::kFlowUnmatched, 1, is_while ? "endwhile" : "endrepeat",
         is_while ? "while" : "repeat");
  }
  Loop& loop = loops_.back();
  if (kind == FlowKind::kRepeat && --loop.left == 0) {
    loops_.pop_back();
    return;
  }
  TRN_CHECK(kind != FlowKind::kRepeat || loop.left > 0);
  // the next pass finds its first block by the node once it is kept
  if (loop.start_node < 0) {
    const auto found = kept_at_.find(key_of(loop.start));
    if (found != kept_at_.end()) loop.start_node = found->second;
  }
  go(loop.start, loop.start_node);
}

// Inner loops and open branches are left with the loop that the label names. `again`: continue, which goes to
// the condition of a while loop, and to the closing word of a do or repeat loop.
void Flow::break_loop(std::int32_t label, bool again) {
  const std::size_t outside = frames_.empty() ? 0 : frames_.back().loops;
  while (loops_.size() > outside && loops_.back().label != label) loops_.pop_back();
  if (loops_.size() == outside)
    fail(GcodeErrorCode::kFlowUnmatched, 1, again ? "continue" : "break", "a loop of that label");
  TRN_CHECK(loops_.back().ifs <= ifs_.size());
  ifs_.resize(loops_.back().ifs);
  const FlowKind kind = loops_.back().kind;
  const FlowKind end = kind == FlowKind::kWhile ? FlowKind::kEndWhile
                       : kind == FlowKind::kDo  ? FlowKind::kWhile
                                                : FlowKind::kEndRepeat;
  if (again && kind == FlowKind::kWhile) return go(loops_.back().start, loops_.back().start_node);
  skip_to(label, {end});
  if (!again) {
    loops_.pop_back();
    return;
  }
  go(current_, -1);  // obey the loop's end itself
}

void Flow::close_if(std::int32_t label, std::string_view word) {
  const std::size_t outside =
      std::max(frames_.empty() ? 0 : frames_.back().ifs, loops_.empty() ? 0 : loops_.back().ifs);
  if (ifs_.size() <= outside || ifs_.back().label != label)
    fail(GcodeErrorCode::kFlowUnmatched, 1, word, "if");
  ifs_.pop_back();
}

// A false condition looks from branch to branch for the first one to run; `elseif` reached by running on
// means that an earlier branch has run, and goes to `endif` (Flow::obey).
void Flow::obey_if(const ParsedBlock& block, std::int32_t label) {
  const std::uint32_t from_line = line();
  if (condition(block)) return ifs_.push_back({label, from_line});
  for (;;) {
    const FlowKind found = skip_to(label, {FlowKind::kElseIf, FlowKind::kElse, FlowKind::kEndIf});
    if (found == FlowKind::kEndIf) return;
    if (found == FlowKind::kElse || condition(skipped_)) return ifs_.push_back({label, from_line});
  }
}

// A definition is passed over where it stands; its place is kept for the calls.
void Flow::skip_definition(std::int32_t label) {
  const auto [at, fresh] = file().subs.emplace(label, next_.at);
  if (!fresh && at->second.line != next_.at.line)
    fail(GcodeErrorCode::kSubRepeated, 1, "o" + labels_.name(label), at->second.line - 1);
  skip_to(label, {FlowKind::kEndSub});
}

// Reads on to the O-word of this label and one of these kinds. It is left in skipped_, and the line after it
// comes next. Once the way has been gone, the block it began at has it as a jump, so that later passes go
// there at once: `jump` to the next branch, `jump_end` to the end, which is all that is wanted where `wanted`
// has one kind.
FlowKind Flow::skip_to(std::int32_t label, std::initializer_list<FlowKind> wanted) {
  TRN_CHECK(wanted.size() > 0);
  const std::uint32_t from_line = current_.at.line;
  const auto name = [](FlowKind kind) {
    switch (kind) {
      case FlowKind::kEndWhile:
        return "endwhile";
      case FlowKind::kEndRepeat:
        return "endrepeat";
      case FlowKind::kEndSub:
        return "endsub";
      case FlowKind::kWhile:
        return "while";
      default:
        return "endif";
    }
  };
  std::int32_t from_node = current_node_;
  const bool to_end = wanted.size() == 1;
  if (from_node >= 0) {
    const std::int32_t jump = store_[static_cast<std::size_t>(from_node)].jump_to(to_end);
    if (jump >= 0) {
      TRN_CHECK(static_cast<std::size_t>(jump) < store_.size());
      const Node& kept = store_[static_cast<std::size_t>(jump)];
      skipped_ = kept.block;
      current_ = kept.place;
      current_node_ = jump;
      go(kept.after, kept.next);
      return kept.block.flow.kind;
    }
  }
  for (;;) {
    const ParsedBlock* block = skip_fetch();
    if (!block)
      fail(GcodeErrorCode::kFlowNoEnd, 1, name(*(wanted.end() - 1)), "o" + labels_.name(label), from_line);
    if (!block->is_flow()) continue;
    if (block->flow.kind == FlowKind::kSub && *wanted.begin() == FlowKind::kEndSub)
      fail(GcodeErrorCode::kFlowSyntax, block->flow.column, "sub inside a sub",
           "one definition after another");
    if (std::find(wanted.begin(), wanted.end(), block->flow.kind) == wanted.end()) continue;
    if (label_passed(*block) != label) continue;
    for (const FlowKind kind : wanted) {
      if (block->flow.kind != kind) continue;
      if (keeping() && current_node_ < 0) {  // keep it, so that the way here is remembered
        go(current_);
        block = fetch_kept();
      }
      if (block != &skipped_) skipped_ = *block;
      remember_jump(from_node, to_end);
      return kind;
    }
  }
}

// From one kept block to the present one. A computed label may be another one at the next pass.
void Flow::remember_jump(std::int32_t from_node, bool to_end) {
  if (from_node < 0 || current_node_ < 0 || static_cast<std::size_t>(from_node) >= store_.size()) return;
  Node& from = store_[static_cast<std::size_t>(from_node)];
  if (from.block.flow.label < 0 || skipped_.flow.label < 0) return;
  from.jump_to(to_end) = current_node_;
}

// Like fetch, but a line that is not kept yet is only searched for an O-word.
const ParsedBlock* Flow::skip_fetch() {
  if (keeping()) {
    const bool is_kept = next_node_ >= 0 || kept_at_.count(key_of(next_)) > 0;
    if (is_kept) return fetch_kept();
  }
  std::string_view line;
  next_node_ = -1;
  if (!read_line(line)) return nullptr;
  parser_.parse_flow_only(line, skipped_);
  return &skipped_;
}

void Flow::check_closed() {
  if (!frames_.empty()) return;
  ParsedBlock block;
  std::string_view line;
  std::vector<std::int32_t> closed;
  const CodePlace end = current_;
  try {
    while (!(loops_.empty() && ifs_.empty()) && read_line(line)) {
      parser_.parse_flow_only(line, block);
      const bool closes = block.flow.kind == FlowKind::kEndWhile || block.flow.kind == FlowKind::kEndRepeat ||
                          block.flow.kind == FlowKind::kEndIf || block.flow.kind == FlowKind::kWhile;
      if (closes) closed.push_back(label_passed(block));
    }
  } catch (const BlockError&) {  // what is behind the end is nobody's program
  }
  current_ = end;
  const auto open = [&](std::int32_t label) {
    return std::find(closed.begin(), closed.end(), label) == closed.end();
  };
  for (const Loop& loop : loops_)
    if (open(loop.label))
      fail(GcodeErrorCode::kFlowNoEnd, 1, "end of the loop", "o" + labels_.name(loop.label), loop.line);
  for (const Branch& branch : ifs_)
    if (open(branch.label))
      fail(GcodeErrorCode::kFlowNoEnd, 1, "endif", "o" + labels_.name(branch.label), branch.line);
}

bool Flow::recover() {
  if (ended_) return false;
  loops_.clear();
  ifs_.clear();
  if (frames_.empty()) return true;
  // Sub-programs are left from the inside outwards, each with what it has to restore, and the check goes on
  // behind the outermost call.
  const Frame outermost = frames_.front();
  while (!frames_.empty()) {
    executor_.on_return(static_cast<int>(frames_.size()));
    if (!frames_.back().numbered) parameters_.pop_frame();
    frames_.pop_back();
  }
  executor_.set_call_level(0);
  go(outermost.back, -1);
  return true;
}

std::string Flow::current_text() {
  File& f = file();
  const LinePlace after = f.reader->place();
  std::string text;
  std::string_view line;
  try {
    if (f.reader->seek(current_.at) && f.reader->next(line)) text = std::string(line);
  } catch (const BlockError&) {  // the line itself is what cannot be read
  }
  f.reader->seek(after);
  return text;
}

std::vector<std::string> Flow::stack() const {
  constexpr std::size_t kToldMax = 3;  // a recursion has the same one as often as it is deep
  std::vector<std::string> lines;
  for (auto frame = frames_.rbegin(); frame != frames_.rend() && lines.size() < kToldMax; ++frame)
    lines.push_back(fmt::format("o{} called from {}:{}", labels_.name(frame->label),
                                files_[static_cast<std::size_t>(frame->called_file)]->name,
                                frame->called_line));
  const std::size_t more = frames_.size() - lines.size();
  if (more > 0) lines.push_back(fmt::format("... and {} more call{}", more, more == 1 ? "" : "s"));
  return lines;
}

}  // namespace trn
