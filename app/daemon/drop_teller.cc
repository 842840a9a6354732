#include "app/daemon/drop_teller.h"

#include <fmt/format.h>

#include <utility>

namespace trn {

std::string DropTeller::look(std::uint64_t dropped, std::chrono::steady_clock::time_point now) {
  if (dropped == told_ || now < quiet_until_) return "";
  quiet_until_ = now + std::chrono::minutes(1);
  const std::uint64_t before = std::exchange(told_, dropped);
  return fmt::format("{} packets of clients were no messages and were dropped", dropped - before);
}

}  // namespace trn
