#include "app/lab/picture/colours.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trn::picture {

const char* line_colour(std::size_t index) { return kLineColours[index % kLineColours.size()]; }

std::string shade(double share) {
  static constexpr std::array<std::array<double, 3>, 5> kStops{
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = std::clamp(share, 0.0, 1.0) * 4;
  const std::size_t i = std::min<std::size_t>(static_cast<std::size_t>(at), 3);
  const double f = at - static_cast<double>(i);
  std::array<long, 3> c{};
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = std::lround(kStops[i][k] + f * (kStops[i + 1][k] - kStops[i][k]));
  return fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
}

}  // namespace trn::picture
