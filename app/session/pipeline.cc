#include "app/session/pipeline.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "app/session/program_rules.h"
#include "app/session/range_check.h"
#include "core/check.h"
#include "core/ports.h"
#include "core/safe_file.h"
#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"

namespace trn {

namespace {

Words start_words(const MachineJointMap& map, const JointVec& q, const ProgramStart& start) {
  Words words = Words::Zero();
  if (map.words_at(q, start.switches.corrections_off, words) != KinStatus::kOk)
    throw ProgramError("the machine stands where its own position has no axis words; jog it away first");
  return words;
}

void open(Interpreter& interpreter, const ProgramStart& start, const MachineJointMap& map) {
  const Words words = start_words(map, start.q, start);
  const Words began = start.began.size() > 0 ? start_words(map, start.began, start) : words;
  if (start.text)
    interpreter.open_text(*start.text, start.path, in_degrees<MachineWords>(began),
                          start.kept ? &*start.kept : nullptr);
  else
    interpreter.open(start.path, in_degrees<MachineWords>(began));
  if (start.from_block > 0)
    interpreter.begin_at_block(start.from_block, start.from_line, in_degrees<MachineWords>(words),
                               start.from_place);
  else if (start.from_line > 1)
    interpreter.begin_at(start.from_line, in_degrees<MachineWords>(words));
}

// A planner's message begins with "line N:"; the file belongs in front of it.
std::string with_file(const std::string& file, const std::string& message) {
  constexpr std::string_view kLine = "line ";
  if (message.rfind(kLine, 0) == 0) return fmt::format("{}:{}", file, message.substr(kLine.size()));
  return message;
}

// No more of a program is driven whose planning a failed check has put in doubt.
void refuse(const CheckFailure& failed) {
  if (failed)
    throw ProgramError(explain(failed) +
                       " while the program was planned; this is a defect of the control: report it with the "
                       "program");
}

ProgramConfig config_for(ProgramConfig config, const ProgramStart& start) {
  if (start.text) config.end = ProgramEnd::kFree;
  config.typed = start.text.has_value();
  config.block_delete = start.switches.block_delete;
  config.block_delete_changes = start.block_delete_changes;
  config.held_lines = start.held_lines;
  config.measured = start.measured;
  config.optional_stop = start.switches.optional_stop;
  if (start.open) {
    config.open = start.open;
    config.quote_lines = start.text.has_value();  // the operator's own words
  }
  return config;
}

}  // namespace

ProgramSwitches ProgramSwitches::of(const Assembly& assembly) {
  return {assembly.corrections.planned_off, assembly.program.block_delete, assembly.program.optional_stop};
}

/// Refuses what the machine cannot do, and shows the rest on its way to the planner.
struct Pipeline::MoveTap : MoveSink {
  MoveTap(MoveSink& next_in, const Assembly& assembly, std::function<void(const ProgramMove&)> seen_in,
          std::function<void(SourceLine, const ProgramMove*)> step_in,
          std::function<std::string(std::uint32_t)> place_in)
      : next(next_in),
        rules(assembly),
        seen(std::move(seen_in)),
        step(std::move(step_in)),
        place(std::move(place_in)) {}
  void move(const ProgramMove& m) override {
    if (const std::string refusal = rules.refusal_of(m); !refusal.empty())
      throw ProgramError(fmt::format("{}: {}", place(m.source.line), refusal));
    ++handed_on;
    if (seen) seen(m);
    if (step) step(m.source, &m);
    next.move(m);
  }
  void event(const QueueEvent& event, SourceLine source) override {
    rules.hear(event);
    had_event = true;
    ++handed_on;
    if (step) step(source, nullptr);
    next.event(event, source);
  }
  MoveSink& next;
  ProgramRules rules;
  bool had_event = false;
  std::uint64_t handed_on = 0;  ///< moves and events
  std::function<void(const ProgramMove&)> seen;
  std::function<void(SourceLine, const ProgramMove*)> step;  ///< null: nobody asks for steps
  std::function<std::string(std::uint32_t)> place;           ///< of a line, for messages
};

struct Pipeline::PieceObserver : PieceSink {
  PieceObserver(SpeedPlanner& next_in, PipelineObservers& observers)
      : next(next_in), seen(std::move(observers.piece)), planned(std::move(observers.stretch)) {}
  void piece(const PlanPiece& p) override {
    TRN_CHECK(p.piece.length > 0);
    if (seen) seen(p);
    next.piece(p);
    if (!p.ends_stretch) return;
    if (planned) planned(next.stats().time_s - time_before_s);
    time_before_s = next.stats().time_s;
  }
  void event(const QueueEvent& event, SourceLine source) override { next.event(event, source); }
  SpeedPlanner& next;
  std::function<void(const PlanPiece&)> seen;
  std::function<void(double)> planned;
  double time_before_s = 0;
};

/// Shows what the program says on its way to the lowering.
struct Pipeline::MessageTap : CanonSink {
  MessageTap(CanonSink& next_in, const PipelineObservers& observers)
      : next(next_in), message(observers.message), log(observers.log) {}
  void put(const CanonCommand& command, std::uint32_t line) override {
    if (const auto* said = std::get_if<canon::Message>(&command)) show(said->text, line);
    if (const auto* said = std::get_if<canon::Print>(&command)) show(said->text, line);
    if (const auto* written = std::get_if<canon::Log>(&command); written && log) log(*written, line);
    next.put(command, line);
  }
  void show(std::string_view text, std::uint32_t line) const {
    if (message) message(text, line);
  }
  CanonSink& next;
  std::function<void(std::string_view, std::uint32_t)> message;
  std::function<void(const canon::Log&, std::uint32_t)> log;
};

struct Pipeline::BlockQueue : BlockSink {
  void block(const MotionBlock& b) override {
    TRN_CHECK(!end_given);
    if (b.event.kind == QueueEvent::Kind::kProgramEnd && b.segment_count == 0) end_given = true;
    items.push_back(b);
  }
  std::deque<MotionBlock> items;
  bool end_given = false;
};

Pipeline::~Pipeline() = default;

Pipeline::Pipeline(const Assembly& assembly, Parameters& parameters, ToolTable& tools,
                   const ProgramStart& start, PipelineObservers observers)
    : name_(start.path),
      program_(config_for(assembly.program, start)),
      blocks_(std::make_unique<BlockQueue>()),
      speed_(assembly.plan_joints, *assembly.map, assembly.planner.speed, *blocks_),
      pieces_(std::make_unique<PieceObserver>(speed_, observers)),
      geometry_(assembly.planner.geometry, *pieces_),
      dry_run_(start.switches.dry_run
                   ? std::make_unique<DryRun>(geometry_, assembly, assembly.program.dry_run_up_mm)
                   : nullptr),
      moves_(
          std::make_unique<MoveTap>(dry_run_ ? static_cast<MoveSink&>(*dry_run_) : geometry_, assembly,
                                    std::move(observers.move), step_recorder(observers.steps),
                                    [this](std::uint32_t line) { return interpreter_.place_of(line, 0); })),
      lowering_(program_, assembly.kinematics.get(), *moves_, start_words(*assembly.map, start.q, start),
                start.switches.corrections_off),
      messages_(std::make_unique<MessageTap>(lowering_, observers)),
      interpreter_({program_, parameters, tools, assembly.kinematics.get(), *messages_,
                    std::move(observers.warning), true, start.ends_round,
                    [journal = observers.journal] {
                      if (journal) journal->adopt();
                    }}),
      map_(*assembly.map),
      tools_(tools),
      line_done_(std::move(observers.line_done)),
      journal_(observers.journal) {
  const CheckScope checks(failed_check_);
  open(interpreter_, start, *assembly.map);
  if (start.from_line <= 1 && start.from_block == 0) return;
  if (journal_) journal_->line_done(0, std::numeric_limits<std::uint64_t>::max());
  if (line_done_) line_done_(true);
  if (interpreter_.waiting()) finish_stages();
}

// All that was planned so far must be driven before an answer comes, or the program ends.
void Pipeline::finish_stages() {
  geometry_.finish();
  speed_.finish();
}

bool Pipeline::next(MotionBlock& block, const std::atomic<bool>* abandoned, std::uint64_t lines_max) {
  const CheckScope checks(failed_check_);
  const auto goes_on = [&] { return !ended_ && !interpreter_.waiting() && !(abandoned && *abandoned); };
  const std::uint64_t lines_before = interpreter_.lines_run();
  while (blocks_->items.empty() && goes_on()) {
    fill();
    if (interpreter_.lines_run() - lines_before > lines_max) give_up();
  }
  if (blocks_->items.empty()) return false;
  block = blocks_->items.front();
  find_step(block);
  handed_out_.add(block);
  TRN_CHECK(block.segment_count <= MotionBlock::kMaxSegments);
  blocks_->items.pop_front();
  return true;
}

std::function<void(SourceLine, const ProgramMove*)> Pipeline::step_recorder(bool wanted) {
  if (!wanted) return {};
  return [this](SourceLine source, const ProgramMove* move) {
    steps_.push_back(step_of(interpreter_, lowering_, tools_, source, move));
  };
}

// Steps of no length, and those that a curve swallows, have no block.
void Pipeline::find_step(const MotionBlock& block) {
  step_.reset();
  while (!steps_.empty() && steps_.front().source.step <= block.source.step) {
    step_ = steps_.front();
    steps_.pop_front();
  }
  if (!step_) return;
  step_->begins_at = handed_out_;
  step_->timing = PlanTime::kind_of(block);
  last_step_ = step_;
}

HeldLines Pipeline::held_lines(const std::string& text, const JointVec& q) const {
  Words words = Words::Zero();
  if (words_in(map_, q, lowering_.context(), words) != KinStatus::kOk)
    throw ProgramError("the machine stands where its position has no axis words; jog it away first");
  const ProgramWords stands = lowering_.program_of(words);
  HeldLines lines{interpreter_.blocks(), text, {}};
  for (int i = 0; i < 6; ++i) lines.stands[static_cast<std::size_t>(i)] = stands[i];
  return lines;
}

const ProgramStep* Pipeline::held_step() {
  if (!last_step_) return nullptr;
  ProgramStep now = step_of(interpreter_, lowering_, tools_, last_step_->source, nullptr);
  now.begins_at = last_step_->begins_at;
  now.timing = last_step_->timing;
  now.text = last_step_->text;
  last_step_ = now;
  return &*last_step_;
}

bool Pipeline::run_line() {
  const bool more = interpreter_.step();
  if (journal_) journal_->line_done(interpreter_.blocks(), moves_->handed_on);
  if (line_done_) line_done_(std::exchange(moves_->had_event, false));
  return more;
}

void Pipeline::fill() {
  std::string failure;
  try {
    const bool more = run_line();
    if (interpreter_.waiting()) finish_stages();
    refuse_failed_check();
    if (more) return;
  } catch (const GcodeError& error) {
    failure = error.what();
  } catch (const FileError& error) {
    failure =
        fmt::format("{}:{}: {}; what the line sets was not set", name_, interpreter_.line(), error.what());
  } catch (const ProgramError& error) {
    failure = with_file(name_, error.what());
  }
  // What came before an error still runs, and ends at rest: where it ends, or before the place that could not
  // be planned.
  try {
    if (!speed_.failed()) finish_stages();
    refuse_failed_check();
  } catch (const ProgramError& error) {
    if (failure.empty()) failure = with_file(name_, error.what());
  }
  end_program();
  if (!failure.empty()) throw ProgramError(failure);
}

void Pipeline::refuse_failed_check() const { refuse(failed_check_); }

void Pipeline::give_up() {
  geometry_.finish();
  speed_.finish();
  end_program();
  throw ProgramError(fmt::format(
      "{}: {} lines were run here without any motion, perhaps for ever; end the loop, or the program",
      interpreter_.place_of(interpreter_.line(), 0), interpreter_.lines_run()));
}

bool Pipeline::waiting() const { return !ended_ && blocks_->items.empty() && interpreter_.waiting(); }

void Pipeline::answer(const ProgramAnswer& answer) {
  MachineAnswer out;
  out.value = answer.value;
  if (answer.probe) {
    lowering_.stand_at(answer.y_stand);
    out.stands = lowering_.program_of(answer.y_stand);
    // The probe was heard with the joints at q_contact; they are turned as at the end of the path.
    Words contact = answer.y_stand;
    if (words_in(map_, answer.q_contact, lowering_.context(), contact) != KinStatus::kOk)
      contact = answer.y_stand;
    contact.tail<3>() = answer.y_stand.tail<3>();
    out.contact = lowering_.program_of(contact);
  }
  interpreter_.answer(out);
  if (journal_) journal_->adopt();
}

void Pipeline::end_program() {
  ended_ = true;
  if (blocks_->end_given) return;
  MotionBlock end;
  end.event.kind = QueueEvent::Kind::kProgramEnd;
  end.source.line = interpreter_.line();
  blocks_->block(end);
}

ProgramReader::ProgramReader(const Assembly& assembly, Parameters& parameters, ToolTable& tools,
                             const ProgramStart& start, MoveSink& sink)
    : name_(start.path),
      program_(config_for(assembly.program, start)),
      lowering_(program_, assembly.kinematics.get(), sink, start_words(*assembly.map, start.q, start),
                start.switches.corrections_off),
      interpreter_({program_, parameters, tools, assembly.kinematics.get(), lowering_, {}, true, true}) {
  open(interpreter_, start, *assembly.map);
}

bool ProgramReader::step() {
  CheckFailure failed;
  const CheckScope checks(failed);
  try {
    const bool more = interpreter_.step();
    while (interpreter_.asks_for_tool()) interpreter_.answer({});
    refuse(failed);
    return more;
  } catch (const ProgramError& error) {
    throw ProgramError(with_file(name_, error.what()));
  }
}

MmWords ProgramReader::stands() const {
  const Settings& settings = interpreter_.settings();
  return in_mm(settings.position, settings.modal.inch);
}

std::string remark_on(const ProgramSummary& summary) {
  if (summary.asks_at != 0)
    return fmt::format("checked up to line {}: what follows depends on what the machine answers there\n",
                       summary.asks_at);
  if (summary.round_at != 0)
    return fmt::format("M99 in line {} begins the program again, for ever\n", summary.round_at);
  if (summary.endless == 0) return "";
  return fmt::format("checked the first {} lines that it runs: a loop at line {} goes on, perhaps for ever\n",
                     summary.endless, summary.lines);
}

std::string approach_text(std::uint32_t line, const std::vector<Words>& approach) {
  std::string text = fmt::format("from line {}, in the modes the lines before it leave; approach:\n", line);
  for (const Words& to : approach)
    text += fmt::format("  X{:.3f} Y{:.3f} Z{:.3f} A{:.3f} B{:.3f} C{:.3f}\n", to[kX], to[kY], to[kZ],
                        to[kA] * kDegPerRad, to[kB] * kDegPerRad, to[kC] * kDegPerRad);
  return text;
}

ProgramSummary check_program(const Assembly& assembly, Parameters parameters, ToolTable tools,
                             const ProgramStart& start, const std::function<void(std::uint32_t)>& progress,
                             const std::atomic<bool>* given_up) {
  const ProgramConfig program = config_for(assembly.program, start);
  const Words words = start_words(*assembly.map, start.q, start);
  const Interpreter* reader = nullptr;
  RangeCheck range_check(assembly, [&](const RefusedMove& refused) {
    if (refused.line == 0)  // the approach of a program that is begun further down
      throw ProgramError(
          fmt::format("{}:{}: on the way to this line, {}", start.path, start.from_line, refused.text));
    throw ProgramError(fmt::format("{}: {}", reader->place_of(refused.line, refused.letter), refused.text));
  });
  range_check.stand_at(start.q);
  Lowering lowering(program, assembly.kinematics.get(), range_check, words, start.switches.corrections_off);
  Interpreter interpreter({program, parameters, tools, assembly.kinematics.get(), lowering, {}, true, true});
  reader = &interpreter;
  std::uint64_t steps = 0;
  CheckFailure failed;
  const CheckScope checks(failed);
  try {
    open(interpreter, start, *assembly.map);
    const auto put_tool_in = [&] {
      while (interpreter.asks_for_tool()) interpreter.answer({});
    };
    put_tool_in();
    while (!interpreter.loops_long() && interpreter.step()) {
      put_tool_in();
      if (interpreter.waiting()) break;
      if (given_up && *given_up) throw ProgramError(start.path + ": the check was given up");
      refuse(failed);
      if (progress && ++steps % 100000 == 0) progress(interpreter.line());
    }
    refuse(failed);  // of the last line, too
  } catch (const ProgramError& error) {
    throw ProgramError(with_file(start.path, error.what()));
  }
  return {interpreter.line(),
          range_check.moves,
          interpreter.waiting() ? interpreter.line() : 0,
          interpreter.loops_long() ? interpreter.lines_run() : 0,
          interpreter.came_round() ? interpreter.line() : 0,
          range_check.approach};
}

}  // namespace trn
