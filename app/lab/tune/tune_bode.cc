#include "app/lab/tune/tune_bode.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "app/lab/picture/axes.h"
#include "app/lab/picture/colours.h"
#include "app/lab/picture/svg.h"
#include "app/lab/tune/fourier.h"
#include "core/joint_model.h"

namespace trn {

namespace {

using Complex = std::complex<double>;
using picture::Axes;
using picture::Px;
using picture::Svg;

constexpr std::size_t kMovingWindow = 256, kStrokeWindow = 1024;  // periods of a window
constexpr double kTrusted = 0.7;                                  // coherence
constexpr double kBeyondSeen = 1.3;  // of the greatest frequency: farther away is a guess
constexpr double kSlowestSwing_hz = 5;
constexpr std::size_t kGapMax = 8;                               // frequencies
constexpr double kNotRigid = 0.1, kExplained = 0.5, kDip = 0.6;  // of the rigid response; of what that leaves
constexpr double kStrokeSpeed = 0.2, kSlowestMoving = 0.01;      // of the joint's velocity

std::vector<double> differences(const std::vector<double>& q, double period_s) {
  std::vector<double> out(q.size());
  for (std::size_t k = 1; k + 1 < q.size(); ++k) out[k] = (q[k + 1] - q[k - 1]) / (2 * period_s);
  return out;
}

/// Auto and cross spectra, added up window by window.
class CrossSpectra {
 public:
  explicit CrossSpectra(std::size_t size) : size_(size), xx_(size / 2), yy_(size / 2), xy_(size / 2) {}
  void add(const std::vector<Complex>& x, const std::vector<Complex>& y) {
    for (std::size_t i = 0; i < size_ / 2; ++i) {
      xx_[i] += std::norm(x[i]);
      yy_[i] += std::norm(y[i]);
      xy_[i] += std::conj(x[i]) * y[i];
    }
  }
  FrequencyResponse response(double period_s) const {
    FrequencyResponse result;
    for (std::size_t i = 1; i < size_ / 2; ++i) {
      if (xx_[i] <= 0 || yy_[i] <= 0) continue;
      result.hz.push_back(static_cast<double>(i) / (static_cast<double>(size_) * period_s));
      result.h.push_back(xy_[i] / xx_[i]);
      result.coherence.push_back(std::norm(xy_[i]) / (xx_[i] * yy_[i]));
    }
    return result;
  }

