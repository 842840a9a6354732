#include "sim/micromill/micro_mill_plant.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/micromill/linear_motor_axis.h"

namespace trn {
namespace {

// Ripple of an axis that stands at x, N: it comes with the first step, before anything moves.
double ripple_N(const LinearMotorAxis::Config& config, double x_mm) {
  LinearMotorAxis axis(config);
  axis.place(x_mm);
  axis.set_enabled(false);
  axis.step(0, 1e-6);
  return axis.disturbance_N();
}

// docs/sources.md S5.1: gain J in mm/s^2 per A, drag alpha, and the masses that Trunnion takes.
TEST(MicroMillPlant, TheNominalOneIsThatOfTheSources) {
  const MicroMillPlant::Config plant = micro_mill_plant(0, 0.001);
  const double gain[] = {2010, 689}, drag[] = {3.89, 10.2}, mass[] = {2, 6};
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(1000 * plant.axes[i].force_N_A / plant.axes[i].mass_kg, gain[i], 1e-9);
    EXPECT_EQ(plant.axes[i].damping_1_s, drag[i]);
    EXPECT_EQ(plant.axes[i].mass_kg, mass[i]);
    EXPECT_EQ(plant.axes[i].mass_nominal_kg, mass[i]);
    EXPECT_EQ(plant.axes[i].force_nominal_N_A, plant.axes[i].force_N_A);
  }
  EXPECT_NEAR(plant.cutter.step_s * plant.steps_per_period, 0.001, 1e-15);
}

// The magnets of X repeat after 32 mm, those of Y after 36: what is learnt of one does not hold for the
// other.
TEST(MicroMillPlant, RippleRepeatsWithTheMagnets) {
  const MicroMillPlant::Config plant = micro_mill_plant(0, 0.001);
  const double pitch_mm[] = {32, 36};
  for (std::size_t i = 0; i < 2; ++i) {
    double most = 0;
    for (double x = -20; x < 20; x += 1.7) {
      const double here = ripple_N(plant.axes[i], x);
      ASSERT_NEAR(ripple_N(plant.axes[i], x + pitch_mm[i]), here, 1e-9) << i;
      most = std::max(most, std::abs(ripple_N(plant.axes[i], x + pitch_mm[i] / 2) - here));
    }
    EXPECT_GT(most, 1) << "and not sooner";
  }
}

// A drive believes the nominal numbers; the plant of a seed differs from them, and is always the same.
TEST(MicroMillPlant, ASeedMakesAnotherPlantThatTheDriveDoesNotKnow) {
  const MicroMillPlant::Config nominal = micro_mill_plant(0, 0.001);
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const MicroMillPlant::Config plant = micro_mill_plant(seed, 0.001), again = micro_mill_plant(seed, 0.001);
    for (std::size_t i = 0; i < 2; ++i) {
      const double share = plant.axes[i].mass_kg / nominal.axes[i].mass_kg;
      EXPECT_NE(share, 1);
      EXPECT_NEAR(share, 1, 0.05);
      EXPECT_EQ(plant.axes[i].mass_nominal_kg, nominal.axes[i].mass_nominal_kg);
      EXPECT_EQ(plant.axes[i].force_nominal_N_A, nominal.axes[i].force_nominal_N_A);
      EXPECT_EQ(again.axes[i].mass_kg, plant.axes[i].mass_kg);
      EXPECT_GT(plant.axes[i].friction.static_up_N, plant.axes[i].friction.coulomb_up_N);
      EXPECT_GT(plant.axes[i].friction.static_down_N, plant.axes[i].friction.coulomb_down_N);
    }
    EXPECT_NE(plant.axes[0].seed, plant.axes[1].seed);
    EXPECT_EQ(another_cutter(plant, seed, 1).stiffness_N_mm, plant.cutter.stiffness_N_mm);
    EXPECT_NE(another_cutter(plant, seed, 1).runout_mm, another_cutter(plant, seed, 2).runout_mm);
  }
}

}  // namespace
}  // namespace trn
