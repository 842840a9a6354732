#include "hal/modbus/modbus_link.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "sim/modbus/emulated_line.h"

// Requests on a line whose only device is unit 3, on a pseudo-terminal.
namespace trn {
namespace {

struct Bench {
  Bench() : line(address(), {3}), link(address(), 2) {}
  static ModbusAddress address() {
    return parse_modbus_address("rtu:" + testing::TempDir() + "link:115200:N");
  }
  EmulatedLine line;
  ModbusLink link;
  std::vector<std::uint16_t> values;
};

TEST(ModbusLink, ReadsAndWritesEveryTable) {
  Bench bench;
  for (const ModbusTable table : {ModbusTable::kInput, ModbusTable::kHolding}) {
    bench.line.set_block(3, table, 40, {11, 65535, 13});
    EXPECT_EQ(bench.link.read(3, table, 40, 3, bench.values), "");
    EXPECT_EQ(bench.values, (std::vector<std::uint16_t>{11, 65535, 13}));
  }
  for (const ModbusTable table : {ModbusTable::kCoil, ModbusTable::kDiscrete}) {
    bench.line.set_block(3, table, 8, {1, 0, 1});
    EXPECT_EQ(bench.link.read(3, table, 8, 3, bench.values), "");
    EXPECT_EQ(bench.values, (std::vector<std::uint16_t>{1, 0, 1}));
  }
  EXPECT_EQ(bench.link.write(3, ModbusTable::kHolding, 40, {7}), "");
  EXPECT_EQ(bench.link.write(3, ModbusTable::kHolding, 41, {8, 9}), "");
  EXPECT_EQ(bench.line.block(3, ModbusTable::kHolding, 40, 3), (std::vector<std::uint16_t>{7, 8, 9}));
  EXPECT_EQ(bench.link.write(3, ModbusTable::kCoil, 9, {5}), "");
  EXPECT_EQ(bench.line.get(3, ModbusTable::kCoil, 9), 1);
}

// After a refusal (exception 2: illegal data address) the line is as good as before.
TEST(ModbusLink, ARefusalSaysWhoWhatAndWhy) {
  Bench bench;
  bench.line.set(3, ModbusTable::kInput, 7, 5);
  const std::string who = Bench::address().text() + " unit 3: ", why = ": Illegal data address";
  EXPECT_EQ(bench.link.read(3, ModbusTable::kInput, 7, 2, bench.values), who + "reading input 7 to 8" + why);
  EXPECT_EQ(bench.link.write(3, ModbusTable::kHolding, 12, {1}), who + "writing holding 12" + why);
  EXPECT_EQ(bench.link.write(3, ModbusTable::kInput, 7, {1}),
            who + "only a coil or holding registers can be written");
  EXPECT_EQ(bench.link.read(3, ModbusTable::kInput, 7, 1, bench.values), "");
  EXPECT_EQ(bench.values, std::vector<std::uint16_t>{5});
}

/// Answers one request on TCP: register 7 is 0x1234, told in two parts with a pause between.
class HaltingDevice {
 public:
  HaltingDevice() : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || listen(listener_, 1) != 0 ||
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no port");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
  }
  ~HaltingDevice() {
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    close(listener_);
  }
  HaltingDevice(const HaltingDevice&) = delete;
  HaltingDevice& operator=(const HaltingDevice&) = delete;
  int port() const { return port_; }

 private:
  void serve() const {
    const int client = accept(listener_, nullptr, nullptr);
    std::uint8_t request[12];
    if (recv(client, request, sizeof request, MSG_WAITALL) == sizeof request) {
      const std::uint8_t answer[] = {request[0], request[1], 0, 0, 0, 5, request[6], 4, 2, 0x12, 0x34};
      const int no_delay = 1;
      setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &no_delay, sizeof no_delay);
      send(client, answer, 9, MSG_NOSIGNAL);
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      send(client, answer + 9, 2, MSG_NOSIGNAL);
    }
    close(client);
  }
  int listener_, port_ = 0;
  std::thread thread_;
};

// The time is for the whole answer, however its bytes are spread over it.
TEST(ModbusLink, ADeviceMayHaltWithinItsAnswer) {
  const HaltingDevice device;
  ModbusLink link(parse_modbus_address("tcp:127.0.0.1:" + std::to_string(device.port())), 5);
  std::vector<std::uint16_t> values;
  EXPECT_EQ(link.read(1, ModbusTable::kInput, 7, 1, values), "");
  EXPECT_EQ(values, std::vector<std::uint16_t>{0x1234});
}

}  // namespace
}  // namespace trn
