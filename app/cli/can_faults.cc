#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "app/cli/commands.h"
#include "app/cli/fault_rows.h"
#include "app/cli/named_files.h"
#include "app/lab/fault_rehearsal.h"

namespace trn {

namespace {

using Json = nlohmann::ordered_json;

struct FaultOptions {
  std::string machine;
  bool json = false;
};

Exit rehearse(const FaultOptions& options) {
  bool good = true, begun = options.json;
  Json rows = Json::array(), steps = Json::array();
  for (const RehearsedFault& row : rehearse_faults(options.machine, [&](const RehearsedFault& done) {
         if (!std::exchange(begun, true)) print_fault_header();
         if (!options.json) print_fault_row(done);
       })) {
    good &= row.good();
    rows.push_back(json_of(row));
  }
  if (!options.json) fmt::print("\nbring-up with a drive that refuses an object\n");
  for (const RefusedStep& step : rehearse_refusals(options.machine)) {
    const bool fine = !step.moved && step.recovered;
    good &= fine;
    steps.push_back(
        {{"object", step.object}, {"message", step.message}, {"warning", step.warning}, {"good", fine}});
    if (!options.json)
      fmt::print("{}  {}\n", step.object,
                 !step.message.empty()  ? step.message
                 : step.warning.empty() ? "not needed by this machine"
                                        : "warning: " + step.warning);
  }
  if (options.json) fmt::print("{}\n", Json{{"faults", rows}, {"bring_up", steps}, {"good", good}}.dump(2));
  return good ? Exit::kDone : Exit::kMachineFault;
}

}  // namespace

void add_can_faults(CLI::App& can, Exit& exit) {
  auto options = std::make_shared<FaultOptions>();
  CLI::App* sub =
      can.add_subcommand("faults", "Rehearse what can go wrong on the bus, with emulated drives in memory");
  sub->add_option("--machine,-m", options->machine, kMachineOption)->required();
  sub->add_flag("--json", options->json, "Write JSON, for programs");
  sub->footer(
      std::string("For every row the machine of the config is brought up on emulated drives, homed and put\n"
                  "in motion; then the cause happens.\n") +
      kFaultColumns);
  sub->callback([&exit, options] { exit = rehearse(*options); });
}

}  // namespace trn
