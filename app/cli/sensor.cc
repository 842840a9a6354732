#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "app/cli/client_line.h"
#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/client/command_client.h"
#include "app/daemon/telemetry.h"
#include "app/session/assembly.h"
#include "core/machine.h"

namespace trn {

namespace {

struct SensorOptions {
  std::string machine, remote, name;
  double value = 0, every_s = 0, timeout_s = kTimeout_s;
};

Exit send_reading(const SensorOptions& options) {
  const Machine machine = client_machine(options.machine, options.remote);
  const std::vector<std::string> names = assemble_planning(machine.root).corrections.sensors->names();
  if (std::find(names.begin(), names.end(), options.name) == names.end())
    throw CLI::ValidationError(
        "name", fmt::format("no correction asks for a sensor '{}'; they ask for: {}", options.name,
                            names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  CommandClient client = make_client(machine, options.remote, options.timeout_s);
  trunnion::sensor_t reading;
  reading.count = 1;
  reading.name = {options.name};
  reading.value = {options.value};
  do {
    reading.time_us = unix_time_us();
    client.send_sensor(reading);
    std::this_thread::sleep_for(std::chrono::duration<double>(options.every_s));
  } while (options.every_s > 0);
  return Exit::kDone;
}

}  // namespace

void add_sensor(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<SensorOptions>();
  CLI::App* command = app.add_subcommand(
      "sensor", "Give the daemon's corrections a reading, as the temperature of a ball screw");
  command->add_option("name", options->name, "as the config's corrections name it")->required();
  command->add_option("value", options->value, "temperature in degrees Celsius")->required();
  command->add_option("--machine,-m", options->machine, kMachineHelp)->envname("TRUNNION_MACHINE");
  command->add_option("--remote", options->remote, kRemoteHelp);
  add_timeout(*command, options->timeout_s);
  command->add_option("--every", options->every_s, "go on, with one reading every so many seconds")
      ->check(CLI::PositiveNumber);
  command->callback([options, &exit] { exit = send_reading(*options); });
}

}  // namespace trn
