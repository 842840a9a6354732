#include "interp/plan/geometry/tube_places.h"

namespace trn::tube {

TRN_VECTOR_CLONES void find_off(const std::vector<Place>& places, const std::vector<Point>& coefficients,
                                std::vector<Point>& off) {
  for (size_t s = 0; s < places.size(); ++s) {
    const Place& p = places[s];
    const Point* c = &coefficients[p.span];
    Triple y = p.row[0] * c[0].w;
    for (size_t i = 1; i < 6; ++i) y += p.row[i] * c[i].w;
    off[s].w = y - p.middle;
  }
}

TRN_VECTOR_CLONES void add_pulls(const std::vector<Place>& places, const std::vector<double>& weight,
                                 std::vector<BandRow>& band, std::vector<Point>& rhs) {
  for (size_t s = 0; s < places.size();) {
    const size_t span = places[s].span;
    Six square[6] = {};
    Triple right[6] = {};
    for (; s < places.size() && places[s].span == span; ++s) {
      const Place& p = places[s];
      const Six row = p.pull * p.row;
      for (size_t i = 0; i < 6; ++i) {
        square[i] += row[i] * p.row;
        right[i] += row[i] * p.aim;
      }
    }
    for (size_t i = 0; i < 6; ++i) {
      square[i] *= weight[span];
      rhs[span + i].w += weight[span] * right[i];
      for (size_t j = i; j < 6; ++j) band[span + i][j - i] += square[i][j];
    }
  }
}

}  // namespace trn::tube
