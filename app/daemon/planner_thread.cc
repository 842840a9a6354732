#include "app/daemon/planner_thread.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include "app/session/place_record.h"
#include "core/safe_file.h"
#include "interp/gcode/canon.h"
#include "interp/move.h"

namespace trn {

namespace {

constexpr int kMessagesMax = 1000;  // of one program
constexpr std::size_t kPlannerMessageBytesMax = 500;
constexpr std::size_t kLogsBeforeStartMax = 10000;

void doze() { std::this_thread::sleep_for(std::chrono::milliseconds(1)); }

}  // namespace

PlannerListeners planner_listeners(SessionLog* log, FeatureRecorder* features) {
  PlannerListeners out;
  out.starts = [log, features](const ProgramStart& start) {
    if (log) log->program(start);
    if (features) features->begin();
  };
  if (log) out.taken_back = [log](std::uint64_t block) { log->taken_back(block); };
  if (features) out.move = [features](const ProgramMove& move) { features->programmed(move); };
  return out;
}

PlannerThread::PlannerThread(const Assembly& assembly, MotionQueue& queue, Parameters parameters,
                             ToolTable tools, PlannerListeners listeners, MemoryFiles files)
    : PlannerThread(assembly, queue, std::move(parameters), std::move(tools), std::move(listeners),
                    std::move(files), {own_abandoned_, own_closed_, own_optional_stop_}) {}

PlannerThread::PlannerThread(const Assembly& assembly, MotionQueue& queue, Parameters parameters,
                             ToolTable tools, PlannerListeners listeners, MemoryFiles files,
                             PlannerFlags flags)
    : assembly_(assembly),
      queue_(queue),
      parameters_(std::move(parameters)),
      tools_(std::move(tools)),
      memory_(parameters_, tools_, files),
      journal_(parameters_, tools_),
      listeners_(std::move(listeners)),
      program_log_(files.logs, [this](const std::string& text) { say(text, 0); }),
      abandoned_(flags.abandoned),
      closed_(flags.closed),
      optional_stop_(flags.optional_stop),
      files_(abandoned_, assembly.program.words),
      switches_(ProgramSwitches::of(assembly)),
      time_pass_(assembly) {}

PlannerThread::~PlannerThread() {
  close();
  try {
    settle();
  } catch (const FileError&) {  // who wants to know has called `settle`
  }
}

void PlannerThread::join() {
  if (thread_.joinable()) thread_.join();
}

void PlannerThread::settle() {
  end_reading();
  memory_.keep(true);
}

// Whatever is read is given up; nothing is read from then on.
void PlannerThread::end_reading() {
  abandoned_ = true;
  time_pass_.end();
  join();
  forget_unstarted();
  parameters_.leave_sub_programs();
}

// The lines of a program that never moved have set nothing.
void PlannerThread::forget_unstarted() {
  logs_before_start_.clear();
  if (started_.exchange(true)) return;
  journal_.take_back();
  kept_ = true;
}

// A typed line has told already what it has set.
void PlannerThread::gave_up_at(std::uint64_t block) {
  const bool moved = started_;
  end_reading();
  if (moved) {
    if (listeners_.taken_back) listeners_.taken_back(block);
    const Parameters ahead = parameters_;
    const ToolTable tools_ahead = tools_;
    journal_.take_back_to(block);
    if (start_.text) tell_measured(ahead, tools_ahead, 0);
    memory_.keep(true);
  }
  show_idle();
}

void PlannerThread::starts() {
  bool read_to_its_end = false;
  {
    const std::lock_guard lock(mutex_);
    if (started_.exchange(true)) return;
    read_to_its_end = ended_;
  }
  if (read_to_its_end) {
    join();
    keep_started();
    return show_idle();
  }
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (!kept_ && !ended_ && !abandoned_ && std::chrono::steady_clock::now() < end) doze();
  if (const std::string failure = take_failure(); !failure.empty()) throw FileError(failure);
}

// In the planner's thread, or behind its end.
void PlannerThread::keep_started() {
  if (!started_ || kept_) return;
  try {
    for (const auto& [log, line] : std::exchange(logs_before_start_, {})) program_log_.take(log, line);
    memory_.keep(true);
  } catch (...) {
    kept_ = true;
    throw;
  }
  kept_ = true;
}

void PlannerThread::take_log(const canon::Log& log, std::uint32_t line) {
  while (!started_ && logs_before_start_.size() >= kLogsBeforeStartMax && !abandoned_) doze();
  keep_started();
  if (kept_)  // and not `started_`, which another thread may set at any moment: what came before goes first
    program_log_.take(log, line);
  else
    logs_before_start_.emplace_back(log, line);
}

// Nobody who waits for what is shown may be kept waiting by the lock.
void PlannerThread::end_thread() {
  show_idle();
  bool started_since = false;
  {
    const std::lock_guard lock(mutex_);
    started_since = started_ && !kept_;
    try {
      keep_started();
    } catch (const std::exception& error) {
      failure_ = error.what();
    }
    ended_ = true;
  }
  if (started_since) show_idle();
}

// The planner waits for the answer, and touches nothing meanwhile.
void PlannerThread::confirm_tool(int number) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  started_ = true;  // else nobody would stand at its tool
  while (!(waits_ && kept_) && !abandoned_ && std::chrono::steady_clock::now() < end) doze();
  if (abandoned_ || !waits_ || !kept_) throw std::runtime_error("no program waits for a tool any more");
  set_spindle_tool(parameters_, tools_, number, assembly_.program.parameter_unit_mm);
  journal_.adopt();
  memory_.keep(true);
}

