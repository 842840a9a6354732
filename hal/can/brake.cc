#include "hal/can/brake.h"

namespace trn {

void Brake::step(const Input& input) TRN_RT {
  if (!config_.fitted) return;
  ++periods_;
  unwanted_ = input.wanted ? 0 : unwanted_ + 1;
  const bool done_moving = input.stands || unwanted_ > config_.stop_periods_max;
  switch (state_) {
    case State::kClosed:
      if (input.held && input.wanted) enter(State::kOpening);
      return;
    case State::kOpening:
    case State::kOpen:
      // Nobody holds it any more: at once. Told to stop: the drive brakes it first, the brake only holds.
      if (!input.held || (!input.wanted && done_moving)) return enter(State::kClosing);
      if (state_ == State::kOpening && periods_ >= config_.release_periods) enter(State::kOpen);
      return;
    case State::kClosing:
      if (periods_ >= config_.close_periods) enter(State::kClosed);
      return;
  }
}

}  // namespace trn
