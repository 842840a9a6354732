#include "sim/canopen/emulated_units.h"

#include <cmath>
#include <cstdint>

#include "core/units.h"

namespace trn {

namespace {

double ratio(const ObjectStore& store, std::uint16_t index) {
  const auto over = static_cast<double>(store.integer({index, 1})),
             under = static_cast<double>(store.integer({index, 2}));
  return under > 0 ? over / under : 0;
}

double power_of_ten(std::int64_t code) { return std::pow(10.0, static_cast<std::int8_t>(code >> 24)); }

}  // namespace

double EmulatedUnits::counts(const ObjectStore& store, unsigned length) const {
  if (length == 0xB5) return 1;
  if (length == 0x01) return counts_per_m;
  double revolution = counts_per_revolution > 0 ? counts_per_revolution : 1;
  const double feed = ratio(store, 0x6092), encoder = ratio(store, 0x608F), gear = ratio(store, 0x6091);
  if (encoder > 0) revolution = gear > 0 ? encoder * gear : encoder;
  if (feed > 0) revolution = feed;
  const std::int64_t position = store.integer({0x60A8, 0});
  if ((position >> 16 & 0xFF) == 0x41) revolution = 360 / power_of_ten(position);
  if ((position >> 16 & 0xFF) == 0xB4) revolution = 1 / power_of_ten(position);
  return length == 0x41 ? revolution / 360 : length == 0x10 ? revolution / (2 * kPi) : revolution;
}

double EmulatedUnits::counts_s(const ObjectStore& store) const {
  const std::int64_t code = store.integer({0x60A9, 0});
  if (code == 0) return velocity;
  const double minute = (code >> 8 & 0xFF) == 0x47 ? 60 : 1;
  return power_of_ten(code) * counts(store, code >> 16 & 0xFF) / minute;
}

double EmulatedUnits::counts_s2(const ObjectStore& store) const {
  const std::int64_t code = store.integer({0x60AA, 0});
  if (code == 0) return store.integer({0x60A9, 0}) == 0 ? acceleration : counts_s(store);
  // maxon: C0 over seconds is revolutions per minute and second.
  if ((code >> 16 & 0xFF) == 0xC0) return power_of_ten(code) * counts(store, 0xB4) / 60;
  return power_of_ten(code) * counts(store, code >> 16 & 0xFF);
}

}  // namespace trn
