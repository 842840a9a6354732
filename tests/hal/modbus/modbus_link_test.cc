#include "hal/modbus/modbus_link.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace trn {
namespace {

// A character on a serial line has 11 bits: without parity two stop bits (serial line 1.02, 2.5.1).
TEST(ModbusAddress, IsReadAndTold) {
  const std::pair<std::string, std::string> rows[] = {
      {"tcp:10.0.0.5", "tcp 10.0.0.5:502"},
      {"tcp:cabinet:15020", "tcp cabinet:15020"},
      {"tcp:cabinet:65535", "tcp cabinet:65535"},
      {"rtu:/dev/ttyUSB0", "rtu /dev/ttyUSB0 19200 8E1"},
      {"rtu:/dev/ttyUSB0:9600", "rtu /dev/ttyUSB0 9600 8E1"},
      {"rtu:/dev/ttyUSB0:115200:N", "rtu /dev/ttyUSB0 115200 8N2"},
      {"rtu:/dev/ttyUSB0:115200:O", "rtu /dev/ttyUSB0 115200 8O1"}};
  for (const auto& [text, told] : rows) EXPECT_EQ(parse_modbus_address(text).text(), told) << text;
}

TEST(ModbusAddress, AnythingElseIsRefused) {
  for (const char* text :
       {"", "tcp", "tcp:", "tcp::502", "tcp:a:0", "tcp:a:65536", "tcp:a:5x", "tcp:a:502:1", "rtu",
        "rtu:", "rtu:/dev/x:0", "rtu:/dev/x:-1", "rtu:/dev/x:fast", "rtu:/dev/x:9600:X",
        "rtu:/dev/x:9600:", "rtu:/dev/x:0:E", "rtu:/dev/x:9600:E:1", "udp:a", "10.0.0.5"})
    EXPECT_THROW(parse_modbus_address(text), std::runtime_error) << text;
}

TEST(ModbusLink, ALineThatIsNotThereIsNamed) {
  ModbusAddress address;
  address.device = testing::TempDir() + "no_such_line";
  ModbusLink link(address, 0.1);
  std::vector<std::uint16_t> values;
  const std::string wanted =
      "rtu " + address.device + " 19200 8E1: cannot be opened: No such file or directory";
  EXPECT_EQ(link.read(1, ModbusTable::kInput, 0, 1, values), wanted);
  EXPECT_EQ(link.write(1, ModbusTable::kHolding, 0, {1}), wanted);
}

/// A pair of terminals; `far` is the device's end.
struct SerialLine {
  SerialLine() : far(posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_TRUE(far >= 0 && grantpt(far) == 0 && unlockpt(far) == 0);
    std::array<char, 64> text{};
    EXPECT_EQ(ptsname_r(far, text.data(), text.size()), 0);
    name = text.data();
    near = open(name.c_str(), O_RDWR | O_NOCTTY);
    termios raw{};
    tcgetattr(near, &raw);
    cfmakeraw(&raw);
    tcsetattr(near, TCSANOW, &raw);
  }
  ~SerialLine() {
    close(near);
    close(far);
  }
  int far, near = -1;
  std::string name;  ///< of the other end
};

// Unit 17, function 3, two bytes, their value, checksum (Modbus over serial line 1.02, 6.2)
TEST(ModbusLink, BytesBehindAnAnswerAreNotTheNextOne) {
  SerialLine line;
  ModbusLink link(parse_modbus_address("rtu:" + line.name + ":115200:N"), 0.2);
  std::thread device([&line] {
    std::uint8_t request[8];
    EXPECT_EQ(read(line.far, request, sizeof request), 8);
    const std::uint8_t answers[] = {17, 3, 2, 0, 1, 0xB8, 0x47, 17, 3, 2, 0, 2, 0xF8, 0x46};
    EXPECT_EQ(write(line.far, answers, sizeof answers), static_cast<ssize_t>(sizeof answers));
  });
  std::vector<std::uint16_t> values;
  EXPECT_EQ(link.read(17, ModbusTable::kHolding, 0, 1, values), "");
  EXPECT_EQ(values, std::vector<std::uint16_t>{1});
  device.join();
  EXPECT_NE(link.read(17, ModbusTable::kHolding, 5, 1, values), "") << "the device is silent";
}

}  // namespace
}  // namespace trn
