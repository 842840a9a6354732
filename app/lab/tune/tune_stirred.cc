#include "app/lab/tune/tune_stirred.h"

#include <algorithm>
#include <array>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "app/lab/tune/fourier.h"

namespace trn {

namespace {

using Wave = std::complex<double>;

constexpr std::size_t kStirredWindow = 1024, kStirredHop = 256;
constexpr double kSure = 0.6;       // coherence
constexpr double kOfNyquist = 0.9;  // beyond, differences of places say nothing
constexpr double kLowest_hz = 5;
constexpr double kLittleLeft = 0.5;  // of what a rigid joint leaves
constexpr double kFloor = 0.05;      // of the rigid response: what a dip weighs at least
constexpr double kSwings = 0.35;     // damping: beyond, there is no peak
constexpr int kShiftMax = 3;

/// Told, its mean force over the inertia, and acceleration; of the windows in which the joint went evenly.
struct Spectra {
  std::vector<Wave> told_force, told_motion;
  std::vector<double> told, motion;
  int windows = 0;
};

/// Motor and load on a spring under a force that holds for a period: acceleration, as a difference of places,
/// over that of a rigid joint. The exact solution of a damped swing under zero-order hold (Astrom and
/// Wittenmark, docs/sources.md); frequencies in Hz, `share` of the load in the whole inertia.
struct HeldSpring {
  double hz = 0, share = 0.5, damping = 0.02;

  Wave response(double at_hz, double period_s) const {
    if (hz <= 0) return 1;
    const double w = 2 * std::numbers::pi * hz, t = period_s, decay = std::exp(-damping * w * t);
    const double wd = w * std::sqrt(std::max(1e-9, 1 - damping * damping)), ratio = damping * w / wd;
    const double c = std::cos(wd * t), s = std::sin(wd * t);
    const double b1 = (1 - decay * (c + ratio * s)) / (w * w),
                 b2 = (decay * decay + decay * (ratio * s - c)) / (w * w);
    const Wave z = std::polar(1.0, 2 * std::numbers::pi * at_hz * t);
    const Wave swing = z * (b1 * z + b2) / (z * z - 2.0 * decay * c * z + decay * decay);
    return 1.0 + share / (1 - share) * (z - 2.0 + 1.0 / z) / (t * t) * swing * 2.0 / (1.0 + z);
  }
};

// By how many periods the torque that is told by the drive is behind the one it was told.
int shift_of(const TuneData& data, std::size_t from) {
  int best = 0;
  double most = -1;
  for (int shift = -kShiftMax; shift <= kShiftMax; ++shift) {
    double sum = 0;
    for (std::size_t k = from + kShiftMax; k + kShiftMax + 1 < data.rows(); ++k) {
      const auto at = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(k) - shift);
      // Differences: friction and weight do not matter.
      sum += (data.force[k + 1] - data.force[k]) * (data.stirred[at + 1] - data.stirred[at]);
    }
    if (sum > most) most = sum, best = shift;
  }
  return best;
}

/// What is looked at, period by period from `from` on.
struct Signals {
  std::vector<double> told, force, motion;
  std::vector<std::size_t> begins;  ///< of the windows
};

Signals signals_of(const TuneData& data, const TuneFit& fit, const Joint& joint, std::size_t from) {
  const std::size_t n = data.rows();
  const double dt = data.period_s;
  const int shift = shift_of(data, from);
  Signals out;
  out.told.assign(n, 0);
  out.force.assign(n, 0);
  out.motion.assign(n, 0);
  std::vector<double> mean(n, 0);
  const auto told = [&](std::size_t k) {
    return data.stirred[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
        static_cast<std::ptrdiff_t>(k) - shift, 0, static_cast<std::ptrdiff_t>(n) - 1))];
  };
  // What is told holds for the period; the rest of the force, the loops', goes on evenly from end to end.
  for (std::size_t k = std::max<std::size_t>(from, 1); k < n; ++k)
    mean[k] = told(k) + (data.force[k - 1] - told(k - 1) + data.force[k] - told(k)) / 2;
  for (std::size_t k = std::max<std::size_t>(from, 1); k + 1 < n; ++k) {
    out.told[k] = told(k);
    out.force[k] = (mean[k] + mean[k + 1]) / 2 / fit.inertia.value;
    out.motion[k] = (data.measured[k + 1] - 2 * data.measured[k] + data.measured[k - 1]) / (dt * dt);
  }
  constexpr std::size_t kHalf = 10;
  const double slowest = 0.01 * joint.limit.velocity;
  std::size_t run = 0;
  for (std::size_t k = from + kHalf; k + kHalf < n; ++k) {
    const double way = data.measured[k + kHalf] - data.measured[k - kHalf];
    const double before = data.measured[k + kHalf - 1] - data.measured[k - kHalf - 1];
    const bool even = std::abs(way) > slowest * 2 * kHalf * dt && (way > 0) == (before > 0);
    run = even ? run + 1 : 0;
    if (run >= kStirredWindow && (run - kStirredWindow) % kStirredHop == 0)
      out.begins.push_back(k + 1 - kStirredWindow);
  }
  return out;
}

