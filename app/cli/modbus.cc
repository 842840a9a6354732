#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/commands.h"
#include "hal/modbus/modbus_link.h"

namespace trn {

namespace {

struct ModbusOptions {
  std::string address, table = "holding";
  int unit = 1, first = 0, count = 1, last = 247;
  std::vector<std::uint16_t> values;
  double timeout_s = 0.3;
  bool json = false;
};

ModbusTable table_of(const std::string& name) {
  for (const ModbusTable table : {ModbusTable::kCoil, ModbusTable::kDiscrete, ModbusTable::kInput})
    if (to_string(table) == name) return table;
  return ModbusTable::kHolding;
}

Exit fail(const std::string& what) {
  fmt::print(stderr, "trunnion modbus: {}\n", what);
  return Exit::kMachineFault;
}

// A device that refuses the register answers all the same.
Exit scan(const ModbusOptions& options) {
  ModbusLink link(parse_modbus_address(options.address), options.timeout_s);
  std::vector<int> found;
  for (int unit = 1; unit <= options.last; ++unit) {
    std::vector<std::uint16_t> words;
    const std::string trouble = link.read(unit, ModbusTable::kHolding, 0, 1, words);
    const bool answers = trouble.empty() || trouble.find("Illegal") != std::string::npos;
    if (trouble.find("cannot be opened") != std::string::npos) return fail(trouble);
    if (!answers) continue;
    found.push_back(unit);
    if (!options.json) fmt::print("unit {} answers\n", unit);
  }
  if (options.json) fmt::print("{}\n", nlohmann::json(found).dump());
  return found.empty() ? fail("nobody answers; check supply, wiring, bit rate and parity") : Exit::kDone;
}

Exit read(const ModbusOptions& options) {
  ModbusLink link(parse_modbus_address(options.address), options.timeout_s);
  std::vector<std::uint16_t> words;
  const std::string trouble =
      link.read(options.unit, table_of(options.table), options.first, options.count, words);
  if (!trouble.empty()) return fail(trouble);
  if (options.json) fmt::print("{}\n", nlohmann::json(words).dump());
  for (std::size_t i = 0; i < words.size() && !options.json; ++i)
    fmt::print("{} {}: {} (0x{:04X}, signed {})\n", options.table, options.first + static_cast<int>(i),
               words[i], words[i], static_cast<std::int16_t>(words[i]));
  return Exit::kDone;
}

Exit write(const ModbusOptions& options) {
  ModbusLink link(parse_modbus_address(options.address), options.timeout_s);
  const std::string trouble =
      link.write(options.unit, table_of(options.table), options.first, options.values);
  return trouble.empty() ? Exit::kDone : fail(trouble);
}

Exit guarded(const ModbusOptions& options, Exit (*command)(const ModbusOptions&)) {
  try {
    return command(options);
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}

}  // namespace

void add_modbus(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ModbusOptions>();
  CLI::App* modbus = app.add_subcommand("modbus", "Look at Modbus devices, and talk to them");
  modbus->require_subcommand(1);
  modbus->footer(
      "ADDRESS is tcp:HOST[:PORT] or rtu:DEVICE[:BAUD[:N|E|O]].\n"
      "Example: trunnion modbus read rtu:/dev/ttyUSB0:19200:E --unit 3 --table input --first 0 --count 4");
  const auto add = [&](const std::string& name, const std::string& help,
                       Exit (*command)(const ModbusOptions&)) {
    CLI::App* sub = modbus->add_subcommand(name, help);
    sub->add_option("address", options->address, "tcp:HOST[:PORT] or rtu:DEVICE[:BAUD[:N|E|O]]")->required();
    sub->add_option("--timeout", options->timeout_s, "Seconds to wait for an answer")
        ->check(CLI::PositiveNumber);
    sub->callback([&exit, options, command] { exit = guarded(*options, command); });
    return sub;
  };
  CLI::App* scan_app = add("scan", "Ask every unit whether it is there", scan);
  scan_app->add_option("--last", options->last, "Highest unit to ask")->check(CLI::Range(1, 247));
  scan_app->add_flag("--json", options->json, "Write JSON, for programs");
  CLI::App* read_app = add("read", "Read coils, inputs or registers", read);
  CLI::App* write_app = add("write", "Write a coil or holding registers", write);
  for (CLI::App* sub : {read_app, write_app}) {
    sub->add_option("--unit", options->unit, "Unit (slave address)")->check(CLI::Range(0, 247));
    sub->add_option("--table", options->table, "coil, discrete, input or holding")
        ->check(CLI::IsMember({"coil", "discrete", "input", "holding"}));
    sub->add_option("--first", options->first, "First address, counted from 0")->check(CLI::Range(0, 65535));
  }
  read_app->add_option("--count", options->count, "How many")->check(CLI::Range(1, 120));
  read_app->add_flag("--json", options->json, "Write JSON, for programs");
  write_app->add_option("values", options->values, "Numbers, 0 to 65535")->required();
  add_modbus_faults(*modbus, exit);
}

}  // namespace trn