std::string PlannerThread::load(const std::string& path, const JointVec& q) {
  return remark_on(begin({path, std::nullopt, q}));
}

std::string PlannerThread::load_from(const std::string& path, const JointVec& q, std::uint32_t line) {
  ProgramStart start{path, std::nullopt, q};
  start.from_line = line;
  const ProgramSummary summary = begin(start);
  return approach_text(line, summary.approach) + remark_on(summary);
}

ProgramStart PlannerThread::start_at(const PlaceRecord& place, const JointVec& q, double before_mm,
                                     PlaceEntry& entry) {
  ProgramStart start{place.program, std::nullopt, q};
  start.open = opener();
  start.switches = switches_;
  start.block_delete_changes = place.block_delete_changes;
  start.measured = place.measured;
  if (place.began.size() == q.size()) start.began = place.began;
  entry = find_entry(assembly_, parameters_, tools_, start, place, before_mm);
  start.from_line = entry.line;
  start.from_block = entry.block;
  start.from_place = entry.place;
  return start;
}

std::string PlannerThread::load_place(const PlaceRecord& place, const JointVec& q, double before_mm) {
  end_reading();
  abandoned_ = closed_.load();
  PlaceEntry entry;
  const ProgramStart start = start_at(place, q, before_mm, entry);
  const ProgramSummary summary = begin(start);
  return place_text(place, entry) + approach_text(entry.line, summary.approach) + remark_on(summary);
}

// The planner's thread reads nothing meanwhile, and has read nothing behind the stop.
void PlannerThread::check_place(const PlaceRecord& place, const JointVec& q) {
  if (abandoned_ || !(at_stop_ || waits_)) throw ProgramError("no program waits any more");
  PlaceEntry entry;
  const ProgramStart start = start_at(place, q, 0, entry);
  check_program(assembly_, parameters_, tools_, start, {}, &abandoned_);
}

