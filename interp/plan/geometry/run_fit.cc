#include "interp/plan/geometry/run_fit.h"

#include <algorithm>
#include <cmath>

namespace trn {

namespace {

constexpr double kSpanMax = 4.0;  // mm, and degrees: short enough to be sampled by the speed stage
constexpr double kSpanMin = 1e-3;
constexpr double kSpansMax = 8192;
constexpr double kSpanGrowth = 1.5;     // between neighbours
constexpr double kRoughnessScale = 60;  // sixth difference at step h over the deviation of a spline of span h
constexpr double kUsageMax = 0.93;      // leaves room for what lies between the samples
constexpr double kUsageMaxAtCorner = 0.5;  // leaves the rest to the blend
constexpr int kRounds = 5;
constexpr size_t kRefinementsMax = 256;

// Place on the polyline; asked for ascending u mostly, hence the moving start of the search.
class Polyline {
 public:
  explicit Polyline(std::span<const RunVertex> v) : v_(v) {}
  Words at(double u) {
    while (i_ > 0 && v_[i_].u > u) --i_;
    while (i_ + 2 < v_.size() && v_[i_ + 1].u < u) ++i_;
    const double part = (u - v_[i_].u) / (v_[i_ + 1].u - v_[i_].u);
    return v_[i_].y + (v_[i_ + 1].y - v_[i_].y) * part;
  }

 private:
  std::span<const RunVertex> v_;
  size_t i_ = 0;
};

struct Refinement {
  double u = 0, span_max = 0;
};

class RunFitter {
 public:
  explicit RunFitter(const RunRequest& request)
      : request_(request), line_(request.vertices), end_(request.vertices.back().u) {
    start_ = request.head ? request.head->knots[5] : request.vertices.front().u;
  }

  RunFit run() {
    RunFit fit;
    for (int round = 0; round < kRounds; ++round) {
      place_knots(fit.spline);
      solve(fit.spline);
      judge(fit);
      if (fit.ok || !refine(fit)) break;
    }
    return fit;
  }

 private:
  double usage(const Words& e) const {
    const double p = e.head<3>().norm(), r = e.tail<3>().norm();
    const auto part = [](double d, double tol) { return d <= 1e-12 ? 0 : (tol > 0 ? d / tol : 1e9); };
    return std::max(part(p, request_.tolerance_mm), part(r, request_.tolerance_rad));
  }

  // Sixth difference of the polyline: what a spline of span h cannot follow.
  double roughness(double u, double h) {
    constexpr double kBinomial[7] = {1, -6, 15, -20, 15, -6, 1};
    const double centre = std::clamp(u, start_ + 3 * h, std::max(start_ + 3 * h, end_ - 3 * h));
    Words sum = Words::Zero();
    for (int k = 0; k < 7; ++k) sum += kBinomial[k] * line_.at(std::min(centre + (k - 3) * h, end_));
    return usage(sum) / kRoughnessScale;
  }

  double span_limit(double u) const {
    double limit = std::min(kSpanMax, (end_ - start_) / 6);
    for (const Refinement& r : refinements_) limit = std::min(limit, r.span_max + 0.4 * std::abs(u - r.u));
    return limit;
  }

  double next_span(double u, double before) {
    double h = std::min(kSpanGrowth * before, span_limit(u));
    h = std::min(h, span_limit(u + h));
    for (int i = 0; i < 40 && roughness(u + h / 2, h) > kUsageMax; ++i) h *= 0.8;
    return std::max({h, kSpanMin, (end_ - start_) / kSpansMax});
  }

  void place_knots(QuinticSpline& spline) {
    auto& t = spline.knots;
    t.clear();
    if (request_.head)
      t.assign(request_.head->knots.begin(), request_.head->knots.end());
    else
      t.assign(6, start_);
    double h = request_.head ? t[10] - t[9] : kSpanMax;
    while (t.back() < end_) {
      h = next_span(t.back(), h);
      const double left = end_ - t.back();
      if (left < 1.3 * h)
        h = left;
      else if (left < 2 * h)
        h = left / 2;
      t.push_back(left == h ? end_ : t.back() + h);
    }
    t.insert(t.end(), 5, end_);
  }

  void solve(QuinticSpline& spline) {
    spline.coefficients.assign(spline.knots.size() - 6, Words::Zero());
    const int head = fix_head(spline), tail = fix_tail(spline);
    take_samples(spline);
    fit_coefficients(spline, samples_, head, tail);
  }

  // A coefficient of a straight line is the line at the mean of the coefficient's five inner knots.
  static double greville(const QuinticSpline& s, size_t i) {
    return (s.knots[i + 1] + s.knots[i + 2] + s.knots[i + 3] + s.knots[i + 4] + s.knots[i + 5]) / 5;
  }

  int fix_head(QuinticSpline& s) {
    if (request_.start == RunEnd::kFrozen) {
      std::copy(request_.head->coefficients.begin(), request_.head->coefficients.end(),
                s.coefficients.begin());
      return 5;
    }
    const auto& v = request_.vertices;
    if (request_.start == RunEnd::kPoint) return s.coefficients[0] = v[0].y, 1;
    for (size_t i = 0; i < 4; ++i)
      s.coefficients[i] = v[0].y + (v[1].y - v[0].y) * ((greville(s, i) - v[0].u) / (v[1].u - v[0].u));
    return 4;
  }

