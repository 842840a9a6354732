#include "interp/plan/geometry/run_fit.h"

#include <algorithm>
#include <cmath>

#include "core/path.h"
#include "interp/plan/geometry/run_target.h"
#include "interp/plan/geometry/span_mesh.h"
#include "interp/plan/geometry/tube_fit.h"

namespace trn {

namespace {

constexpr double kTube = 0.93;           // of the tolerance: leaves room for what lies between the samples
constexpr double kUsageMax = 0.98;       // of an accepted curve
constexpr double kNearGreatest = 0.9;    // looked at more closely
constexpr double kTubeAtCorner = 0.05;   // of the tolerance: the rest belongs to the blend
constexpr double kCornerReach = 20;      // tolerances: how far from a corner its blend may come
constexpr double kCornerSpan = 5;        // tolerances: longest span beside a corner
constexpr double kSamplesOfSpan = 4;     // at least
constexpr double kSpanOfChordMin = 0.1;  // shorter spans follow the corners, not the curve
constexpr int kAttempts = 6;
constexpr double kRefine = 0.5;  // of a span outside
constexpr int kTightenings = 48,
              kTighteningsPerReach = 8;  // then one span more around the worst is tightened
constexpr double kSpanGrowth = 1.5;      // beside given knots
constexpr size_t kSpansOfVertexMax = 16;

class RunFitter {
 public:
  explicit RunFitter(const RunRequest& request)
      : request_(request),
        target_(request.vertices, request.tolerance_mm, request.tolerance_rad),
        end_(request.vertices.back().u) {
    start_ = request.head ? request.head->knots[5] : request.vertices.front().u;
  }

  // Knots, then a fit that follows the target, then the smooth one. Where even the first leaves the
  // tolerance, the knots lie too far apart; where only the second does, the first is rough but inside, and
  // serves.
  RunFit run() {
    RunFit fit;
    limit_at_ends();
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      place_knots(fit.spline);
      TubeFit tube = follow(fit.spline);
      judge(fit);
      if (!fit.ok && refine(fit)) continue;
      const RunFit followed = fit;
      smooth(fit, tube);
      if (fit.ok) break;
      if (followed.ok) return followed;  // rough, but inside
      if (!refine(fit)) break;
    }
    return fit;
  }

 private:
  void limit_at_ends() {
    const double span = kCornerSpan * std::max(request_.tolerance_mm, 1e-3);
    if (request_.head)
      limits_.push_back({mesh_start(), kSpanGrowth * (request_.head->knots[10] - request_.head->knots[9])});
    if (request_.start == RunEnd::kCorner) limits_.push_back({start_, span});
    if (request_.end == RunEnd::kCorner) limits_.push_back({end_, span});
  }

  double mesh_start() const { return request_.head ? request_.head->knots[10] : start_; }

  void place_knots(QuinticSpline& spline) {
    const std::vector<double> breaks =
        mesh_breaks({target_, mesh_start(), end_, request_.tolerance_mm, request_.tolerance_rad, limits_});
    auto& t = spline.knots;
    if (request_.head)
      t.assign(request_.head->knots.begin(), request_.head->knots.end());
    else
      t.assign(6, start_);
    t.insert(t.end(), breaks.begin() + 1, breaks.end());
    t.insert(t.end(), 5, end_);
  }

  TubeFit follow(QuinticSpline& spline) {
    spline.coefficients.assign(spline.knots.size() - 6, Words::Zero());
    const size_t head = fix_head(spline), tail = fix_tail(spline);
    take_samples(spline);
    TubeFit tube(spline, samples_, {head, spline.coefficients.size() - tail});
    tube.follow();
    return tube;
  }

  void smooth(RunFit& fit, TubeFit& tube) {
    tube.smooth();
    judge(fit);
    for (int i = 0; i < kTightenings && !fit.ok; ++i) {
      tube.tighten(fit.usage, kUsageMax, static_cast<size_t>(i) / kTighteningsPerReach);
      judge(fit);
    }
  }

  // A coefficient of a straight line is the line at the mean of the coefficient's five inner knots.
  static double greville(const QuinticSpline& s, size_t i) {
    return (s.knots[i + 1] + s.knots[i + 2] + s.knots[i + 3] + s.knots[i + 4] + s.knots[i + 5]) / 5;
  }

