#include "core/serial_branches.h"

#include <gtest/gtest.h>

#include "core/solve3.h"

namespace trn {
namespace {

const Joints& joints() {
  static const Joints all{{"X", JointKind::kLinear, {}}, {"C", JointKind::kRotary, {}}};
  return all;
}

SerialBranches read(const std::string& text) { return read_branches(parse_config(text, "m.toml"), joints()); }

std::string error_of(const std::string& text) {
  try {
    read(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(SerialBranches, AreReadFromTheBaseOutwards) {
  const SerialBranches branches = read(
      "[[tool_branch]]\noffset_mm = [1, 2, 3]\njoint = 'X'\ndirection = [2, 0, 0]\n"
      "[[work_branch]]\njoint = 'C'\ndirection = [0, 3, 4]\n[[work_branch]]\noffset_mm = [0, 0, 75]\n");
  ASSERT_EQ(branches.tool.size(), 1u);
  EXPECT_EQ(branches.tool[0].joint, 0);
  EXPECT_EQ(branches.tool[0].kind, JointKind::kLinear);
  EXPECT_EQ(branches.tool[0].direction, Vec3(1, 0, 0));
  EXPECT_EQ(branches.tool[0].offset_mm, Vec3(1, 2, 3));
  ASSERT_EQ(branches.work.size(), 2u);
  EXPECT_EQ(branches.work[0].kind, JointKind::kRotary);
  EXPECT_NEAR((branches.work[0].direction - Vec3(0, 0.6, 0.8)).norm(), 0, 1e-15);
  EXPECT_EQ(branches.work[1].joint, -1);
  EXPECT_EQ(branches.work[1].offset_mm, Vec3(0, 0, 75));
}

TEST(SerialBranches, ATiltTurnsWhatIsBehindIt) {
  const SerialBranches branches = read(
      "[[tool_branch]]\noffset_mm = [0, 0, -10]\ndirection = [1, 0, 0]\ntilt_deg = 90\n"
      "[[tool_branch]]\noffset_mm = [1, 2, 3]\ndirection = [0, 0, 1]\njoint = 'X'\n"
      "[[tool_branch]]\ndirection = [0, 0, 2]\ntilt_deg = 90\n[[tool_branch]]\noffset_mm = [5, 0, 0]\n");
  ASSERT_EQ(branches.tool.size(), 4u);
  EXPECT_EQ(branches.tool[0].joint, -1);
  EXPECT_EQ(branches.tool[0].offset_mm, Vec3(0, 0, -10));
  // Y goes to Z and Z to -Y. Behind the second tilt X goes to Y, which has gone to Z.
  EXPECT_LT((branches.tool[1].offset_mm - Vec3(1, -3, 2)).norm(), 1e-14);
  EXPECT_LT((branches.tool[1].direction - Vec3(0, -1, 0)).norm(), 1e-15);
  EXPECT_LT((branches.tool[3].offset_mm - Vec3(0, 0, 5)).norm(), 1e-14);
  EXPECT_LT((branches.R_MS.col(0) - Vec3(0, 0, 1)).norm(), 1e-15);
  EXPECT_LT((branches.R_MS.col(2) - Vec3(0, -1, 0)).norm(), 1e-15);
}

TEST(SerialBranches, RefuseWhatIsNoBranch) {
  EXPECT_NE(error_of("[[tool_branch]]\njoint = 'X'\ndirection = [1, 0, 0]\ntilt_deg = 5\n").find("m.toml:4:"),
            std::string::npos);
  EXPECT_NE(error_of("[[tool_branch]]\ntilt_deg = 5\n").find("direction"), std::string::npos);
  EXPECT_NE(error_of("[[tool_branch]]\ndirection = [1, 0, 0]\ntilt_deg = 181\n").find("180"),
            std::string::npos);
  EXPECT_NE(error_of("[[work_branch]]\ndirection = [1, 0, 0]\ntilt_deg = 5\n").find("G68.2"),
            std::string::npos);
  EXPECT_NE(error_of("[[tool_branch]]\njoint = 'Y'\ndirection = [1, 0, 0]\n").find("m.toml:2:"),
            std::string::npos);
  EXPECT_NE(
      error_of("[[tool_branch]]\njoint = 'X'\ndirection = [0, 1e200, 0]\n").find("too large to be meant"),
      std::string::npos);
  EXPECT_NE(error_of("[[tool_branch]]\njoint = 'X'\ndirection = [0, 0, 0]\n").find("must not be zero"),
            std::string::npos);
  EXPECT_NE(error_of("[[tool_branch]]\njoint = 'X'\ndirection = [1, 0, 0]\n[[work_branch]]\njoint = 'X'\n"
                     "direction = [0, 1, 0]\n")
                .find("already in a branch"),
            std::string::npos);
  EXPECT_NE(error_of("[[work_branch]]\ndirection = [0, 1, 0]\n").find("joint"), std::string::npos);
}

TEST(Solve3, SolvesAndTellsTheVolume) {
  Mat3 columns;
  columns << 2, 0, 1, 0, 3, 0, 1, 0, -1;
  Vec3 x;
  EXPECT_DOUBLE_EQ(solve3(columns, columns * Vec3(1, -2, 0.5), x), columns.determinant());
  EXPECT_NEAR((x - Vec3(1, -2, 0.5)).norm(), 0, 1e-14);
  columns.col(2) = columns.col(0) + columns.col(1);
  EXPECT_NEAR(solve3(columns, Vec3(1, 1, 1), x), 0, 1e-12);
}

}  // namespace
}  // namespace trn
