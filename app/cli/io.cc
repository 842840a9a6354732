#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/lab/text_file.h"
#include "app/lab/wiring.h"
#include "app/session/assembly.h"

namespace trn {

namespace {

using Json = nlohmann::ordered_json;

struct IoOptions {
  std::string machine, svg;
  bool json = false;
};

constexpr const char kIoFooter[] =
    "What is wired to what by the config: signals, safety inputs, brakes, values of devices on a field bus,\n"
    "and what the simulation wires.\n"
    "For example: trunnion io --machine gantry_router --svg wiring.svg\n"
    "docs/config.md, chapter \"Wiring of signals\", has the keys. What needs logic is a client of the "
    "daemon\n"
    "(examples/clients).\n"
    "Exit: 0 done, 3 bad config, 5 usage, or the drawing cannot be written.\n";

const char* kind_text(WireRow::Kind kind) {
  constexpr const char* kKinds[] = {"signal", "safety", "brake", "field bus",
                                    "simulated"};  // as WireRow::Kind
  return kKinds[static_cast<std::size_t>(kind)];
}

Exit show_wiring(const IoOptions& options) {
  const Assembly assembly = assemble(options.machine);
  const std::vector<WireRow> rows = wiring_of(assembly);
  if (!options.svg.empty()) write_text_file(options.svg, wiring_svg(assembly.machine.name, rows));
  if (options.json) {
    Json out = Json::array();
    for (const WireRow& row : rows)
      out.push_back({{"kind", kind_text(row.kind)},
                     {"name", row.name},
                     {"from", row.from},
                     {"to", row.to},
                     {"how", row.how}});
    fmt::print("{}\n", out.dump(2));
    return Exit::kDone;
  }
  std::size_t from = 0, to = 0, name = 0;
  for (const WireRow& row : rows) {
    from = std::max(from, row.from.size());
    to = std::max(to, row.to.size());
    name = std::max(name, row.name.size());
  }
  for (const WireRow& row : rows)
    fmt::print("{:<{}}  {:<{}} -> {:<{}}{}{}\n", row.name, name, row.from, from, row.to,
               row.how.empty() ? 0 : to, row.how.empty() ? "" : "  ", row.how);
  if (rows.empty()) fmt::print("{}: nothing is wired\n", options.machine);
  return Exit::kDone;
}

}  // namespace

void add_io(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<IoOptions>();
  CLI::App* command = app.add_subcommand("io", "Show what is wired to what, and draw it");
  command->add_option("--machine,-m", options->machine, kMachineOption)->required();
  command->add_option("--svg", options->svg, "draw it into this file");
  command->add_flag("--json", options->json, "as JSON");
  command->footer(kIoFooter);
  command->callback([options, &exit] { exit = show_wiring(*options); });
}

}  // namespace trn
