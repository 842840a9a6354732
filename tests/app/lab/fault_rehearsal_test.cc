#include "app/lab/fault_rehearsal.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

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

// An encoder that reads other numbers than the joint, and a correction that is still on its way when the
// machine has stopped on the path: neither is a fault of the machine.
TEST(FaultRehearsalOf, AMachineWithEncoderOffsetAndBacklashIsHealthy) {
  std::ifstream in(source_dir() + "/configs/cradle_can.toml");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto edit = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
  };
  edit("eds/servo.eds", source_dir() + "/configs/eds/servo.eds");
  const std::size_t method = text.find("homing_method = 5");  // of X
  text.replace(method, std::string("homing_method = 5").size(),
               "absolute = true\nencoder_offset_mm = 12.345");
  text +=
      "\n[corrections.joint_table]\n[[corrections.joint_table.joint]]\njoint = \"X\"\nbacklash_mm = 0.02\n";
  edit("[drives]\n",
       "[[safety.input]]\nkind = \"emergency_stop\"\nfrom = \"drive.Y.input.16\"\n\n[drives]\n");
  const std::string path = testing::TempDir() + "healthy.toml";
  std::ofstream(path) << text;
  for (const RehearsedFault& row : rehearse_faults(path, {})) {
    // The one that resets is the drive of Z, whose encoder counts from zero then.
    EXPECT_EQ(row.kept_position, row.cause != "node resets") << row.cause;
    EXPECT_TRUE(row.good()) << row.cause << ": creeps " << row.crept;
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, FaultRehearsal,
                         testing::Values("cradle_can.toml", "hexapod_can.toml", "gantry_router.toml"),
                         [](const auto& param) {
                           return std::string(param.param, 0, std::string(param.param).find('_'));
                         });

}  // namespace
}  // namespace trn
