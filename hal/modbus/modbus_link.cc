#include "hal/modbus/modbus_link.h"

#include <fmt/format.h>
#include <modbus.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace trn {

namespace {

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ':')
      parts.emplace_back();
    else
      parts.back().push_back(c);
  }
  return parts;
}

bool parse_int(const std::string& text, int& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && value > 0;
}

}  // namespace

std::string ModbusAddress::text() const {
  if (!host.empty()) return fmt::format("tcp {}:{}", host, port);
  return fmt::format("rtu {} {} 8{}{}", device, baud, parity, stop_bits);
}

ModbusAddress parse_modbus_address(const std::string& text) {
  const std::vector<std::string> parts = split(text);
  ModbusAddress out;
  bool good = parts.size() >= 2 && !parts[1].empty();
  if (good && parts[0] == "tcp") {
    out.host = parts[1];
    good = parts.size() == 2 || (parts.size() == 3 && parse_int(parts[2], out.port) && out.port < 65536);
  } else if (good && parts[0] == "rtu") {
    out.device = parts[1];
    if (parts.size() >= 3) good = parse_int(parts[2], out.baud);
    if (parts.size() == 4) {
      out.parity = parts[3].empty() ? ' ' : parts[3][0];
      good = good && (out.parity == 'N' || out.parity == 'E' || out.parity == 'O');
    }
    good = good && parts.size() <= 4;
    out.stop_bits = out.parity == 'N' ? 2 : 1;  // 11 bits a character (Modbus over serial line, 2.5.1)
  } else {
    good = false;
  }
  if (!good)
    throw std::runtime_error(
        fmt::format("'{}' is no Modbus address; legal: tcp:HOST[:PORT], "
                    "rtu:DEVICE[:BAUD[:N|E|O]], as in rtu:/dev/ttyUSB0:19200:E",
                    text));
  return out;
}

std::string_view to_string(ModbusTable table) {
  static constexpr std::string_view kNames[] = {"coil", "discrete", "input", "holding"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(ModbusTable::kHolding) + 1);
  return kNames[static_cast<std::size_t>(table)];
}

void ModbusLink::Close::operator()(_modbus* context) const {
  modbus_close(context);
  modbus_free(context);
}

ModbusLink::ModbusLink(const ModbusAddress& address, double timeout_s) : address_(address) {
  const bool tcp = !address.host.empty();
  context_.reset(
      tcp ? modbus_new_tcp_pi(address.host.c_str(), std::to_string(address.port).c_str())
          : modbus_new_rtu(address.device.c_str(), address.baud, address.parity, 8, address.stop_bits));
  if (!context_) throw std::runtime_error(fmt::format("{}: {}", address.text(), modbus_strerror(errno)));
  // libmodbus takes seconds and microseconds apart and refuses both at 0.
  const auto seconds = static_cast<std::uint32_t>(timeout_s);
  const auto micros = static_cast<std::uint32_t>(std::lround((timeout_s - seconds) * 1e6)) % 1000000;
  modbus_set_response_timeout(context_.get(), seconds, seconds == 0 && micros == 0 ? 1 : micros);
  modbus_set_byte_timeout(context_.get(), 0, 0);  // none of its own: the time is for the whole answer
}

ModbusLink::~ModbusLink() = default;

std::string ModbusLink::open() {
  if (connected_) return "";
  if (modbus_connect(context_.get()) != 0)
    return fmt::format("{}: cannot be opened: {}", address_.text(), modbus_strerror(errno));
  connected_ = true;
  return "";
}

std::string ModbusLink::begin_request(int unit) {
  if (std::string trouble = open(); !trouble.empty()) return trouble;
  // What came late, or behind an answer, would be taken for the answer to this request.
  modbus_flush(context_.get());
  modbus_set_slave(context_.get(), unit);
  return "";
}

// After a refusal the line is as good as before; after anything else it is opened anew, without old bytes in
// it.
std::string ModbusLink::failure(int unit, const std::string& what) {
  const int error = errno;
  // An exception answer (illegal function, address, value and so on) came in due form, so the line itself is
  // in order. A time-out or a wrong checksum may leave half a frame behind, which the next answer would be
  // taken for.
  const bool refused = error > MODBUS_ENOBASE && error < EMBBADCRC;
  if (!refused) {
    modbus_flush(context_.get());
    modbus_close(context_.get());
    connected_ = false;
  }
  return fmt::format("{} unit {}: {}: {}", address_.text(), unit, what, modbus_strerror(error));
}

std::string ModbusLink::read(int unit, ModbusTable table, int first, int count,
                             std::vector<std::uint16_t>& values) {
  values.assign(static_cast<std::size_t>(count), 0);
  if (std::string trouble = begin_request(unit); !trouble.empty()) return trouble;
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(count));
  int got = -1;
  if (table == ModbusTable::kCoil) got = modbus_read_bits(context_.get(), first, count, bits.data());
  if (table == ModbusTable::kDiscrete)
    got = modbus_read_input_bits(context_.get(), first, count, bits.data());
  if (table == ModbusTable::kInput)
    got = modbus_read_input_registers(context_.get(), first, count, values.data());
  if (table == ModbusTable::kHolding)
    got = modbus_read_registers(context_.get(), first, count, values.data());
  if (got != count)
    return failure(unit, fmt::format("reading {} {} to {}", to_string(table), first, first + count - 1));
  // Bits come from libmodbus in a form of their own, one byte each.
  if (table == ModbusTable::kCoil || table == ModbusTable::kDiscrete) values.assign(bits.begin(), bits.end());
  return "";
}

std::string ModbusLink::write(int unit, ModbusTable table, int first,
                              const std::vector<std::uint16_t>& values) {
  if (std::string trouble = begin_request(unit); !trouble.empty()) return trouble;
  const int count = static_cast<int>(values.size());
  int done = -1;
  if (table == ModbusTable::kCoil && count == 1)
    done = modbus_write_bit(context_.get(), first, values[0] != 0);
  // Function 6 for one register, 16 for several: many inverters know only the one for single words.
  else if (table == ModbusTable::kHolding && count == 1)
    done = modbus_write_register(context_.get(), first, values[0]);
  else if (table == ModbusTable::kHolding)
    done = modbus_write_registers(context_.get(), first, count, values.data());
  else
    return fmt::format("{} unit {}: only a coil or holding registers can be written", address_.text(), unit);
  return done == count ? "" : failure(unit, fmt::format("writing {} {}", to_string(table), first));
}

}  // namespace trn
