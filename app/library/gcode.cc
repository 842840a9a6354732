#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "app/library/as_error.h"
#include "app/library/move_list.h"
#include "app/library/trunnion.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"

namespace trunnion {

namespace {

std::vector<Move> moves_of(const std::string& tools_file,
                           const std::function<void(trn::Interpreter&)>& open) {
  trn::ProgramConfig config;
  trn::Parameters parameters;
  trn::ToolTable tools;
  if (!tools_file.empty()) tools = trn::ToolTable::load(tools_file, config.parameter_unit_mm);
  trn::MoveList list;
  trn::Lowering lowering(config, nullptr, list);
  trn::Interpreter interpreter({config, parameters, tools, nullptr, lowering, {}, false, true});
  open(interpreter);
  while (interpreter.step())
    if (interpreter.loops_long())
      throw Error(interpreter.place_of(interpreter.line(), 0) +
                  ": the program still goes round, perhaps for ever");
  return std::move(list.moves);
}

}  // namespace

std::vector<Move> read_gcode(const std::string& file, const std::string& tools) {
  return trn::as_error(
      [&] { return moves_of(tools, [&](trn::Interpreter& program) { program.open(file); }); });
}

std::vector<Move> read_gcode_text(const std::string& text, const std::string& tools,
                                  const std::string& name) {
  return trn::as_error(
      [&] { return moves_of(tools, [&](trn::Interpreter& program) { program.open_text(text, name); }); });
}

}  // namespace trunnion
