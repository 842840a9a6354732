#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "hal/can/bus.h"
#include "hal/can/frame.h"

namespace trn {

/// What a bad cable, a hasty node or a foreign one makes of answers: cut, twice, late, or of somebody else.
/// Not answers that a node of its own makes up, for nobody can tell these from true ones.
class HostileBus : public CanEndpoint {
 public:
  /// `strike` of 100 frames with the identifier `answers` are struck.
  HostileBus(CanEndpoint& bus, std::uint32_t answers, unsigned seed, int strike, std::int64_t late_ns)
      : bus_(bus), answers_(answers), random_(seed), strike_(strike), late_ns_(late_ns) {}

  int send(std::span<const CanFrame> frames) noexcept override { return bus_.send(frames); }
  int receive(std::span<CanFrame> frames) noexcept override {
    std::array<CanFrame, 64> in;
    for (int count = bus_.receive(in); count > 0; count = bus_.receive(in))
      for (int i = 0; i < count; ++i) take(in[static_cast<std::size_t>(i)]);
    std::size_t taken = 0;
    for (auto it = waiting_.begin(); it != waiting_.end() && taken < frames.size();) {
      if (it->first > now_ns()) {
        ++it;
        continue;
      }
      frames[taken++] = it->second;
      it = waiting_.erase(it);
    }
    return static_cast<int>(taken);
  }
  BusState state() const noexcept override { return bus_.state(); }
  std::int64_t now_ns() const noexcept override { return bus_.now_ns(); }
  void wait(std::int64_t timeout_ns) override { bus_.wait(timeout_ns); }
  std::string recover() override { return bus_.recover(); }
  int struck() const { return struck_; }

 private:
  int up_to(int most) { return static_cast<int>(random_() % static_cast<unsigned>(most + 1)); }

  void take(CanFrame frame) {
    if (frame.id != answers_ || up_to(99) >= strike_) {
      waiting_.emplace_back(now_ns(), frame);
      return;
    }
    ++struck_;
    switch (up_to(5)) {
      case 0:  // lost
        return;
      case 1:
        frame.size = static_cast<std::uint8_t>(up_to(7));
        break;
      case 2:
        waiting_.emplace_back(now_ns() + up_to(1000) * (late_ns_ / 1000), frame);
        break;
      case 3:
        waiting_.emplace_back(now_ns() + 3 * up_to(1000) * (late_ns_ / 1000), frame);
        return;
      case 4: {  // a node beside it, with its own answer
        CanFrame foreign = frame;
        foreign.id = frame.id + 1 + static_cast<unsigned>(up_to(3));
        waiting_.emplace_back(now_ns(), foreign);
        break;
      }
      default: {  // what answers nothing that was asked
        CanFrame other = frame;
        other.data[0] =
            static_cast<std::uint8_t>(frame.data[0] ^ (0x80u | static_cast<unsigned>(up_to(127))));
        waiting_.emplace_back(now_ns(), other);
      }
    }
    waiting_.emplace_back(now_ns(), frame);
  }

  CanEndpoint& bus_;
  std::uint32_t answers_;
  std::mt19937 random_;
  int strike_, struck_ = 0;
  std::int64_t late_ns_;
  std::deque<std::pair<std::int64_t, CanFrame>> waiting_;
};

}  // namespace trn