  size_t fix_head(QuinticSpline& s) {
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

  size_t fix_tail(QuinticSpline& s) {
    const size_t n = s.coefficients.size();
    const RunVertex &b = request_.vertices.back(), &a = request_.vertices[request_.vertices.size() - 2];
    if (request_.end != RunEnd::kOnLine) return s.coefficients[n - 1] = b.y, 1;
    for (size_t i = n - 4; i < n; ++i)
      s.coefficients[i] = b.y + (b.y - a.y) * ((greville(s, i) - b.u) / (b.u - a.u));
    return 4;
  }

  // The tube narrows towards a corner.
  double tube(double u) const {
    const double reach = kCornerReach * request_.tolerance_mm;
    double part = kTube;
    if (request_.start == RunEnd::kCorner) part = std::min(part, kTubeAtCorner + (u - start_) / reach);
    if (request_.end == RunEnd::kCorner) part = std::min(part, kTubeAtCorner + (end_ - u) / reach);
    return part;
  }

  // The tube must not depend on where the vertices happen to lie on the curve. The target bulges outwards
  // from its chords by their sag. On the outer side the tolerance, which counts from the chord, leaves the
  // curve the sag less; on the inner side it leaves all of the tolerance, at the vertices. So the middle of
  // the tube lies half a sag inside of the target, and its radius is half a sag less than the tolerance.
  // Beside a corner (freedom 0) the middle is the chord itself.
  void add_sample(size_t chord, double share) {
    TubeSample& sample = samples_.emplace_back();
    const RunVertex &a = request_.vertices[chord], &b = request_.vertices[chord + 1];
    sample.u = a.u + (b.u - a.u) * share;
    sample.target = target_.at(chord, share);
    const Words on_chord = a.y + (b.y - a.y) * share, slope = (b.y - a.y) / (b.u - a.u);
    const double early =
        nearest_along(sample.target - on_chord, slope, request_.tolerance_mm, request_.tolerance_rad);
    const double part = tube(sample.u), freedom = part / kTube;
    const Words half_sag = freedom * target_.sag(chord, share) / 2;
    sample.middle =
        on_chord + slope * early * (1 - freedom) + freedom * (sample.target - on_chord) - half_sag;
    const double kept = 1 - b.tolerance_used;
    sample.radius_mm = part * (kept * request_.tolerance_mm - half_sag.head<3>().norm());
    sample.radius_rad = part * std::max(kept * request_.tolerance_rad - half_sag.tail<3>().norm(), 1e-15);
  }

  // The tube's samples: the vertices, but no more than kSamplesOfSpan or so in a span, and places on longer
  // chords.
  void take_samples(const QuinticSpline& spline) {
    samples_.clear();
    const auto& v = request_.vertices;
    size_t k = 0;
    const size_t spans = static_cast<size_t>(spline.span_count());
    double last = -1e300;
    for (size_t i = 0; i + 1 < v.size(); ++i) {
      const double chord = v[i + 1].u - v[i].u;
      while (k + 1 < spans && spline.knots[k + 6] <= v[i].u) ++k;
      const double step = (spline.knots[k + 6] - spline.knots[k + 5]) / kSamplesOfSpan;
      if (v[i].u < start_ - chord) continue;
      const auto add = [&](double u, double share) {
        if (u < start_) return;
        add_sample(i, share);
        last = u;
      };
      if (v[i].u - last >= 0.7 * step) add(v[i].u, 0);
      const int parts = std::max(1, static_cast<int>(chord / step));
      for (int p = 1; p < parts; ++p) add(v[i].u + p * chord / parts, 1.0 * p / parts);
    }
    add_sample(v.size() - 2, 1);
    const size_t n = samples_.size();
    for (size_t i = 0; i < n; ++i)
      samples_[i].weight = (samples_[std::min(i + 1, n - 1)].u - samples_[i - std::min<size_t>(i, 1)].u) / 2;
    locate_samples(spline, samples_);
  }

  // Judges the fit on the programmed chords: each one at its ends and in between, in every span that it
  // crosses. The fit itself knew its samples only.
  void judge(RunFit& fit) {
    const size_t spans = static_cast<size_t>(fit.spline.span_count());
    fit.usage.assign(spans, TubeUse{});
    double worst = 0;
    const auto& v = request_.vertices;
    size_t i = vertex_before(start_);
    PathPoint from = fit.spline.derivatives_at_break(0);
    for (size_t k = 0; k < spans; ++k) {
      const double u0 = fit.spline.at_break(static_cast<int>(k)),
                   u1 = fit.spline.at_break(static_cast<int>(k + 1));
      const PathPoint to = fit.spline.derivatives_at_break(static_cast<int>(k + 1));
      const PathPiece piece = make_hermite(from, to, u1 - u0);
      from = to;
      while (i + 2 < v.size() && v[i + 1].u <= u0) ++i;
      for (size_t c = i; c + 1 < v.size() && v[c].u < u1; ++c) {
        const TubeUse used = chord_usage(piece, u0, u1, c);
        fit.usage[k].raise(used);
        if (used.worst() <= worst) continue;
        worst = used.worst();
        fit.worst_vertex = c;
      }
    }
    fit.ok = worst <= kUsageMax;
  }

  TubeUse chord_usage(const PathPiece& piece, double u0, double u1, size_t chord) const {
    const RunVertex &a = request_.vertices[chord], &b = request_.vertices[chord + 1];
    const double from = std::max(a.u, u0), to = std::min(b.u, u1), step_max = (u1 - u0) / 8;
    const int parts =
        b.u - a.u < step_max / 4 ? 1 : std::max(2, static_cast<int>(std::ceil((to - from) / step_max)));
    const auto use = [&](double u) { return usage_at(piece.at(u - u0), u, chord); };
    const double step = (to - from) / parts;
    TubeUse worst;
    for (int p = 0; p <= parts; ++p) {
      const double u = from + step * p;
      const TubeUse used = use(u);
      worst.raise(used);
      if (used.worst() < kNearGreatest || parts == 1) continue;
      double peak_at = u, peak = used.worst();  // it may lie between
      for (const double beside : {-0.5, -0.25, 0.25, 0.5}) {
        const double at = std::clamp(u + beside * step, from, to);
        const TubeUse there = use(at);
        worst.raise(there);
        if (there.worst() > peak) {
          peak = there.worst();
          peak_at = at;
        }
      }
      raise_to_peak(use, std::max(from, peak_at - 0.25 * step), std::min(to, peak_at + 0.25 * step), worst);
    }
    return worst;
  }

  // Beside a vertex the peak may be much narrower than the distance of the samples: golden section.
  template <typename Use>
  static void raise_to_peak(const Use& use, double from, double to, TubeUse& worst) {
    constexpr double kGolden = 0.6180339887498949;
    constexpr int kSteps = 8;
    double left = to - kGolden * (to - from), right = from + kGolden * (to - from);
    TubeUse at_left = use(left), at_right = use(right);
    for (int i = 0; i < kSteps; ++i) {
      worst.raise(at_left);
      worst.raise(at_right);
      if (at_left.worst() > at_right.worst()) {
        to = right;
        right = left;
        at_right = at_left;
        at_left = use(left = to - kGolden * (to - from));
      } else {
        from = left;
        left = right;
        at_left = at_right;
        at_right = use(right = from + kGolden * (to - from));
      }
    }
  }

  // Deviation of y from the nearest place of the chord, or of the neighbouring chord when that place lies
  // beyond an end.
  TubeUse usage_at(const Words& y, double u, size_t chord) const {
    const double length = request_.vertices[chord + 1].u - request_.vertices[chord].u;
    double place = 0;
    const TubeUse used = usage_on(y, u, chord, place);
    const bool before = place <= 0 && chord > 0,
               after = place >= length && chord + 2 < request_.vertices.size();
    if (!before && !after) return used;
    const TubeUse beside = usage_on(y, u, before ? chord - 1 : chord + 1, place);
    return beside.worst() < used.worst() ? beside : used;
  }

  TubeUse usage_on(const Words& y, double u, size_t chord, double& place) const {
    const RunVertex &a = request_.vertices[chord], &b = request_.vertices[chord + 1];
    const Words slope = (b.y - a.y) / (b.u - a.u), e = y - a.y - slope * (u - a.u);
    place = u - a.u + nearest_along(e, slope, request_.tolerance_mm, request_.tolerance_rad);
    place = std::clamp(place, 0.0, b.u - a.u);
    const auto use_from = [&](double at) {
      TubeUse from = tube_use(y - a.y - slope * at, request_.tolerance_mm, request_.tolerance_rad);
      from.linear += b.tolerance_used;
      from.rotary += b.tolerance_used;
      return from;
    };
    TubeUse used = use_from(place);
    if (used.worst() <= kUsageMax) return used;
    // The place was nearest for position and rotary words together. Another one, towards equal parameters,
    // may be better for the worse of the two.
    for (const double share : {0.25, 0.5, 0.75, 1.0}) {
      const double other = place + share * (std::clamp(u - a.u, 0.0, b.u - a.u) - place);
      const TubeUse there = use_from(other);
      if (there.worst() < used.worst()) used = there;
    }
    return used;
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

  // Asks for shorter spans where the tolerance is exceeded, and for none longer elsewhere. False: shorter
  // spans would not help, as they are shortest, given, or too many.
  bool refine(const RunFit& fit) {
    const size_t spans = fit.usage.size();
    bool shorter = false;
    limits_.clear();
    for (size_t k = 0; k < spans; ++k) {
      const double u0 = fit.spline.at_break(static_cast<int>(k)),
                   h = fit.spline.at_break(static_cast<int>(k + 1)) - u0;
      const bool over = fit.usage[k].worst() > kUsageMax;
      if (request_.head && k < 5) {  // these knots are given
        if (over) return false;
        continue;
      }
      const bool can = h > std::max(1.01 * kSpanMin, kSpanOfChordMin * chord_at(u0 + h / 2));
      limits_.push_back({u0 + h / 2, over && can ? kRefine * h : h});
      shorter = shorter || (over && can);
    }
    return shorter && spans < kSpansOfVertexMax * request_.vertices.size();
  }

  const RunRequest& request_;
  const RunTarget target_;
  double start_ = 0, end_ = 0;
  std::vector<SpanLimit> limits_;  // ascending in u
  std::vector<TubeSample> samples_;
};

}  // namespace

RunFit fit_run(const RunRequest& request) { return RunFitter(request).run(); }

}  // namespace trn
