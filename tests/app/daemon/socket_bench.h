#pragma once

#include <gtest/gtest.h>

#include <string>

#include "app/client/access_config.h"
#include "app/daemon/access.h"
#include "hal/local_socket.h"

namespace trn {

/// A path for a socket that no other test uses.
inline std::string socket_of_test() {
  static int count = 0;
  return testing::TempDir() + "socket" + std::to_string(++count);
}

/// A daemon's socket and a client of it, both of this process and in one thread.
struct SocketBench {
  std::string path = socket_of_test();
  AccessRules access{AccessConfig{}};
  LocalServer server{path, static_cast<gid_t>(-1)};
  LocalClient client{path};

  /// Whatever was sent arrives, in both directions.
  void pump() {
    while (server.handle(0) || client.handle(0)) {
    }
  }
};

}  // namespace trn
