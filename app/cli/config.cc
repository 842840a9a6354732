#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <stdexcept>

#include "app/cli/commands.h"
#include "app/cli/config_keys.h"
#include "app/cli/config_page.h"
#include "app/cli/config_schema.h"
#include "app/cli/config_specimens.h"
#include "app/cli/named_files.h"
#include "app/session/assembly.h"
#include "app/session/plausibility.h"

namespace trn {

namespace {

struct ConfigOptions {
  bool keys = false, json = false, schema = false;
  std::string check;
};

constexpr const char kConfigFooter[] =
    "Every key of a machine's config with its range, unit, default and meaning. For example, "
    "docs/config.md:\n"
    "  trunnion config --keys > docs/config.md\n"
    "An editor completes and checks a config by its schema (taplo; Even Better TOML in VS Code):\n"
    "  trunnion config --schema > machine.schema.json\n"
    "and in the first line of the config: #:schema ./machine.schema.json\n"
    "A config that is legal may still be wrong. What is hardly meant so is asked about:\n"
    "  trunnion config --check configs/mill.toml\n"
    "Exit: 0 done, 3 bad config, 4 a key has no meaning or a meaning no key, 5 usage.\n";

void show_keys(const ConfigOptions& options) {
  const ConfigKeys keys = gather_keys(ask_all_readers());
  if (const std::vector<std::string> errors = keys.check(); !errors.empty())
    throw std::runtime_error(fmt::format("{}", fmt::join(errors, "\n")));
  if (options.schema)
    fmt::print("{}\n", config_schema(keys).dump(1));
  else
    fmt::print("{}", options.json ? config_json(keys).dump(2) + "\n" : config_page(keys));
}

void ask_about(const std::string& file) {
  const Assembly assembly = assemble(file);
  const std::vector<std::string> questions = implausible(assembly.machine, *assembly.kinematics);
  for (const std::string& question : questions) fmt::print("is this right? {}\n", question);
  if (questions.empty()) fmt::print("{}: nothing to ask\n", file);
}

}  // namespace

void add_config(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ConfigOptions>();
  CLI::App* command = app.add_subcommand("config", "Tell what the config of a machine may say");
  CLI::Option* keys = command->add_flag("--keys", options->keys, "every key that there is, as Markdown");
  command->add_flag("--json", options->json, "with --keys: as JSON")->needs(keys);
  command->add_flag("--schema", options->schema, "a JSON schema for editors, which complete and check by it");
  command->add_option(
      "--check", options->check,
      "read this config, or that of a machine by its name, and ask about figures that are hardly "
      "right");
  command->footer(kConfigFooter);
  command->callback([options, &exit] {
    if (!options->keys && !options->schema && options->check.empty())
      throw CLI::RequiredError("--keys, --schema or --check");
    if (!options->check.empty()) ask_about(machine_of_name(options->check).value_or(options->check));
    if (options->keys || options->schema) show_keys(*options);
    exit = Exit::kDone;
  });
}

}  // namespace trn