Spectra spectra_of(const Signals& signals, std::size_t first, std::size_t step) {
  constexpr std::size_t kHalf = kStirredWindow / 2;
  Spectra out{std::vector<Wave>(kHalf), std::vector<Wave>(kHalf), std::vector<double>(kHalf),
              std::vector<double>(kHalf), 0};
  for (std::size_t i = first; i < signals.begins.size(); i += step) {
    const std::vector<Wave> told = window_spectrum(signals.told, signals.begins[i], kStirredWindow),
                            force = window_spectrum(signals.force, signals.begins[i], kStirredWindow),
                            motion = window_spectrum(signals.motion, signals.begins[i], kStirredWindow);
    for (std::size_t k = 0; k < kHalf; ++k) {
      out.told_force[k] += std::conj(told[k]) * force[k];
      out.told_motion[k] += std::conj(told[k]) * motion[k];
      out.told[k] += std::norm(told[k]);
      out.motion[k] += std::norm(motion[k]);
    }
    ++out.windows;
  }
  return out;
}

/// A frequency, what was seen there, and how much it is worth.
struct Seen {
  double hz = 0, weight = 0;
  Wave h;
};

std::vector<Seen> seen_of(const Spectra& spectra, double period_s) {
  std::vector<Seen> out;
  const double hz_step = 1 / (static_cast<double>(kStirredWindow) * period_s), nyquist_hz = 0.5 / period_s;
  for (std::size_t k = 1; k < kStirredWindow / 2; ++k) {
    const double hz = hz_step * static_cast<double>(k);
    if (hz < kLowest_hz || hz > kOfNyquist * nyquist_hz || spectra.told[k] <= 0 || spectra.motion[k] <= 0)
      continue;
    const double coherence = std::norm(spectra.told_motion[k]) / (spectra.told[k] * spectra.motion[k]);
    out.push_back({hz, coherence < kSure ? 0 : coherence / (1.02 - coherence),
                   spectra.told_motion[k] / spectra.told_force[k]});
  }
  return out;
}

// Of the response's own size, so that a dip counts as a peak does. `late`: of the places behind the torque,
// periods.
double left_over(const std::vector<Seen>& seen, const HeldSpring& spring, int late, double period_s) {
  double sum = 0, weights = 0;
  for (const Seen& one : seen) {
    if (one.weight == 0) continue;
    const Wave model =
        spring.response(one.hz, period_s) * std::polar(1.0, -2 * std::numbers::pi * one.hz * period_s * late);
    sum += one.weight * std::norm(one.h - model) / (std::norm(model) + kFloor);
    weights += one.weight;
  }
  return weights > 0 ? sum / weights : 0;
}

/// A grid, then ever smaller steps about the best of it.
struct SpringFit {
  HeldSpring spring;
  double left = 0, rigid = 0;
};

SpringFit fit_spring(const std::vector<Seen>& seen, double high_hz, double period_s) {
  SpringFit out;
  int late = 0;
  out.rigid = left_over(seen, {}, 0, period_s);
  for (int shift = -1; shift <= 2; ++shift)
    if (const double left = left_over(seen, {}, shift, period_s); left < out.rigid)
      out.rigid = left, late = shift;
  out.left = out.rigid;
  for (int shift = -1; shift <= 2; ++shift)
    for (double hz = kLowest_hz; hz < high_hz; hz *= 1.02)
      for (const double share : {0.15, 0.35, 0.55, 0.75, 0.9})
        for (const double damping : {0.01, 0.04, 0.15, 0.4}) {
          const HeldSpring tried{hz, share, damping};
          if (const double left = left_over(seen, tried, shift, period_s); left < out.left)
            out.left = left, out.spring = tried, late = shift;
        }
  if (out.spring.hz <= 0) return out;
  for (double step = 0.02; step > 1e-4; step /= 1.6)
    for (int i = 0; i < 6; ++i)
      for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {1.0, -1.0}) {
          HeldSpring tried = out.spring;
          if (axis == 0) tried.hz *= 1 + sign * step;
          if (axis == 1) tried.share = std::clamp(tried.share + sign * 2 * step, 0.02, 0.98);
          if (axis == 2) tried.damping = std::clamp(tried.damping * (1 + sign * 8 * step), 0.001, 0.99);
          if (const double left = left_over(seen, tried, late, period_s); left < out.left)
            out.left = left, out.spring = tried;
        }
  return out;
}

}  // namespace

std::optional<StirredLoop> measure_stirred(const TuneData& data, const TuneFit& fit, const Joint& joint) {
  const auto first = std::find_if(data.stroke.begin(), data.stroke.end(),
                                  [&](int stroke) { return stroke >= data.first_stirred; });
  if (first == data.stroke.end() || data.stirred.size() != data.rows()) return std::nullopt;
  const auto from = static_cast<std::size_t>(first - data.stroke.begin());
  const Signals signals = signals_of(data, fit, joint, from);
  if (signals.begins.size() < 4) return std::nullopt;
  StirredLoop out;
  out.nyquist_hz = 0.5 / data.period_s;
  const double high_hz = kOfNyquist * out.nyquist_hz;
  const std::vector<Seen> seen = seen_of(spectra_of(signals, 0, 1), data.period_s);
  for (const Seen& one : seen)
    if (one.weight > 0) out.seen_up_to_hz = one.hz;
  const SpringFit found = fit_spring(seen, high_hz, data.period_s);
  if (found.spring.hz <= 0 || found.left > kLittleLeft * found.rigid || found.spring.damping > kSwings)
    return out;
  std::array<double, 2> halves{};
  for (std::size_t half = 0; half < 2; ++half)
    halves[half] =
        fit_spring(seen_of(spectra_of(signals, half, 2), data.period_s), high_hz, data.period_s).spring.hz;
  out.resonance_hz = found.spring.hz;
  out.deviation_hz = std::abs(halves[0] - halves[1]) / 2;
  out.damping = found.spring.damping;
  out.share = found.spring.share;
  return out;
}

}  // namespace trn
