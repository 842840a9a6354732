#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hal/modbus/modbus_link.h"
#include "sim/modbus/emulated_device.h"
#include "sim/modbus/modbus_framing.h"

namespace trn {

/// One Modbus line with its devices, served by a thread: TCP on the address' port, or a pseudo-terminal that
/// gets the address' device as its name (a link, removed at the end).
class EmulatedLine {
 public:
  /// What goes wrong with a device.
  struct Trouble {
    bool silent = false;    ///< unplugged
    bool is_short = false;  ///< answers end in the middle
    int late_ms = 0;        ///< answers come late
    int lie = 0;            ///< added to every register that is read
  };

  /// std::runtime_error if the port or the name cannot be had.
  EmulatedLine(const ModbusAddress& address, const std::vector<int>& units);
  ~EmulatedLine();
  EmulatedLine(const EmulatedLine&) = delete;
  EmulatedLine& operator=(const EmulatedLine&) = delete;

  void set(int unit, ModbusTable table, int address, std::uint16_t value);
  std::uint16_t get(int unit, ModbusTable table, int address) const;
  /// Several registers in a row, as one request has them.
  void set_block(int unit, ModbusTable table, int first, const std::vector<std::uint16_t>& values);
  std::vector<std::uint16_t> block(int unit, ModbusTable table, int first, int count) const;
  void trouble(int unit, const Trouble& trouble);
  /// From now on every answer is made of random bytes, often behind a header that fits the request; what is
  /// asked for is done all the same.
  void noise(std::uint32_t seed);
  void no_noise();
  std::uint64_t requests() const { return requests_; }

 private:
  struct Unit {
    EmulatedDevice device;
    Trouble trouble;
  };
  struct Client {
    int fd = -1;
    std::vector<std::uint8_t> bytes;
  };

  void listen_on(int port);
  void open_terminal(const std::string& name);
  void serve();
  void accept_client();
  bool read_from(Client& client);
  void answer(int fd, const ModbusRequest& request);
  bool make_noise(const ModbusRequest& request, const EmulatedDevice::Pdu& truth,
                  std::vector<std::uint8_t>& bytes);
  EmulatedDevice::Pdu answer_of(const ModbusRequest& request, Trouble& trouble);

  bool tcp_;
  std::string link_;
  int listener_ = -1;
  std::vector<Client> clients_;
  mutable std::mutex mutex_;
  std::map<int, Unit> units_;          ///< guarded by mutex_
  std::optional<std::mt19937> noise_;  ///< guarded by mutex_
  std::atomic<std::uint64_t> requests_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace trn
