#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "app/daemon/worker.h"

namespace trn {

/// Parts made and time run, kept on disk. Lives in one thread, which never waits for the disk.
class RunCounters {
 public:
  struct Values {
    std::int64_t parts = 0;  ///< programs that came to their end
    double run_s = 0;        ///< of all programs
    bool operator==(const Values&) const = default;
  };
  static constexpr double kRunSlack_s = 10;  ///< of run time that a kill may lose

  /// Goes on with what the file has; "": in memory only. What cannot be read is told by `take_trouble`, and
  /// then nothing is written.
  explicit RunCounters(std::string file);
  /// Writes what is not yet there.
  ~RunCounters();
  RunCounters(const RunCounters&) = delete;
  RunCounters& operator=(const RunCounters&) = delete;

  void program_begins() { program_s_ = 0; }
  void program_ran(double time_s) {
    program_s_ += time_s;
    now_.run_s += time_s;
  }
  void part_made() { ++now_.parts; }
  /// Written at once.
  void set_parts(std::int64_t parts) {
    now_.parts = parts;
    not_before_ = {};
  }
  /// The parts stand on disk, if there is a file.
  bool parts_are_kept() const { return now_.parts == kept_.parts; }
  /// Begins to write what is due.
  void poll();

  /// As they stand on disk; without a file: as they are.
  std::int64_t parts() const { return kept_.parts; }
  double run_s() const { return now_.run_s; }
  /// Of the program that began last.
  double program_s() const { return program_s_; }
  /// What is wrong with the file, once each time; "" if nothing.
  std::string take_trouble();

 private:
  bool due() const;

  std::string file_;
  Values now_, kept_;
  double program_s_ = 0;
  bool writing_ = false;
  std::string trouble_;
  std::chrono::steady_clock::time_point not_before_;  ///< after a failure
  std::unique_ptr<Worker> disk_;
};

}  // namespace trn
