#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "app/cli/commands.h"
#include "app/cli/fault_rows.h"
#include "app/cli/named_files.h"
#include "app/lab/fault_rehearsal.h"
#include "app/lab/modbus_rehearsal.h"

namespace trn {

namespace {

struct FaultOptions {
  std::string machine;
  bool json = false;
};

Exit rehearse(const FaultOptions& options) {
  bool good = true, begun = options.json;
  auto rows = nlohmann::ordered_json::array();
  for (const RehearsedFault& row : rehearse_modbus_faults(options.machine, [&](const RehearsedFault& done) {
         if (!std::exchange(begun, true)) print_fault_header();
         if (!options.json) print_fault_row(done);
       })) {
    good &= row.good();
    rows.push_back(json_of(row));
  }
  if (options.json) fmt::print("{}\n", nlohmann::ordered_json{{"faults", rows}, {"good", good}}.dump(2));
  return good ? Exit::kDone : Exit::kMachineFault;
}

}  // namespace

void add_modbus_faults(CLI::App& modbus, Exit& exit) {
  auto options = std::make_shared<FaultOptions>();
  CLI::App* sub =
      modbus.add_subcommand("faults", "Rehearse what can go wrong with the devices, on emulated ones");
  sub->add_option("--machine,-m", options->machine, kMachineOption)->required();
  sub->add_flag("--json", options->json, "Write JSON, for programs");
  sub->footer(
      std::string(
          "For every row the machine of the config, with simulated drives and its devices emulated\n"
          "on loopback TCP and pseudo-terminals, is put in motion with the spindle on, in real time;\n"
          "then the cause happens.\n") +
      kFaultColumns);
  sub->callback([&exit, options] { exit = rehearse(*options); });
}

}  // namespace trn
