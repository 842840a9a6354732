#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/machine.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/canon_printer.h"
#include "interp/gcode/error.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "kinematics/factory.h"
#include "tests/support/paths.h"

namespace trn::test {

/// Keeps the canonical functions as text.
class CanonText : public CanonSink {
 public:
  void put(const CanonCommand& command, std::uint32_t) override {
    std::string line;
    CanonPrinter::print(command, line);
    if (!line.empty()) text += line + "\n";
  }
  std::string text;
};

/// Keeps the planner's moves and events.
class MoveList : public MoveSink {
 public:
  void move(const ProgramMove& move) override { moves.push_back(move); }
  void event(const QueueEvent& event, SourceLine) override { events.push_back(event); }
  std::vector<ProgramMove> moves;
  std::vector<QueueEvent> events;
};

/// Three tools, mm.
inline ToolTable small_table() {
  return ToolTable::parse("T1 P1 D6 Z+50\nT2 P2 D10 Z+80.5 ;end mill\nT3 P3 D0 X+1 Z+30\n", "t.tbl");
}

/// A program with everything it needs; without `kinematics` it has six axes and no RTCP.
struct Session {
  ProgramConfig config;
  Parameters parameters;
  ToolTable tools = small_table();
  std::shared_ptr<const Kinematics> kinematics;
  std::vector<std::string> warnings;
  std::uint64_t blocks = 0;

  void run(const std::string& program, CanonSink& sink, int steps_max = 1'000'000'000) {
    Interpreter interpreter({config, parameters, tools, kinematics.get(), sink,
                             [&](const Diagnostic& warning) { warnings.push_back(warning.text); }});
    interpreter.open_text(program, "p.ngc");
    while (steps_max-- > 0 && interpreter.step()) {
    }
    blocks = interpreter.blocks();
  }
  /// Canonical functions after the six of the start, without those of the program's end.
  std::string canon(const std::string& program) {
    CanonText sink;
    run(program + "\nM2\n", sink);
    std::size_t start = 0;
    for (int i = 0; i < 6; ++i) start = sink.text.find('\n', start) + 1;
    const std::size_t end = sink.text.rfind("SET_G5X_OFFSET(1");
    return sink.text.substr(start, end - start);
  }
  MoveList moves(const std::string& program) {
    MoveList list;
    Lowering lowering(config, kinematics.get(), list);
    run(program, lowering);
    return list;
  }
  /// what() of the error that the program ends with; "" if it has none.
  std::string error(const std::string& program) {
    CanonText sink;
    try {
      run(program + "\nM2\n", sink);
    } catch (const GcodeError& error) {
      return error.what();
    }
    return {};
  }
};

inline std::string canon(const std::string& program) { return Session().canon(program); }

/// A shipped machine: its kinematics and [program].
inline Session shipped(const std::string& name) {
  const Machine machine = read_machine(load_config(source_dir() + "/configs/" + name + ".toml"));
  Session session;
  session.kinematics = make_kinematics(machine);
  session.config = read_program_config(machine.root);
  return session;
}
inline Session cradle() { return shipped("cradle"); }

/// Expands "T 1 2 3" and "F 1 2 3" to STRAIGHT_TRAVERSE and STRAIGHT_FEED with zero rotary words; other lines
/// stay.
inline std::string moves(std::initializer_list<std::string> lines) {
  std::string text;
  for (const std::string& line : lines) {
    double x = 0, y = 0, z = 0;
    char kind = 0;
    if (std::sscanf(line.c_str(), "%c %lf %lf %lf", &kind, &x, &y, &z) == 4)
      text += fmt::format("STRAIGHT_{}({:.4f}, {:.4f}, {:.4f}, 0.0000, 0.0000, 0.0000)\n",
                          kind == 'T' ? "TRAVERSE" : "FEED", x, y, z);
    else
      text += line + "\n";
  }
  return text;
}

}  // namespace trn::test
