#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

namespace trn {

/// A whole number of a file as it stands there. std::runtime_error where it is no whole number or does not
/// fit; the library itself would cut it.
template <typename Whole>
Whole whole(const nlohmann::json& json) {
  const bool fits = json.is_number_unsigned()
                        ? std::in_range<Whole>(json.get<std::uint64_t>())
                        : json.is_number_integer() && std::in_range<Whole>(json.get<std::int64_t>());
  if (!fits) throw std::runtime_error(fmt::format("{} is no whole number, or too large here", json.dump()));
  return json.get<Whole>();
}

}  // namespace trn
