#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "app/client/command_client.h"
#include "hal/lcm_messages.h"
#include "tests/world/programs.h"
#include "tests/world/watched_drives.h"

namespace trn::world {

/// What the clients of a session share.
struct ClientWorld {
  CommandClient::Config config;
  std::vector<std::string> programs;  ///< paths
  WatchedDrives& drives;
  Means means;
  bool home_first = false;
  std::atomic<bool> closing = false;  ///< the daemon was told to end: it need not answer any more
};

/// Work offsets that were sent by MDI: what the file of variables must hold.
class KeptOffsets {
 public:
  explicit KeptOffsets(double at_first) : sure_(at_first), last_(at_first) {}
  static constexpr int kParameter = 5241;  ///< X of G55
  /// The next line; each has another value.
  std::string next_line();
  void accepted() {
    sure_ = last_;
    perhaps_.clear();
  }
  /// "" or what is wrong with a file of variables that a power cut left.
  std::string judge(bool there, const std::string& text) const;

 private:
  double sure_, last_;
  std::set<double> perhaps_;  ///< sent since, and not acknowledged
};

/// Uses the machine as a person would who is in a hurry, until the daemon ends.
void operate(ClientWorld& world, KeptOffsets& offsets, std::uint64_t seed);
/// Asks everything twice and more, and compares the answers.
void doubt(ClientWorld& world, std::uint64_t seed);
/// Sends what is no message, or nearly one; leaves in the middle.
void harass(ClientWorld& world, std::uint64_t seed);
/// Commands an emergency stop now and then.
void guard(ClientWorld& world, std::uint64_t seed);

}  // namespace trn::world
