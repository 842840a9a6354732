#pragma once

#include <string>
#include <vector>

namespace trn {

/// A daemon that answers on this host, and that this user may ask.
struct RunningDaemon {
  std::string machine;      ///< its name
  std::string config_file;  ///< whole path, as the daemon read it
};

/// All of them whose sockets lie where clients look without a config.
std::vector<RunningDaemon> find_daemons();

/// The config of the one daemon that runs; or, with a name, of the daemon of this machine. NoAnswer, with
/// what there is, if that is not one.
std::string config_of_daemon(const std::string& machine);

/// Tells one content of a file from another: 16 digits of its hash; "" if it cannot be read.
std::string file_mark(const std::string& path);

}  // namespace trn
