#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "app/client/command_client.h"
#include "core/machine.h"

namespace trn {

/// The machine that a client is for. `machine`: a config, or the name of one whose daemon runs here; "": the
/// one that runs. NoAnswer where that is not one, ConfigError. Over a gateway (`key_file`) it must be a
/// config.
Machine client_machine(const std::string& machine, const std::string& key_file);

/// A client of the machine's daemon: over its socket on this host, or, where `key_file` names a private key,
/// signed and through the machine's gateway. NoAnswer, KeyError, ConfigError where the config has no gateway.
CommandClient make_client(const Machine& machine, const std::string& key_file, double timeout_s);

/// How long a client waits for its daemon where nobody says another time.
inline constexpr double kTimeout_s = 2;

/// Adds `--timeout`, which an environment variable may give to all clients at once.
void add_timeout(CLI::App& client, double& timeout_s);

/// What `--remote` means, for its help.
inline constexpr const char* kRemoteHelp =
    "From another host: sign with this private key ('trunnion key make'), and go through the machine's "
    "gateway";

}  // namespace trn
