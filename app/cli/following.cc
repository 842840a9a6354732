#include "app/lab/following.h"

#include <fmt/format.h>

#include <memory>
#include <string>

#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/cli/run_inputs.h"
#include "app/session/assembly.h"
#include "core/machine.h"

namespace trn {

namespace {

struct FollowingOptions {
  std::string program, machine, tools;
  bool json = false;
};

constexpr const char kFollowingFooter[] =
    "The program runs three times on the drives that the config emulates: with places alone, with velocities "
    "beside\nthem (0x60B1), and with velocities and torques (0x60B2). A following error is the distance "
    "between a measured\nplace and the setpoint that it belongs to.\n"
    "Example: trunnion following impeller --machine cradle_servo\n";

Exit following(FollowingOptions options) {
  options.program = with_examples(options.program);
  const RunInputs inputs = complete_inputs({options.program, options.machine, options.tools}, "");
  check_inputs(inputs);
  const auto make = [&] { return assemble(inputs.machine); };
  const std::vector<FollowingRun> runs = run_following(make, inputs.program, inputs.tools);
  const Machine machine = make().machine;
  if (!options.json)
    fmt::print("Following errors of {} on {}, period {:g} ms\n", inputs.program, machine.name,
               1000 * machine.period_s);
  fmt::print("{}", options.json ? following_json(runs, machine) : following_table(runs, machine));
  return Exit::kDone;
}

}  // namespace

void add_following(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<FollowingOptions>();
  CLI::App* command = app.add_subcommand(
      "following", "Tell how far the axes are behind their setpoints, with and without feed-forward");
  command->add_option("program", options->program, "G-code file; or an example by its name: impeller")
      ->required();
  command->add_option("--machine,-m", options->machine,
                      "the machine by its name, or its config (.toml), with a section [feed_forward]. "
                      "Without it, the program's first "
                      "lines name it");
  command->add_option("--tools", options->tools, "tool table (.tbl)");
  command->add_flag("--json", options->json, "the table as JSON (mm, degrees)");
  command->footer(kFollowingFooter);
  command->callback([options, &exit] { exit = following(*options); });
}

}  // namespace trn
