#pragma once

#include <unistd.h>

#include <string>

namespace trn {

/// A multicast group that stays on this host and that no other test process uses at the same time; the same
/// in its children.
inline std::string local_group() {
  static const pid_t process = getpid();
  return "udpm://239.255.76.68:" + std::to_string(20'000 + process % 20'000) + "?ttl=0";
}

}  // namespace trn
