#include "interp/plan/geometry/corner_blend.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/axes.h"
#include "core/check.h"
#include "interp/move.h"

namespace trn {

namespace {

constexpr int kSamples = 32;        // even, so that the middle is one of them
constexpr double kNearlyAll = 0.8;  // of the greatest sample: the peak may be beside it
constexpr int kPeakSteps = 16;      // of the golden section, down to 1e-3 of the samples' distance
constexpr double kUsageAim =
    0.9999;                         // of the tolerance: the rest covers rounding and the peak search's error
constexpr double kSpeedMin = 0.03;  // |y'| of a blend; lines at 175 degrees have 0.044

template <typename Function>
double golden_peak(const Function& f, double from, double to) {
  constexpr double kGolden = 0.6180339887498949;
  double left = to - kGolden * (to - from), right = from + kGolden * (to - from);
  double at_left = f(left), at_right = f(right);
  for (int i = 0; i < kPeakSteps; ++i) {
    if (at_left > at_right) {
      to = right;
      right = left;
      at_right = at_left;
      left = to - kGolden * (to - from);
      at_left = f(left);
    } else {
      from = left;
      left = right;
      at_left = at_right;
      right = from + kGolden * (to - from);
      at_right = f(right);
    }
  }
  return std::max(at_left, at_right);
}

double usage(double deviation, double tolerance) {
  TRN_CHECK(deviation >= 0 && tolerance >= 0);
  if (deviation <= 1e-13) return 0;
  return tolerance > 0 ? deviation / tolerance : std::numeric_limits<double>::infinity();
}

double usage(const Words& deviation, const BlendBounds& bounds) {
  return std::max(usage(deviation.head<3>().norm(), bounds.tolerance_mm),
                  usage(deviation.tail<3>().norm(), bounds.tolerance_rad));
}

bool both_lines(const PathPiece& a, const PathPiece& b) {
  return a.kind == PathPiece::Kind::kLine && b.kind == PathPiece::Kind::kLine;
}

// The greatest value of `f` over [0, length], from its samples `at` even distances: a golden section in every
// interval that may hold the peak. f may have a kink in the middle, where the programmed path has its corner,
// so no interval reaches across it.
template <typename Function>
double peak(const Function& f, double length, const std::array<double, kSamples + 1>& at) {
  const double step = length / kSamples, greatest = *std::max_element(at.begin(), at.end());
  double best = greatest;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const bool rises = k == 0 || k == kSamples / 2 || at[k - 1] <= at[k];
    const bool falls = k + 2 > kSamples || k + 1 == kSamples / 2 || at[k + 2] <= at[k + 1];
    if (std::max(at[k], at[k + 1]) < kNearlyAll * greatest || !rises || !falls) continue;
    best = std::max(best, golden_peak(f, step * static_cast<double>(k), step * static_cast<double>(k + 1)));
  }
  return best;
}

// A septic follows an arc well for about a radian.
double curve_span_max(const PathPiece& piece) {
  if (piece.kind != PathPiece::Kind::kArc || piece.omega == 0) return piece.length;
  return std::min(piece.length, 1 / std::abs(piece.omega));
}

bool is_smooth(const PathPiece& before, const PathPiece& after) {
  const PathPoint a = before.derivatives(before.length), b = after.derivatives(0);
  const double scale = 1e-11 + 1e-14 * (1 + path_norm(a.y)) / std::min(before.length, after.length);
  const auto close = [&](const Words& u, const Words& v) {
    return path_norm(u - v) <= scale * (path_norm(u) + path_norm(v));
  };
  return close(a.d1, b.d1) && close(a.d2, b.d2) && close(a.d3, b.d3);
}

Junction exact_junction(const PathItem& before, const PathItem& after) {
  const bool join = before.mode == PathMode::kExactPath && is_smooth(before.piece, after.piece);
  return {join ? Junction::Kind::kSmooth : Junction::Kind::kStop, 0};
}

}  // namespace

PathPiece make_blend(const PathPiece& before, const PathPiece& after, double span) {
  TRN_CHECK(span > 0);
  TRN_CHECK(span <= before.length && span <= after.length);
  return make_hermite(before.derivatives(before.length - span), after.derivatives(span), 2 * span);
}

double blend_usage(const PathPiece& before, const PathPiece& after, double span, const BlendBounds& bounds) {
  // Between two lines P1 gives the deviation in closed form; between other pieces it is searched.
  if (both_lines(before, after)) return usage(kCornerMiss * span * (after.c[1] - before.c[1]), bounds);
  const PathPiece blend = make_blend(before, after, span);
  const auto used = [&](double s) {
    const Words programmed = s <= span ? before.at(before.length - span + s) : after.at(s - span);
    return usage(blend.at(s) - programmed, bounds);
  };
  std::array<double, kSamples + 1> at{};
  for (std::size_t k = 1; k < kSamples; ++k) {
    const double s = 2 * span * static_cast<double>(k) / kSamples;
    if (path_norm(blend.derivatives(s).d1) < kSpeedMin) return std::numeric_limits<double>::infinity();
    at[k] = used(s);
  }
  return peak(used, 2 * span, at) / kUsageAim;
}

double largest_span(const PathPiece& before, const PathPiece& after, const BlendBounds& bounds) {
  TRN_CHECK(bounds.span_max > 0);
  double high = bounds.span_max;
  double at_high = blend_usage(before, after, high, bounds);
  if (at_high <= 1) return high;
  if (both_lines(before, after)) return high / at_high;  // proportional; 0 without tolerance
  // Usage grows about in proportion to the span, but not exactly and not always steadily. The first guesses
  // assume proportion, the later ones halve the interval on a logarithmic scale; `low` always keeps the
  // bounds.
  double low = 0;
  const Words turn = after.derivatives(0).d1 - before.derivatives(before.length).d1;
  double guess = 0.98 / usage(kCornerMiss * turn, bounds);  // right for two lines
  for (int i = 0; i < 40 && high > kBlendSpanMin && low < high * 0.997; ++i) {
    const double span = guess > low && guess < high ? guess : (low > 0 ? std::sqrt(low * high) : high / 3);
    const double used = blend_usage(before, after, span, bounds);
    (used <= 1 ? low : high) = span;
    guess = std::isfinite(used) && i < 4 ? span * std::min(0.999 / used, 4.0) : 0;
  }
  return low;
}

Junction classify(const PathItem& before, const PathItem& after) {
  if (before.mode != after.mode || before.context != after.context) return {};
  if (before.joins_next) return {Junction::Kind::kSmooth, 0};
  if (before.mode != PathMode::kContinuous) return exact_junction(before, after);
  if (is_smooth(before.piece, after.piece)) return {Junction::Kind::kSmooth, 0};
  const Words t0 = before.piece.derivatives(before.piece.length).d1, t1 = after.piece.derivatives(0).d1;
  if (path_dot(t0, t1) <= kReversalCos * path_norm(t0) * path_norm(t1)) return {};
  const BlendBounds bounds{std::min(before.tolerance_mm, after.tolerance_mm),
                           std::min(before.tolerance_rad, after.tolerance_rad),
                           std::min(curve_span_max(before.piece), curve_span_max(after.piece))};
  const double span = largest_span(before.piece, after.piece, bounds);
  if (span < kBlendSpanMin) return {};
  return {Junction::Kind::kBlend, span};
}

}  // namespace trn
