#include "app/daemon/run_counters.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <utility>

#include "core/safe_file.h"

namespace trn {

namespace {

constexpr auto kRetry = std::chrono::seconds(10);

std::string text_of(const RunCounters::Values& values) {
  return fmt::format("parts {}\nrun_s {:.3f}\n", values.parts, values.run_s);
}

bool read(const std::string& file, RunCounters::Values& values) {
  std::ifstream in(file);
  std::string parts, run;
  RunCounters::Values found;
  in >> parts >> found.parts >> run >> found.run_s;
  if (!in || parts != "parts" || run != "run_s" || found.parts < 0 || !(found.run_s >= 0) ||
      !std::isfinite(found.run_s))
    return false;
  values = found;
  return true;
}

}  // namespace

RunCounters::RunCounters(std::string file) : file_(std::move(file)) {
  if (file_.empty() || !std::filesystem::exists(file_) || read(file_, now_)) {
    kept_ = now_;
  } else {
    trouble_ = file_ + ": has no counters ('parts 12', 'run_s 345.6'); remove it, then restart the daemon";
    file_.clear();
  }
  if (!file_.empty()) disk_ = std::make_unique<Worker>();
}

RunCounters::~RunCounters() {
  disk_.reset();
  if (file_.empty() || now_ == kept_) return;
  try {
    write_file_safely(file_, text_of(now_));
  } catch (const std::exception&) {  // it was told while there was somebody to hear it
    return;
  }
}

bool RunCounters::due() const { return now_.parts != kept_.parts || now_.run_s - kept_.run_s >= kRunSlack_s; }

void RunCounters::poll() {
  if (!disk_) {
    kept_ = now_;
    return;
  }
  disk_->collect();
  if (writing_ || !due() || std::chrono::steady_clock::now() < not_before_) return;
  writing_ = true;
  disk_->post([this, file = file_, values = now_] {
    std::string error;
    try {
      write_file_safely(file, text_of(values));
    } catch (const std::exception& failure) {
      error = failure.what();
    }
    return Worker::Done([this, values, error] {
      writing_ = false;
      if (error.empty()) kept_ = values;
      if (!error.empty()) not_before_ = std::chrono::steady_clock::now() + kRetry;
      trouble_ = error;
    });
  });
}

std::string RunCounters::take_trouble() { return std::exchange(trouble_, ""); }

}  // namespace trn
