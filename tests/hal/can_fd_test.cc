#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "hal/can/bus_budget.h"
#include "hal/can/eds.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"
#include "tests/support/paths.h"

// CAN FD: lengths, times and PDOs. The bit counter here writes the frame out (ISO 11898-1:2015, 10.4.2); the
// formula under test does not.
namespace trn {
namespace {

struct Bits {
  int slow = 0, fast = 0;
};

/// Bits of an FD frame with 11-bit identifier and bit-rate switch, those before the CRC stuffed as they come.
Bits count_bits(unsigned id, const std::vector<std::uint8_t>& data) {
  Bits out;
  int run = 0, last = -1;
  bool fast = false;
  const auto put = [&](int bit) {
    ++(fast ? out.fast : out.slow);
    run = bit == last ? run + 1 : 1;
    last = bit;
    if (run < 5) return;
    ++(fast ? out.fast : out.slow);
    last = 1 - last;
    run = 1;
  };
  put(0);
  for (int i = 10; i >= 0; --i) put(static_cast<int>(id >> i & 1u));
  for (const int bit : {0, 0, 1, 0, 1}) put(bit);  // RRS, IDE, FDF, res, BRS
  fast = true;
  put(0);  // ESI
  const int size = static_cast<int>(data.size());
  int code = size;
  for (const int legal : {12, 16, 20, 24, 32, 48, 64})
    if (size > 8 && size >= legal) code = 9 + (legal <= 24 ? (legal - 12) / 4 : legal / 16 + 2);
  for (int i = 3; i >= 0; --i) put(code >> i & 1);
  for (const std::uint8_t byte : data)
    for (int i = 7; i >= 0; --i) put(byte >> i & 1);
  for (int i = 0; i < 4 + (size <= 16 ? 17 : 21); ++i)
    out.fast += i % 4 == 0 ? 2 : 1;  // a fixed stuff bit each 4
  out.slow += 1 + 2 + 7 + 3;         // CRC delimiter, acknowledge, end of frame, pause
  return out;
}

TEST(CanFd, LengthsAreTheLegalOnes) {
  const std::pair<int, int> rows[] = {{0, 0},   {7, 7},   {8, 8},   {9, 12},  {12, 12}, {13, 16},
                                      {17, 20}, {21, 24}, {25, 32}, {33, 48}, {49, 64}, {64, 64}};
  for (const auto& [bytes, size] : rows) EXPECT_EQ(fd_size(bytes), size) << bytes;
}

TEST(CanFd, NoFrameIsLongerThanTheWorst) {
  std::mt19937 random(5);
  for (const int size : {0, 1, 7, 8, 12, 16, 20, 24, 32, 48, 64}) {
    double longest = 0;
    const double worst = worst_fd_frame_s(size, 1e6, 5e6);
    for (int i = 0; i < 4000; ++i) {
      const auto pattern = static_cast<std::uint8_t>(random() % 3 == 0 ? 0x00
                                                     : random() % 2    ? 0xFF
                                                                       : random());
      std::vector<std::uint8_t> data(static_cast<std::size_t>(size));
      for (auto& byte : data) byte = random() % 20 ? pattern : static_cast<std::uint8_t>(random());
      const Bits bits = count_bits(random() % 3 ? random() % 0x800 : 0, data);
      const double time_s = bits.slow / 1e6 + bits.fast / 5e6;
      ASSERT_LE(time_s, worst + 1e-12) << size << " bytes";
      longest = std::max(longest, time_s);
    }
    EXPECT_GT(longest, 0.85 * worst) << size << " bytes: the bound is far from what can be";
  }
}

TEST(CanFd, OnePdoTakesWhatClassicFramesNeedThreeFor) {
  const ObjectDictionary eds = load_eds(source_dir() + "/configs/eds/servo.eds", 3);
  const std::vector<ObjectKey> objects = {{0x6041, 0}, {0x6064, 0}, {0x60B9, 0}, {0x6061, 0},
                                          {0x60BA, 0}, {0x60BB, 0}, {0x60FD, 0}};
  EXPECT_EQ(plan_pdos(eds, objects, false, 3).size(), 3u);
  const std::vector<Pdo> pdos = plan_pdos(eds, objects, false, 3, true);
  ASSERT_EQ(pdos.size(), 1u);
  EXPECT_EQ(pdos[0].size(), 2 + 4 + 2 + 1 + 4 + 4 + 4);
  EXPECT_EQ(pdos[0].frame_size(), 24);
}

TEST(CanFd, SixAxesFitOneMillisecond) {
  BusBudget budget{"can0", 1e6, 0.001, {}};
  budget.data_bitrate = 5e6;
  budget.items = {{"SYNC", 1, 0, 0.001}, {"setpoints", 6, 7, 0.001, true}, {"feedback", 6, 7, 0.001, true}};
  EXPECT_TRUE(budget.fits()) << budget.arithmetic();
  budget.data_bitrate = 1e6;
  EXPECT_FALSE(budget.fits()) << budget.arithmetic();
  EXPECT_NE(budget.arithmetic().find("6 x  7 bytes FD"), std::string::npos) << budget.arithmetic();
}

}  // namespace
}  // namespace trn
