#include "compensation/micromill/deflection_correction.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>

#include "compensation/micromill/friction_network.h"
#include "compensation/micromill/load_observer.h"
#include "core/config.h"

namespace trn {

namespace {

MotorModel read_motor(const ConfigTable& axis) {
  return {axis.number("gain_mm_s2_A", kPositive), axis.number("damping_1_s", kPositive),
          axis.number("mass_kg", kPositive)};
}

LoadNoise read_noise(const ConfigTable& axis) {
  return {axis.number("sigma_current_A", kPositive), axis.number("sigma_load_rate_N_s", kPositive),
          axis.number("sigma_position_mm", kPositive)};
}

}  // namespace

DeflectionCorrection::DeflectionCorrection(const Config& config)
    : config_(config), estimator_(config.estimator), share_(1 - std::exp(-config.period_s / config.lag_s)) {}

void DeflectionCorrection::wanted(const CorrectionInput& input, JointVec& offset) TRN_RT {
  offset.setZero(input.q.size());
  // Without power the currents say nothing of the force, and the observer would take friction for a cut. It
  // starts anew when the drives are on again.
  told_ = input.feedback.current_A.size() >= 2 && input.feedback.state == DriveState::kEnabled;
  if (!told_) {
    state_ = DeflectionEstimator::State{};
    out_ = DeflectionEstimator::Output{};
  } else {
    estimator_.step(input.feedback.current_A.head<2>(), input.feedback.q.head<2>(), state_, out_);
  }
  // A correction that is not sure of itself goes back to zero, by the same low pass and the same rate as it
  // came: a step in the path would mark the work more than the bend does.
  const bool usable = told_ && config_.trained && out_.known && !out_.alarm;
  const double step_max = config_.rate_mm_s * config_.period_s;
  for (int i = 0; i < 2; ++i) {
    // The tool bends away from the cut, so the path goes the other way by the same amount.
    const double goal = usable ? -config_.gain * out_.deflection_mm[i] : 0.0;
    smooth_mm_[i] += share_ * (goal - smooth_mm_[i]);
    shift_mm_[i] += std::clamp(smooth_mm_[i] - shift_mm_[i], -step_max, step_max);
    offset[i] = shift_mm_[i];
  }
}

const char* DeflectionCorrection::warning() const TRN_RT {
  if (!told_) return "the drives do not tell their current: the tool's deflection is unknown";
  if (!config_.trained)
    return "friction is not learnt: run 'trunnion micromill train' and name the file in `networks`";
  if (out_.alarm) return "the load filter's model no longer fits the stage; the deflection is not corrected";
  if (!out_.known)
    return "place or speed beyond what the friction networks learnt; the deflection is not corrected";
  return "";
}

CorrectionMargins correction_margins(const DeflectionCorrection::Config& config, int axis, double smoothing_s,
                                     double servo_rad_s, double process) {
  const LoadObserver observer(config.estimator.axes[static_cast<std::size_t>(axis)].observer);
  CorrectionMargins out;
  out.phase_margin_rad = std::numeric_limits<double>::infinity();
  const std::complex<double> w(servo_rad_s), one(1);
  // Up to nearly pi over the period, which is as fast as anything sampled can swing. Steps of 1 % pass over
  // no peak of these smooth functions.
  for (double omega = 0.1; omega < 3 / config.period_s; omega *= 1.01) {  // up to half the tick's rate
    const std::complex<double> s(0, omega);
    // Three equal poles with the zeros that a PID with its speed fed forward has: at low frequencies it
    // follows without any lag.
    const std::complex<double> servo = w * (3.0 * s * s + 3.0 * w * s + w * w) / std::pow(s + w, 3);
    const std::complex<double> filter = 1.0 / ((one + s * config.lag_s) * std::pow(one + s * smoothing_s, 3));
    const std::complex<double> L = process * config.gain * filter * observer.load_response(omega) * servo;
    const double gain = std::abs(L);
    // The deflection feeds the cut: the loop closes with a plus, so 1 is the critical point and not -1, and
    // the phase margin counts from 0.
    if (gain >= 1) out.phase_margin_rad = std::min(out.phase_margin_rad, std::abs(std::arg(L)));
    if (gain <= out.loop_gain_max) continue;
    out.loop_gain_max = gain;
    out.worst_rad_s = omega;
  }
  out.gain_margin = out.loop_gain_max > 0 ? 1 / out.loop_gain_max : std::numeric_limits<double>::infinity();
  return out;
}

DeflectionCorrection::Config read_deflection(const ConfigTable& table, double period_s) {
  DeflectionCorrection::Config config;
  config.period_s = config.estimator.period_s = period_s;
  config.gain = table.number("gain", config.gain, Range{0, 1.2});
  config.lag_s = table.number("lag_s", config.lag_s, kPositive);
  config.rate_mm_s = table.number("rate_mm_s", config.rate_mm_s, kPositive);
  const std::vector<double> stiffness = table.numbers("stiffness_N_mm");
  if (stiffness.size() != 2 || *std::min_element(stiffness.begin(), stiffness.end()) <= 0)
    throw table.error("stiffness_N_mm",
                      "'stiffness_N_mm' must be two numbers above zero: along X and along Y");
  const double alarm = table.number("innovation_alarm", kInnovationAlarm, Range{1, 1e6});
  const auto every = static_cast<int>(table.integer("measure_every", 1, Range{1, 100}));
  const std::string file = table.text("networks", "");
  config.trained = !file.empty();
  const std::filesystem::path beside = std::filesystem::path(table.file()).parent_path() / file;
  const StageNetworks networks = config.trained ? read_networks(beside.string()) : StageNetworks{};
  for (std::size_t i = 0; i < 2; ++i) {
    const ConfigTable axis = table.table(kStageAxes[i]);
    DeflectionEstimator::Axis& out = config.estimator.axes[i];
    out.observer = {read_motor(axis), read_noise(axis), period_s, every};
    out.stiffness_N_mm = stiffness[i];
    out.network = networks.network[i];
    // A stage that was never trained has nothing to compare with. Its alarm never comes; `trained` keeps it
    // from correcting.
    out.innovation_rms_max_mm = std::numeric_limits<double>::infinity();
    if (config.trained) out.innovation_rms_max_mm = alarm * networks.record[i].innovation_rms_mm;
  }
  return config;
}

}  // namespace trn
