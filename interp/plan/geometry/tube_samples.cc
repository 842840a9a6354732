#include "interp/plan/geometry/tube_samples.h"

#include <algorithm>

namespace trn::tube {

TRN_VECTOR_CLONES void find_deviations(const std::vector<GroupSample>& samples,
                                       const std::vector<Point>& coefficients,
                                       std::vector<Point>& deviation) {
  for (size_t s = 0; s < samples.size(); ++s) {
    const GroupSample& p = samples[s];
    const Point* c = &coefficients[p.span];
    const Triple front =
        p.front[0] * c[0].w + p.front[1] * c[1].w + p.front[2] * c[2].w + p.front[3] * c[3].w;
    const Triple y = front + p.back[0] * c[4].w + p.back[1] * c[5].w;
    deviation[s].w = y - p.middle;
  }
}

TRN_VECTOR_CLONES void add_fit_terms(const std::vector<GroupSample>& samples,
                                     const std::vector<double>& weight, std::vector<BandRow>& band,
                                     std::vector<Point>& rhs) {
  // All samples of a span share six coefficients. Their products are summed in registers, so that the band is
  // written once a span and not once a sample.
  for (size_t s = 0; s < samples.size();) {
    const size_t span = samples[s].span;
    Four front[4] = {}, back[6] = {};  // products of a function with the first four and with the last two
    Triple right[6] = {};
    for (; s < samples.size() && samples[s].span == span; ++s) {
      const GroupSample& p = samples[s];
      const Four pulled_front = p.fit_weight * p.front, pulled_back = p.fit_weight * p.back;
      for (size_t i = 0; i < 6; ++i) {
        const double pulled = i < 4 ? pulled_front[i] : pulled_back[i - 4];
        if (i < 4) front[i] += pulled * p.front;
        back[i] += pulled * p.back;
        right[i] += pulled * p.fit_target;
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
