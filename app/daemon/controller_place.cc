#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>

#include "app/daemon/command_server.h"
#include "app/daemon/machine_controller.h"
#include "app/daemon/program_source.h"
#include "app/daemon/read_files.h"
#include "app/daemon/supervisor.h"
#include "app/daemon/telemetry.h"
#include "app/session/pipeline.h"
#include "app/session/place_record.h"
#include "app/session/program_step.h"
#include "core/axes.h"
#include "core/units.h"
#include "interp/gcode/active_codes.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/settings.h"
#include "interp/move.h"
#include "kernel/rt_messages.h"

// What program is loaded and where it begins, and the controller's record of where it is.
namespace trn {

namespace {

using trunnion::acknowledge_t;

constexpr auto kPlacePeriod = std::chrono::seconds(1);

std::string letters_and_values(const std::string& axes, const MmWords& words) {
  std::string text;
  for (std::size_t i = 0; kWordLetters[i] != 0; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double value = k < 3 ? words.xyz[k] : words.abc_deg[k - 3];
    if (axes.find(kWordLetters[i]) != std::string::npos)
      text += fmt::format(" {}{:.4f}", kWordLetters[i], value);
  }
  return text.empty() ? text : text.substr(1);
}

}  // namespace

// From a line: the answer tells the approach, and a start in another place than here is refused.
CommandServer::Answer MachineController::load_from(std::string path, std::uint32_t line,
                                                   const Ticket& ticket) {
  const bool loaded = path.empty();
  if (loaded) path = program_path_;
  if (path.empty()) return refused("no program is loaded; load one first");
  return prepare(ticket, path, line, loaded);
}

// Without a path: the loaded one, from its beginning again. It is read when it starts: read ahead now, what
// was given up could not be gone on with.
CommandServer::Answer MachineController::load(const std::string& path, const Ticket& ticket) {
  if (!path.empty()) return prepare(ticket, path, 0, false);
  if (program_path_.empty()) return refused("no program is loaded; load one first");
  run_job(
      ticket, clear_then([] {}), [this] { from_line_ = 0; }, Job::kLoad);
  return {acknowledge_t::WORKING, ""};
}

// What is refused leaves the program before loaded. `loaded`: it must be the file that was loaded before.
CommandServer::Answer MachineController::prepare(const Ticket& ticket, const std::string& path,
                                                 std::uint32_t line, bool loaded) {
  progress_.begin();
  const JointVec q = report_.q_plan;
  struct Prepared {
    std::string text;
    ReadFiles file;
  };
  const auto prepared = std::make_shared<Prepared>();
  if (loaded) prepared->file = read_;
  run_job(
      ticket, clear_then([this, path, q, line, loaded, prepared] {
        prepared->file.check();
        if (loaded) parts_.programs.check_files();
        prepared->text = line > 1 ? parts_.programs.load_from(path, q, line) : parts_.programs.load(path, q);
        prepared->file.note(path);  // by now it is known to be a file, and one that answers
      }),
      [this, path, q, line, prepared] {
        program_path_ = status_.program = path;
        read_ = prepared->file;
        program_mark_ = read_.mark(path);
        prepared_at_ = q;
        from_line_ = line;
        block_delete_changes_.clear();
        began_.resize(0);
        job_message_ = prepared->text;
      },
      Job::kLoad);
  return {acknowledge_t::WORKING, ""};
}

CommandServer::Answer MachineController::start(const Ticket& ticket) {
  const JointVec q = report_.q_plan;
  const bool prepared = prepared_at_ && *prepared_at_ == q;
  if (!prepared) block_delete_changes_.clear();
  if (!prepared || began_.size() == 0) began_ = q;
  if (!prepared && from_line_ > 1) {
    machine_event(Event::kMotionDone);
    return refused(prepared_text());
  }
  const auto file = std::make_shared<ReadFiles>(read_);
  const auto load_again = [this, path = program_path_, q, file] {
    file->check();
    parts_.programs.check_files();
    parts_.programs.load(path, q);
    file->check();
    keep_beginning(path);
    parts_.programs.starts();
  };
  const auto begin_prepared = [this, path = program_path_, from_start = from_line_ <= 1, file] {
    file->check();
    parts_.programs.check_files();
    if (from_start) keep_beginning(path);
    parts_.programs.starts();
  };
  run_job(
      ticket, prepared ? std::function<void()>(begin_prepared) : clear_then(load_again),
      [this] {
        status_.program = program_path_;
        if (from_line_ > 1)
          job_message_ = fmt::format("it begins in line {}, as it was prepared", from_line_);
      },
      Job::kStart);
  return {acknowledge_t::WORKING, ""};
}

// Where the record says; the answer tells the place and the approach.
CommandServer::Answer MachineController::load_place(double before_mm, const Ticket& ticket) {
  if (!parts_.place) return refused("the daemon records no place; give it --vars or --place");
  const JointVec q = report_.q_plan;
  struct Found {
    PlaceRecord place;
    std::string text;
    ReadFiles file;
  };
  const auto found = std::make_shared<Found>();
  run_job(
      ticket, clear_then([this, q, before_mm, found] {
        found->place = parts_.place->read();
        refuse_without_place(found->place);
        found->file.note(found->place.program);
        if (found->file.mark(found->place.program) != found->place.mark)
          throw ProgramError(
              fmt::format("{} is not the file any more that was under way; begin it with "
                          "'trunnion start --from LINE'",
                          found->place.program));
        found->text = parts_.programs.load_place(found->place, q, before_mm);
        found->file.check();
      }),
      [this, q, found] {
        program_path_ = status_.program = found->place.program;
        program_mark_ = found->place.mark;
        read_ = found->file;
        prepared_at_ = q;
        from_line_ = std::max(2U, found->place.line);
        block_delete_changes_ = found->place.block_delete_changes;
        began_ = found->place.began;
        measured_ = found->place.measured;
        progress_.begin();
        job_message_ = found->text;
      },
      Job::kLoad);
  return {acknowledge_t::WORKING, ""};
}

// In a worker's thread, before the program moves: where the power fails behind its first lines, the place
// that is found is not one of another program.
void MachineController::keep_beginning(const std::string& path) const {
  if (!parts_.place) return;
  PlaceRecord begun;
  begun.program = path;
  begun.mark = program_mark_;
  parts_.place->note(begun);
  parts_.place->wait_until_kept();
}

PlaceRecord MachineController::place_now(const ProgramStep& step) {
  const Settings& settings = step.settings;
  const ProgramSwitches switches = parts_.programs.switches();
  PlaceRecord place;
  place.program = program_path_;
  place.mark = program_mark_;
  place.block = step.block;
  place.line = step.source.line;
  place.file = step.file.data();
  place.text = step.text.data();
  place.gone_mm = noted_.gone_mm;
  const bool at_move = step.moves && report_.on_path;
  const double straight_mm = (step.to - report_.y).head<3>().norm();
  // Of an arc it tells the turn; `at` the place on it.
  if (at_move) place.left_mm = step.arc ? std::max(0.0, step.length_mm - noted_.move_mm) : straight_mm;
  if (at_move) place.at = step.frame.mm_of(report_.y);
  place.moves = step.moves;
  place.to = step.frame.mm_of(step.to);
  place.tool = settings.current_tool;
  place.codes = active_codes(settings, step.cutter_comp);
  const MmWords offset = in_mm(settings.g5x, settings.modal.inch);
  place.work_offset =
      fmt::format("{} {}", g_name(kWorkOffsetCodes[static_cast<std::size_t>(settings.modal.work_offset - 1)]),
                  letters_and_values(status_.axes, offset));
  place.spindle_rpm = report_.spindle_rpm;
  place.coolant = report_.coolant;
  const bool on_path = report_.on_path && follows_program(report_);
  if (parts_.map) {
    const ShownPosition shown = shown_position(*parts_.map, step, report_.q_plan, on_path, report_.y);
    place.work = letters_and_values(status_.axes, shown.work);
  }
  place.block_delete = switches.block_delete;
  place.optional_stop = switches.optional_stop;
  place.block_delete_changes = block_delete_changes_;
  place.began = began_;
  place.measured = measured_;
  return place;
}

// What is set while no program is under way counts up to the place where one was given up.
void MachineController::hear_measured() {
  for (const ProgramSource::Measured& set : parts_.programs.take_measured()) {
    const bool held = set.values.until_block() > 0;
    if (set.begins) measured_ = set.values;
    if (held) measured_.add(set.values);
    if (set.begins || !parts_.place) continue;
    try {
      PlaceRecord place = parts_.place->read();
      if (place.ended) continue;
      MeasuredValues values = set.values;
      if (!held) values.set_until(place.block);
      place.measured.add(values);
      const auto tool = values.numbers.find(parameter::kTool);
      if (held && tool != values.numbers.end()) place.tool = static_cast<int>(tool->second.value);
      parts_.place->note(place);
    } catch (const std::exception&) {  // there is no program to go on with
    }
  }
}

// Of the block and of the move, how much of the path is done; it may go back along it.
void MachineController::note_way(const ProgramStep& step, bool fresh) {
  const double way_mm = noted_.on_path ? (report_.y - noted_.was_at).head<3>().norm() : 0;
  const double gone_mm = report_.override_now < 0 ? -way_mm : way_mm;
  const std::uint32_t number = step.source.step;
  noted_.gone_mm = fresh ? 0 : noted_.gone_mm + gone_mm;
  if (number == noted_.step)
    noted_.move_mm += gone_mm;
  else
    noted_.move_mm = number < noted_.step && noted_.open ? step.length_mm : 0;
  noted_.step = number;
  noted_.was_at = report_.y;
  noted_.on_path = report_.on_path;
}

// The program that is loaded must still run without it; what is prepared of that is let go.
CommandServer::Answer MachineController::delete_tool(int number, const Ticket& ticket) {
  if (supervisor_.state() != MachineState::kIdle || jobs_ + loads_ > 0)
    return refused("a tool is taken out of the table while the machine is idle; 'stop' what runs first");
  spdlog::info("tool {} is to leave the table: {}", number, cause_);
  run_job(
      ticket, clear_then([this, number, path = program_path_, q = report_.q_plan] {
        parts_.programs.delete_tool(number, path, q);
      }),
      [this, number] { job_message_ = fmt::format("tool {} is out of the table", number); }, Job::kLoad);
  return {acknowledge_t::WORKING, ""};
}

// Only the tick knows that a program has come to its end: a stop may bring the machine to rest between two
// looks at its state. A program that failed has ended too, but there its place counts.
void MachineController::keep_end() {
  if (ended_.empty()) return;
  if (!status_.program_failed) {
    counters_.part_made();
    PlaceRecord ended;
    ended.program = ended_;
    ended.ended = true;
    if (parts_.place) parts_.place->note(ended);
  }
  ended_.clear();
}

// At every new line or move, and once a second.
void MachineController::note_place() {
  const bool file = !program_path_.empty() && status_.program == program_path_;
  const MachineState state = supervisor_.state();
  if (state == MachineState::kIdle && noted_.open && jobs_ + loads_ == 0) {
    placed_.reset();
    noted_.open = false;
  }
  const std::uint32_t number = present_step(report_);
  if (!file || number == 0 || jobs_ > 0 || report_.detour != DetourState::kNone) return;
  const ProgramStep* step = parts_.programs.step(number);
  if (!step || step->block == 0 || step->source.line == 0) return;  // the way to a place is none
  const auto now = Clock::now();
  const bool fresh = !noted_.open || step->block != noted_.block;
  note_way(*step, fresh);
  // While it comes to a stand: of a second of the path nothing must be missing where it stands.
  const bool slows = state == MachineState::kStopping || state == MachineState::kHolding;
  if (!fresh && now < noted_.next && !(slows && report_.y != noted_.stood_at)) return;
  noted_.stood_at = report_.y;
  noted_.block = step->block;
  noted_.open = true;
  noted_.next = now + kPlacePeriod;
  placed_ = place_now(*step);
  if (parts_.place) parts_.place->note(*placed_);
}

}  // namespace trn
