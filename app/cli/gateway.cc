#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "app/cli/commands.h"
#include "app/client/command_rights.h"
#include "app/client/signing_key.h"
#include "app/daemon/privileges.h"
#include "app/gateway/gateway_process.h"
#include "core/config.h"
#include "core/machine.h"

namespace trn {

namespace {

// What this process needs no more when its files and sockets are open. It looks for a daemon that was started
// anew, so it may make sockets.
void confine(const std::string& counters_folder) {
  Rights rights;
  rights.write_folders = {counters_folder};
  rights.real_time = false;
  for (const std::string& bad : give_up_privileges(rights)) spdlog::warn("NOT CLOSED: {}", bad);
}

void serve(const std::string& config) {
  const Machine machine = read_machine(load_config(config));
  const GatewayParts parts{read_lcm(machine.root, machine.name), read_access(machine.root),
                           read_gateway(machine.root)};
  if (parts.gateway.url.empty())
    throw machine.root.error("gateway",
                             "no other host may command this machine: '[gateway] url' is empty or not there");
  run_gateway(parts, confine);
}

void add_key_make(CLI::App& key) {
  auto file = std::make_shared<std::string>();
  auto name = std::make_shared<std::string>();
  auto role = std::make_shared<std::string>("look");
  CLI::App* make = key.add_subcommand("make", "Make a key, and print what the machine's config needs of it");
  make->add_option("file", *file, "Where the private key is written; must not be there yet")->required();
  make->add_option("name", *name, "Who will hold it: letters, digits and . _ @ -")->required();
  make->add_option("--role", *role, "What it may do: look (and stop), operate, or \"set up\"")
      ->check(CLI::IsMember({"look", "operate", "set up"}))
      ->capture_default_str();
  make->callback([file, name, role] {
    make_key_file(*file, *name);
    fmt::print("{}", config_section(*name, SigningKey::read(*file).public_key(), role_called(*role).value()));
  });
}

void add_key_show(CLI::App& key) {
  auto file = std::make_shared<std::string>();
  CLI::App* show = key.add_subcommand("show", "Print the public key and the name of a private key's file");
  show->add_option("file", *file, "As 'trunnion key make' wrote it")->required();
  show->callback([file] {
    const SigningKey read = SigningKey::read(*file);
    fmt::print("{}\n{}\n", text_of(read.public_key()), read.name());
  });
}

}  // namespace

void add_gateway(CLI::App& app, Exit& exit) {
  auto config = std::make_shared<std::string>();
  CLI::App* gateway = app.add_subcommand(
      "gateway", "Let signed commands of other computers in, and hand them to this computer's daemon");
  gateway
      ->add_option("--machine,-m", *config,
                   "The machine by its name, or its config (.toml); see [gateway] there")
      ->required();
  gateway->footer(
      "Clients of other hosts: trunnion start --machine CFG --remote KEY_FILE, and so on.\n"
      "Exit codes: 0 done, 3 bad config, 4 LCM, counters or keys cannot be used.");
  gateway->callback([&exit, config] {
    serve(*config);
    exit = Exit::kDone;
  });
}

void add_key(CLI::App& app) {
  CLI::App* key =
      app.add_subcommand("key", "Make and show the keys with which other computers sign their commands");
  key->require_subcommand(1);
  key->footer("Exit codes: 0 done, 4 the file cannot be used or written, 5 usage.");
  add_key_make(*key);
  add_key_show(*key);
}

}  // namespace trn
