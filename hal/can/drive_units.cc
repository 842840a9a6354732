#include "hal/can/drive_units.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "core/units.h"

namespace trn {

namespace {

constexpr ObjectKey kPositionUnit{0x60A8, 0}, kVelocityUnit{0x60A9, 0}, kAccelerationUnit{0x60AA, 0};

/// A unit of position over one of time, as bits 16 to 23 and 8 to 15 of the objects have them, and how many
/// of the former's SI-like base per second (s^2) one is.
struct Unit {
  std::string_view name;
  std::uint8_t length, time;
  int exponent;  ///< power of ten that belongs to the name: mm/s is m/s with -3
  double per_s;  ///< 1, or a part of it if the time is minutes
};

// Codes of CiA 303-2: 01 m, 10 rad, 41 degree, B4 revolution, B5 increment; 03 s, 47 min, 57 s^2. C0 over 03
// is how maxon writes rpm/s.
constexpr std::uint8_t kMetre = 0x01, kRadian = 0x10, kDegree = 0x41, kRevolution = 0xB4, kCount = 0xB5;
constexpr Unit kVelocities[] = {
    {"counts/s", kCount, 0x03, 0, 1},        {"counts/min", kCount, 0x47, 0, 1.0 / 60},
    {"rpm", kRevolution, 0x47, 0, 1.0 / 60}, {"rev/s", kRevolution, 0x03, 0, 1},
    {"deg/s", kDegree, 0x03, 0, 1},          {"rad/s", kRadian, 0x03, 0, 1},
    {"mm/s", kMetre, 0x03, -3, 1},           {"m/s", kMetre, 0x03, 0, 1}};
constexpr Unit kAccelerations[] = {{"counts/s^2", kCount, 0x57, 0, 1},   {"rpm/s", 0xC0, 0x03, 0, 1.0 / 60},
                                   {"rev/s^2", kRevolution, 0x57, 0, 1}, {"deg/s^2", kDegree, 0x57, 0, 1},
                                   {"rad/s^2", kRadian, 0x57, 0, 1},     {"mm/s^2", kMetre, 0x57, -3, 1},
                                   {"m/s^2", kMetre, 0x57, 0, 1}};

/// A unit and how many of it are one of the drive's numbers.
struct Scaled {
  const Unit* unit = nullptr;
  double times = 1;
};

std::string legal_names(std::span<const Unit> units) {
  std::string out;
  for (const Unit& unit : units) out += fmt::format("{}\"{}\"", out.empty() ? "" : ", ", unit.name);
  return out;
}

// "rpm", "0.1 rpm"
Scaled named(std::string_view text, std::span<const Unit> units, const std::string& key) {
  Scaled out;
  const auto blank = text.find(' ');
  const std::string_view number = blank == std::string_view::npos ? "1" : text.substr(0, blank);
  const std::string_view name = blank == std::string_view::npos ? text : text.substr(blank + 1);
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), out.times);
  const bool counts = error == std::errc() && end == number.data() + number.size() &&
                      std::isfinite(out.times) && out.times > 0;
  for (const Unit& unit : units)
    if (counts && unit.name == name) out.unit = &unit;
  if (!out.unit)
    throw DriveUnitError(
        key, fmt::format("'{}' is no unit; legal: {}, with a number in front as in \"0.1 {}\"", text,
                         legal_names(units), units[1].name));
  return out;
}

// Bits 24 to 31 are the power of ten, signed; the lowest byte is reserved.
std::optional<Scaled> decoded(std::int64_t code, std::span<const Unit> units) {
  const auto exponent = static_cast<std::int8_t>(code >> 24);
  for (const Unit& unit : units)
    if (unit.exponent <= 0 && unit.length == (code >> 16 & 0xFF) && unit.time == (code >> 8 & 0xFF))
      return Scaled{&unit, std::pow(10.0, exponent - unit.exponent)};
  return std::nullopt;
}

std::optional<std::int64_t> encoded(const Scaled& scaled) {
  const double power = std::log10(scaled.times);
  const long exponent = std::lround(power) + scaled.unit->exponent;
  if (std::abs(power - std::round(power)) > 1e-9 || exponent < -128 || exponent > 127) return std::nullopt;
  return static_cast<std::int64_t>(static_cast<std::uint32_t>(exponent & 0xFF) << 24 |
                                   static_cast<std::uint32_t>(scaled.unit->length) << 16 |
                                   static_cast<std::uint32_t>(scaled.unit->time) << 8);
}

class UnitReader {
 public:
  UnitReader(const DriveUnitWish& wish, const ObjectDictionary& dictionary)
      : wish_(wish), dictionary_(dictionary) {}

  DriveUnits read() {
    const std::optional<Scaled> velocity = one(wish_.velocity, kVelocityUnit, kVelocities, "velocity_unit");
    const std::optional<Scaled> acceleration =
        one(wish_.acceleration, kAccelerationUnit, kAccelerations, "acceleration_unit");
    if (velocity) units_.velocity = 1 / counts_of(*velocity);
    units_.acceleration = acceleration ? 1 / counts_of(*acceleration) : units_.velocity;
    check_factor();
    const auto encoder = [&](std::uint8_t sub) {
      return static_cast<double>(value({0x608F, sub}).value_or(0));
    };
    units_.counts_per_motor_turn =
        encoder(1) > 0 && encoder(2) > 0 ? encoder(1) / encoder(2) : wish_.counts_per_revolution;
    // Positions are counted in what the data sheet says, as counts_per_mm is.
    if (const std::int64_t code = value({0x60A8, 0}).value_or(0); code != 0) need(kPositionUnit, code, true);
    return units_;
  }

