#pragma once

#include <cstdint>
#include <fstream>
#include <functional>
#include <string>

#include "interp/gcode/canon.h"

namespace trn {

/// The file that a program writes by (LOGOPEN,name), (LOG,text) and (LOGCLOSE), and the one that takes the
/// contacts of its probe moves, (PROBEOPEN name) and (PROBECLOSE). They lie in one folder, which whoever
/// starts the program has named; a program can write nowhere else.
class ProgramLog {
 public:
  /// `folder`: "" keeps nothing, and says so by `warn` at the first file.
  ProgramLog(std::string folder, std::function<void(const std::string&)> warn)
      : folder_(std::move(folder)), warn_(std::move(warn)) {}

  /// A line without an open file goes nowhere. ProgramError "line N: .." for a name that is more than a name,
  /// and where the file cannot be written.
  void take(const canon::Log& log, std::uint32_t line);
  /// The program is over, or another one begins.
  void close() {
    log_.close();
    contacts_.close();
  }

 private:
  void open(std::ofstream& out, const std::string& name, bool append, std::uint32_t line);
  static void write(std::ofstream& out, const std::string& text, std::uint32_t line);

  std::string folder_;
  std::function<void(const std::string&)> warn_;
  std::ofstream log_, contacts_;
  bool warned_ = false;
};

}  // namespace trn