 private:
  std::size_t size_;
  std::vector<double> xx_, yy_;
  std::vector<Complex> xy_;
};

/// Of windows that begin at these places.
FrequencyResponse response(const std::vector<double>& in, const std::vector<double>& out,
                           const std::vector<std::size_t>& begins, double period_s) {
  CrossSpectra sum(kMovingWindow);
  for (const std::size_t from : begins)
    sum.add(window_spectrum(in, from, kMovingWindow), window_spectrum(out, from, kMovingWindow));
  return sum.response(period_s);
}

// A stroke from rest to rest needs no window: nothing of it is cut off.
std::vector<Complex> stroke_spectrum(const std::vector<double>& signal, std::size_t from, std::size_t to) {
  std::vector<Complex> out(kStrokeWindow);
  for (std::size_t i = from; i < to; ++i) out[i - from] = signal[i];
  transform(out);
  return out;
}

FrequencyResponse stroke_response(const TuneData& data, double fast) {
  const std::vector<double> wanted = differences(data.setpoint, data.period_s),
                            seen = differences(data.measured, data.period_s);
  CrossSpectra sum(kStrokeWindow);
  for (std::size_t from = 0, to = 0; from < data.rows(); from = to) {
    double speed = 0;
    for (to = from; to < data.rows() && data.stroke[to] == data.stroke[from]; ++to)
      speed = std::max(speed, std::abs(wanted[to]));
    if (speed > fast && to - from <= kStrokeWindow)
      sum.add(stroke_spectrum(wanted, from, to), stroke_spectrum(seen, from, to));
  }
  return sum.response(data.period_s);
}

// Windows all over which the joint moves in one direction: at rest a force says nothing of masses.
std::vector<std::size_t> moving_windows(const std::vector<double>& v, double slowest) {
  std::vector<std::size_t> out;
  std::size_t run = 0;
  for (std::size_t k = 1; k < v.size(); ++k) {
    const bool goes_on = std::abs(v[k]) > slowest && (v[k] > 0) == (v[k - 1] > 0);
    run = goes_on ? run + 1 : 0;
    if (run >= kMovingWindow && (run - kMovingWindow) % (kMovingWindow / 8) == 0)
      out.push_back(k + 1 - kMovingWindow);
  }
  return out;
}

// Over some periods, so that the steps of the encoder do not turn it round.
std::vector<double> smooth_velocity(const std::vector<double>& q, double period_s) {
  constexpr std::size_t kHalf = 4;
  std::vector<double> out(q.size());
  for (std::size_t k = kHalf; k + kHalf < q.size(); ++k)
    out[k] = (q[k + kHalf] - q[k - kHalf]) / (2 * kHalf * period_s);
  return out;
}

std::vector<double> accelerations(const std::vector<double>& q, double period_s) {
  std::vector<double> out(q.size());
  for (std::size_t k = 1; k + 1 < q.size(); ++k)
    out[k] = (q[k + 1] - 2 * q[k] + q[k - 1]) / (period_s * period_s);
  return out;
}

// What is left of the motor's force for moving masses, over all of them: the acceleration of a rigid joint.
std::vector<double> rigid_acceleration(const TuneData& data, const TuneFit& fit,
                                       const std::vector<double>& v) {
  JointModel friction = fit.model(0);
  friction.inertia = 0;
  std::vector<double> out(data.rows());
  for (std::size_t k = 0; k < data.rows(); ++k) {
    const double force = data.force[k] - friction.force(data.measured[k], v[k], 0);
    out[k] = std::isfinite(force) ? force / fit.inertia.value : 0;
  }
  return out;
}

// Where it falls to 3 dB or 90 degrees, between two bins on a straight line.
std::optional<double> bandwidth(const FrequencyResponse& closed) {
  const double level = std::sqrt(0.5);
  for (std::size_t i = 1; i < closed.hz.size() && closed.coherence[i] >= kTrusted; ++i) {
    const double before = std::abs(closed.h[i - 1]), here = std::abs(closed.h[i]);
    if (here < level && before > here)
      return closed.hz[i] -
             (closed.hz[i] - closed.hz[i - 1]) * std::clamp((level - here) / (before - here), 0.0, 1.0);
    if (std::real(closed.h[i]) < 0) return closed.hz[i];
  }
  return std::nullopt;
}

// Up to where force and acceleration have to do with each other, but for a gap as a dip makes one.
double seen_up_to(const FrequencyResponse& r) {
  double last = 0;
  for (std::size_t i = 0, gap = 0; i < r.hz.size() && gap < kGapMax; ++i) {
    const bool seen = r.coherence[i] >= kTrusted;
    gap = seen ? 0 : gap + 1;
    if (seen) last = r.hz[i];
  }
  return last;
}

/// A motor and its load on a spring.
struct TwoMasses {
  double swing_hz = 0;  ///< of the load, the motor held; 0: rigid
  double share = 0.5;   ///< of the inertia, the load's
  double damping = 0.05;

