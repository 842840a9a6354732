#include "hal/can/cia402_touch.h"

#include "core/check.h"

namespace trn {

namespace {
// 0x60B8: on, first event only, from the input; which edge. 0x60B9: on, position of an edge stored.
constexpr std::uint16_t kOn = 1u << 0, kAtRise = 1u << 4, kAtFall = 1u << 5;
constexpr std::uint16_t kIsOn = 1u << 0, kRoseAt = 1u << 1, kFellAt = 1u << 2;
}  // namespace

// What an earlier use has left is cleared first: a drive forgets it when it is switched off.
void Cia402Touch::arm(bool contact) TRN_RT {
  contact_ = contact;
  phase_ = Phase::kClearing;
}

std::uint16_t Cia402Touch::function() const TRN_RT {
  // A drive takes a new edge only after its probe was switched off: 0x60B9 keeps 'stored' as long as the
  // function is on.
  if (phase_ <= Phase::kClearing) return 0;
  return static_cast<std::uint16_t>(kOn | (contact_ ? kAtRise : kAtFall));
}

void Cia402Touch::take_status(std::uint16_t status) TRN_RT {
  const bool on = status & kIsOn, stored = status & (contact_ ? kRoseAt : kFellAt);
  // Each phase waits for the drive to show it. A status that still tells of the last contact would otherwise
  // pass for this one.
  if (phase_ == Phase::kClearing && !on)
    phase_ = Phase::kArming;
  else if (phase_ == Phase::kArming && on && !stored)
    phase_ = Phase::kArmed;
  else if (phase_ == Phase::kArmed && on && stored)
    phase_ = Phase::kTriggered;
}

void Cia402Touch::take_position(bool contact, std::int32_t counts) TRN_RT {
  // The positions of both edges come in the same PDO. Only that of the edge that was armed is of this move,
  // and only once the status says so.
  if (contact != contact_ || phase_ != Phase::kTriggered) return;
  counts_ = counts;
  TRN_CHECK(phase_ == Phase::kTriggered);
  phase_ = Phase::kLatched;
}

}  // namespace trn
