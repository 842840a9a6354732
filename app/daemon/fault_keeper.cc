#include "app/daemon/fault_keeper.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "core/fault.h"
#include "core/safe_file.h"

namespace trn {

namespace {

// A signal is worth a column if it says something in some period.
bool says_something(const Signal& signal, const ScopeRing& ring) {
  for (std::size_t row = 0; row < ring.size(); ++row) {
    const double value = signal.value(ring.row(row));
    if (signal.bit >= 0 ? value != 0 : !std::isnan(value)) return true;
  }
  return false;
}

Worker::Done write_record(const ScopeRecord& record, const std::string& path) {
  std::string bad;
  try {
    write_file_safely(path, scope_csv(record));
  } catch (const std::exception& error) {
    bad = error.what();
  }
  return [path, bad] {
    if (bad.empty()) return spdlog::info("the last seconds before the fault are in {}", path);
    spdlog::warn("what happened before the fault is not kept: {}", bad);
  };
}

}  // namespace

ScopeRecord record_of(const ScopeRing& ring, const SignalTable& table, const std::string& machine) {
  ScopeRecord record;
  record.machine = machine;
  record.period_s = table.period_s();
  std::vector<const Signal*> kept;
  for (const Signal& signal : table.signals())
    if (says_something(signal, ring)) kept.push_back(&signal);
  for (const Signal* signal : kept) record.columns.push_back({signal->name, signal->unit});
  for (std::size_t row = 0; row < ring.size(); ++row) {
    record.periods.push_back(ring.period(row));
    for (const Signal* signal : kept) record.values.push_back(signal->value(ring.row(row)));
  }
  return record;
}

std::string next_fault_file(const std::string& log, int files_max) {
  namespace fs = std::filesystem;
  std::string oldest;
  fs::file_time_type oldest_time = fs::file_time_type::max();
  for (int i = 1; i <= files_max; ++i) {
    const std::string path = fmt::format("{}.fault{}.csv", log, i);
    std::error_code none;
    const fs::file_time_type time = fs::last_write_time(path, none);
    if (none) return path;
    if (time >= oldest_time) continue;
    oldest = path;
    oldest_time = time;
  }
  return oldest;
}

FaultKeeper::FaultKeeper(const ScopeConfig& config, const Machine& machine, const SignalTable& table,
                         std::string log)
    : config_(config),
      machine_(machine.name),
      log_(std::move(log)),
      period_s_(machine.period_s),
      table_(table) {
  if (!log_.empty() && config_.fault_files > 0) worker_.emplace();
}

FaultKeeper::~FaultKeeper() {
  if (worker_) worker_->finish();
}

void FaultKeeper::report(const CycleReport& report, const ScopeRing& ring) {
  if (!worker_) return;
  worker_->collect();
  const bool faulty = report.fault != Fault::kOk;
  // A fault that comes while the file of another one waits is in that file.
  if (faulty && !latched_ && !due_period_) {
    fault_period_ = report.period;
    due_period_ = report.period + static_cast<std::uint64_t>(std::llround(config_.after_fault_s / period_s_));
  }
  latched_ = faulty;
  if (!due_period_ || report.period < *due_period_) return;
  if (!worker_->idle()) return wait_for_disk(ring);
  due_period_.reset();
  keep(ring);
}

// One copy at a time: on a disk that hangs, fault upon fault would take the memory. While the ring has the
// fault, its file can still be written.
void FaultKeeper::wait_for_disk(const ScopeRing& ring) {
  if (ring.first_from(fault_period_) > 0) return;
  due_period_.reset();
  spdlog::warn(
      "what happened before the fault is not kept: the file of the fault before it is still being "
      "written; the disk of {} is slow",
      log_);
}

// The rows are copied here; what takes long is the thread's.
void FaultKeeper::keep(const ScopeRing& ring) {
  auto copy = std::make_shared<ScopeRing>(ring);
  const std::uint64_t trigger = fault_period_;
  worker_->post([copy, trigger, &table = table_, machine = machine_, log = log_, most = config_.fault_files] {
    ScopeRecord record = record_of(*copy, table, machine);
    record.trigger_period = trigger;
    return write_record(record, next_fault_file(log, most));
  });
}

}  // namespace trn
