#include "hal/can/setup_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "hal/can/sdo.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

// CiA 402-2, 12.4.4: the period is 0x60C2:1 (unsigned, 8 bits) times ten to the power of 0x60C2:2 (signed)
// seconds.
TEST(SetupSteps, TheInterpolationPeriodIsExact) {
  const ObjectDictionary eds = load_eds(source_dir() + "/configs/eds/servo.eds", 3);
  for (const double period_s : {0.0001, 0.000125, 0.00025, 0.000255, 0.001, 0.002, 0.004, 0.01, 0.255, 1.0}) {
    DriveSetup setup;
    setup.period_s = period_s;
    std::int64_t value = 0, exponent = 0;
    for (const SetupStep& step : setup_steps(setup, eds, {}, {})) {
      if (step.key == ObjectKey{0x60C2, 1}) value = decode_integer(DataType::kUnsigned8, step.bytes);
      if (step.key == ObjectKey{0x60C2, 2}) exponent = decode_integer(DataType::kInteger8, step.bytes);
    }
    EXPECT_NEAR(static_cast<double>(value) * std::pow(10.0, static_cast<double>(exponent)), period_s, 1e-9);
  }
}

}  // namespace
}  // namespace trn
