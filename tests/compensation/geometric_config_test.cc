#include <gtest/gtest.h>

#include <string>

#include "compensation/actual_chain.h"
#include "compensation/geometric.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/units.h"
#include "tests/kinematics/machines.h"

namespace trn {
namespace {

GeometricConfig read(const std::string& keys) {
  const ConfigTable root = parse_config("[geometric]\n" + keys, "t");
  return read_geometric(load_machine("cradle").machine, root.table("geometric"));
}

std::string refusal(const std::string& keys) {
  try {
    read(keys);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(GeometricConfig, WithoutKeysItIsTheOneInTheHeader) {
  const GeometricConfig none = read(""), header;
  EXPECT_EQ(none.limit_mm, header.limit_mm);
  EXPECT_DOUBLE_EQ(none.limit_rad, header.limit_rad);
  EXPECT_EQ(none.mode, GeometricMode::kFull);
  EXPECT_EQ(none.chain.model, TiltModel::kLinear);
}

TEST(GeometricConfig, LimitsAreReadInTheirUnits) {
  const GeometricConfig config =
      read("limit_mm = 0.25\nlimit_deg = 3\nmode = \"position\"\nmodel = \"exact\"\n");
  EXPECT_EQ(config.limit_mm, 0.25);
  EXPECT_DOUBLE_EQ(config.limit_rad, 3 * kPi / 180);
  EXPECT_EQ(config.mode, GeometricMode::kPosition);
  EXPECT_EQ(config.chain.model, TiltModel::kExact);
  for (const char* legal : {"limit_mm = 0.001", "limit_mm = 50", "limit_deg = 0.001", "limit_deg = 10"})
    EXPECT_EQ(refusal(legal), "") << legal;
  for (const char* bad : {"limit_mm = 0.0009", "limit_mm = 51", "limit_deg = 0", "limit_deg = 11"})
    EXPECT_NE(refusal(bad), "") << bad;
}

// Errors of location: lengths as they are, tilts in seconds of arc.
TEST(GeometricConfig, ErrorsOfAnAxisAreItsOwn) {
  const GeometricConfig config = read("[[geometric.axis]]\njoint = \"A\"\ney0_mm = 0.03\nec0_arcsec = 7.2\n");
  for (const int joint : {3, 4}) {
    ActualChain chain = config.chain;
    const ActualAxis& axis = *find_axis(chain, joint);
    EXPECT_EQ(axis.location.offset, joint == 3 ? Vec3(0, 0.03, 0) : Vec3::Zero());
    EXPECT_LT((axis.location.tilt - (joint == 3 ? Vec3(0, 0, 0.002 * kPi / 180) : Vec3::Zero())).norm(),
              1e-15);
  }
  EXPECT_NE(refusal("[[geometric.axis]]\njoint = \"A\"\n[[geometric.axis]]\njoint = \"A\"\n")
                .find("this axis has its errors already"),
            std::string::npos);
}

}  // namespace
}  // namespace trn
