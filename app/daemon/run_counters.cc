#include "app/daemon/run_counters.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <sstream>
#include <system_error>
#include <utility>

#include "core/plain_file.h"
#include "core/safe_file.h"

namespace trn {

namespace {

constexpr auto kRetry = std::chrono::seconds(10);
constexpr std::size_t kBytesMax = std::size_t{1} << 20;

std::string text_of(const RunCounters::Values& values) {
  return fmt::format("parts {}\nrun_s {:.3f}\n", values.parts, values.run_s);
}

bool is_there(const std::string& file) {
  std::error_code none;
  return std::filesystem::exists(std::filesystem::symlink_status(file, none));
}

// PlainFileError where nothing can be read.
bool read(const std::string& file, RunCounters::Values& values) {
  std::istringstream in(read_plain_file(file, kBytesMax));
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
  try {
    if (!file_.empty() && is_there(file_) && !read(file_, now_))
      trouble_ = "has no counters ('parts 12', 'run_s 345.6'); remove it, then restart the daemon";
  } catch (const PlainFileError& error) {
    trouble_ = error.what() + std::string("; remove it, then restart the daemon");
  }
  kept_ = now_;
  if (!trouble_.empty()) trouble_ = std::exchange(file_, "") + ": " + trouble_;
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