// Whether a program needs it is known by running through it without the tool.
void PlannerThread::delete_tool(int number, const std::string& path, const JointVec& q) {
  end_reading();
  abandoned_ = closed_.load();
  if (!tools_.find(number)) throw ProgramError(fmt::format("there is no tool {} in the table", number));
  if (static_cast<int>(parameters_[parameter::kTool]) == number)
    throw ProgramError(
        fmt::format("tool {} is in the spindle; put it away first (trunnion tool 0 --in-spindle)", number));
  const auto runs = [&](const ToolTable& tools) -> std::string {
    ProgramStart start{path, std::nullopt, q};
    start.open = opener();
    start.switches = switches_;
    try {
      check_program(assembly_, parameters_, tools, start, {}, &abandoned_);
      return "";
    } catch (const ProgramError& error) {
      return error.what();
    }
  };
  ToolTable without = tools_;
  without.remove(number);
  const std::string lacks = path.empty() ? "" : runs(without);
  if (!lacks.empty() && runs(tools_) != lacks)
    throw ProgramError(fmt::format("the loaded program needs tool {}: {}", number, lacks));
  const ToolTable before = tools_;
  tools_.remove(number);
  memory_.keep(true);
  tell_measured(parameters_, before, 0);
  show_idle();
}

// The daemon itself knows the program's own file.
OpenFile PlannerThread::opener(const std::string& program) {
  return [this, program](const std::string& path, bool may_be_missing) {
    auto file = files_.open(path, may_be_missing);
    if (file && !program.empty() && path != program) read_.note(path);
    return file;
  };
}

void PlannerThread::load_mdi(const std::string& text, const JointVec& q) { begin({"mdi", text, q}); }

ProgramSummary PlannerThread::begin(ProgramStart start) {
  end_reading();
  abandoned_ = closed_.load();
  start.open = opener(start.text ? "" : start.path);
  take_failure();
  if (start.text) {
    adopt_outputs();
    start.outputs = outputs_;
    start.kept = mdi_;
  }
  start.switches = switches_;
  const ProgramSummary summary = checked(start);
  wait_until_cleared();
  if (listeners_.starts) listeners_.starts(start);
  start_ = start;
  journal_.begin();
  start_parameters_ = parameters_;  // as the program finds them
  start_tools_ = tools_;
  if (listeners_.measured && !start.text && start.from_block == 0)
    listeners_.measured(found_by_program(parameters_), true);
  changes_ = start.block_delete_changes;
  held_state_ = HeldState::kNone;
  auto pipeline = std::make_unique<Pipeline>(assembly_, parameters_, tools_, start, observers());
  queue_.begin_generation();
  if (listeners_.begins) listeners_.begins();
  if (listeners_.time && !start.text)
    time_pass_.begin(start, start_parameters_, start_tools_, listeners_.time);
  ended_ = waits_ = at_stop_ = false;
  blocks_read_ = 0;
  wish_ = kNoWish;
  if (!start.text) mdi_.reset();
  started_ = kept_ = start.text.has_value();
  thread_ = std::thread([this, mdi = start.text.has_value(), pipeline = std::move(pipeline)] {
    pthread_setname_np(pthread_self(), "planner");
    if (feed(*pipeline) && mdi) mdi_ = pipeline->settings();
    if (mdi) tell_measured(start_parameters_, start_tools_, 0);
    end_thread();
  });
  wait_until_primed();
  return summary;
}

// A program that is refused leaves the one before as it was loaded.
ProgramSummary PlannerThread::checked(const ProgramStart& start) {
  const ReadFiles before = read_;
  if (!start.text) read_.clear();
  try {
    return check_program(assembly_, parameters_, tools_, start, {}, &abandoned_);
  } catch (...) {
    read_ = before;
    throw;
  }
}

void PlannerThread::check_files() { read_.check(); }

PipelineObservers PlannerThread::observers() {
  PipelineObservers observers;
  observers.line_done = [this](bool event) {
    keep_started();
    if (kept_) memory_.keep(event);
  };
  observers.move = listeners_.move;
  said_ = 0;
  program_log_.close();
  observers.message = [this](std::string_view text, std::uint32_t line) { say(text, line); };
  observers.journal = &journal_;
  observers.steps = static_cast<bool>(listeners_.step);
  observers.log = [this](const canon::Log& log, std::uint32_t line) { take_log(log, line); };
  return observers;
}

// A program that talks in a loop must not fill a log.
void PlannerThread::say(std::string_view text, std::uint32_t line) {
  if (!listeners_.message || ++said_ > kMessagesMax) return;
  listeners_.message(text.substr(0, kPlannerMessageBytesMax), line);
  if (said_ == kMessagesMax) listeners_.message("what this program says further is not shown", line);
}

