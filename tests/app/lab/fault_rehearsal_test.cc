#include "app/lab/fault_rehearsal.h"

#include <gtest/gtest.h>

#include "tests/support/paths.h"

// The fault table as `trunnion can faults` rehearses it: real tick, real master, emulated drives.
namespace trn {
namespace {

class FaultRehearsal : public testing::TestWithParam<const char*> {
 protected:
  std::string config() const { return source_dir() + "/configs/" + GetParam(); }
};

TEST_P(FaultRehearsal, EveryRowIsAsItShould) {
  const auto rows = rehearse_faults(config(), {});
  EXPECT_EQ(rows.size(), config().find("gantry") == std::string::npos ? 21u : 30u);
  for (const RehearsedFault& row : rows)
    EXPECT_TRUE(row.good()) << row.cause << ": " << fault_info(row.fault).name << ", rest after "
                            << row.to_rest << ", creeps " << row.crept << ", recovers after "
                            << row.to_recover;
}

TEST_P(FaultRehearsal, NothingMovesBehindARefusedStep) {
  const auto steps = rehearse_refusals(config());
  EXPECT_GT(steps.size(), 20u);
  int told = 0;
  for (const RefusedStep& step : steps) {
    EXPECT_FALSE(step.moved) << step.object << ": " << step.message;
    EXPECT_TRUE(step.recovered) << step.object << ": " << step.message;
    told += !step.message.empty();
    if (step.object == "0x6085") {
      EXPECT_NE(step.warning.find("0x6085:0"), std::string::npos) << "it goes on, and says so";
    }
  }
  EXPECT_GT(told, 12);
}

INSTANTIATE_TEST_SUITE_P(Machines, FaultRehearsal,
                         testing::Values("cradle_can.toml", "hexapod_can.toml", "gantry_router.toml"),
                         [](const auto& param) {
                           return std::string(param.param, 0, std::string(param.param).find('_'));
                         });

}  // namespace
}  // namespace trn
