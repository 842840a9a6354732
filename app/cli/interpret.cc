#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/session/assembly.h"
#include "app/session/range_check.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/canon_printer.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"

namespace trn {

namespace {

struct InterpretOptions {
  std::string program, machine, tools, variables, units;
  bool canon = false, block_delete = false, save_variables = false;
  int max_errors = 20;
};

/// Counts what the planner would get, and hands it to the judge of the axes' ranges.
class MoveCounter : public MoveSink {
 public:
  explicit MoveCounter(MoveSink* judge) : judge_(judge) {}
  void move(const ProgramMove& move) override {
    if (judge_) judge_->move(move);
    ++moves;
    if (move.kind == ProgramMove::Kind::kTraverse)
      ++traverses;
    else
      path += tip_way(move);
  }
  void event(const QueueEvent& event, SourceLine source) override {
    if (judge_) judge_->event(event, source);
    ++events;
  }
  void stop_judging() { judge_ = nullptr; }
  std::uint64_t moves = 0, traverses = 0, events = 0;
  double path = 0;  ///< of feeds, mm

 private:
  // A helix is as long as its turn and its rise together.
  static double tip_way(const ProgramMove& move) {
    const Vec3 way = (move.to - move.from).head<3>();
    if (move.kind != ProgramMove::Kind::kArc) return way.norm();
    const Vec3 from_centre = Vec3(move.from.head<3>()) - move.arc_centre;
    const double radius = move.arc_axis.cross(from_centre).norm();
    return std::hypot(radius * move.arc_sweep_rad, way.dot(move.arc_axis));
  }

  MoveSink* judge_;
};

/// Canonical functions, printed or lowered to moves or both.
struct CanonFanOut : CanonSink {
  void put(const CanonCommand& command, std::uint32_t line) override {
    for (CanonSink* sink : sinks) sink->put(command, line);
  }
  std::vector<CanonSink*> sinks;
};

/// Counts and prints what is wrong with a program.
struct Findings {
  int errors = 0, warnings = 0, errors_max = 0;

