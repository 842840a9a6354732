#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "core/config.h"
#include "hal/modbus/field_devices.h"
#include "hal/modbus/modbus_io.h"
#include "hal/modbus/modbus_link.h"

namespace trn {

namespace {

/// Picks values of the devices by name.
class Roles {
 public:
  explicit Roles(const ModbusConfig& devices) {
    for (const ModbusDeviceConfig& device : devices.devices)
      for (const ModbusValueConfig& value : device.values) {
        names_.push_back(value.name);
        places_[value.name] = {device.line, device.unit, value.table, value.address};
        if (value.table == ModbusTable::kCoil || value.table == ModbusTable::kHolding)
          writable_.push_back(value.name);
      }
  }
  std::string read(const ConfigTable& table, const std::string& key) const {
    return table.has(key) ? table.choice(key, names_) : "";
  }
  std::string written(const ConfigTable& table, const std::string& key) {
    const std::string name = read(table, key);
    if (!name.empty()) take(table, key, name);
    return name;
  }
  std::vector<std::string> list(const ConfigTable& table, const std::string& key, bool written) {
    std::vector<std::string> out = table.texts(key, {});
    if (out.size() > kMaxIo) throw table.error(key, fmt::format("'{}' has more than {} names", key, kMaxIo));
    for (const std::string& name : out) {
      if (std::find(names_.begin(), names_.end(), name) == names_.end())
        throw table.error(key, fmt::format("'{}' is no value of a [[modbus.device]]{}", name, hint(name)));
      if (written) take(table, key, name);
    }
    return out;
  }

 private:
  // An output and another writer of its register would each undo what the other has written, at every turn.
  void take(const ConfigTable& table, const std::string& key, const std::string& name) {
    if (std::find(writable_.begin(), writable_.end(), name) == writable_.end())
      throw table.error(key,
                        fmt::format("'{}' cannot be written; it must be a coil or a holding register", name));
    const auto [place, first] = writers_.emplace(places_[name], key);
    if (!first && (key.ends_with("_outputs") || place->second.ends_with("_outputs")))
      throw table.error(key, fmt::format("'{}' is written by '{}' already; a register has one writer", name,
                                         place->second));
  }
  std::string hint(const std::string& name) const {
    const std::string near = nearest_word(name, names_);
    return near.empty() ? "" : fmt::format("; did you mean '{}'?", near);
  }
  using Place = std::tuple<std::size_t, int, ModbusTable, int>;  ///< line, unit, table, address
  std::vector<std::string> names_, writable_;
  std::map<std::string, Place> places_;
  std::map<Place, std::string> writers_;  ///< the key that writes there
};

ModbusIoConfig::Spindle read_spindle(const ConfigTable& table, Roles& roles) {
  ModbusIoConfig::Spindle spindle;
  spindle.speed = roles.written(table, "speed");
  spindle.run = roles.written(table, "run");
  spindle.reverse = roles.written(table, "reverse");
  spindle.actual = roles.read(table, "actual");
  spindle.at_speed = roles.read(table, "at_speed");
  spindle.fault = roles.read(table, "fault");
  spindle.tolerance_rpm = table.number("tolerance_rpm", spindle.tolerance_rpm, kPositive);
  if (spindle.run.empty() && spindle.speed.empty())
    throw table.error("run", "a spindle needs 'speed' or 'run', or nothing could turn it");
  return spindle;
}

}  // namespace

ModbusIoConfig read_modbus_io(const ConfigTable& root) {
  ModbusIoConfig config;
  config.devices = read_modbus(root);
  const auto io = root.table_if("io");
  // Devices may be read for corrections and reports alone, with the I/O of the machine simulated.
  if (!io || io->text("type", "simulated") != "modbus") return config;
  if (config.devices.devices.empty())
    throw io->error("type", "'type' is \"modbus\", but there is no [[modbus.device]]");
  Roles roles(config.devices);
  if (const auto spindle = io->table_if("spindle")) config.spindle = read_spindle(*spindle, roles);
  config.digital_inputs = roles.list(*io, "digital_inputs", false);
  config.digital_outputs = roles.list(*io, "digital_outputs", true);
  config.analog_inputs = roles.list(*io, "analog_inputs", false);
  config.analog_outputs = roles.list(*io, "analog_outputs", true);
  config.mist = roles.written(*io, "mist");
  config.flood = roles.written(*io, "flood");
  return config;
}

}  // namespace trn
