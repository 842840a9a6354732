#include "interp/plan/geometry/span_mesh.h"

#include <algorithm>
#include <cmath>

#include "core/axes.h"
#include "interp/plan/geometry/run_vertex.h"

namespace trn {

namespace {

constexpr double kSpanMax = 4.0;        // mm, and degrees: short enough to be sampled by the speed stage
constexpr double kNodeDistance = 2.0;   // where spans are long
constexpr double kSpansMax = 8192;      // bounds the memory
constexpr double kSpansMin = 6;         // a curve wants some freedom
constexpr double kRoughnessScale = 60;  // sixth difference at step h over the deviation of a spline of span h
constexpr double kRoughnessMax = 0.1;   // of the tolerance; the rest is the spline's freedom
constexpr double kDensity = 1.6;        // spans laid for one needed, so that it hardly matters where they lie
constexpr double kShrink = 0.8;         // of a span that is too long, until it is short enough
constexpr double kGrading = 0.3;        // growth of the spans with the distance

class SpanMesh {
 public:
  explicit SpanMesh(const SpanMeshRequest& request) : r_(request) {
    span_max_ = std::min(kSpanMax, (r_.end - r_.start) / kSpansMin);
    span_min_ = std::min(std::max(kSpanMin, (r_.end - r_.start) / kSpansMax), span_max_);
  }

  // Finds the span needed at nodes along the run, adds the limits that were asked for, grades the spans, and
  // spreads the breaks. The nodes begin evenly from both ends alike, so a run backwards has the same ones.
  std::vector<double> breaks() {
    const int parts = std::max(4, static_cast<int>(std::ceil((r_.end - r_.start) / kNodeDistance)));
    SpanLimit from{r_.start, span_at(r_.start)};
    nodes_.push_back(from);
    for (int i = 1; i <= parts; ++i) {
      const double u = i == parts ? r_.end : r_.start + (r_.end - r_.start) * i / parts;
      const SpanLimit to{u, span_at(u)};
      bisect(from, to);
      from = to;
    }
    merge_limits();
    grade();
    return distribute();
  }

 private:
  Words at(double u) const {
    const auto v = r_.target.vertices();
    const auto after =
        std::upper_bound(v.begin() + 1, v.end() - 1, u,
                         [](double place, const RunVertex& vertex) { return place < vertex.u; });
    const auto i = static_cast<size_t>(after - v.begin()) - 1;
    return r_.target.at(i, (u - v[i].u) / (v[i + 1].u - v[i].u));
  }

  // What a quintic spline of span h cannot follow of the target at u, over the tolerance. A quintic
  // reproduces polynomials of degree 5; the sixth difference at step h shows the rest. The seven samples move
  // inwards at the ends of the run. A difference along the path means that the curve is early or late, and
  // does not count.
  double roughness(double u, double h) const {
    constexpr double kBinomial[7] = {1, -6, 15, -20, 15, -6, 1};
    const double first = std::max(r_.start, std::min(u - 3 * h, r_.end - 6 * h));
    Words sum = Words::Zero();
    for (int k = 0; k < 7; ++k) sum += kBinomial[k] * at(std::min(first + k * h, r_.end));
    const Words along = at(std::min(u + h, r_.end)) - at(std::max(u - h, r_.start));
    sum -= along * nearest_along(sum, along, r_.tolerance_mm, r_.tolerance_rad);
    return tube_use(sum, r_.tolerance_mm, r_.tolerance_rad).worst() / kRoughnessScale;
  }

  double span_at(double u) const {
    double h = span_max_;
    while (h > span_min_ && roughness(u, h) > kRoughnessMax) h *= kShrink;
    return std::max(h, span_min_);
  }

  // Nodes are made as dense as the spans themselves, so that no place that needs short ones is missed.
  void bisect(const SpanLimit& from, const SpanLimit& to) {
    const double apart = to.u - from.u;
    if (apart > 1.3 * std::min(from.span, to.span) && apart > 2 * span_min_) {
      const SpanLimit middle{from.u + apart / 2, span_at(from.u + apart / 2)};
      bisect(from, middle);
      bisect(middle, to);
    } else {
      nodes_.push_back(to);
    }
  }

  void merge_limits() {
    const auto middle = static_cast<std::ptrdiff_t>(nodes_.size());
    for (const SpanLimit& limit : r_.limits)
      if (limit.u >= r_.start && limit.u <= r_.end)
        nodes_.push_back({limit.u, std::min(limit.span, span_max_)});
    std::inplace_merge(nodes_.begin(), nodes_.begin() + middle, nodes_.end(),
                       [](const SpanLimit& a, const SpanLimit& b) { return a.u < b.u; });
  }

  // Two sweeps give the largest spans that are nowhere longer than needed and grow by kGrading of the
  // distance.
  void grade() {
    for (size_t i = 1; i < nodes_.size(); ++i)
      nodes_[i].span =
          std::min(nodes_[i].span, nodes_[i - 1].span + kGrading * (nodes_[i].u - nodes_[i - 1].u));
    for (size_t i = nodes_.size() - 1; i-- > 0;)
      nodes_[i].span =
          std::min(nodes_[i].span, nodes_[i + 1].span + kGrading * (nodes_[i + 1].u - nodes_[i].u));
  }

  // Spreads the breaks evenly over the integral of the density kDensity / span. The density is linear between
  // nodes, so its integral is a parabola there, and a break is found by solving a quadratic equation: the
  // form 2 c / (d0 + sqrt(d0^2 + 2 slope c)) has no cancellation for any slope.
  std::vector<double> distribute() const {
    std::vector<double> sum(nodes_.size(), 0);
    for (size_t i = 1; i < nodes_.size(); ++i)
      sum[i] =
          sum[i - 1] + (nodes_[i].u - nodes_[i - 1].u) * (1 / nodes_[i].span + 1 / nodes_[i - 1].span) / 2;
    const int count = std::max(1, static_cast<int>(std::ceil(kDensity * sum.back() - 1e-6)));
    std::vector<double> breaks{r_.start};
    size_t i = 1;
    for (int k = 1; k < count; ++k) {
      const double wanted = sum.back() * k / count;
      while (sum[i] < wanted) ++i;
      const double d0 = 1 / nodes_[i - 1].span, d1 = 1 / nodes_[i].span,
                   length = nodes_[i].u - nodes_[i - 1].u;
      const double slope = (d1 - d0) / length, c = wanted - sum[i - 1];
      breaks.push_back(nodes_[i - 1].u + 2 * c / (d0 + std::sqrt(d0 * d0 + 2 * slope * c)));
    }
    breaks.push_back(r_.end);
    return breaks;
  }

  const SpanMeshRequest& r_;
  double span_max_ = 0, span_min_ = 0;
  std::vector<SpanLimit> nodes_;
};

}  // namespace

std::vector<double> mesh_breaks(const SpanMeshRequest& request) { return SpanMesh(request).breaks(); }

}  // namespace trn
