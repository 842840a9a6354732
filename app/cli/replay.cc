#include "app/session/replay.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "app/cli/commands.h"
#include "app/session/assembly.h"
#include "app/session/session_log.h"
#include "app/session/trace.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

namespace {

struct ReplayOptions {
  std::string log, machine, tools, vars, trace;
};

// As they were when the session began, unless another table is given.
ToolTable tools_of(const ReplayOptions& options, const SessionHead& head) {
  if (!options.tools.empty()) return ToolTable::load(options.tools);
  if (!head.tools_text.empty()) return ToolTable::parse(head.tools_text, options.log + " (tools)");
  return head.tools.empty() ? ToolTable() : ToolTable::load(head.tools);
}

Exit replay_session(const ReplayOptions& options) {
  const Session session = read_session(options.log);
  if (session.torn_line > 0)
    fmt::print(stderr, "{}:{}: the last line is cut off, as by a power cut; it is left out\n", options.log,
               session.torn_line);
  const auto chosen = [](const std::string& ours, const std::string& logged) {
    return ours.empty() ? logged : ours;
  };
  const Assembly assembly = assemble(chosen(options.machine, session.head.machine));
  ToolTable tools = tools_of(options, session.head);
  Parameters parameters;
  if (!options.vars.empty())
    load_parameters(options.vars, parameters);
  else
    parse_parameters(session.head.vars_text, options.log + " (variables)", parameters);
  TraceWriter trace(options.trace, assembly.machine, *assembly.map, *assembly.corrections.setpoint, false,
                    !session.head.run);
  const ReplayResult result = replay(session, assembly, parameters, tools, trace);
  trace.close();
  if (const auto& gap = result.gap)
    fmt::print(stderr,
               "{}: from period {} to {}, {} entries could not be written; what happened from there on is "
               "not known, "
               "and the replay ends\n",
               options.log, gap->since, gap->period, gap->lost);
  fmt::print("{} entries, {} periods, {} starvations, fault {}: {}\n", session.entries.size(), result.periods,
             result.starvations, fault_info(result.fault).name, options.trace);
  return Exit::kDone;
}

}  // namespace

void add_replay(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command = app.add_subcommand("replay",
                                         "Run a session again from its log (daemon --log, run --log). There "
                                         "are no drives and no clock; the setpoints are the same bits");
  command->add_option("log", options->log, "the session's log")->required();
  command->add_option("--trace", options->trace, "write the setpoints of every period (CSV)")->required();
  command->add_option("--machine,-m", options->machine, "config, if it is not where the log says");
  command->add_option("--tools", options->tools, "tool table instead of the one that the log has");
  command->add_option("--vars", options->vars, "variables instead of those that the log has");
  command->footer(
      "Compare: the daemon's own --record of that session, or the run's --trace, and the trace are equal "
      "files.");
  command->callback([options, &exit] { exit = replay_session(*options); });
}

}  // namespace trn