// The tick lets dropped blocks go while it stands; a second is thousands of periods.
void PlannerThread::wait_until_cleared() {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (queue_.holds_stop() || queue_.buffered_s() > 0) {
    if (std::chrono::steady_clock::now() > end)
      throw std::runtime_error("the tick does not let the last program go");
    doze();
  }
}

// A program may calculate for long before its first motion, or for ever.
void PlannerThread::wait_until_primed() {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  const auto primed = [&] {
    return ended_ || waits_ || at_stop_ || queue_.buffered_s() >= assembly_.planner.buffer_s;
  };
  while (!primed() && !abandoned_ && std::chrono::steady_clock::now() < end) doze();
  const std::string failure = take_failure();
  if (!failure.empty()) throw ProgramError(failure);
}

bool PlannerThread::feed(Pipeline& pipeline) {
  MotionBlock block;
  bool sound = true;
  for (bool more = true; more && !abandoned_;) {
    try {
      take_wish(pipeline);
      more = pipeline.next(block, &abandoned_);
      blocks_read_ = pipeline.blocks_read();
      if (more && pipeline.step() && listeners_.step) listeners_.step(*pipeline.step());
      if (more) push(pipeline, block);
      if (more) wait_at_stop(pipeline, block.event.kind);
      if (!more && pipeline.waiting()) more = wait_for_answer(pipeline);
    } catch (const std::exception& error) {  // the end of the program still follows
      const std::lock_guard lock(mutex_);
      if (!abandoned_) failure_ = error.what();  // else it is the reading that was given up
      sound = false;
    }
  }
  return sound && !abandoned_;
}

void PlannerThread::tell_measured(const Parameters& before, const ToolTable& tools_before,
                                  std::uint64_t until_block) {
  if (!listeners_.measured) return;
  MeasuredValues changes = changes_between(before, tools_before, parameters_, tools_);
  changes.set_until(until_block);
  if (!changes.empty()) listeners_.measured(changes, false);
}

// Only for people: where it cannot be found out, nothing else is wrong.
void PlannerThread::show_idle() {
  if (!listeners_.stands) return;
  const Parameters& parameters = started_ ? parameters_ : start_parameters_;
  const ToolTable& tools = started_ ? tools_ : start_tools_;
  if (listeners_.tables) listeners_.tables(parameters, tools);
  try {
    listeners_.stands(idle_step(assembly_, parameters, tools, mdi_ ? &*mdi_ : nullptr));
  } catch (const std::exception&) {
    return;
  }
}

// What is planned under way has its own.
void PlannerThread::show() {
  if (!abandoned_ && !ended_) return;
  join();
  adopt_outputs();
  show_idle();
}

// Between programs, by who loads them.
void PlannerThread::adopt_outputs() {
  if (outputs_) trn::adopt_outputs(*outputs_, assembly_, parameters_, tools_, mdi_);
}

bool PlannerThread::wait_for_answer(Pipeline& pipeline) {
  ProgramAnswer answer;
  waits_ = true;
  while (!abandoned_ && !queue_.take_answer(answer)) {
    take_wish(pipeline);
    take_held(pipeline);
    doze();
  }
  take_held(pipeline);
  waits_ = false;
  if (!abandoned_) pipeline.answer(answer);
  return !abandoned_;
}

void PlannerThread::push(Pipeline& pipeline, const MotionBlock& block) {
  while (!abandoned_ && (queue_.buffered_s() > assembly_.planner.buffer_s || !queue_.push(block))) {
    take_wish(pipeline);
    doze();
  }
}

// What follows a program stop is read when the program goes on: whatever is switched there acts behind it.
void PlannerThread::wait_at_stop(Pipeline& pipeline, QueueEvent::Kind kind) {
  using Kind = QueueEvent::Kind;
  const auto stops = [&] {
    return kind == Kind::kProgramStop || (kind == Kind::kOptionalStop && optional_stop_);
  };
  while (stops() && queue_.holds_stop() && !abandoned_) {
    at_stop_ = true;
    take_wish(pipeline);
    take_held(pipeline);
    doze();
  }
  take_held(pipeline);
  at_stop_ = false;
}

