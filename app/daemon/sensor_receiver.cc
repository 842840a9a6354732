#include "app/daemon/sensor_receiver.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

namespace trn {

namespace {
constexpr std::size_t kShownMax = 40;
constexpr std::size_t kUnknownMax = 100;
}  // namespace

std::string shown_name(const std::string& name) {
  std::string out = name.substr(0, kShownMax);
  for (char& c : out)
    if (c < ' ' || c > '~') c = '?';
  return out;
}

void SensorReceiver::receive(const trunnion::sensor_t& readings, const std::string& stranger) {
  if (!stranger.empty()) {
    if (!std::exchange(told_stranger_, true))
      spdlog::warn("sensor readings of {} are not taken: no right to operate", stranger);
    return;
  }
  for (std::size_t i = 0; i < readings.name.size(); ++i) {
    const int channel = board_.find(readings.name[i]);
    if (channel >= 0)
      board_.publish(channel, readings.value[i]);
    else if (unknown_.size() < kUnknownMax && unknown_.insert(readings.name[i]).second)
      spdlog::warn("sensor '{}': no correction asks for it; they ask for: {}", shown_name(readings.name[i]),
                   board_.names().empty() ? "none" : fmt::format("{}", fmt::join(board_.names(), ", ")));
  }
}

}  // namespace trn
