#include "compensation/screw_correction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kFactorMin = 0.3, kFactorMax = 3;  // a model that is further off is wrong in another way
// A model that is colder than this has no shape yet: its ratio to a reading would be noise over noise.
constexpr double kCold_K = 1e-3;
constexpr double kJudge_s = 0.5;  // the least time over which a change is judged: a sensor has steps
constexpr double kSmooth_s = 30;  // time constant of what the sensor changes: its place warms in bursts

/// Weights of the uniform cubic B-spline at t of 0 to 1 behind the last profile: what grows evenly is
/// followed evenly, anything else with two continuous derivatives.
std::array<double, 4> spline_weights(double t) TRN_RT {
  const double x = std::clamp(t, 0.0, 1.0), y = 1 - x;
  return {y * y * y / 6, (4 + x * x * (3 * x - 6)) / 6, (1 + x * (3 + x * (3 - 3 * x))) / 6, x * x * x / 6};
}

/// Second derivatives of the natural cubic spline on equally spaced nodes.
template <std::size_t N>
std::array<double, N> second_derivatives(const std::array<double, N>& u, double h) {
  std::array<double, N> m{}, upper{}, right{};
  for (std::size_t i = 1; i + 1 < N; ++i) {
    const double pivot = 4 - upper[i - 1];
    upper[i] = 1 / pivot;
    right[i] = (6 / (h * h) * (u[i + 1] - 2 * u[i] + u[i - 1]) - right[i - 1]) / pivot;
  }
  for (std::size_t i = N - 2; i > 0; --i) m[i] = right[i] - upper[i] * m[i + 1];
  return m;
}

}  // namespace

double ScrewCorrection::Profile::at(double x_mm, double spacing_mm) const TRN_RT {
  // Beyond the bearings the screw ends, and its growth stays that of the end.
  const double cells = std::clamp(x_mm / spacing_mm, 0.0, static_cast<double>(kNodes - 1));
  // The last place belongs to the cell on its left, or else it would read a node that there is none of.
  const auto i = static_cast<std::size_t>(std::min<double>(std::floor(cells), kNodes - 2));
  const double b = cells - static_cast<double>(i), a = 1 - b;
  TRN_CHECK(b >= 0 && b <= 1);
  return a * u[i] + b * u[i + 1] +
         spacing_mm * spacing_mm / 6 * (a * (a * a - 1) * m[i] + b * (b * b - 1) * m[i + 1]);
}

ScrewCorrection::ScrewCorrection(const ScrewCorrectionConfig& config, const SensorBoard& board)
    : config_(config), board_(board) {
  for (const ScrewConfig& screw : config_.screws) {
    Nut nut;
    // The nut's place counts from the fixed bearing, as in S2.5, whichever way the joint's own scale runs.
    nut.direction = screw.far_bearing_mm > screw.fixed_bearing_mm ? 1 : -1;
    nut.length_mm = std::abs(screw.far_bearing_mm - screw.fixed_bearing_mm);
    nut.spacing_mm = nut.length_mm / (kNodes - 1);
    // The only link between tick and worker. 64 updates of the default 0.1 s are six seconds: so long the
    // worker may sleep before a way is lost.
    nut.ways = std::make_unique<Ring<Way>>(64);
    nut.profiles = std::make_unique<Ring<Profile>>(64);
    nuts_.push_back(std::move(nut));
    workers_.push_back({ScrewHeatModel(nuts_.back().length_mm, screw.heat, kNodes),
                        std::vector<double>(kNodes, 0.0), std::vector<double>(kNodes, 0.0)});
    const std::string& name = screw.sensor.name;
    const char* then =
        screw.sensor.hold_on_dropout ? "the last growth is held" : "the heat model goes on alone";
    silent_texts_.push_back(fmt::format("sensor {} is silent: {}", name, then));
    absurd_texts_.push_back(fmt::format("sensor {} reads nonsense: {}", name, then));
  }
}

unsigned ScrewCorrection::joint_mask() const {
  unsigned mask = 0;
  for (const ScrewConfig& screw : config_.screws) mask |= 1u << screw.joint;
  return mask;
}

const char* ScrewCorrection::warning() const TRN_RT { return warning_.load(std::memory_order_relaxed); }

double ScrewCorrection::displacement(const Nut& nut, double x_mm) const TRN_RT {
  const std::array<double, 4> weights = spline_weights(time_s_ / config_.update_s);
  double sum = 0;
  for (std::size_t k = 0; k < weights.size(); ++k)
    sum += weights[k] * nut.profiles_now[k].at(x_mm, nut.spacing_mm);
  return sum;
}

void ScrewCorrection::next_profile(Nut& nut, int channel) TRN_RT {
  // The reading goes along with the way of the nut, as the tick has heard it. The worker must not look at the
  // sensor itself: a replay of the log would find another value there.
  if (channel >= 0) nut.way.sensor = board_.heard(channel);
  nut.ways->try_push(nut.way);
  nut.way = {};
  std::move(nut.profiles_now.begin() + 1, nut.profiles_now.end(), nut.profiles_now.begin());
  // When the worker is late, the last profile stays twice in the row and the growth stands still for an
  // update. Nothing jumps.
  nut.profiles->try_pop(nut.profiles_now.back());
}

