#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/config.h"
#include "hal/modbus/field_devices.h"
#include "hal/modbus/modbus_io.h"
#include "sim/modbus/emulated_line.h"

namespace trn {

/// A value of an emulated device that runs by itself: start + rate * time.
struct EmulatedValue {
  std::string name;  ///< "device.value"
  double start = 0, rate_per_s = 0;
};

/// Array [[modbus.emulation]]; it may be missing. ConfigError as ConfigTable.
std::vector<EmulatedValue> read_emulated_values(const ConfigTable& root, const ModbusConfig& devices);

/// Every Modbus line of a machine with its devices, and what happens behind their registers: the spindle
/// comes up to the speed it is told, digital input i follows digital output i, other values run by
/// themselves.
class EmulatedCabinet {
 public:
  EmulatedCabinet(const ModbusIoConfig& config, const std::vector<EmulatedValue>& values);

  /// Lets `dt_s` pass.
  void step(double dt_s);
  /// std::runtime_error if there is no such device.
  void trouble(const std::string& device, const EmulatedLine::Trouble& trouble);
  void set(const std::string& name, double value);
  double get(const std::string& name) const;
  EmulatedLine& line(std::size_t index) { return *lines_[index]; }

 private:
  struct Place {
    const ModbusDeviceConfig* device = nullptr;
    const ModbusValueConfig* value = nullptr;
  };
  Place place(const std::string& name) const;
  void step_spindle(double dt_s);

  ModbusIoConfig config_;
  std::vector<EmulatedValue> values_;
  std::vector<std::unique_ptr<EmulatedLine>> lines_;
  double time_s_ = 0, rpm_ = 0;
};

}  // namespace trn
