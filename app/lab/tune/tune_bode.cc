#include "app/lab/tune/tune_bode.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "core/joint_model.h"
#include "app/lab/picture/axes.h"
#include "app/lab/picture/colours.h"
#include "app/lab/picture/svg.h"

namespace trn {

namespace {

using Complex = std::complex<double>;
using picture::Axes;
using picture::Px;
using picture::Svg;

constexpr std::size_t kWelch = 512;        // periods of a window
constexpr double kTrusted = 0.7;           // coherence
constexpr double kDip = 0.6, kPeak = 1.7;  // of the rigid response
constexpr double kSwingHz_min = 4;

// Radix 2, in place (Cooley and Tukey 1965).
void transform(std::vector<Complex>& x) {
  const std::size_t n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(x[i], x[j]);
  }
  for (std::size_t length = 2; length <= n; length <<= 1) {
    const Complex turn = std::polar(1.0, -2 * std::numbers::pi / static_cast<double>(length));
    for (std::size_t i = 0; i < n; i += length) {
      Complex w = 1;
      for (std::size_t k = 0; k < length / 2; ++k, w *= turn) {
        const Complex u = x[i + k], v = w * x[i + k + length / 2];
        x[i + k] = u + v;
        x[i + k + length / 2] = u - v;
      }
    }
  }
}

/// A window of the signal with its mean taken away, as a spectrum.
std::vector<Complex> spectrum(const std::vector<double>& signal, std::size_t from) {
  double mean = 0;
  for (std::size_t i = 0; i < kWelch; ++i) mean += signal[from + i] / kWelch;
  std::vector<Complex> out(kWelch);
  for (std::size_t i = 0; i < kWelch; ++i) {
    const double hann = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / kWelch);
    out[i] = hann * (signal[from + i] - mean);
  }
  transform(out);
  return out;
}

FrequencyResponse response(const std::vector<double>& in, const std::vector<double>& out, double period_s) {
  std::vector<double> xx(kWelch / 2), yy(kWelch / 2);
  std::vector<Complex> xy(kWelch / 2);
  for (std::size_t from = 0; from + kWelch <= in.size(); from += kWelch / 2) {
    const std::vector<Complex> x = spectrum(in, from), y = spectrum(out, from);
    for (std::size_t i = 0; i < kWelch / 2; ++i) {
      xx[i] += std::norm(x[i]);
      yy[i] += std::norm(y[i]);
      xy[i] += std::conj(x[i]) * y[i];
    }
  }
  FrequencyResponse result;
  for (std::size_t i = 1; i < kWelch / 2; ++i) {
    if (xx[i] <= 0 || yy[i] <= 0) continue;
    result.hz.push_back(static_cast<double>(i) / (kWelch * period_s));
    result.h.push_back(xy[i] / xx[i]);
    result.coherence.push_back(std::norm(xy[i]) / (xx[i] * yy[i]));
  }
  return result;
}

std::vector<double> differences(const std::vector<double>& q, double period_s) {
  std::vector<double> out(q.size());
  for (std::size_t k = 1; k + 1 < q.size(); ++k) out[k] = (q[k + 1] - q[k - 1]) / (2 * period_s);
  return out;
}

// What is left of the motor's force for moving masses.
std::vector<double> moving_force(const TuneData& data, const TuneFit& fit, const std::vector<double>& v,
                                 double slowest) {
  std::vector<double> out(data.rows());
  const JointModel model = fit.model(slowest);
  for (std::size_t k = 0; k < data.rows(); ++k) {
    JointModel friction = model;
    friction.inertia = 0;
    out[k] = std::isfinite(data.force[k]) ? data.force[k] - friction.force(data.measured[k], v[k], 0) : 0;
  }
  return out;
}

// The free mass turns force into velocity as 1 / (J i w).
void over_rigid(FrequencyResponse& mechanics, double inertia) {
  for (std::size_t i = 0; i < mechanics.hz.size(); ++i)
    mechanics.h[i] *= Complex(0, 2 * std::numbers::pi * mechanics.hz[i] * inertia);
}

std::optional<double> bandwidth(const FrequencyResponse& closed) {
  for (std::size_t i = 0; i < closed.hz.size(); ++i) {
    if (closed.coherence[i] < kTrusted) continue;
    if (std::abs(closed.h[i]) < std::sqrt(0.5) || std::real(closed.h[i]) < 0) return closed.hz[i];
  }
  return std::nullopt;
}

