#include "app/lab/ballbar_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "app/lab/measuring_run.h"
#include "app/lab/text_file.h"
#include "core/axes.h"
#include "core/plain_file.h"
#include "core/units.h"
#include "kernel/rt_messages.h"

namespace trn {

namespace {

constexpr double kFeedMmMin = 500, kRadiusMm = 100;

/// Reads the bar at every setpoint while the test's axis turns.
class BarReader final : public ReportSink {
 public:
  BarReader(const Assembly& assembly, const ActualChain& truth, const BallbarTest& test,
            const BallbarInstrument& instrument)
      : assembly_(assembly), truth_(truth), instrument_(instrument), random_(instrument.seed) {
    trace_.test = test;
    next_ = std::min(test.from_rad, test.to_rad);
  }
  void write(const CycleReport& report) override {
    if (!report.on_path || report.motion != MotionState::kMoving || !turning(report)) return;
    const double angle = angle_of(report);
    const BallbarTest& test = trace_.test;
    const double low = std::min(test.from_rad, test.to_rad), high = std::max(test.from_rad, test.to_rad);
    if (angle < low - kRounding || angle > high + test.step_rad / 20)
      return;  // the first one behind the end counts
    if (!instrument_.every_period && angle < next_ - kRounding) return;
    while (next_ <= angle + kRounding) next_ += test.step_rad;
    trace_.readings.push_back(
        {angle, measured(ballbar_reading(truth_, test, instrument_.setup, report.q_setpoint))});
  }
  BallbarTrace take() { return std::move(trace_); }

 private:
  // The second line of motion is the one that turns under feed.
  static bool turning(const CycleReport& report) { return report.line >= kFeedLine; }
  double angle_of(const CycleReport& report) const {
    JointVec q;
    assembly_.kinematics->joints_from_words(report.y, q);
    return q[trace_.test.joint];
  }
  double measured(double reading) {
    if (instrument_.noise_mm > 0) reading += instrument_.noise_mm * normal_(random_);
    const double r = instrument_.resolution_mm;
    return r > 0 ? r * std::round(reading / r) : reading;
  }

  static constexpr double kRounding = 1e-9;
  static constexpr std::uint32_t kFeedLine = 5;
  const Assembly& assembly_;
  const ActualChain& truth_;
  const BallbarInstrument& instrument_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  BallbarTrace trace_;
  double next_ = 0;
};

bool parse_pair(std::string_view text, double& a, double& b) {
  const std::size_t comma = text.find_first_of(",;\t");
  if (comma == std::string_view::npos) return false;
  const auto number = [](std::string_view t, double& out) {
    while (!t.empty() && t.front() == ' ') t.remove_prefix(1);
    while (!t.empty() && (t.back() == ' ' || t.back() == '\r')) t.remove_suffix(1);
    const auto [end, error] = std::from_chars(t.data(), t.data() + t.size(), out);
    return error == std::errc() && end == t.data() + t.size() && std::isfinite(out);
  };
  return number(text.substr(0, comma), a) && number(text.substr(comma + 1), b);
}

const BallbarTest* find_test(const std::vector<BallbarTest>& tests, const std::string& name) {
  const auto found = std::find_if(tests.begin(), tests.end(), [&](const auto& t) { return t.name == name; });
  return found == tests.end() ? nullptr : &*found;
}

}  // namespace

std::string ballbar_program(const Assembly& assembly, const BallbarTest& test) {
  const auto words_at = [&](double angle) {
    Words words;
    assembly.kinematics->words_from_joints(ballbar_joints(read_chain(assembly.machine), test, angle), words);
    return words;
  };
  const double low = std::min(test.from_rad, test.to_rad) - test.overrun_rad;
  const double high = std::max(test.from_rad, test.to_rad) + test.overrun_rad;
  const Words from = words_at(low), to = words_at(high);
  int word = kA;
  while (word < kC && from[word] == to[word]) ++word;
  const char letter = kWordLetters[word];
  std::string out = fmt::format("(ball bar, test {}: ball at {:g} {:g} {:g} on the table, bar {:g} mm)\n",
                                test.name, test.ball_B.x(), test.ball_B.y(), test.ball_B.z(), test.bar_mm);
  out += "G21 G90 G94 G61 G49 G54\n";
  out += fmt::format("G0 X{:.9f} Y{:.9f} Z{:.9f}\n", from[kX], from[kY], from[kZ]);
  // Every rotary word: where the machine stands need not be a round number with corrections on.
  out += "G0";
  for (int k = kA; k <= kC; ++k)
    if (assembly.kinematics->word_mask() >> k & 1u)
      out += fmt::format(" {}{:.9f}", kWordLetters[k], from[k] * kDegPerRad);
  out += "\n";
  out += fmt::format("G1 {}{:.9f} F{:.4f}\n", letter, to[word] * kDegPerRad,
                     kFeedMmMin / kRadiusMm * kDegPerRad);
  return out + "M2\n";
}

BallbarTrace run_ballbar(Assembly& assembly, const ActualChain& truth, const BallbarTest& test,
                         const BallbarInstrument& instrument, const std::string& program_path) {
  write_text_file(program_path, ballbar_program(assembly, test));
  BarReader reader(assembly, truth, test, instrument);
  run_measurement(assembly, program_path, reader, "test " + test.name);
  return reader.take();
}

void write_ballbar_csv(const std::string& path, const BallbarTrace& trace, bool compensated) {
  std::string text = fmt::format("# test {}\n# compensation {}\nangle_deg,reading_mm\n", trace.test.name,
                                 compensated ? "on" : "off");
  for (const BallbarReading& r : trace.readings)
    text += fmt::format("{:.12g},{:.12g}\n", r.angle_rad * kDegPerRad, r.reading_mm);
  write_text_file(path, text);
}

BallbarTrace read_ballbar_csv(const std::string& path, const std::string& name,
                              const std::vector<BallbarTest>& tests) {
  std::istringstream in(read_named_file(path));
  std::string text, test_name = name;
  BallbarTrace trace;
  for (int line = 1; std::getline(in, text); ++line) {
    if (text.rfind("# test ", 0) == 0 && name.empty()) test_name = text.substr(7);
    if (text.rfind("# compensation on", 0) == 0)
      throw std::runtime_error(
          fmt::format("{}:{}: taken with compensation on; identify needs it off", path, line));
    if (text.empty() || text[0] == '#' || text == "\r") continue;
    BallbarReading r;
    if (parse_pair(text, r.angle_rad, r.reading_mm)) {
      r.angle_rad *= kRadPerDeg;
      trace.readings.push_back(r);
    } else if (!trace.readings.empty() || line > 10) {
      throw std::runtime_error(fmt::format("{}:{}: expected angle (deg), reading (mm)", path, line));
    }
  }
  while (!test_name.empty() && (test_name.back() == '\r' || test_name.back() == ' ')) test_name.pop_back();
  const BallbarTest* test = find_test(tests, test_name);
  if (!test) {
    std::string names;
    for (const BallbarTest& t : tests) names += " " + t.name;
    throw std::runtime_error(
        fmt::format("{}: which test is this? Give it as NAME={} with NAME one of{}", path, path, names));
  }
  trace.test = *test;
  return trace;
}

}  // namespace trn
