#include <fmt/format.h>

#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "core/config.h"
#include "core/machine.h"
#include "interp/gcode/canon_printer.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/parameter_file.h"
#include "kernel/commands/commands.h"
#include "kernel/corrections.h"
#include "kinematics/factory.h"

namespace trn {

namespace {

struct InterpretOptions {
  std::string program, machine, tools, variables;
  bool canon = false, block_delete = false, save_variables = false;
  int max_errors = 20;
};

/// Counts what the planner would get.
class MoveCounter : public MoveSink {
 public:
  void move(const ProgramMove& move) override {
    ++moves;
    if (move.kind == ProgramMove::Kind::kTraverse)
      ++traverses;
    else
      path += (move.to - move.from).head<3>().norm();
  }
  void event(const QueueEvent&, SourceLine) override { ++events; }
  std::uint64_t moves = 0, traverses = 0, events = 0;
  double path = 0;  ///< chords of feeds, mm
};

struct Outcome {
  int errors = 0, warnings = 0;
};

// Steps to the end; an error is told and the program gone on with, where that makes sense.
Outcome run_program(Interpreter& interpreter, int max_errors, const std::function<void()>& on_error) {
  Outcome outcome;
  for (;;) {
    try {
      if (!interpreter.step()) return outcome;
    } catch (const ProgramError& error) {
      on_error();
      fmt::print(stderr, "{}\n", error.what());
      if (++outcome.errors >= max_errors) {
        fmt::print(stderr, "{} errors, giving up\n", outcome.errors);
        return outcome;
      }
      if (!interpreter.recover()) return outcome;
    }
  }
}

int interpret(const InterpretOptions& options, const ProgramConfig& config, const Kinematics* kinematics) {
  Parameters parameters;
  ToolTable tools;
  if (!options.variables.empty()) load_parameters(options.variables, parameters);
  if (!options.tools.empty()) tools = ToolTable::load(options.tools);
  MoveCounter counter;
  CanonPrinter printer(stdout);
  Lowering lowering(config, kinematics, counter);
  int warnings = 0;
  CanonSink* sink = &lowering;
  if (options.canon) sink = &printer;
  Interpreter interpreter({config, parameters, tools, kinematics, *sink, [&](const Diagnostic& warning) {
                             ++warnings;
                             if (warnings <= options.max_errors) fmt::print(stderr, "{}\n", warning.text);
                           }});
  interpreter.open(options.program);
  // What follows an error is only searched for more errors: its functions are not what the program means.
  const Outcome outcome = run_program(interpreter, options.max_errors, [&] { printer.stop(true); });
  if (options.canon) {
    printer.stop(false);
    printer.put(canon::Plain{PlainCanon::kOnReset}, 0);
    printer.put(canon::Plain{PlainCanon::kOnReset}, 0);
    printer.flush();
  } else {
    fmt::print("{}: {} lines, {} moves ({} rapid), {:.1f} mm of feed, {} events, {} warnings, {} errors\n",
               options.program, interpreter.line(), counter.moves, counter.traverses, counter.path,
               counter.events, warnings, outcome.errors);
  }
  if (options.save_variables && outcome.errors == 0) save_parameters(options.variables, parameters);
  return outcome.errors;
}

Exit run(const InterpretOptions& options) {
  std::unique_ptr<Kinematics> kinematics;
  ProgramConfig config;
  try {
    if (!options.machine.empty()) {
      const Machine machine = read_machine(load_config(options.machine));
      kinematics = make_kinematics(machine);
      config = read_program_config(machine.root);
      config.switches = read_switches(machine.root, config);
    }
  } catch (const ConfigError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadConfig;
  }
  if (options.block_delete) config.block_delete = true;
  try {
    return interpret(options, config, kinematics.get()) == 0 ? Exit::kDone : Exit::kBadProgram;
  } catch (const ProgramError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadProgram;
  }
}

}  // namespace

void add_interpret(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<InterpretOptions>();
  CLI::App* command = app.add_subcommand("interpret",
                                         "Read a program to its end without moving anything: all its errors, "
                                         "or its canonical machining functions");
  command->add_option("program", options->program, "G-code file")->required();
  command->add_option("--machine", options->machine,
                      "machine config (.toml); without it: all six words, no RTCP");
  command->add_flag("--canon", options->canon, "print NIST RS274/NGC canonical functions, one a line");
  command->add_option("--tools", options->tools, "tool table (.tbl)");
  command->add_option("--vars", options->variables, "variables (.var)");
  command
      ->add_flag("--save-vars", options->save_variables,
                 "write the variables back after a program without errors")
      ->needs(command->get_option("--vars"));
  command->add_flag("--block-delete", options->block_delete, "skip lines that begin with '/'");
  command->add_option("--max-errors", options->max_errors, "give up after this many errors")
      ->check(CLI::PositiveNumber);
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trn
