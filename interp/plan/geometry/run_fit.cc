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
constexpr double kCornerSpan = 10;      // tolerances: what a blend at the corner takes, about
constexpr double kUsageMaxAtCorner = 0.5;  // leaves the rest to the blend
// Smoothing length as a part of the span: damps what the samples' rounding would excite near the spline's own
// resolution and carries spans that hold no sample.
constexpr double kSmoothing = 0.3;
constexpr double kTubeSmoothing = 0.3;  // weighs smoothness against the speed of convergence
constexpr double kTubeAim = 0.88;       // leaves room for what the rounds do not reach
constexpr int kTubeRounds = 16;         // between two looks at the result
constexpr int kTubeRoundsMax = 64;
constexpr double kRoughSpanOfChord = 0.8;  // shorter ones may follow the corners of the polyline
constexpr size_t kTubeMargin = 10;         // spans beside the bad ones that may help
constexpr double kTubeHopeless = 3;        // a usage that no more rounds will mend
constexpr int kTubeAttempts = 3;
constexpr double kTubeSpanOfChordMin = 0.1;  // as kSpanOfChordMin, when the tube asks for more freedom
constexpr double kTubeSpacing = 0.5;         // of the samples, in spans
constexpr double kSpanOfChordMin = 0.3;      // shorter spans follow the corners, not the curve
constexpr int kRounds = 6;
constexpr int kCornerRounds = 2;  // for so long the blend's part is asked for
constexpr size_t kSpansOfVertexMax = 16;
constexpr double kGrading = 0.4;  // growth of the span limit with the distance from a short span

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
    corner_span_ = kCornerSpan * std::max(request.tolerance_mm, 1e-3);
  }

  RunFit run() {
    RunFit fit;
    for (int round = 0; round < kRounds; ++round) {
      usage_max_at_corner_ = round < kCornerRounds ? kUsageMaxAtCorner : kUsageMax;
      place_knots(fit.spline);
      solve(fit.spline);
      judge_all(fit);
      if (fit.ok || !refine(fit, kSpanOfChordMin)) break;
    }
    for (int attempt = 0; attempt < kTubeAttempts && !use_the_tube(fit); ++attempt) {
      if (!refine(fit, kTubeSpanOfChordMin)) break;
      place_knots(fit.spline);
      solve(fit.spline);
      judge_all(fit);
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

  // Asked for ascending u mostly; what was asked for far away does not reach here.
  double span_limit(double u) {
    double limit = std::min(kSpanMax, (end_ - start_) / 6);
    if (request_.start == RunEnd::kCorner) limit = std::min(limit, corner_span_ + kGrading * (u - start_));
    if (request_.end == RunEnd::kCorner)
      limit = std::min(limit, corner_span_ + kGrading * std::abs(end_ - u));
    const auto& r = refinements_;
    while (near_ > 0 && r[near_].u > u) --near_;
    while (near_ + 1 < r.size() && r[near_ + 1].u <= u) ++near_;
    const auto reach = [&](const Refinement& at) { return kGrading * std::abs(u - at.u) < limit; };
    for (size_t i = near_; i < r.size() && (i == near_ || reach(r[i])); ++i)
      limit = std::min(limit, r[i].span_max + kGrading * std::abs(u - r[i].u));
    for (size_t i = near_; i-- > 0 && reach(r[i]);)
      limit = std::min(limit, r[i].span_max + kGrading * std::abs(u - r[i].u));
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
    fixed_head_ = static_cast<size_t>(head);
    fixed_tail_ = static_cast<size_t>(tail);
    take_samples(spline, 1);
    SplineProblem(spline, samples_, kSmoothing, head, tail).solve(samples_, spline);
  }

  // Where chords are too coarse for a curve through their vertices: place by place the smoothest curve in the
  // tube of the tolerance around the polyline. False: some place has none.
  bool use_the_tube(RunFit& fit) {
    take_samples(fit.spline, kTubeSpacing);
    const size_t spans = fit.usage.size();
    for (size_t k = 0; k < spans; ++k) {
      if (!wants_tube(fit, k)) continue;
      size_t last = k;
      bool ok = true;
      for (size_t j = k; j < std::min(spans, last + kTubeMargin); ++j) {
        if (wants_tube(fit, j)) last = j;
        ok = ok && fit.usage[j] <= allowed(j, spans);
      }
      const std::vector<Words> before = fit.spline.coefficients;
      fit.ok = smooth_in_tube(fit, k, last);
      if (!fit.ok && !ok) return false;
      if (!fit.ok) {  // rough, but inside: better than nothing
        fit.spline.coefficients = before;
        judge_all(fit);
      }
      k = last;
    }
    return fit.ok;
  }

  // A span outside its tolerance, or one so short beside its chord that it follows the corners.
  bool wants_tube(const RunFit& fit, size_t k) const {
    if (fit.usage[k] > allowed(k, fit.usage.size())) return true;
    if (k < 5 && request_.head) return false;
    const double u0 = fit.spline.at_break(static_cast<int>(k)),
                 u1 = fit.spline.at_break(static_cast<int>(k + 1));
    return u1 - u0 < kRoughSpanOfChord * chord_at((u0 + u1) / 2);
  }

  // By alternating directions (ADMM): the spline follows targets inside the tube, the targets follow the
  // spline as far as the tube lets them, and what is left between them is remembered. Only coefficients
  // around the spans first .. last change.
  bool smooth_in_tube(RunFit& fit, size_t first, size_t last) {
    const size_t n = fit.spline.coefficients.size(), spans = fit.usage.size();
    const size_t from = std::max(fixed_head_, first - std::min(first, kTubeMargin));
    const size_t to = std::min(n - fixed_tail_, last + 6 + kTubeMargin);
    const size_t judge_from = from - std::min<size_t>(from, 5), judge_to = std::min(spans, to);
    std::vector<SplineSample> part;
    for (const SplineSample& s : samples_)
      if (s.span >= judge_from && s.span < judge_to) part.push_back(s);
    std::vector<Words> centre, left(part.size(), Words::Zero());
    for (const SplineSample& s : part) centre.push_back(s.y);
    SplineProblem problem(fit.spline, part, kTubeSmoothing, static_cast<int>(from), static_cast<int>(n - to));
    for (int round = 1; round <= kTubeRoundsMax; ++round) {
      for (size_t i = 0; i < part.size(); ++i) {
        const Words y = value_at(fit.spline, part[i]) + left[i];
        const Words target = into_tube(y - centre[i]) + centre[i];
        left[i] = y - target;
        part[i].y = target - left[i];
      }
      problem.solve(part, fit.spline);
      if (round % kTubeRounds != 0) continue;
      const double worst = judge(fit, judge_from, judge_to);
      if (worst <= 1) return true;
      if (worst > kTubeHopeless) return false;
    }
    return false;
  }

  Words into_tube(Words e) const {
    const double p = e.head<3>().norm(), r = e.tail<3>().norm();
    if (p > kTubeAim * request_.tolerance_mm) e.head<3>() *= kTubeAim * request_.tolerance_mm / p;
    if (r > kTubeAim * request_.tolerance_rad) e.tail<3>() *= kTubeAim * request_.tolerance_rad / r;
    return e;
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
    if (request_.start != RunEnd::kOnLine) return s.coefficients[0] = v[0].y, 1;
    for (size_t i = 0; i < 4; ++i)
      s.coefficients[i] = v[0].y + (v[1].y - v[0].y) * ((greville(s, i) - v[0].u) / (v[1].u - v[0].u));
    return 4;
  }

  int fix_tail(QuinticSpline& s) {
    const size_t n = s.coefficients.size();
    const RunVertex &b = request_.vertices.back(), &a = request_.vertices[request_.vertices.size() - 2];
    if (request_.end != RunEnd::kOnLine) return s.coefficients[n - 1] = b.y, 1;
    for (size_t i = n - 4; i < n; ++i)
      s.coefficients[i] = b.y + (b.y - a.y) * ((greville(s, i) - b.u) / (b.u - a.u));
    return 4;
  }

  void add_sample(double u, double weight, const Words& y) {
    SplineSample& sample = samples_.emplace_back();
    sample.u = u;
    sample.weight = weight;
    sample.y = y;
  }

  // The vertices, and places on chords longer than `spacing` spans; each with the length it stands for.
  void take_samples(const QuinticSpline& spline, double spacing) {
    samples_.clear();
    const auto& v = request_.vertices;
    size_t k = 0;
    const size_t spans = static_cast<size_t>(spline.span_count());
    double carried = 0;  // half of the chord before
    for (size_t i = 0; i + 1 < v.size(); ++i) {
      const double chord = v[i + 1].u - v[i].u;
      while (k + 1 < spans && spline.knots[k + 6] <= v[i].u) ++k;
      const double h = spline.knots[k + 6] - spline.knots[k + 5];
      const int parts = std::max(1, static_cast<int>(std::ceil(chord / (spacing * h))));
      const double step = chord / parts;
      if (v[i].u >= start_) add_sample(v[i].u, carried + step / 2, v[i].y);
      for (int p = 1; p < parts; ++p)
        if (const double u = v[i].u + p * step; u >= start_)
          add_sample(u, step, v[i].y + (v[i + 1].y - v[i].y) * (1.0 * p / parts));
      carried = step / 2;
    }
    add_sample(v.back().u, carried, v.back().y);
    locate_samples(spline, samples_);
  }

  double allowed(size_t span, size_t spans) const {
    const bool first = span == 0 && request_.start == RunEnd::kCorner;
    const bool last = span + 1 == spans && request_.end == RunEnd::kCorner;
    return first || last ? usage_max_at_corner_ : kUsageMax;
  }

  // Samples every chord at its ends and in between, in each span it crosses.
  // Returns the worst usage over what is allowed, and where, of the spans [first, end).
  double judge(RunFit& fit, size_t first, size_t end) {
    const size_t spans = fit.usage.size();
    double worst = 0;
    const auto& v = request_.vertices;
    size_t i = vertex_before(fit.spline.at_break(static_cast<int>(first)));
    PathPoint from = fit.spline.derivatives_at_break(static_cast<int>(first));
    for (size_t k = first; k < end; ++k) {
      const double u0 = fit.spline.at_break(static_cast<int>(k)),
                   u1 = fit.spline.at_break(static_cast<int>(k + 1));
      const PathPoint to = fit.spline.derivatives_at_break(static_cast<int>(k + 1));
      const PathPiece piece = make_hermite(from, to, u1 - u0);
      from = to;
      fit.usage[k] = 0;
      while (i + 2 < v.size() && v[i + 1].u <= u0) ++i;
      for (size_t c = i; c + 1 < v.size() && v[c].u < u1; ++c) {
        const double used = chord_usage(piece, u0, u1, v[c], v[c + 1]);
        fit.usage[k] = std::max(fit.usage[k], used);
        if (used / allowed(k, spans) <= worst) continue;
        worst = used / allowed(k, spans);
        fit.worst_vertex = c;
      }
    }
    return worst;
  }

  void judge_all(RunFit& fit) {
    fit.usage.assign(static_cast<size_t>(fit.spline.span_count()), 0);
    fit.ok = judge(fit, 0, fit.usage.size()) <= 1;
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

  size_t vertex_before(double u) const {
    const auto& v = request_.vertices;
    const auto after = std::upper_bound(v.begin() + 1, v.end() - 1, u,
                                        [](double at, const RunVertex& vertex) { return at < vertex.u; });
    return static_cast<size_t>(after - v.begin()) - 1;
  }

  double chord_at(double u) const {
    const size_t i = vertex_before(u);
    return request_.vertices[i + 1].u - request_.vertices[i].u;
  }

  // Asks for shorter spans where the tolerance is exceeded, none longer elsewhere. False: no use.
  bool refine(const RunFit& fit, double span_of_chord_min) {
    const size_t spans = fit.usage.size();
    bool shorter = false;
    refinements_.clear();
    near_ = 0;
    for (size_t k = 0; k < spans; ++k) {
      const double u0 = fit.spline.at_break(static_cast<int>(k)),
                   h = fit.spline.at_break(static_cast<int>(k + 1)) - u0;
      const double over = fit.usage[k] / allowed(k, spans);
      if (over > 1 && request_.head && k < 5) return false;  // these knots are given
      const bool can = h > std::max(1.01 * kSpanMin, span_of_chord_min * chord_at(u0 + h / 2));
      refinements_.push_back({u0 + h / 2, over > 1 && can ? h * (over > 4 ? 0.4 : 0.65) : h});
      shorter = shorter || (over > 1 && can);
    }
    return shorter && spans < kSpansOfVertexMax * request_.vertices.size();
  }

  const RunRequest& request_;
  Polyline line_;
  double start_ = 0, end_ = 0;
  double corner_span_ = 0;
  size_t fixed_head_ = 0, fixed_tail_ = 0;
  double usage_max_at_corner_ = 0;
  std::vector<Refinement> refinements_;  // ascending in u
  size_t near_ = 0;                      // the one last asked about
  std::vector<SplineSample> samples_;
};

}  // namespace

RunFit fit_run(const RunRequest& request) { return RunFitter(request).run(); }

}  // namespace trn