  void error(const std::string& text) {
    ++errors;
    if (errors <= errors_max) fmt::print(stderr, "{}\n", text);
    if (errors == errors_max) fmt::print(stderr, "{} errors, giving up\n", errors);
  }
  void warning(const std::string& text) {
    if (++warnings <= errors_max) fmt::print(stderr, "{}\n", text);
  }
  bool enough() const { return errors >= errors_max; }
};

// Steps to the end; an error is told and the program gone on with, where that makes sense.
void run_program(Interpreter& interpreter, Findings& findings, const std::function<void()>& on_error) {
  while (!findings.enough()) {
    try {
      if (!interpreter.step()) return;
      if (interpreter.loops_long())
        return findings.warning(fmt::format(
            "{}: warning: read up to here: after {} lines the program still goes round, perhaps for ever",
            interpreter.place_of(interpreter.line(), 0), interpreter.lines_run()));
    } catch (const ProgramError& error) {
      on_error();
      findings.error(error.what());
      if (findings.enough() || !interpreter.recover()) return;
    }
  }
}

// Without a machine: what the stand-alone interpreters of the family have when they are given no tool table.
ToolTable sample_tools() {
  return ToolTable::parse(
      "T1 P1 Z0.511 D0.125\nT2 P2 Z0.1 D0.0625\nT3 P3 Z1.273 D0.201\nT99999 P99999 Z0.1\n",
      "the sample table that stands in for the one that was not given", kMmPerInch);
}

// `assembly` is null without a machine: there are no ranges then.
int interpret(const InterpretOptions& options, const ProgramConfig& config, const Assembly* assembly) {
  Parameters parameters;
  ToolTable tools = assembly ? ToolTable() : sample_tools();
  if (!options.variables.empty()) load_parameters(options.variables, parameters);
  if (!options.tools.empty()) tools = ToolTable::load(options.tools, config.parameter_unit_mm);
  Findings findings;
  findings.errors_max = options.max_errors;
  const Kinematics* kinematics = assembly ? assembly->kinematics.get() : nullptr;
  const Interpreter* reader = nullptr;
  CanonPrinter printer(stdout);
  std::optional<RangeCheck> range_check;
  if (assembly)
    range_check.emplace(*assembly, [&](const RefusedMove& refused) {
      printer.stop(true);
      findings.error(fmt::format("{}: {}", reader->place_of(refused.line, refused.letter), refused.text));
    });
  MoveCounter counter(range_check ? &*range_check : nullptr);
  Lowering lowering(config, kinematics, counter);
  CanonFanOut all;
  if (options.canon) all.sinks.push_back(&printer);
  if (!options.canon || assembly) all.sinks.push_back(&lowering);
  CanonSink& sink = all.sinks.size() == 1 ? *all.sinks.front() : all;
  Interpreter interpreter({config, parameters, tools, kinematics, sink,
                           [&](const Diagnostic& warning) { findings.warning(warning.text); }, false, true});
  reader = &interpreter;
  interpreter.open(options.program);
  // What follows an error is only searched for more of the kind: its functions and places are not what the
  // program means.
  run_program(interpreter, findings, [&] {
    printer.stop(true);
    counter.stop_judging();
  });
  if (options.canon) {
    printer.stop(false);
    printer.put(canon::Plain{PlainCanon::kOnReset}, 0);
    printer.put(canon::Plain{PlainCanon::kOnReset}, 0);
    printer.flush();
  } else {
    fmt::print("{}: {} lines, {} moves ({} rapid), {:.1f} mm of feed, {} events, {} warning{}, {} error{}\n",
               options.program, interpreter.line(), counter.moves, counter.traverses, counter.path,
               counter.events, findings.warnings, findings.warnings == 1 ? "" : "s", findings.errors,
               findings.errors == 1 ? "" : "s");
  }
  if (options.save_variables && findings.errors == 0) save_parameters(options.variables, parameters);
  return findings.errors;
}

Exit run(const InterpretOptions& options) {
  std::optional<Assembly> assembly;
  ProgramConfig config;
  if (!options.machine.empty()) {
    assembly.emplace(assemble(options.machine));
    config = assembly->program;
  }
  if (options.units == "inch" || (options.units.empty() && options.machine.empty()))
    config.parameter_unit_mm = kMmPerInch;
  if (options.block_delete) config.block_delete = true;
  return interpret(options, config, assembly ? &*assembly : nullptr) == 0 ? Exit::kDone : Exit::kBadProgram;
}

}  // namespace

void add_interpret(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<InterpretOptions>();
  CLI::App* command = app.add_subcommand(
      "interpret",
      "Read a program to its end and tell all its errors; nothing moves. With --machine also where an axis "
      "leaves its range, with --canon its canonical machining functions");
  command->add_option("program", options->program, "G-code file")->required();
  command->add_option(
      "--machine,-m", options->machine,
      "the machine by its name, or its config (.toml). Without it: all six axis words, no RTCP");
  command->add_flag("--canon", options->canon, "print NIST RS274/NGC canonical functions, one a line");
  command->add_option("--tools", options->tools, "tool table (.tbl)");
  command->add_option("--vars", options->variables, "variables (.var)");
  command
      ->add_flag("--save-vars", options->save_variables,
                 "write the variables back after a program without errors")
      ->needs(command->get_option("--vars"));
  command
      ->add_option("--units", options->units,
                   "unit of lengths in tool table, variables and numbered parameters. Without it: mm with "
                   "--machine, else inch, as other interpreters of this dialect have it")
      ->check(CLI::IsMember({"mm", "inch"}));
  command->add_flag("--block-delete", options->block_delete, "skip lines that begin with '/'");
  command->add_option("--max-errors", options->max_errors, "give up after this many errors")
      ->check(CLI::PositiveNumber);
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trn
