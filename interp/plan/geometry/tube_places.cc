#include "interp/plan/geometry/tube_places.h"

#include <algorithm>

namespace trn::tube {

TRN_VECTOR_CLONES void find_off(const std::vector<Place>& places, const std::vector<Point>& coefficients,
                                std::vector<Point>& off) {
  for (size_t s = 0; s < places.size(); ++s) {
    const Place& p = places[s];
    const Point* c = &coefficients[p.span];
    const Triple front =
        p.front[0] * c[0].w + p.front[1] * c[1].w + p.front[2] * c[2].w + p.front[3] * c[3].w;
    const Triple y = front + p.back[0] * c[4].w + p.back[1] * c[5].w;
    off[s].w = y - p.middle;
  }
}

TRN_VECTOR_CLONES void add_pulls(const std::vector<Place>& places, const std::vector<double>& weight,
                                 std::vector<BandRow>& band, std::vector<Point>& rhs) {
  for (size_t s = 0; s < places.size();) {
    const size_t span = places[s].span;
    Four front[4] = {}, back[6] = {};  // products of a function with the first four and with the last two
    Triple right[6] = {};
    for (; s < places.size() && places[s].span == span; ++s) {
      const Place& p = places[s];
      const Four pulled_front = p.pull * p.front, pulled_back = p.pull * p.back;
      for (size_t i = 0; i < 6; ++i) {
        const double pulled = i < 4 ? pulled_front[i] : pulled_back[i - 4];
        if (i < 4) front[i] += pulled * p.front;
        back[i] += pulled * p.back;
        right[i] += pulled * p.aim;
      }
    }
    for (size_t i = 0; i < 6; ++i) {
      const auto row = band.begin() + static_cast<std::ptrdiff_t>(span + i);
      for (size_t j = i; j < 4; ++j) (*row)[j - i] += weight[span] * front[i][j];
      for (size_t j = std::max<size_t>(i, 4); j < 6; ++j) (*row)[j - i] += weight[span] * back[i][j - 4];
      rhs[span + i].w += weight[span] * right[i];
    }
  }
}

}  // namespace trn::tube
