#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "hal/lcm_messages.h"
#include "hal/udp_group.h"

namespace trn {

/// Every machine whose daemon tells its status over LCM. What comes from a network is shown and moves
/// nothing. At most kMachinesMax are kept; who has been silent for a minute is forgotten.
class Fleet {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMachinesMax = 200;

  /// `url` as in [lcm]; empty, or where this host cannot listen: no machine is ever seen. `pages`: addresses
  /// of other panels by the names of their machines.
  Fleet(const std::string& url, std::map<std::string, std::string> pages);

  /// Takes what has come; true once a second, when pages are to be told anew. A page knows by that, too, that
  /// the panel lives.
  bool step(Clock::time_point now);
  /// Sorted by name.
  nlohmann::json machines(Clock::time_point now) const;
  /// Why nothing can be heard; "": it can.
  const std::string& silent() const { return silent_; }

 private:
  struct Seen {
    trunnion::status_t status;
    WireSender sender;
    Clock::time_point heard;
  };

  void take(std::span<const std::uint8_t> datagram, const WireSender& sender, Clock::time_point now);

  std::map<std::string, std::string> pages_;
  std::string silent_;
  std::unique_ptr<UdpReceiver> in_;
  std::map<std::string, Seen> seen_;
  Clock::time_point told_;
};

}  // namespace trn