// The deepest dip, or the highest peak, that is trusted; its place between bins by a parabola through their
// logarithms.
std::optional<double> extreme(const FrequencyResponse& r, bool peak, double from_hz) {
  std::optional<std::size_t> best;
  const auto level = [&](std::size_t i) { return (peak ? 1 : -1) * std::log(std::abs(r.h[i]) + 1e-12); };
  for (std::size_t i = 1; i + 1 < r.hz.size(); ++i) {
    const bool beyond = peak ? std::abs(r.h[i]) > kPeak : std::abs(r.h[i]) < kDip;
    if (r.hz[i] < from_hz || !beyond || level(i) < level(i - 1) || level(i) < level(i + 1)) continue;
    // A dip has little signal of its own: its shoulders are trusted.
    if (std::max(r.coherence[i - 1], r.coherence[i + 1]) < kTrusted / 2) continue;
    if (!best || level(i) > level(*best)) best = i;
  }
  if (!best) return std::nullopt;
  const std::size_t i = *best;
  const double left = level(i - 1), middle = level(i), right = level(i + 1);
  const double bend = left - 2 * middle + right;
  const double shift = bend < 0 ? 0.5 * (left - right) / bend : 0;
  return r.hz[i] + shift * (r.hz[i + 1] - r.hz[i]);
}

double decibels(const Complex& h) { return 20 * std::log10(std::max(1e-6, std::abs(h))); }

void draw_response(Svg& svg, double top, const std::string& title, const FrequencyResponse& r, bool phase) {
  std::vector<double> values;
  std::vector<Px> places;
  for (std::size_t i = 0; i < r.hz.size(); ++i) {
    const bool trusted = r.coherence[i] >= kTrusted / 2;
    const double value = phase ? std::arg(r.h[i]) * 180 / std::numbers::pi : decibels(r.h[i]);
    values.push_back(trusted ? value : std::nan(""));
  }
  const double low = std::log10(r.hz.empty() ? 1 : r.hz.front()),
               high = std::log10(r.hz.empty() ? 10 : r.hz.back());
  const Axes axes({80, top, 800, 150}, {low, high}, picture::Range::over(values, 0.1));
  axes.draw(svg, "frequency, powers of ten Hz", title);
  for (std::size_t i = 0; i < r.hz.size(); ++i) places.push_back(axes.at(std::log10(r.hz[i]), values[i]));
  svg.polyline(places, picture::line_colour(phase ? 1 : 0));
}

}  // namespace

TuneLoop measure_loop(const TuneData& data, const TuneFit& fit, const Joint& joint) {
  TuneLoop loop;
  const std::vector<double> wanted = differences(data.setpoint, data.period_s),
                            seen = differences(data.measured, data.period_s);
  loop.closed = response(wanted, seen, data.period_s);
  loop.mechanics = response(moving_force(data, fit, seen, 0.002 * joint.limit.velocity), seen, data.period_s);
  over_rigid(loop.mechanics, fit.inertia.value);
  loop.bandwidth_hz = bandwidth(loop.closed);
  loop.swing_hz = extreme(loop.mechanics, false, kSwingHz_min);
  loop.resonance_hz = extreme(loop.mechanics, true, loop.swing_hz.value_or(kSwingHz_min));
  return loop;
}

std::optional<double> recommended_jerk(const TuneLoop& loop, const Joint& joint) {
  const std::optional<double> slowest = loop.swing_hz ? loop.swing_hz : loop.resonance_hz;
  if (!slowest) return std::nullopt;
  return joint.limit.acceleration * *slowest;
}

std::string bode_svg(const TuneLoop& loop, const Joint& joint) {
  Svg svg(900, 960);
  svg.text(80, 30, fmt::format("Joint {}: what follows a setpoint, and what a force moves", joint.name),
           {.size = 17});
  draw_response(svg, 80, "closed loop, dB", loop.closed, false);
  draw_response(svg, 300, "closed loop, degrees", loop.closed, true);
  draw_response(svg, 520, "mechanics over a rigid mass, dB", loop.mechanics, false);
  draw_response(svg, 740, "mechanics, degrees", loop.mechanics, true);
  return svg.str();
}

}  // namespace trn
