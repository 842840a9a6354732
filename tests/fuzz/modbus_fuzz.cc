#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hal/modbus/modbus_link.h"
#include "sim/modbus/emulated_device.h"
#include "sim/modbus/modbus_framing.h"
#include "tests/fuzz/require.h"

// Fuzz target: any bytes as what a Modbus server answers (first byte even), over a pair of terminals, or as
// what a client asks of the emulated devices. A reading is what stands in a sound answer, or there is an
// error in words; every request has an answer of a legal length.
namespace {

using namespace trn;
using fuzz::require;
using Bytes = std::vector<std::uint8_t>;

/// A serial line that ModbusLink opens by its name, and a device at its other end.
class Line {
 public:
  Line() : far_(posix_openpt(O_RDWR | O_NOCTTY)) {
    require(far_ >= 0 && grantpt(far_) == 0 && unlockpt(far_) == 0, "a pair of terminals");
    std::array<char, 64> text{};
    require(ptsname_r(far_, text.data(), text.size()) == 0, "a terminal's name");
    name = text.data();
    near_ = open(name.c_str(), O_RDWR | O_NOCTTY);  // it stays a line of raw bytes while this is open
    termios raw{};
    require(near_ >= 0 && tcgetattr(near_, &raw) == 0, "a terminal");
    cfmakeraw(&raw);
    require(tcsetattr(near_, TCSANOW, &raw) == 0, "a terminal of raw bytes");
    std::thread([this] { serve(); }).detach();
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  /// What the device says to the next request.
  void prepare(const Bytes& answer) {
    const std::lock_guard lock(mutex_);
    answer_ = answer;
  }
  void clear() {
    prepare({});
    tcflush(near_, TCIFLUSH);
  }

  std::string name;

 private:
  void serve() {
    std::array<std::uint8_t, 512> request;
    while (read(far_, request.data(), request.size()) > 0) {
      const std::lock_guard lock(mutex_);
      require(write(far_, answer_.data(), answer_.size()) >= 0, "room on the line");
    }
  }

  int far_, near_ = -1;
  std::mutex mutex_;
  Bytes answer_;
};

constexpr int kUnit = 17;
constexpr double kTimeout_s = 0.002;

/// An answer to function `function`: its head as it should be where the input says so, and then with a
/// checksum.
Bytes answer_of(fuzz::Bytes& in, std::uint8_t function, int count) {
  const std::uint8_t how = in.byte();
  const auto data = in.some(how & 1 ? 200 : in.byte() % 200);
  Bytes answer(data.begin(), data.end());
  if (how & 2) {
    const int bytes = function <= 2 ? (count + 7) / 8 : 2 * count;
    answer.resize(static_cast<std::size_t>(bytes), 0);
    answer.insert(answer.begin(), {kUnit, function, static_cast<std::uint8_t>(bytes)});
  }
  if (!(how & 4)) return answer;
  const std::uint16_t crc = modbus_crc(answer);
  answer.push_back(static_cast<std::uint8_t>(crc));
  answer.push_back(static_cast<std::uint8_t>(crc >> 8));
  return answer;
}

// From the words of the protocol: bits from the lowest on, words with the high byte in front.
std::uint16_t value_in(const Bytes& answer, std::uint8_t function, std::size_t i) {
  if (function <= 2) return answer[3 + i / 8] >> i % 8 & 1;
  return static_cast<std::uint16_t>(answer[3 + 2 * i] << 8 | answer[4 + 2 * i]);
}

void judge(const Bytes& answer, std::uint8_t function, int count, const std::vector<std::uint16_t>& values) {
  require(values.size() == static_cast<std::size_t>(count), "as many values as were asked for");
  const bool ours = answer.size() >= 5 && (answer[0] == kUnit || answer[0] == 0);  // libmodbus: 0 is anybody
  require(ours && answer[1] == function, "an answer of this unit");
  for (std::size_t i = 0; i < values.size(); ++i)
    require(values[i] == value_in(answer, function, i), "the value that was answered");
}

void ask(fuzz::Bytes& in) {
  static auto* line = new Line;  // its thread lasts as long as the process
  line->clear();
  ModbusLink link(parse_modbus_address("rtu:" + line->name + ":115200:N"), kTimeout_s);
  constexpr int kRequests = 3;
  for (int i = 0; i < kRequests && !in.empty(); ++i) {
    constexpr std::uint8_t kFunctions[] = {1, 2, 4, 3};  // as ModbusTable
    const std::uint8_t what = in.byte();
    const auto table = static_cast<ModbusTable>(what & 3);
    const std::uint8_t function = kFunctions[what & 3];
    const int count = 1 + (what >> 3);
    const Bytes answer = answer_of(in, function, count);
    line->prepare(answer);
    std::vector<std::uint16_t> values;
    const bool reads = (what & 4) == 0;
    const std::string trouble =
        reads ? link.read(kUnit, table, 100, count, values) : link.write(kUnit, table, 100, {0x1234});
    if (reads && trouble.empty()) judge(answer, function, count, values);
    require(trouble.empty() || trouble.find("unit 17: ") != std::string::npos,
            "an error says whose: " + trouble);
  }
}

EmulatedDevice device_of_all_tables() {
  EmulatedDevice device;
  for (const ModbusTable table :
       {ModbusTable::kCoil, ModbusTable::kDiscrete, ModbusTable::kInput, ModbusTable::kHolding})
    for (int address = 0; address < 40; ++address)
      device.set(table, address, static_cast<std::uint16_t>(address));
  return device;
}

void serve(fuzz::Bytes& in, bool tcp) {
  constexpr std::size_t kPduMax = 253;
  static const EmulatedDevice kDevice = device_of_all_tables();
  EmulatedDevice device = kDevice;
  Bytes came;
  while (!in.empty()) {
    const auto more = in.some(in.byte());
    came.insert(came.end(), more.begin(), more.end());
    while (const auto request = tcp ? take_tcp_request(came) : take_rtu_request(came)) {
      require(request->pdu.size() <= kPduMax + 7, "a request of a legal length");
      const Bytes pdu = device.answer(request->pdu);
      require(pdu.size() >= 2 && pdu.size() <= kPduMax, "an answer of a legal length");
      require((pdu[0] & 0x7F) == (request->pdu[0] & 0x7F), "the function that was asked");
      const Bytes framed = tcp ? tcp_answer(*request, pdu) : rtu_answer(*request, pdu);
      require(tcp || modbus_crc(framed) == 0, "a checksum");
    }
    require(came.size() < 600, "no more kept than a request has");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes in(data, size);
  const std::uint8_t what = in.byte();
  if (what % 2 == 0)
    ask(in);
  else
    serve(in, what % 4 == 1);
  return 0;
}
