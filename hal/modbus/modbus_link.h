#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

struct _modbus;

namespace trn {

/// A serial line's frames (Modbus over serial line 1.02, 2.5.1): bits of a character, with start, parity and
/// stop, and the silence between frames.
inline constexpr double kRtuBitsPerCharacter = 11, kRtuSilence_characters = 3.5;

/// Where Modbus devices are: a serial line (RTU) or a host (TCP).
struct ModbusAddress {
  std::string host;    ///< TCP; empty: RTU
  int port = 502;      ///< TCP
  std::string device;  ///< RTU: "/dev/ttyUSB0"
  int baud = 19200;
  char parity = 'E';
  int stop_bits = 1;

  std::string text() const;  ///< "tcp 10.0.0.5:502", "rtu /dev/ttyUSB0 19200 8E1"
};
/// "tcp:HOST[:PORT]" or "rtu:DEVICE[:BAUD[:PARITY]]"; std::runtime_error that says what is legal.
ModbusAddress parse_modbus_address(const std::string& text);

/// The four tables of a Modbus device.
enum class ModbusTable : std::uint8_t { kCoil, kDiscrete, kInput, kHolding };
std::string_view to_string(ModbusTable table);

/// A request that failed; what() says to whom, what for and why.
class ModbusLink {
 public:
  ModbusLink(const ModbusAddress& address, double timeout_s);
  ~ModbusLink();
  ModbusLink(const ModbusLink&) = delete;
  ModbusLink& operator=(const ModbusLink&) = delete;

  /// Connects when it is not. "" or what is wrong; the next request tries anew.
  std::string read(int unit, ModbusTable table, int first, int count, std::vector<std::uint16_t>& values);
  std::string write(int unit, ModbusTable table, int first, const std::vector<std::uint16_t>& values);

 private:
  std::string open();
  std::string begin_request(int unit);
  std::string failure(int unit, const std::string& what);

  ModbusAddress address_;
  struct Close {
    void operator()(_modbus* context) const;
  };
  std::unique_ptr<_modbus, Close> context_;
  bool connected_ = false;
};

}  // namespace trn
