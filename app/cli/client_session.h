#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/cli/client_line.h"
#include "app/cli/commands.h"
#include "app/client/command_client.h"
#include "core/machine.h"
#include "hal/lcm_messages.h"

// What the sub-commands share that talk to a daemon.
namespace trn {

/// What every client takes, and what the single ones take besides.
struct ClientOptions {
  std::string machine;
  std::string remote;  // file of a private key; empty: the daemon's socket
  double timeout_s = kTimeout_s;
  bool wait = false;
  double patience_s = 3600;
  bool json = false;
  bool lines = false;  // monitor: no screen
  bool yes = false;    // start --from: do not ask
  std::string text;    // program, MDI line, joint
  double amount = 0;   // override: percent
  long count = 0;      // monitor: lines, 0 = no end; start: first line
};

/// A client's view of its machine: the config and the line to its daemon.
struct ClientSession {
  explicit ClientSession(const ClientOptions& options);
  /// Warns, on stderr, if the daemon has read another config than this client. It waits for a status if none
  /// was heard yet: at most half a second, and at most half of `timeout_s`.
  void compare_configs(double timeout_s);
  Machine machine;
  CommandClient client;
};

/// One client: adds its sub-command with the options all clients share; `work` runs when it was chosen.
CLI::App& add_client(CLI::App& app, Exit& exit, const std::shared_ptr<ClientOptions>& options,
                     const std::string& name, const std::string& help,
                     std::function<Exit(const ClientOptions&)> work);
/// Adds --wait and --patience.
void add_wait(CLI::App& client, const std::shared_ptr<ClientOptions>& options);

/// Of the joint with this name in the config; CLI::ValidationError where there is none.
int joint_index(const Machine& machine, const std::string& name);
trunnion::command_t command_of(std::int8_t verb);
trunnion::command_t text_command(std::int8_t verb, const std::string& text);
/// Sends it and, if the options say so, waits until its work is over. The answer for people goes to stderr.
/// `typed`: what was typed for it, where that is not the command's own name.
Exit send(ClientSession& session, const ClientOptions& options, const trunnion::command_t& command,
          const std::string& typed = "");
Exit exit_of(const trunnion::acknowledge_t& answer);

/// `trunnion reverse` and `trunnion forward`.
void add_retrace(CLI::App& app, Exit& exit);
/// `trunnion wheel`.
void add_wheel(CLI::App& app, Exit& exit);
/// `trunnion jog`.
void add_jog(CLI::App& app, Exit& exit);

/// On one line; what came in a message may be any bytes.
std::string one_line(const nlohmann::ordered_json& json);

}  // namespace trn
