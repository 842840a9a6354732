#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <stdexcept>

#include "app/cli/commands.h"
#include "app/cli/config_keys.h"
#include "app/cli/config_page.h"
#include "app/cli/config_specimens.h"

namespace trn {

namespace {

struct ConfigOptions {
  bool keys = false, json = false;
};

constexpr const char kConfigFooter[] =
    "Every key of a machine's config with its range, unit, default and meaning, as docs/config.md has them:\n"
    "  trunnion config --keys > docs/config.md\n"
    "The readers of all kinds of machines and drives are run, and what they ask for is written down.\n"
    "Exit: 0 done, 4 a key has no meaning or a meaning no key, 5 usage.\n";

void show_keys(const ConfigOptions& options) {
  const ConfigKeys keys = gather_keys(ask_all_readers());
  if (const std::vector<std::string> errors = keys.check(); !errors.empty())
    throw std::runtime_error(fmt::format("{}", fmt::join(errors, "\n")));
  fmt::print("{}", options.json ? config_json(keys).dump(2) + "\n" : config_page(keys));
}

}  // namespace

void add_config(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ConfigOptions>();
  CLI::App* command = app.add_subcommand("config", "what the config of a machine may say");
  command->add_flag("--keys", options->keys, "every key that there is, as Markdown")->required();
  command->add_flag("--json", options->json, "the same as JSON");
  command->footer(kConfigFooter);
  command->callback([options, &exit] {
    show_keys(*options);
    exit = Exit::kDone;
  });
}

}  // namespace trn
