#include "sim/micromill/micro_mill_plant.h"

#include <algorithm>

#include "core/units.h"
#include "sim/micromill/guide_friction.h"
#include "sim/micromill/noise.h"

namespace trn {

using Eigen::Vector2d;

MicroMillPlant::MicroMillPlant(const Config& config)
    : config_(config),
      axes_{LinearMotorAxis(config.axes[0]), LinearMotorAxis(config.axes[1])},
      cutter_(config.cutter),
      air_({PartSurface::Shape::kRound, Vector2d::Zero(), 1}) {}

void MicroMillPlant::clamp(const std::optional<PartSurface::Config>& part) {
  part_.reset();
  if (part) part_.emplace(*part);
}

Vector2d MicroMillPlant::block_force_N(const Vector2d& holder_mm) const TRN_RT {
  Vector2d force = Vector2d::Zero();
  for (int i = 0; i < 2; ++i) {
    const double pressed = holder_mm[i] - config_.block_mm[static_cast<std::size_t>(i)];
    // A block pushes and does not pull: the tool bends like a spring once it touches.
    if (pressed > 0) force[i] = -config_.cutter.stiffness_N_mm[i] * pressed;
  }
  return force;
}

void MicroMillPlant::step(const Eigen::Vector3d& target_mm) TRN_RT {
  // The cutter's teeth and the bristles of friction swing within a fraction of a period, so the stage is
  // computed in small steps and reported by its means.
  const double dt_s = config_.period_s / config_.steps_per_period;
  for (int i = 0; i < 2; ++i) axes_[static_cast<std::size_t>(i)].begin_period(target_mm[i], config_.period_s);
  z_mm_ = target_mm[2];
  // Below the plate there is nothing more to cut.
  const double depth_mm = part_ ? std::min(-z_mm_, config_.plate_mm) : 0.0;
  Vector2d force_sum = Vector2d::Zero(), disturbance_sum = force_sum, deflection_sum = force_sum;
  for (int step = 0; step < config_.steps_per_period; ++step) {
    const Vector2d holder(axes_[0].x_mm(), axes_[1].x_mm());
    Vector2d force = cutter_.step(holder, depth_mm, part_ ? *part_ : air_);
    Vector2d bent = cutter_.deflection_mm();
    if (block_present_) {
      force = block_force_N(holder);
      bent = cutter_.bent_by(force);
    }
    for (int i = 0; i < 2; ++i) {
      axes_[static_cast<std::size_t>(i)].step(force[i], dt_s);
      disturbance_sum[i] += axes_[static_cast<std::size_t>(i)].disturbance_N();
    }
    force_sum += force;
    deflection_sum += bent;
  }
  const double n = config_.steps_per_period;
  tool_force_N_ = force_sum / n;
  disturbance_N_ = disturbance_sum / n;
  deflection_mm_ = deflection_sum / n;
}

namespace {

// docs/sources.md S5.1: J (mm/s^2 per A), alpha (1/s) and mass (kg); force per current is J M.
LinearMotorAxis::Config nominal_axis(double gain, double damping, double mass, double coulomb_N) {
  LinearMotorAxis::Config axis;
  // J is mm/s^2 per A; times the mass it is a force in mN, hence the thousand.
  axis.force_N_A = axis.force_nominal_N_A = gain * mass / 1000;
  axis.mass_kg = axis.mass_nominal_kg = mass;
  axis.damping_1_s = axis.damping_nominal_1_s = damping;
  axis.friction = {coulomb_N, 1.15 * coulomb_N, 1.3 * coulomb_N, 1.45 * coulomb_N, 1.5, 0.01, 300, 0.3};
  return axis;
}

double spread(NoiseSource& noise, double share) { return 1 + share * noise.uniform(-1, 1); }

void vary_axis(LinearMotorAxis::Config& axis, NoiseSource& noise) {
  axis.mass_kg *= spread(noise, 0.05);
  axis.force_N_A *= spread(noise, 0.02);
  axis.damping_1_s *= spread(noise, 0.1);
  GuideFriction::Config& f = axis.friction;
  for (double* level : {&f.coulomb_up_N, &f.coulomb_down_N}) *level *= spread(noise, 0.3);
  f.static_up_N = f.coulomb_up_N * noise.uniform(1.1, 1.5);
  f.static_down_N = f.coulomb_down_N * noise.uniform(1.1, 1.5);
  f.stribeck_mm_s *= spread(noise, 0.4);
  f.viscous_N_s_mm *= spread(noise, 0.5);
  f.bristle_N_mm *= spread(noise, 0.4);
  for (double& amplitude : axis.ripple_N) amplitude *= spread(noise, 0.4);
  for (double& phase : axis.ripple_phase_rad) phase = noise.uniform(0, 2 * kPi);
}

void vary_cutter(MillingCutter::Config& cutter, NoiseSource& noise) {
  cutter.stiffness_N_mm.x() *= spread(noise, 0.15);
  cutter.stiffness_N_mm.y() = cutter.stiffness_N_mm.x() * spread(noise, 0.03);
  cutter.tangential_N_mm2 *= spread(noise, 0.15);
  cutter.radial_N_mm2 *= spread(noise, 0.15);
  cutter.edge_tangential_N_mm *= spread(noise, 0.2);
  cutter.edge_radial_N_mm *= spread(noise, 0.2);
  cutter.relaxation_s *= spread(noise, 0.15);
  cutter.runout_mm *= spread(noise, 0.5);
  cutter.runout_angle_rad = noise.uniform(0, 2 * kPi);
}

}  // namespace

MicroMillPlant::Config micro_mill_plant(std::uint64_t seed, double period_s) {
  MicroMillPlant::Config plant;
  plant.period_s = period_s;
  plant.axes[0] = nominal_axis(2010, 3.89, 2.0, 1.2);
  plant.axes[1] = nominal_axis(689, 10.2, 6.0, 1.8);
  plant.axes[0].magnet_pitch_mm = 32;
  plant.axes[0].ripple_N = {0.9, 0.25, 0.1, 0.05};
  plant.axes[1].magnet_pitch_mm = 36;
  plant.axes[1].ripple_N = {1.2, 0.35, 0.12, 0.06};
  plant.axes[0].ripple_phase_rad = {0.4, 1.9, 3.1, 5.0};
  plant.axes[1].ripple_phase_rad = {2.2, 0.3, 4.4, 1.0};
  plant.cutter.step_s = period_s / plant.steps_per_period;
  // Seed 0 is the stage of the paper. Any other is one like it, as two machines of a series differ; the same
  // seed is always the same stage.
  NoiseSource noise(seed);
  if (seed != 0) {
    for (LinearMotorAxis::Config& axis : plant.axes) vary_axis(axis, noise);
    vary_cutter(plant.cutter, noise);
  }
  for (std::size_t i = 0; i < 2; ++i) plant.axes[i].seed = 1000 * seed + 7 * i + 1;
  return plant;
}

MillingCutter::Config another_cutter(const MicroMillPlant::Config& plant, std::uint64_t seed, int count) {
  MillingCutter::Config cutter = plant.cutter;
  NoiseSource noise(seed * 100 + static_cast<std::uint64_t>(count) + 17);
  cutter.runout_mm *= spread(noise, 0.5);
  cutter.runout_angle_rad = noise.uniform(0, 2 * kPi);
  const double wear = noise.uniform(0.9, 1.2);  // a worn edge rubs more
  cutter.edge_tangential_N_mm *= wear;
  cutter.edge_radial_N_mm *= wear;
  return cutter;
}

}  // namespace trn
