#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <thread>

#include "core/fault.h"
#include "hal/modbus/field_devices.h"
#include "hal/modbus/modbus_link.h"
#include "sim/modbus/emulated_line.h"
#include "tests/support/rounds.h"

// The real Modbus side against emulated devices, on loopback TCP and on a pseudo-terminal.
namespace trn {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kPoll = 0.02;

struct Bench {
  explicit Bench(bool serial, double timeout_s = 0.05) {
    ModbusAddress address;
    address.parity = 'N';  // a pseudo-terminal has none
    if (serial)
      address.device = testing::TempDir() + "trunnion_modbus_line";
    else
      address.host = "127.0.0.1";
    address.port = 15020;
    for (int tries = 0; !line && tries < 50; ++tries, ++address.port) {
      try {
        line = std::make_unique<EmulatedLine>(address, std::vector<int>{3});
        config.lines.push_back({"line", address, timeout_s});
      } catch (const std::runtime_error&) {
        if (serial) throw;
      }
    }
    ModbusDeviceConfig device;
    device.name = "box";
    device.unit = 3;
    device.poll_s = kPoll;
    device.stale_s = 5 * kPoll;
    device.retries = 1;
    device.values = {{"box.temperature", ModbusTable::kInput, 7, true, 0.1, -50, 150},
                     {"box.speed", ModbusTable::kHolding, 2, false, 1, 0, 0},
                     {"box.run", ModbusTable::kCoil, 5, false, 1, 0, 0}};
    config.devices = {device};
    line->set(3, ModbusTable::kInput, 7, static_cast<std::uint16_t>(-123));
    line->set(3, ModbusTable::kHolding, 2, 0);
    line->set(3, ModbusTable::kCoil, 5, 0);
  }
  /// Polls until `done`; -1 if it does not come.
  static double polls_until(const std::function<bool()>& done, double limit_s = 5) {
    const auto begin = Clock::now();
    while (std::chrono::duration<double>(Clock::now() - begin).count() < limit_s) {
      if (done()) return std::chrono::duration<double>(Clock::now() - begin).count() / kPoll;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return -1;
  }

  ModbusConfig config;
  std::unique_ptr<EmulatedLine> line;
};

class ModbusLines : public testing::TestWithParam<bool> {};

TEST_P(ModbusLines, ReadsScalesAndWrites) {
  Bench bench(GetParam());
  FieldDevices devices(bench.config);
  ASSERT_GE(Bench::polls_until([&] { return !devices.value("box.temperature")->stale; }), 0);
  EXPECT_NEAR(devices.value("box.temperature")->value, -12.3, 1e-9);
  EXPECT_TRUE(devices.write("box.speed", 18000));
  EXPECT_TRUE(devices.write("box.run", 1));
  EXPECT_FALSE(devices.write("box.sped", 1));
  ASSERT_GE(Bench::polls_until([&] { return devices.settled_ns() > 0; }), 0);
  EXPECT_EQ(bench.line->get(3, ModbusTable::kHolding, 2), 18000);
  EXPECT_EQ(bench.line->get(3, ModbusTable::kCoil, 5), 1);
  std::string detail;
  EXPECT_EQ(devices.fault(detail), Fault::kOk) << detail;
}

struct TroubleRow {
  const char* name;
  EmulatedLine::Trouble trouble;
  Fault fault;
};

TEST_P(ModbusLines, EveryTroubleIsToldInTimeAndHeals) {
  const TroubleRow rows[] = {{"unplugged", {true, false, 0, 0}, Fault::kDeviceLost},
                             {"short", {false, true, 0, 0}, Fault::kDeviceLost},
                             {"slow by 200 ms", {false, false, 200, 0}, Fault::kDeviceLost},
                             {"slow by 10 ms", {false, false, 10, 0}, Fault::kOk},
                             {"lying", {false, false, 0, 9000}, Fault::kDeviceFault}};
  Bench bench(GetParam());
  FieldDevices devices(bench.config);
  std::string detail;
  for (const TroubleRow& row : rows) {
    ASSERT_GE(Bench::polls_until([&] {
                return !devices.value("box.temperature")->stale && devices.fault(detail) == Fault::kOk;
              }),
              0)
        << row.name << ": " << detail;
    bench.line->trouble(3, row.trouble);
    const double wait_s = row.fault == Fault::kOk ? 10 * kPoll : 5;
    const double polls = Bench::polls_until([&] { return devices.fault(detail) != Fault::kOk; }, wait_s);
    const Fault fault = polls < 0 ? Fault::kOk : devices.fault(detail);
    printf("    %-16s %-14s after %5.1f polls: %s\n", row.name, std::string(fault_info(fault).name).c_str(),
           polls, fault == Fault::kOk ? "" : detail.c_str());
    EXPECT_EQ(fault, row.fault) << row.name << ": " << detail;
    bench.line->trouble(3, {});
  }
}

INSTANTIATE_TEST_SUITE_P(Tcp, ModbusLines, testing::Values(false));
INSTANTIATE_TEST_SUITE_P(Serial, ModbusLines, testing::Values(true));

TEST(FieldDevices, WhatADeviceDoesNotTakeIsTriedAgain) {
  Bench bench(false);
  FieldDevices devices(bench.config);
  std::string detail;
  ASSERT_GE(Bench::polls_until([&] { return !devices.value("box.speed")->stale; }), 0);
  bench.line->trouble(3, {true, false, 0, 0});
  devices.write("box.speed", 500);
  ASSERT_GE(Bench::polls_until([&] { return devices.fault(detail) == Fault::kDeviceLost; }), 0);
  EXPECT_EQ(devices.settled_ns(), -1);
  bench.line->trouble(3, {});
  ASSERT_GE(Bench::polls_until([&] { return bench.line->get(3, ModbusTable::kHolding, 2) == 500; }), 0);
  EXPECT_GE(Bench::polls_until([&] { return devices.fault(detail) == Fault::kOk; }), 0) << detail;
}

// 80000 in sixteen bits would be 14464, and -5 would be 65531: a spindle would turn as nobody asked.
TEST(FieldDevices, WhatDoesNotFitItsRegisterIsNotWritten) {
  for (const double wanted : {80000.0, 65536.0, -5.0, 1e300}) {
    Bench bench(false);
    FieldDevices devices(bench.config);
    std::string detail;
    ASSERT_GE(Bench::polls_until([&] { return !devices.value("box.speed")->stale; }), 0);
    EXPECT_FALSE(devices.fits("box.speed", wanted)) << wanted;
    EXPECT_FALSE(devices.write("box.speed", wanted)) << wanted;
    EXPECT_EQ(devices.fault(detail), Fault::kDeviceFault) << "not lost: nobody asked it";
    EXPECT_NE(detail.find("does not fit register 2 (0 to 65535)"), std::string::npos) << detail;
    EXPECT_EQ(devices.settled_ns(), -1);
    EXPECT_TRUE(devices.write("box.run", 1));
    ASSERT_GE(Bench::polls_until([&] { return bench.line->get(3, ModbusTable::kCoil, 5) == 1; }), 0)
        << "others are told as ever";
    EXPECT_EQ(bench.line->get(3, ModbusTable::kHolding, 2), 0) << wanted;
    EXPECT_EQ(devices.fault(detail), Fault::kDeviceFault) << wanted;
    devices.write("box.speed", 65535);
    ASSERT_GE(Bench::polls_until([&] { return bench.line->get(3, ModbusTable::kHolding, 2) == 65535; }), 0);
    EXPECT_GE(Bench::polls_until([&] { return devices.fault(detail) == Fault::kOk; }), 0) << detail;
  }
}

// Until a slow device has acknowledged it, a value is on its way.
TEST(FieldDevices, AWriteIsSettledWhenItIsAcknowledged) {
  Bench bench(false, 2);
  FieldDevices devices(bench.config);
  for (const int speed : {500, 600}) {
    bench.line->trouble(3, {false, false, 100, 0});
    const std::int64_t asked_ns =
        std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
    devices.write("box.speed", speed);
    std::int64_t settled_ns = -1;
    ASSERT_GE(Bench::polls_until([&] { return (settled_ns = devices.settled_ns()) != -1; }), 0);
    EXPECT_GT(settled_ns, asked_ns + 100'000'000) << "the acknowledgement of this one";
    EXPECT_EQ(bench.line->get(3, ModbusTable::kHolding, 2), speed);
  }
}

TEST(FieldDevices, EveryReadingIsToldToTheListener) {
  Bench bench(false);
  std::atomic<int> told = 0;
  std::atomic<double> last = 0;
  FieldDevices devices(bench.config, [&](const std::string& name, double value) {
    if (name == "box.temperature") {
      ++told;
      last = value;
    }
  });
  ASSERT_GE(Bench::polls_until([&] { return told > 3; }), 0);
  EXPECT_NEAR(last, -12.3, 1e-9);
  bench.line->trouble(3, {false, false, 0, 9000});
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_LT(last, 150) << "nonsense is not passed on";
}

// The parser of answers against noise: header by right or wrong, lengths, counts and content at random.
TEST(ModbusLink, RandomAnswersAreRefusedOrWellFormed) {
  const long wanted = test::rounds(3000);
  Bench bench(false, 0.0004);
  bench.line->noise(7);
  ModbusLink link(bench.config.lines[0].address, 0.0004);
  std::vector<std::uint16_t> values;
  long good = 0;
  const auto answered = [&] { return static_cast<long>(bench.line->requests()); };
  for (long i = 0; i < 2 * wanted && answered() < wanted; ++i) {
    const int count = 1 + static_cast<int>(i % 5);
    const std::string trouble =
        link.read(3, i % 2 ? ModbusTable::kInput : ModbusTable::kCoil, 0, count, values);
    good += trouble.empty();
    ASSERT_EQ(values.size(), static_cast<std::size_t>(count));
  }
  EXPECT_GE(answered(), wanted);
  printf("    %ld random answers, %ld of them well formed by chance\n", answered(), good);
}

}  // namespace
}  // namespace trn
