#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/config.h"
#include "kernel/commands/commands.h"
#include "kernel/fault_rehearsal.h"

namespace trn {

namespace {

using Json = nlohmann::ordered_json;

struct FaultOptions {
  std::string machine;
  bool json = false;
};

std::string_view reaction_text(Reaction reaction) {
  static constexpr std::string_view kNames[] = {"none", "path stop", "quick stop"};
  return kNames[static_cast<std::size_t>(reaction)];
}

Json json_of(const RehearsedFault& row) {
  return {{"cause", row.cause},
          {"fault", fault_info(row.fault).name},
          {"reaction", reaction_text(fault_info(row.fault).reaction)},
          {"periods_to_fault", row.to_fault},
          {"periods_to_rest", row.to_rest},
          {"crept", row.crept},
          {"position_kept", row.kept_position},
          {"periods_to_recover", row.to_recover},
          {"message", row.message},
          {"good", row.good()}};
}

void print_row(const RehearsedFault& row) {
  const std::string to_fault = row.to_fault < 0 ? "-" : std::to_string(row.to_fault);
  fmt::print("{:<38} {:<16} {:<11} {:>5} {:>6} {:>8.1g}  {:<5} {:>7}  {}\n", row.cause,
             fault_info(row.fault).name, reaction_text(fault_info(row.fault).reaction), to_fault, row.to_rest,
             row.crept, row.kept_position ? "yes" : "lost", row.to_recover,
             row.good() ? "" : "NOT AS IT SHOULD");
  if (!row.message.empty()) fmt::print("    {}\n", row.message);
  std::fflush(stdout);
}

Exit rehearse(const FaultOptions& options) {
  if (!options.json)
    fmt::print("{:<38} {:<16} {:<11} {:>5} {:>6} {:>8}  {:<5} {:>7}\n", "cause, in the middle of a motion",
               "fault", "reaction", "fault", "rest", "creeps", "place", "recover");
  bool good = true;
  Json rows = Json::array(), steps = Json::array();
  for (const RehearsedFault& row : rehearse_faults(options.machine, [&](const RehearsedFault& done) {
         if (!options.json) print_row(done);
       })) {
    good &= row.good();
    rows.push_back(json_of(row));
  }
  if (!options.json) fmt::print("\nbring-up with a drive that refuses an object\n");
  for (const RefusedStep& step : rehearse_refusals(options.machine)) {
    const bool fine = !step.moved && step.recovered;
    good &= fine;
    steps.push_back({{"object", step.object}, {"message", step.message}, {"good", fine}});
    if (!options.json)
      fmt::print("{}  {}\n", step.object, step.message.empty() ? "not needed by this machine" : step.message);
  }
  if (options.json) fmt::print("{}\n", Json{{"faults", rows}, {"bring_up", steps}, {"good", good}}.dump(2));
  return good ? Exit::kDone : Exit::kMachineFault;
}

Exit guarded(const FaultOptions& options) {
  try {
    return rehearse(options);
  } catch (const ConfigError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadConfig;
  } catch (const std::exception& error) {
    fmt::print(stderr, "trunnion can faults: {}\n", error.what());
    return Exit::kMachineFault;
  }
}

}  // namespace

void add_can_faults(CLI::App& can, Exit& exit) {
  auto options = std::make_shared<FaultOptions>();
  CLI::App* sub = can.add_subcommand("faults", "Rehearse everything that can go wrong on the bus, in memory");
  sub->add_option("--machine", options->machine, "Config of the machine (configs/X.toml)")->required();
  sub->add_flag("--json", options->json, "For programs");
  sub->footer(
      "For every row the machine of the config is brought up on emulated drives, homed and put in motion; "
      "then\n"
      "the cause happens. fault: periods from cause to latched fault; rest: until no drive moves; creeps: "
      "way\n"
      "in the second after that (mm, rad); place: position kept; recover: periods from 'reset' to enabled.\n"
      "Exit codes: 0 every row is as it should be, 3 bad config, 4 a row is not, 5 usage.");
  sub->callback([&exit, options] { exit = guarded(*options); });
}

}  // namespace trn