  int fix_tail(QuinticSpline& s) {
    const size_t n = s.coefficients.size();
    const RunVertex &b = request_.vertices.back(), &a = request_.vertices[request_.vertices.size() - 2];
    if (request_.end == RunEnd::kPoint) return s.coefficients[n - 1] = b.y, 1;
    for (size_t i = n - 4; i < n; ++i)
      s.coefficients[i] = b.y + (b.y - a.y) * ((greville(s, i) - b.u) / (b.u - a.u));
    return 4;
  }

  // The vertices, and places on chords longer than a span; each with the length it stands for.
  void take_samples(const QuinticSpline& spline) {
    samples_.clear();
    const auto& v = request_.vertices;
    size_t k = 0;
    const size_t spans = static_cast<size_t>(spline.span_count());
    double carried = 0;  // half of the chord before
    for (size_t i = 0; i + 1 < v.size(); ++i) {
      const double chord = v[i + 1].u - v[i].u;
      while (k + 1 < spans && spline.knots[k + 6] <= v[i].u) ++k;
      const double h = spline.knots[k + 6] - spline.knots[k + 5];
      const int parts = std::max(1, static_cast<int>(std::ceil(chord / h)));
      const double step = chord / parts;
      if (v[i].u >= start_) samples_.push_back({v[i].u, carried + step / 2, v[i].y});
      for (int p = 1; p < parts; ++p)
        if (const double u = v[i].u + p * step; u >= start_)
          samples_.push_back({u, step, v[i].y + (v[i + 1].y - v[i].y) * (1.0 * p / parts)});
      carried = step / 2;
    }
    samples_.push_back({v.back().u, carried, v.back().y});
  }

  double allowed(size_t span, size_t spans) const {
    const bool first = span == 0 && request_.start == RunEnd::kPoint;
    const bool last = span + 1 == spans && request_.end == RunEnd::kPoint;
    return first || last ? kUsageMaxAtCorner : kUsageMax;
  }

  // Samples every chord at its ends and in between, in each span it crosses.
  void judge(RunFit& fit) {
    const size_t spans = static_cast<size_t>(fit.spline.span_count());
    fit.usage.assign(spans, 0);
    fit.ok = true;
    double worst = 0;
    size_t i = 0;
    const auto& v = request_.vertices;
    PathPoint from = fit.spline.derivatives_at_break(0);
    for (size_t k = 0; k < spans; ++k) {
      const double u0 = fit.spline.at_break(static_cast<int>(k)),
                   u1 = fit.spline.at_break(static_cast<int>(k + 1));
      const PathPoint to = fit.spline.derivatives_at_break(static_cast<int>(k + 1));
      const PathPiece piece = make_hermite(from, to, u1 - u0);
      from = to;
      while (i + 2 < v.size() && v[i + 1].u <= u0) ++i;
      for (size_t c = i; c + 1 < v.size() && v[c].u < u1; ++c) {
        const double used = chord_usage(piece, u0, u1, v[c], v[c + 1]);
        fit.usage[k] = std::max(fit.usage[k], used);
        if (used / allowed(k, spans) > worst) {
          worst = used / allowed(k, spans);
          fit.worst_vertex = c;
        }
      }
    }
    fit.ok = worst <= 1;
  }

  double chord_usage(const PathPiece& piece, double u0, double u1, const RunVertex& a,
                     const RunVertex& b) const {
    const double from = std::max(a.u, u0), to = std::min(b.u, u1), step_max = (u1 - u0) / 8;
    const int parts =
        b.u - a.u < step_max / 4 ? 1 : std::max(2, static_cast<int>(std::ceil((to - from) / step_max)));
    const Words slope = (b.y - a.y) / (b.u - a.u);
    double worst = 0;
    for (int p = 0; p <= parts; ++p) {
      const double u = from + (to - from) * p / parts;
      worst = std::max(worst, usage(piece.at(u - u0) - a.y - slope * (u - a.u)));
    }
    return worst;
  }

  // Asks for shorter spans where the tolerance is exceeded. False: no use, or beyond reason.
  bool refine(const RunFit& fit) {
    const size_t spans = fit.usage.size();
    for (size_t k = 0; k < spans; ++k) {
      const double over = fit.usage[k] / allowed(k, spans);
      if (over <= 1) continue;
      const double u0 = fit.spline.at_break(static_cast<int>(k)),
                   h = fit.spline.at_break(static_cast<int>(k + 1)) - u0;
      if ((request_.head && k < 5) || h < 1.01 * kSpanMin) return false;  // given, or as short as can be
      if (refinements_.size() >= kRefinementsMax) return false;
      refinements_.push_back({u0 + h / 2, h * (over > 4 ? 0.4 : 0.65)});
    }
    return true;
  }

  const RunRequest& request_;
  Polyline line_;
  double start_ = 0, end_ = 0;
  std::vector<Refinement> refinements_;
  std::vector<SplineSample> samples_;
};

}  // namespace

RunFit fit_run(const RunRequest& request) { return RunFitter(request).run(); }

}  // namespace trn