void ScrewCorrection::wanted(const CorrectionInput& input, JointVec& offset) TRN_RT {
  time_s_ += config_.period_s;
  const bool due = time_s_ >= config_.update_s;
  if (due) time_s_ -= config_.update_s;
  TRN_CHECK(time_s_ >= 0 && time_s_ < config_.update_s);
  for (std::size_t k = 0; k < nuts_.size(); ++k) {
    const ScrewConfig& screw = config_.screws[k];
    Nut& nut = nuts_[k];
    if (due) next_profile(nut, screw.sensor.channel);
    const double x = nut.direction * (input.q[screw.joint] - screw.fixed_bearing_mm);
    if (nut.seen) {
      // The heat of the nut's friction comes where the nut runs. Which half of the cell it is in makes no
      // difference at the pace of heat.
      const double node = std::clamp(std::round(x / nut.spacing_mm), 0.0, static_cast<double>(kNodes - 1));
      nut.way.mm[static_cast<std::size_t>(node)] += std::abs(x - nut.last_mm);
    }
    nut.seen = true;
    nut.last_mm = x;
    // The encoder must read x - u(x_encoder) for the nut to stand at x.
    offset[screw.joint] = -nut.direction * displacement(nut, x - displacement(nut, x));
  }
}

void ScrewCorrection::work() {
  Way way;
  for (std::size_t k = 0; k < nuts_.size(); ++k)
    while (nuts_[k].ways->try_pop(way)) advance(k, way);
}

void ScrewCorrection::advance(std::size_t screw, const Way& way) {
  const ScrewConfig& config = config_.screws[screw];
  Worker& worker = workers_[screw];
  // The heat model first: the sensor then judges it as of the same moment.
  worker.model.step(config_.update_s, way.mm);
  use_temperatures(screw, way.sensor);
  const std::vector<double> u = screw_displacement(config.mounting, config.alpha_per_K, config.stretch_mm,
                                                   worker.model.places_mm(), worker.used_K);
  Profile profile;
  const double most = config_.rate_mm_s * config_.update_s;
  // A screw grows by um in minutes. Whatever the sensor or the model asks for at once, as when a sensor comes
  // back after an hour, is spread over so long that no cut shows it.
  for (std::size_t i = 0; i < kNodes; ++i)
    profile.u[i] = worker.u_mm[i] += std::clamp(u[i] - worker.u_mm[i], -most, most);
  profile.m = second_derivatives(profile.u, nuts_[screw].spacing_mm);
  nuts_[screw].profiles->try_push(profile);
}

void ScrewCorrection::use_temperatures(std::size_t screw, const SensorBoard::Heard& sensor) {
  const ScrewConfig& config = config_.screws[screw];
  Worker& worker = workers_[screw];
  const std::vector<double>& model = worker.model.rise_K();
  double rise = 0;
  const bool first = !worker.heard;
  const bool heard = config.sensor.channel >= 0 && read_sensor(screw, sensor, rise);
  // The temperatures of the last update stay as they are in `used_K`.
  if (config.sensor.channel >= 0 && !heard && config.sensor.hold_on_dropout) return;
  // The sensor says how warm, the model where. What no factor of the model explains is the whole screw's: the
  // air has become warmer.
  const double spacing = nuts_[screw].spacing_mm;
  const auto at =
      static_cast<std::size_t>(std::clamp(std::round(config.sensor.at_mm / spacing), 0.0, kNodes - 1.0));
  if (heard) {
    // Example: the model says 4 K at the sensor and the sensor 6 K. The whole profile is taken 1.5 times. If
    // it said 20 K, three times the model is believed, and the other 8 K are counted as a warmer shop.
    const double factor = model[at] > kCold_K ? std::clamp(rise / model[at], kFactorMin, kFactorMax) : 1;
    const double uniform_K = rise - factor * model[at];
    const double share = first ? 1 : std::min(1.0, config_.update_s / kSmooth_s);
    worker.factor += share * (factor - worker.factor);
    worker.uniform_K += share * (uniform_K - worker.uniform_K);
  }
  // The planner keeps a share of the rates free for this slope. Growth beyond it is cut off here, or the
  // joints would leave their limits.
  const double most = config_.slope_max / config.alpha_per_K;
  for (std::size_t i = 0; i < kNodes; ++i)
    worker.used_K[i] = std::clamp(worker.factor * model[i] + worker.uniform_K, -most, most);
}

bool ScrewCorrection::read_sensor(std::size_t screw, const SensorBoard::Heard& heard, double& rise_K) {
  const ScrewSensor& sensor = config_.screws[screw].sensor;
  Worker& worker = workers_[screw];
  const auto [count, value] = heard;
  // A sensor that was silent for a while may have moved further in the meantime, so the change is judged over
  // all that time.
  const double since_s = std::max(kJudge_s, worker.silent_s + config_.update_s);
  worker.silent_s = count == worker.count ? worker.silent_s + config_.update_s : 0;
  worker.count = count;
  const bool silent = worker.silent_s >= sensor.timeout_s;
  if (silent || count == 0) {
    worker.heard = false;
    if (silent) warning_ = silent_texts_[screw].c_str();
    return false;
  }
  const bool in_range = value >= sensor.min_C && value <= sensor.max_C;
  const bool jumps = worker.heard && std::abs(value - worker.last_C) > sensor.rate_max_K_s * since_s;
  // Such a reading may be a broken wire (a thermocouple that reads 200 degrees) or a true change that was
  // missed. One reading does not tell which.
  if (!in_range || jumps) {
    // A new level that stays is believed after the time-out.
    worker.absurd_s += config_.update_s;
    if (worker.absurd_s >= sensor.timeout_s) worker.heard = false;
    warning_ = absurd_texts_[screw].c_str();
    return false;
  }
  if (warning_ == silent_texts_[screw].c_str() || warning_ == absurd_texts_[screw].c_str()) warning_ = "";
  worker.heard = true;
  worker.absurd_s = 0;
  worker.last_C = value;
  rise_K = value - sensor.reference_C;
  return true;
}

}  // namespace trn
