#pragma once

#include <cstdio>
#include <string>

#include "interp/gcode/canon.h"

namespace trn {

/// Writes canonical functions one a line, four decimals.
class CanonPrinter : public CanonSink {
 public:
  /// `out` stays the caller's.
  explicit CanonPrinter(std::FILE* out) : out_(out) {}
  ~CanonPrinter() override { flush(); }
  void put(const CanonCommand& command, std::uint32_t line) override;
  void flush();
  /// While stopped nothing is written: an error makes what follows meaningless.
  void stop(bool stopped) { stopped_ = stopped; }

  /// One command as text, without the line's end; empty for one that has no canonical form.
  static void print(const CanonCommand& command, std::string& out);

 private:
  std::FILE* out_;
  std::string text_;
  bool stopped_ = false;
};

}  // namespace trn
