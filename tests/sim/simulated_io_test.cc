#include "sim/simulated_io.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>

#include "core/config.h"
#include "core/machine.h"

// What the section [io] says of simulated wires and scripts.
namespace trn {
namespace {

SimulatedIo::Config read(const std::string& seconds) {
  const std::string text = "[[wire]]\ninput = 1\noutput = 2\ndelay_s = " + seconds +
                           "\n[[script]]\ninput = 3\nvalue = 1\nat_s = " + seconds + "\n";
  const ConfigTable io = parse_config(text, "m.toml");
  return read_simulated_io(Machine{io, "m", 0.001, {}}, io);
}

TEST(SimulatedIoConfig, ATimeIsSoManyPeriods) {
  EXPECT_EQ(read("0.0").wires.at(0).delay_periods, 0u);
  EXPECT_EQ(read("0.0021").wires.at(0).delay_periods, 3u);
  EXPECT_EQ(read("2.0").script.at(0).period, 2000u);
}

TEST(SimulatedIoConfig, ATimeBeyondTheCounterNeverComes) {
  constexpr auto kNever = std::numeric_limits<std::uint32_t>::max();
  EXPECT_EQ(read("1e9").wires.at(0).delay_periods, kNever);
  EXPECT_EQ(read("1e15").script.at(0).period, kNever);
}

}  // namespace
}  // namespace trn
