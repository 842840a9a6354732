#pragma once

#include <functional>
#include <optional>
#include <random>
#include <string>

#include "app/session/assembly.h"
#include "compensation/actual_chain.h"
#include "compensation/fit/ballbar.h"

namespace trn {

/// What is between the true machine and the trace.
struct BallbarInstrument {
  BallbarSetup setup;
  double noise_mm = 0;       ///< standard deviation of one reading
  double resolution_mm = 0;  ///< of the bar's encoder; 0: none
  unsigned seed = 1;
  bool every_period = false;  ///< a reading in every period, not only at the test's steps
};

/// The program of a test: G-code that stands the cup in its place and turns one axis, 500 mm/min at the ball.
std::string ballbar_program(const Assembly& assembly, const BallbarTest& test);

/// Runs a test's program through the whole kernel on the machine of `assembly` and reads the bar of the
/// machine `truth` at every setpoint. `program_path` is where the program lies.
BallbarTrace run_ballbar(Assembly& assembly, const ActualChain& truth, const BallbarTest& test,
                         const BallbarInstrument& instrument, const std::string& program_path);

/// CSV: comment lines "# test a", "# compensation off", then angle_deg,reading_mm.
void write_ballbar_csv(const std::string& path, const BallbarTrace& trace, bool compensated);

/// Reads such a file, or any CSV of two columns angle (deg), reading (mm) with or without a header; `name`
/// ("" if the file says it) is the test. std::runtime_error "file:line: what is wrong".
BallbarTrace read_ballbar_csv(const std::string& path, const std::string& name,
                              const std::vector<BallbarTest>& tests);

}  // namespace trn
