#include "hal/modbus/field_devices.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "core/check.h"

namespace trn {

namespace {

// A character on the line is a start bit, 8 data bits, parity and stop, or two stops without parity. Frames
// are parted by a silence of 3.5 characters (Modbus over serial line 1.02).

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::int64_t ns(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

/// The least and the greatest value that a register can hold.
Range range_of(const ModbusValueConfig& value) {
  const double low = value.is_signed ? -32768 : 0, high = value.is_signed ? 32767 : 65535;
  const double one = low * value.scale, other = high * value.scale;
  return {std::min(one, other), std::max(one, other)};
}

// What the register would hold must mean what was asked for: 80000 in sixteen bits would be 14464.
std::string word_of(const ModbusValueConfig& value, double wanted, std::uint16_t& word) {
  const double low = value.is_signed ? -32768 : 0, high = value.is_signed ? 32767 : 65535;
  const double raw = std::round(wanted / value.scale);
  if (!(raw >= low && raw <= high)) {
    const Range holds = range_of(value);
    return fmt::format("{} = {:g} does not fit register {} ({:g} to {:g}) and was not sent", value.name,
                       wanted, value.address, holds.min, holds.max);
  }
  word = static_cast<std::uint16_t>(static_cast<std::int32_t>(raw));
  return "";
}

// A limit that the register never reaches was meant for another register, scale or sign.
void check_limits(const ConfigTable& table, const ModbusValueConfig& value) {
  const bool bits = value.table == ModbusTable::kCoil || value.table == ModbusTable::kDiscrete;
  if (bits || value.max <= value.min) return;
  const Range holds = range_of(value);
  const double slack = std::abs(value.scale);  // of one count
  for (const auto& [key, limit] : {std::pair("min", value.min), std::pair("max", value.max)})
    if (limit < holds.min - slack || limit > holds.max + slack)
      throw table.error(
          key, fmt::format("'{}' = {:g} does not fit the register, which holds {:g} to {:g}; look at "
                           "'scale' and 'signed', or give a limit that fits",
                           key, limit, holds.min, holds.max));
}

ModbusValueConfig read_value_config(const ConfigTable& table, const std::string& device) {
  static const std::vector<std::string> kTables = {"coil", "discrete", "input", "holding"};  // as ModbusTable
  ModbusValueConfig value;
  value.name = device + "." + table.text("name");
  const std::string kind = table.choice("table", kTables);
  value.table = static_cast<ModbusTable>(std::find(kTables.begin(), kTables.end(), kind) - kTables.begin());
  value.address = static_cast<int>(table.integer("address", Range{0, 65535}));
  value.is_signed = table.boolean("signed", false);
  value.scale = table.number("scale", 1.0, kAnyNumber);
  if (value.scale == 0) throw table.error("scale", "'scale' must not be 0");
  value.min = table.number("min", 0.0, kAnyNumber);
  value.max = table.number("max", 0.0, kAnyNumber);
  if (value.max < value.min) throw table.error("max", "'max' must not be less than 'min'");
  table.finish();  // a misspelt 'signed' explains more than a limit that does not fit
  check_limits(table, value);
  return value;
}

// Two names for one meaning of one register: one of the addresses is wrong, most often after a copy.
void check_twice(const ConfigTable& table, const ModbusValueConfig& value, const ModbusValueConfig& other) {
  const bool same = other.table == value.table && other.address == value.address &&
                    other.is_signed == value.is_signed && other.scale == value.scale;
  if (same)
    throw table.error("address", fmt::format("'{}' and '{}' are the same {} {}; one address is wrong, or one "
                                             "name is enough",
                                             other.name, value.name, to_string(value.table), value.address));
}

ModbusDeviceConfig read_device(const ConfigTable& table, const std::vector<std::string>& lines) {
  ModbusDeviceConfig device;
  device.name = table.text("name");
  const std::string line =
      lines.size() == 1 ? table.choice("line", lines, lines[0]) : table.choice("line", lines);
  device.line = static_cast<std::size_t>(std::find(lines.begin(), lines.end(), line) - lines.begin());
  device.unit = static_cast<int>(table.integer("unit", 1, Range{1, 247}));
  device.poll_s = table.number("poll_s", 0.2, Range{0.005, 3600});
  device.stale_s = table.number("stale_s", 5 * device.poll_s, kPositive);
  if (device.stale_s <= device.poll_s) throw table.error("stale_s", "'stale_s' must be longer than poll_s");
  device.retries = static_cast<int>(table.integer("retries", 2, Range{0, 10}));
  device.required = table.boolean("required", true);
  for (const ConfigTable& entry : table.tables("value")) {
    const ModbusValueConfig value = read_value_config(entry, device.name);
    for (const ModbusValueConfig& other : device.values) {
      if (other.name == value.name)
        throw entry.error("name", fmt::format("'{}' is there already", value.name));
      check_twice(entry, value, other);
    }
    device.values.push_back(value);
  }
  table.finish();
  return device;
}

// The share of a line's time that its polls take must leave room for tries and writes.
void check_budget(const ModbusConfig& config, std::size_t line, const ConfigTable& table) {
  double share = 0;
  std::string sum;
  for (const ModbusDeviceConfig& device : config.devices) {
    if (device.line != line) continue;
    const double time_s = poll_time_s(config.lines[line].address, device);
    share += time_s / device.poll_s;
    sum += fmt::format("\n  {}: {:.1f} ms every {:g} ms", device.name, 1000 * time_s, 1000 * device.poll_s);
  }
  constexpr double kShareMax = 0.7;
  if (share <= kShareMax) return;
  throw table.error("address",
                    fmt::format("line '{}' would be busy {:.0f} % of the time, 70 % is the most:{}\n  a "
                                "faster line, or poll_s longer by {:.2f} times",
                                config.lines[line].name, 100 * share, sum, share / kShareMax));
}

}  // namespace

void leave_signals_to_others() {
  // SIGTERM and its like must reach the thread that ends the daemon in order, not one that is just waiting
  // for an inverter.
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
}

double poll_time_s(const ModbusAddress& address, const ModbusDeviceConfig& device) {
  if (!address.host.empty()) return 0;
  // Unit, function, address, count and CRC are 8 bytes; unit, function, byte count, one register and CRC are
  // 7.
  const double characters =
      8 + 7 + 2 * kRtuSilence_characters;  // request; answer with one register or byte of bits
  return static_cast<double>(device.values.size()) * characters * kRtuBitsPerCharacter / address.baud;
}

ModbusConfig read_modbus(const ConfigTable& root) {
  ModbusConfig config;
  const auto section = root.table_if("modbus");
  if (!section) return config;
  std::vector<std::string> names;
  const std::vector<ConfigTable> lines = section->tables("line");
  for (const ConfigTable& table : lines) {
    ModbusConfig::Line line;
    line.name = table.text("name");
    if (std::find(names.begin(), names.end(), line.name) != names.end())
      throw table.error("name", fmt::format("line '{}' is there already", line.name));
    const std::string address = table.text("address");
    try {
      line.address = parse_modbus_address(address);
    } catch (const std::runtime_error& error) {
      throw table.error("address", error.what());
    }
    line.timeout_s = table.number("timeout_s", 0.2, Range{0.001, 60});
    names.push_back(line.name);
    config.lines.push_back(line);
  }
  for (const ConfigTable& table : section->tables_if("device")) {
    const ModbusDeviceConfig device = read_device(table, names);
    for (const ModbusDeviceConfig& other : config.devices)
      if (other.name == device.name)
        throw table.error("name", fmt::format("device '{}' is there already", device.name));
    config.devices.push_back(device);
  }
  for (std::size_t i = 0; i < lines.size(); ++i) check_budget(config, i, lines[i]);
  return config;
}

FieldDevices::FieldDevices(const ModbusConfig& config, Listener listener)
    : config_(config), listener_(std::move(listener)), states_(config.devices.size()) {
  // From now on: a device that never answers is lost when its time is up, not at once.
  for (DeviceState& state : states_) state.heard_ns = now_ns();
  for (std::size_t line = 0; line < config_.lines.size(); ++line)
    threads_.emplace_back([this, line] { serve(line); });
}

FieldDevices::~FieldDevices() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void FieldDevices::serve(std::size_t line) {
  leave_signals_to_others();
  ModbusLink link(config_.lines[line].address, config_.lines[line].timeout_s);
  std::unique_lock lock(mutex_);
  while (!stop_) {
    news_ = false;
    lock.unlock();
    std::int64_t next_ns = now_ns() + 1'000'000'000;
    for (std::size_t i = 0; i < config_.devices.size(); ++i) {
      if (config_.devices[i].line != line) continue;
      run_writes(link, line);  // before each poll: what is to be done must not wait for all of them
      if (states_[i].next_ns <= now_ns()) poll(link, i);  // next_ns belongs to this thread
      next_ns = std::min(next_ns, states_[i].next_ns);
    }
    lock.lock();
    // Until the next poll is due, or until somebody wants something written.
    const auto pause = std::chrono::nanoseconds(std::max<std::int64_t>(next_ns - now_ns(), 1'000'000));
    wake_.wait_for(lock, pause, [&] { return stop_ || news_; });
  }
}

std::string FieldDevices::read_value(ModbusLink& link, const ModbusDeviceConfig& device,
                                     const ModbusValueConfig& value) {
  std::vector<std::uint16_t> words;
  std::string trouble;
  for (int tries = 0; tries <= device.retries; ++tries) {
    trouble = link.read(device.unit, value.table, value.address, 1, words);
    if (trouble.empty()) break;
  }
  if (!trouble.empty()) return trouble;
  // A register has 16 bits and no sign of its own; what it means is the device's matter.
  const double raw = value.is_signed ? static_cast<std::int16_t>(words[0]) : words[0];
  const double reading = raw * value.scale;
  // A reading that cannot be, such as -32768 of a sensor with a broken wire, is kept for the report but not
  // handed to corrections.
  const bool possible = value.max <= value.min || (reading >= value.min && reading <= value.max);
  if (listener_ && possible) listener_(value.name, reading);
  const std::lock_guard lock(mutex_);
  samples_[value.name] = {reading, now_ns()};
  return "";
}

void FieldDevices::poll(ModbusLink& link, std::size_t index) {
  const ModbusDeviceConfig& device = config_.devices[index];
  DeviceState& state = states_[index];
  // Behind its time a device is polled once and not as often as was missed.
  state.next_ns = std::max(state.next_ns + ns(device.poll_s), now_ns());
  std::string trouble;
  for (const ModbusValueConfig& value : device.values)
    if (trouble = read_value(link, device, value); !trouble.empty()) break;
  judge(index, trouble);
}

void FieldDevices::judge(std::size_t index, const std::string& trouble) {
  const ModbusDeviceConfig& device = config_.devices[index];
  const std::lock_guard lock(mutex_);
  DeviceState& state = states_[index];
  // One failed poll is no loss: the device is lost when nothing was heard for `stale_s`.
  if (trouble.empty()) state.heard_ns = now_ns();
  state.lost = now_ns() - state.heard_ns > ns(device.stale_s);
  state.lies = false;
  if (state.lost && !trouble.empty()) state.trouble = device.name + ": " + trouble;
  for (const ModbusValueConfig& value : device.values) {
    const auto sample = samples_.find(value.name);
    const bool judged = value.max > value.min && sample != samples_.end() && !state.lost;
    // A value without bounds (max not above min) is never impossible.
    if (!judged || (sample->second.value >= value.min && sample->second.value <= value.max)) continue;
    state.lies = true;
    state.trouble = fmt::format("{} is {:g}; {:g} to {:g} is possible", value.name, sample->second.value,
                                value.min, value.max);
  }
}

void FieldDevices::run_writes(ModbusLink& link, std::size_t line) {
  for (std::size_t i = 0; i < config_.devices.size(); ++i) {
    const ModbusDeviceConfig& device = config_.devices[i];
    if (device.line != line || states_[i].write_again_ns > now_ns()) continue;
    for (const ModbusValueConfig& value : device.values) {
      double wanted = 0;
      if (!take_write(value, wanted)) continue;
      std::uint16_t word = 0;
      std::string trouble = word_of(value, wanted, word);
      TRN_CHECK(trouble.empty());  // `write` takes nothing else
      for (int tries = 0; tries <= device.retries; ++tries)
        if (trouble = link.write(device.unit, value.table, value.address, {word}); trouble.empty()) break;
      finish_write(i, value, wanted, trouble);
      // The device does not answer, and the other values would each wait for the time-out as well.
      if (!trouble.empty()) break;
    }
  }
}

bool FieldDevices::take_write(const ModbusValueConfig& value, double& wanted) {
  const std::lock_guard lock(mutex_);
  const auto found = writes_.find(value.name);
  if (found == writes_.end()) return false;
  wanted = found->second;
  writes_.erase(found);
  ++writing_;
  return true;
}

// What a device did not take is tried again with its next poll, unless something newer is asked for.
void FieldDevices::finish_write(std::size_t index, const ModbusValueConfig& value, double wanted,
                                const std::string& trouble) {
  const ModbusDeviceConfig& device = config_.devices[index];
  const std::lock_guard lock(mutex_);
  DeviceState& state = states_[index];
  --writing_;
  settled_ns_ = now_ns();
  state.refuses = !trouble.empty();
  if (trouble.empty()) return;
  state.trouble = device.name + ": " + trouble;
  state.write_again_ns = now_ns() + ns(device.poll_s);
  // emplace leaves a newer wish for the same value as it stands.
  writes_.emplace(value.name, wanted);
}

std::optional<FieldDevices::Value> FieldDevices::value(const std::string& name) const {
  for (const ModbusDeviceConfig& device : config_.devices) {
    const bool known = std::any_of(device.values.begin(), device.values.end(),
                                   [&](const ModbusValueConfig& value) { return value.name == name; });
    if (!known) continue;
    const std::lock_guard lock(mutex_);
    const auto found = samples_.find(name);
    if (found == samples_.end()) return Value{};
    const double age_s = 1e-9 * static_cast<double>(now_ns() - found->second.time_ns);
    return Value{found->second.value, age_s, age_s > device.stale_s, found->second.time_ns};
  }
  return std::nullopt;
}

const ModbusValueConfig* FieldDevices::find(const std::string& name) const {
  for (const ModbusDeviceConfig& device : config_.devices)
    for (const ModbusValueConfig& value : device.values)
      if (value.name == name) return &value;
  return nullptr;
}

bool FieldDevices::fits(const std::string& name, double value) const {
  const ModbusValueConfig* found = find(name);
  std::uint16_t word = 0;
  return found && word_of(*found, value, word).empty();
}

bool FieldDevices::write(const std::string& name, double value) {
  const ModbusValueConfig* found = find(name);
  if (!found) return false;
  std::uint16_t word = 0;
  const std::string trouble = word_of(*found, value, word);
  const std::lock_guard lock(mutex_);
  if (!trouble.empty()) {
    // What was asked for before is not wanted any more either.
    writes_.erase(name);
    misfits_[name] = trouble;
    return false;
  }
  misfits_.erase(name);
  writes_[name] = value;
  news_ = true;
  wake_.notify_all();
  return true;
}

void FieldDevices::forget_misfits() {
  const std::lock_guard lock(mutex_);
  misfits_.clear();
}

std::int64_t FieldDevices::settled_ns() const {
  const std::lock_guard lock(mutex_);
  // A write that is taken out of the list but not yet answered is not settled either.
  return writing_ > 0 || !writes_.empty() || !misfits_.empty() ? -1 : settled_ns_;
}

Fault FieldDevices::fault(std::string& detail) const {
  const std::lock_guard lock(mutex_);
  // The program or the config is wrong here, so it does not matter whether the device is required.
  if (!misfits_.empty()) {
    detail = misfits_.begin()->second;
    return Fault::kDeviceFault;
  }
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const DeviceState& state = states_[i];
    // A device that is read well but takes no writes is of no use for the machine either: its outputs stay as
    // they were.
    const bool lost = state.lost || state.refuses;
    if (!config_.devices[i].required || (!lost && !state.lies)) continue;
    detail = state.trouble;
    return lost ? Fault::kDeviceLost : Fault::kDeviceFault;
  }
  return Fault::kOk;
}

}  // namespace trn