  double resonance_hz() const { return swing_hz / std::sqrt(1 - share); }  // none with a share of 1
  /// Acceleration over that of a rigid joint.
  Complex response(double hz) const {
    if (swing_hz <= 0) return 1;
    const double load = hz / swing_hz, both = hz / resonance_hz();
    return Complex(1 - load * load, 2 * damping * load) / Complex(1 - both * both, 2 * damping * load);
  }
};

// Mean square of what the model leaves; each frequency weighs as much as its coherence is worth (Bendat and
// Piersol, Random Data, 9.2).
double misfit(const FrequencyResponse& r, double up_to_hz, const TwoMasses& masses) {
  double sum = 0, weights = 0;
  for (std::size_t i = 0; i < r.hz.size() && r.hz[i] <= up_to_hz; ++i) {
    const double weight = r.coherence[i] / (1.02 - r.coherence[i]);
    sum += weight * std::norm(r.h[i] - masses.response(r.hz[i]));
    weights += weight;
  }
  return weights > 0 ? sum / weights : 0;
}

// All combinations: there are few, and no descent finds its way among dips. Rigid where two masses explain
// little more.
TwoMasses fit_two_masses(const FrequencyResponse& r, double up_to_hz) {
  TwoMasses best;
  const double rigid = misfit(r, up_to_hz, best);
  double least = rigid;
  for (double hz = kSlowestSwing_hz; hz < kBeyondSeen * up_to_hz; hz *= 1.01)
    for (double share = 0.1; share < 0.95; share += 0.05)
      for (const double damping : {0.01, 0.03, 0.1, 0.2, 0.4, 0.7}) {
        const TwoMasses tried{hz, share, damping};
        if (const double left = misfit(r, up_to_hz, tried); left < least) {
          least = left;
          best = tried;
        }
      }
  if (rigid < kNotRigid * kNotRigid) return {};
  if (least < kExplained * rigid) return best;
  // With play no two masses explain it; the deepest dip is where the load swings most.
  TwoMasses dip;
  double lowest = kDip;
  for (std::size_t i = 0; i < r.hz.size() && r.hz[i] <= up_to_hz; ++i) {
    if (r.coherence[i] < kTrusted || std::abs(r.h[i]) >= lowest) continue;
    lowest = std::abs(r.h[i]);
    dip = {r.hz[i], 1, 0};
  }
  return dip;
}

double decibels(const Complex& h) { return 20 * std::log10(std::max(1e-6, std::abs(h))); }

// Only what is to be trusted: beyond, noise would rule the picture.
void draw_response(Svg& svg, double top, const std::string& title, const FrequencyResponse& r, bool phase) {
  const double high = std::max(10.0, seen_up_to(r));
  std::vector<double> hz, values;
  for (std::size_t i = 0; i < r.hz.size() && r.hz[i] <= high; ++i) {
    const double value = phase ? std::arg(r.h[i]) * 180 / std::numbers::pi : decibels(r.h[i]);
    hz.push_back(r.hz[i]);
    values.push_back(r.coherence[i] >= kTrusted ? value : std::nan(""));
  }
  const Axes axes({80, top, 800, 150}, {0, high}, picture::Range::over(values, 0.1));
  axes.draw(svg, "frequency, Hz", title);
  std::vector<Px> places;
  for (std::size_t i = 0; i < hz.size(); ++i) places.push_back(axes.at(hz[i], values[i]));
  svg.polyline(places, picture::line_colour(phase ? 1 : 0));
}

}  // namespace

TuneLoop measure_loop(const TuneData& data, const TuneFit& fit, const Joint& joint) {
  TuneLoop loop;
  const double dt = data.period_s;
  const std::vector<double> v = smooth_velocity(data.measured, dt);
  const std::vector<double> seen = accelerations(data.measured, dt);
  const std::vector<std::size_t> moving = moving_windows(v, kSlowestMoving * joint.limit.velocity);
  loop.closed = stroke_response(data, kStrokeSpeed * joint.limit.velocity);
  loop.mechanics = response(rigid_acceleration(data, fit, v), seen, moving, dt);
  loop.bandwidth_hz = bandwidth(loop.closed);
  loop.seen_up_to_hz = seen_up_to(loop.mechanics);
  loop.stirred = measure_stirred(data, fit, joint);
  if (loop.stirred && loop.stirred->resonance_hz > 0) {
    loop.resonance_hz = loop.stirred->resonance_hz;
    loop.swing_hz = loop.stirred->swing_hz();
    loop.seen_up_to_hz = std::max(loop.seen_up_to_hz, loop.stirred->seen_up_to_hz);
    return loop;
  }
  const TwoMasses masses = fit_two_masses(loop.mechanics, loop.seen_up_to_hz);
  if (masses.swing_hz <= 0) return loop;
  loop.swing_hz = masses.swing_hz;
  if (masses.resonance_hz() < kBeyondSeen * loop.seen_up_to_hz) loop.resonance_hz = masses.resonance_hz();
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
