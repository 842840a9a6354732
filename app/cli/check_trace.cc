#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "app/check/trace_check.h"
#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "core/config.h"
#include "core/machine.h"

namespace trn {

namespace {

struct CheckTraceOptions {
  std::string trace;
  std::string machine;
  bool json = false;
};

constexpr const char kCheckTraceFooter[] =
    "Position, velocity, acceleration and jerk of every motor joint, as first, second and third differences "
    "of\n"
    "the recorded setpoints over the time step, at rest before the first and after the last row, against "
    "the\n"
    "machine's limits. 'digits +-' is what rounding of the recorded digits alone can do to a ratio; nothing "
    "is\n"
    "subtracted for it. A trace may be written denser than the period. A daemon's recording is judged in\n"
    "pieces, between which the drives had no power (emergency stop, homing, reset).\n"
    "Exit: 0 every ratio <= 1.000001, 2 damaged trace, 3 bad config, 4 a limit is broken, 5 usage.\n";

void show_progress(std::uint64_t rows) {
  if (isatty(STDERR_FILENO)) fmt::print(stderr, "\r{} rows", rows);
}

Exit judge(const CheckTraceOptions& options) {
  const Machine machine = read_machine(load_config(options.machine));
  const TraceVerdict verdict = check_trace(options.trace, machine, show_progress);
  if (isatty(STDERR_FILENO)) fmt::print(stderr, "\r");
  fmt::print("{}", options.json ? verdict_json(verdict, machine, options.trace)
                                : verdict_table(verdict, machine, options.trace));
  return verdict.within_limits ? Exit::kDone : Exit::kMachineFault;
}

}  // namespace

void add_check_trace(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<CheckTraceOptions>();
  CLI::App* command =
      app.add_subcommand("check-trace", "Judge a recorded trace against the machine's limits");
  command
      ->add_option("TRACE", options->trace,
                   "CSV written by 'run --trace' or 'daemon --record', or - for standard input")
      ->required();
  command->add_option("--machine,-m", options->machine, kMachineOption)->required();
  command->add_flag("--json", options->json, "the verdict as JSON (mm, rad, s)");
  command->footer(kCheckTraceFooter);
  command->callback([options, &exit] { exit = judge(*options); });
}

}  // namespace trn
