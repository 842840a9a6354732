#include "hal/modbus/modbus_io.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr auto kTurn = std::chrono::milliseconds(5);             // of the worker
constexpr auto kShutDownTime = std::chrono::milliseconds(1000);  // for the last writes
}  // namespace

ModbusIo::ModbusIo(const ModbusIoConfig& config, FieldDevices::Listener listener)
    : config_(config), listener_(std::move(listener)) {}

ModbusIo::~ModbusIo() { shut_down(); }

void ModbusIo::bring_up() {
  // It runs already: a reset of the drives alone must not stop the spindle. What did not fit has been told,
  // and nobody could ask for less while it is a fault.
  if (thread_.joinable()) return devices_->forget_misfits();
  // After a pause the devices may have been switched off and on: everything is told to them anew.
  put_.clear();
  stop_ = false;
  devices_ = std::make_unique<FieldDevices>(config_.devices, listener_);
  thread_ = std::thread([this] { work(); });
}

// The devices hear that all is off before the lines are closed.
void ModbusIo::shut_down() noexcept {
  if (!thread_.joinable()) return;
  stop_ = true;
  thread_.join();
  // The worker is gone, so this thread may send in its place.
  digital_out_ = 0;
  for (auto& analog : analog_out_) analog = 0;
  rpm_ = 0;
  coolant_ = 0;
  send_outputs();
  const auto end = std::chrono::steady_clock::now() + kShutDownTime;
  while (devices_->settled_ns() < 0 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(kTurn);
  devices_.reset();
}

void ModbusIo::exchange(const IoOutputs& outputs, const IoPlace&, IoInputs& inputs) TRN_RT {
  TRN_CHECK(config_.analog_outputs.size() <= outputs.analog.size());
  TRN_CHECK(std::isfinite(outputs.spindle_rpm));
  constexpr auto kRelaxed = std::memory_order_relaxed;
  digital_out_.store(outputs.digital, kRelaxed);
  for (std::size_t i = 0; i < config_.analog_outputs.size(); ++i)
    analog_out_[i].store(outputs.analog[i], kRelaxed);
  coolant_.store(outputs.coolant, kRelaxed);
  // No inverter here can orient a spindle. It stops and is never ready, so the program waits until its time
  // is up instead of going on.
  const double rpm = outputs.spindle_orients ? 0 : outputs.spindle_rpm;
  // First the speed, then the number of the command with release: whoever sees the number sees its speed.
  if (rpm != rpm_told_) {
    rpm_told_ = rpm;
    rpm_.store(rpm, kRelaxed);
    spindle_commands_.fetch_add(1, std::memory_order_release);
  }
  inputs.digital = digital_in_.load(kRelaxed);
  for (std::size_t i = 0; i < config_.analog_inputs.size(); ++i)
    inputs.analog[i] = analog_in_[i].load(kRelaxed);
  inputs.spindle_ready = !outputs.spindle_orients &&
                         ready_for_.load(std::memory_order_acquire) == spindle_commands_.load(kRelaxed);
  inputs.fault = fault_.load(kRelaxed);
}

void ModbusIo::work() {
  leave_signals_to_others();
  while (!stop_) {
    // The number is read before the speed is sent. If a new command comes in between, the readiness that is
    // found below belongs to the older number, and the tick goes on waiting.
    const std::uint32_t command = spindle_commands_.load(std::memory_order_acquire);
    send_outputs();
    take_inputs();
    watch_faults();
    if (spindle_follows()) ready_for_.store(command, std::memory_order_release);
    std::this_thread::sleep_for(kTurn);
  }
}

void ModbusIo::put(const std::string& name, double value) {
  if (name.empty()) return;
  const auto [place, first] = put_.emplace(name, value);
  // A line carries some tens of values a second: only what changes is written.
  if (!first && place->second == value) return;
  place->second = value;
  devices_->write(name, value);
}

void ModbusIo::send_outputs() {
  const double rpm = rpm_;
  const ModbusIoConfig::Spindle& spindle = config_.spindle;
  const double speed = spindle.reverse.empty() ? rpm : std::abs(rpm);
  const bool fits = speed_fits(speed);
  // With a speed that its register cannot hold, the spindle would start at an older one. It stays as it is
  // until the fault has stopped the motion.
  if (fits) put(spindle.reverse, rpm < 0 ? 1 : 0);
  // Direction and speed before `run`, so that the spindle does not start the wrong way round.
  put(spindle.speed, speed);
  if (fits) put(spindle.run, rpm != 0 ? 1 : 0);
  const std::uint64_t digital = digital_out_;
  for (std::size_t i = 0; i < config_.digital_outputs.size(); ++i)
    put(config_.digital_outputs[i], digital >> i & 1 ? 1 : 0);
  for (std::size_t i = 0; i < config_.analog_outputs.size(); ++i)
    put(config_.analog_outputs[i], analog_out_[i]);
  // One pump for both runs while one of them is on.
  const int coolant = coolant_, both = config_.mist == config_.flood ? 3 : 0;
  put(config_.mist, coolant & (1 | both) ? 1 : 0);
  put(config_.flood, coolant & (2 | both) ? 1 : 0);
}

bool ModbusIo::speed_fits(double rpm) const {
  return config_.spindle.speed.empty() || devices_->fits(config_.spindle.speed, rpm);
}

double ModbusIo::known(const std::string& name) const {
  const auto value = name.empty() ? std::nullopt : devices_->value(name);
  return value ? value->value : 0;
}

void ModbusIo::take_inputs() {
  std::uint64_t digital = 0;
  for (std::size_t i = 0; i < config_.digital_inputs.size(); ++i)
    if (known(config_.digital_inputs[i]) != 0) digital |= std::uint64_t{1} << i;
  digital_in_ = digital;
  for (std::size_t i = 0; i < config_.analog_inputs.size(); ++i)
    analog_in_[i] = known(config_.analog_inputs[i]);
}

// What the inverter says counts only if it was asked after it had taken the command.
bool ModbusIo::spindle_follows() const {
  const std::int64_t settled_ns = devices_->settled_ns();
  if (settled_ns < 0) return false;
  const ModbusIoConfig::Spindle& spindle = config_.spindle;
  const auto fresh = [&](const std::string& name, double& reading) {
    const auto value = devices_->value(name);
    reading = value->value;
    return !value->stale && value->time_ns > settled_ns;
  };
  const double rpm = rpm_, wanted = spindle.reverse.empty() ? rpm : std::abs(rpm);
  if (!speed_fits(wanted)) return false;
  double reading = 0;
  if (!spindle.at_speed.empty() && rpm != 0 && (!fresh(spindle.at_speed, reading) || reading == 0))
    return false;
  // An inverter that does not tell its speed is taken at its word that it took the command.
  if (spindle.actual.empty()) return true;
  return fresh(spindle.actual, reading) && std::abs(reading - wanted) <= spindle.tolerance_rpm;
}

void ModbusIo::watch_faults() {
  std::string trouble;
  Fault fault = devices_->fault(trouble);
  const double code = known(config_.spindle.fault);
  // A device that is lost explains more than a code that was read from it earlier.
  if (fault == Fault::kOk && code != 0) {
    fault = Fault::kDeviceFault;
    trouble = fmt::format("the spindle's inverter reports fault {:g} ({})", code, config_.spindle.fault);
  }
  {
    const std::lock_guard lock(mutex_);
    if (fault != Fault::kOk) trouble_ = trouble;
  }
  fault_ = fault;
}

std::string ModbusIo::explain_fault() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

}  // namespace trn
