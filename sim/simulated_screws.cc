#include "sim/simulated_screws.h"

#include <algorithm>
#include <cmath>

#include "core/config.h"

namespace trn {

namespace {

constexpr double kUpdate_s = 1;

}  // namespace

SimulatedScrews::SimulatedScrews(const std::vector<SimulatedScrewConfig>& screws, double period_s,
                                 SensorBoard& board)
    : period_s_(period_s), board_(board) {
  for (const SimulatedScrewConfig& config : screws) {
    const double length = std::abs(config.screw.far_bearing_mm - config.screw.fixed_bearing_mm);
    Screw screw{config, ScrewHeatModel(length, config.screw.heat, kNodes), {}, {}};
    screw.way_mm.assign(kNodes, 0.0);
    screw.u_mm.assign(kNodes, 0.0);
    screws_.push_back(std::move(screw));
    reports_.push_back({config.screw.joint, 0, {}});
  }
}

double SimulatedScrews::place(const Screw& screw, double joint_mm) const {
  return std::abs(joint_mm - screw.config.screw.fixed_bearing_mm);
}

double SimulatedScrews::displacement(const Screw& screw, double x_mm) const {
  const double spacing = screw.model.places_mm()[1];
  const double cells = std::clamp(x_mm / spacing, 0.0, kNodes - 1.0);
  const auto i = static_cast<std::size_t>(std::min(std::floor(cells), kNodes - 2.0));
  const double w = cells - static_cast<double>(i);
  return (1 - w) * screw.u_mm[i] + w * screw.u_mm[i + 1];
}

void SimulatedScrews::step(const JointVec& q_plan, const JointVec& q_setpoint) {
  for (std::size_t k = 0; k < screws_.size(); ++k) {
    Screw& screw = screws_[k];
    // The plan is where the axis shall be, the setpoint what the correction has made of it. The nut stands at
    // the setpoint and what the screw has grown there.
    const double plan = place(screw, q_plan[screw.config.screw.joint]);
    const double x = place(screw, q_setpoint[screw.config.screw.joint]);
    const double node = std::clamp(std::round(x / screw.model.places_mm()[1]), 0.0, kNodes - 1.0);
    if (screw.seen) screw.way_mm[static_cast<std::size_t>(node)] += std::abs(x - screw.last_mm);
    screw.seen = true;
    screw.last_mm = x;
    Error& worst = reports_[k].worst;
    // What would be wrong without any correction, and what is left with it.
    worst.without = std::max(worst.without, std::abs(displacement(screw, plan)));
    worst.left = std::max(worst.left, std::abs(x + displacement(screw, x) - plan));
  }
  time_s_ += period_s_;
  if (time_s_ < next_s_) return;
  next_s_ += kUpdate_s;
  for (std::size_t k = 0; k < screws_.size(); ++k) {
    warm(screws_[k]);
    const std::vector<double>& rise = screws_[k].model.rise_K();
    reports_[k].rise_K = std::max(reports_[k].rise_K, *std::max_element(rise.begin(), rise.end()));
  }
}

void SimulatedScrews::warm(Screw& screw) {
  const ScrewConfig& config = screw.config.screw;
  // The heat model is the one that the correction has as well, with the numbers of this screw: what a
  // rehearsal shows is how the correction follows, not how good the model is.
  screw.model.step(kUpdate_s, screw.way_mm);
  std::fill(screw.way_mm.begin(), screw.way_mm.end(), 0.0);
  screw.u_mm = screw_displacement(config.mounting, config.alpha_per_K, config.stretch_mm,
                                  screw.model.places_mm(), screw.model.rise_K());
  const bool silent = time_s_ >= screw.config.silent_from_s && time_s_ < screw.config.silent_to_s;
  if (config.sensor.channel < 0 || silent) return;
  const double node = std::round(config.sensor.at_mm / screw.model.places_mm()[1]);
  const auto at = static_cast<std::size_t>(std::clamp(node, 0.0, kNodes - 1.0));
  double celsius = config.sensor.reference_C + screw.model.rise_K()[at];
  // A real sensor has steps, on which the correction must not ride.
  if (const double r = screw.config.resolution_K; r > 0) celsius = r * std::round(celsius / r);
  board_.publish(config.sensor.channel, celsius);
}

std::vector<SimulatedScrewConfig> read_simulated_screws(const Machine& machine, SensorBoard& board) {
  std::vector<SimulatedScrewConfig> out;
  for (const ConfigTable& table : machine.root.table("drives").tables_if("screw")) {
    SimulatedScrewConfig config;
    config.screw = read_screw(machine, table);
    for (const SimulatedScrewConfig& other : out)
      if (other.screw.joint == config.screw.joint)
        throw table.error("joint", "this joint has its screw already");
    const double length = std::abs(config.screw.far_bearing_mm - config.screw.fixed_bearing_mm);
    ScrewSensor& sensor = config.screw.sensor;
    if (table.has("sensor")) {
      sensor.name = table.text("sensor");
      sensor.channel = board.channel(sensor.name);
      if (sensor.channel < 0) throw table.error("sensor", "too many sensors: a machine has up to 16");
    }
    sensor.at_mm = table.number("sensor_at_mm", length / 2, Range{0, length});
    sensor.reference_C = table.number("air_C", sensor.reference_C, Range{-20, 60});
    config.resolution_K = table.number("resolution_K", 0, kNotNegative);
    config.silent_from_s = table.number("silent_from_s", 0, kNotNegative);
    config.silent_to_s = table.number("silent_to_s", 0, kNotNegative);
    out.push_back(std::move(config));
  }
  return out;
}

}  // namespace trn