// On disk before it is answered; the step shows what is in force from here on.
void PlannerThread::take_held(Pipeline& pipeline) {
  HeldState wished = HeldState::kWished;
  if (abandoned_ || !held_state_.compare_exchange_strong(wished, HeldState::kTaken)) return;
  try {
    held_.obeyed = pipeline.held_lines(held_.text, held_.q);
    check_held(held_.obeyed);
    const Parameters before = parameters_;
    const ToolTable tools_before = tools_;
    pipeline.obey_held(held_.obeyed, [this] { memory_.keep(true); });
    tell_measured(before, tools_before, held_.obeyed.after_block);
    if (const ProgramStep* step = pipeline.held_step(); step && listeners_.step) listeners_.step(*step);
    if (listeners_.tables) listeners_.tables(parameters_, tools_);
  } catch (const std::exception& error) {
    held_.refusal = error.what();
  }
  held_state_ = HeldState::kDone;
}

// What follows must not leave the machine with it.
void PlannerThread::check_held(const HeldLines& lines) {
  ProgramStart start = start_;
  start.held_lines.push_back(lines);
  {
    const std::lock_guard lock(mutex_);
    start.block_delete_changes = changes_;
  }
  check_program(assembly_, start_parameters_, start_tools_, start, {}, &abandoned_);
}

HeldLines PlannerThread::obey_held(const std::string& text, const JointVec& q) {
  const auto waits = [this] { return (at_stop_ || waits_) && !abandoned_; };
  if (!waits())
    throw ProgramError("the program does not wait any more; hold it where it waits, and ask again");
  held_.text = text;
  held_.q = q;
  held_.refusal.clear();
  held_state_ = HeldState::kWished;
  while (held_state_ == HeldState::kTaken || (held_state_ == HeldState::kWished && waits())) doze();
  HeldState wished = HeldState::kWished;
  if (held_state_.compare_exchange_strong(wished, HeldState::kNone))
    throw ProgramError("the program has gone on meanwhile; what the line sets was not set");
  while (held_state_ == HeldState::kTaken) doze();
  held_state_ = HeldState::kNone;
  if (!held_.refusal.empty()) throw ProgramError(held_.refusal);
  start_.held_lines.push_back(held_.obeyed);
  return held_.obeyed;
}

void PlannerThread::take_wish(Pipeline& pipeline) {
  try {
    keep_started();
  } catch (const std::exception& error) {  // whoever starts it hears this, and does not
    const std::lock_guard lock(mutex_);
    failure_ = error.what();
    abandoned_ = true;
    return;
  }
  const int wish = wish_.exchange(kNoWish);
  if (wish == kNoWish) return;
  pipeline.set_block_delete(wish != 0);
  const std::lock_guard lock(mutex_);
  taken_ = ReadingPlace{pipeline.blocks_read(), pipeline.line(), pipeline.file_name()};
  changes_.push_back({pipeline.blocks_read(), wish != 0});
}

// Lines that were skipped at the start have not been looked at.
ReadingPlace PlannerThread::switch_block_delete(bool on) {
  if (!ended_) {
    ProgramStart start = start_;
    {
      const std::lock_guard lock(mutex_);
      taken_.reset();
      start.block_delete_changes = changes_;
    }
    start.block_delete_changes.push_back({blocks_read_.load(), on});
    check_program(assembly_, start_parameters_, start_tools_, start, {}, &abandoned_);
    wish_ = on ? 1 : 0;
  }
  while (!ended_ && wish_ != kNoWish) doze();
  wish_ = kNoWish;
  ProgramSwitches switches = switches_;
  switches.block_delete = on;
  switches_ = switches;
  const std::lock_guard lock(mutex_);
  return std::exchange(taken_, std::nullopt).value_or(ReadingPlace{});
}

std::string PlannerThread::take_failure() {
  const std::lock_guard lock(mutex_);
  return std::exchange(failure_, "");
}

}  // namespace trn