 private:
  std::optional<std::int64_t> value(ObjectKey key) const {
    const DictionaryEntry* entry = dictionary_.find(key);
    if (!entry || bits_of(entry->type) == 0) return std::nullopt;
    return decode_integer(entry->type, entry->configured.empty() ? entry->value : entry->configured);
  }

  void need(ObjectKey key, std::int64_t wanted, bool may_write) {
    const DictionaryEntry* entry = dictionary_.find(key);
    if (entry) units_.objects.push_back({key, wanted, may_write && entry->writable});
  }

  // The config's unit, or that of the object; nothing: the drive does not say.
  std::optional<Scaled> one(const std::string& text, ObjectKey key, std::span<const Unit> legal,
                            const std::string& config_key) {
    if (!text.empty()) {
      const Scaled scaled = named(text, legal, config_key);
      if (const auto code = encoded(scaled); code && value(key).value_or(0) != 0) need(key, *code, true);
      return scaled;
    }
    const std::int64_t code = value(key).value_or(0);
    if (code == 0) return std::nullopt;
    const std::optional<Scaled> scaled = decoded(code, legal);
    if (!scaled)
      throw DriveUnitError(
          config_key, fmt::format("the unit 0x{:08X} of {} in {} is not known; say '{}' as in \"0.1 {}\"",
                                  code, to_string(key), dictionary_.file, config_key, legal[1].name));
    need(key, code, true);
    return scaled;
  }

  double counts_of(const Scaled& scaled) {
    const Unit& unit = *scaled.unit;
    const double ten = std::pow(10.0, unit.exponent);
    const double size = scaled.times * unit.per_s * ten;
    if (unit.length == kCount) return size;
    if (unit.length == kMetre) return size * counts_per_m(unit);
    if (unit.length == kDegree) return size * counts_per_revolution(unit) / 360;
    return size * counts_per_revolution(unit) / (unit.length == kRadian ? 2 * kPi : 1);
  }

  double counts_per_m(const Unit& unit) const {
    if (wish_.counts_per_m > 0) return wish_.counts_per_m;
    throw DriveUnitError(
        "velocity_unit",
        fmt::format("{} of a joint that turns; a turn has degrees or revolutions", unit.name));
  }

  // From the position's own unit, else from the feed, else from encoder and gear.
  double counts_per_revolution(const Unit& unit) {
    if (wish_.counts_per_revolution > 0) return wish_.counts_per_revolution;
    const std::int64_t code = value(kPositionUnit).value_or(0);
    const double ten = std::pow(10.0, static_cast<std::int8_t>(code >> 24));
    switch (code >> 16 & 0xFF) {
      case kRevolution:
        return 1 / ten;
      case kDegree:
        return 360 / ten;
      case kRadian:
        return 2 * kPi / ten;
      default:
        break;
    }
    if (const double feed = ratio(0x6092); feed > 0) return feed;
    const double gear = ratio(0x6091);
    if (const double encoder = ratio(0x608F); encoder > 0) return encoder * (gear > 0 ? gear : 1);
    throw DriveUnitError("counts_per_revolution",
                         fmt::format("the drive's unit is {}, and {} does not say how many counts a "
                                     "revolution has; 'counts_per_revolution' must",
                                     unit.name, dictionary_.file));
  }

  // Never written: what a motor's encoder has is not ours to say.
  double ratio(std::uint16_t index) {
    const std::int64_t over = value({index, 1}).value_or(0), under = value({index, 2}).value_or(0);
    if (over <= 0 || under <= 0) return 0;
    const bool known = std::any_of(units_.objects.begin(), units_.objects.end(),
                                   [&](const auto& object) { return object.key.index == index; });
    if (!known) {
      need({index, 1}, over, false);
      need({index, 2}, under, false);
    }
    return static_cast<double>(over) / static_cast<double>(under);
  }

  // 0x6096 multiplies on top, and makers read it in both directions.
  void check_factor() {
    const std::int64_t over = value({0x6096, 1}).value_or(1), under = value({0x6096, 2}).value_or(1);
    if (over != under && wish_.velocity.empty())
      throw DriveUnitError(
          "velocity_unit",
          fmt::format("0x6096 is {}/{} in {}, which makers read in both directions; say what "
                      "one of the drive's units is by 'velocity_unit'",
                      over, under, dictionary_.file));
    if (!wish_.velocity.empty() && over != under) return;
    need({0x6096, 1}, 1, true);
    need({0x6096, 2}, 1, true);
  }

  const DriveUnitWish& wish_;
  const ObjectDictionary& dictionary_;
  DriveUnits units_;
};

// All these objects are UNSIGNED32.
constexpr double kMost = std::numeric_limits<std::uint32_t>::max();

}  // namespace

std::int64_t DriveUnits::velocity_at_most(double counts_s) const {
  // What rounding leaves below a whole number is that number.
  return static_cast<std::int64_t>(
      std::min(std::floor(std::abs(counts_s * velocity) * (1 + 1e-12) + 1e-9), kMost));
}

std::int64_t DriveUnits::acceleration_of(double counts_s2) const {
  return static_cast<std::int64_t>(std::clamp(std::abs(counts_s2 * acceleration) + 1e-9, 1.0, kMost));
}

DriveUnits drive_units(const DriveUnitWish& wish, const ObjectDictionary& dictionary) {
  return UnitReader(wish, dictionary).read();
}

}  // namespace trn
