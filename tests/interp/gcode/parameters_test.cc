#include "interp/gcode/parameters.h"

#include <gtest/gtest.h>

#include <array>

namespace trn {
namespace {

TEST(Parameters, ASubProgramHasThirtyOfItsOwn) {
  Parameters parameters;
  parameters[1] = 11;
  parameters[30] = 12;
  parameters[31] = 13;
  parameters.push_frame(std::array{1.5, 2.5});
  EXPECT_EQ(parameters[1], 1.5);
  EXPECT_EQ(parameters[2], 2.5);
  EXPECT_EQ(parameters[30], 0) << "what no argument gives is zero";
  EXPECT_EQ(parameters[31], 13) << "from #31 on all programs share them";
  parameters[1] = parameters[31] = 99;
  parameters.pop_frame();
  EXPECT_EQ(parameters[1], 11);
  EXPECT_EQ(parameters[30], 12);
  EXPECT_EQ(parameters[31], 99);
}

TEST(Parameters, LocalNamesEndWithTheirCallAndGlobalNamesStay) {
  Parameters parameters;
  const std::int32_t name = parameters.names().intern("depth"), shared = parameters.names().intern("_depth");
  EXPECT_EQ(parameters.names().intern("depth"), name);
  EXPECT_EQ(parameters.names().name(shared), "_depth");
  parameters.set_local(name, 1);
  parameters.push_frame({});
  EXPECT_EQ(parameters.local(name), nullptr);
  parameters.set_local(name, 2);
  parameters.set_global(shared, 3);
  parameters.pop_frame();
  ASSERT_NE(parameters.local(name), nullptr);
  EXPECT_EQ(*parameters.local(name), 1);
  ASSERT_NE(parameters.global(shared), nullptr);
  EXPECT_EQ(*parameters.global(shared), 3);
  parameters.push_frame({});
  EXPECT_EQ(parameters.local(name), nullptr) << "a later call does not see those of an earlier one";
}

TEST(Parameters, TheToolAndThePositionAreReadOnly) {
  for (const int number : {5400, 5413, 5420, 5428}) EXPECT_TRUE(Parameters::is_read_only(number)) << number;
  for (const int number : {1, 5000, 5221, 5399, 5419, 5429})
    EXPECT_FALSE(Parameters::is_read_only(number)) << number;
}

TEST(Parameters, OnlyWhatOutlivesASubProgramCountsAsTouched) {
  Parameters parameters;
  parameters.take_touched();
  parameters[5] = 1;
  EXPECT_FALSE(parameters.take_touched());
  parameters[31] = 1;
  EXPECT_TRUE(parameters.take_touched());
  EXPECT_FALSE(parameters.take_touched());
}

TEST(Parameters, EveryPredefinedNameIsFoundAtItsPlace) {
  const auto names = predefined_names();
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(find_predefined(names[i]), static_cast<int>(i));
  EXPECT_EQ(find_predefined("_no_such"), -1);
}

}  // namespace
}  // namespace trn
