#include "app/lab/joint_measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "app/lab/measuring_run.h"
#include "app/lab/text_file.h"
#include "app/session/corrections.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/units.h"
#include "kernel/rt_messages.h"

namespace trn {

namespace {

constexpr double kDwell_s = 1, kReadAfter_s = 0.9, kOverrun = 2, kJointFeedMmMin = 6000;
constexpr double kMoved = 0.1;  // mm or rad: less is standing still

/// Reads every joint near the end of every dwell.
class ScaleReader final : public ReportSink {
 public:
  ScaleReader(const Assembly& assembly, const std::vector<JointTable>& truth,
              const JointMeasureConfig& config)
      : assembly_(assembly), truth_(truth), config_(config), random_(config.seed) {
    readings_.resize(assembly.machine.joints.size());
    direction_.assign(readings_.size(), 1);
  }
  void write(const CycleReport& report) override {
    if (!report.on_path) return;
    follow(report.q_setpoint);
    if (report.event.kind == QueueEvent::Kind::kDwell)
      periods_left_ = std::lround(kReadAfter_s / assembly_.machine.period_s);
    else if (periods_left_ > 0 && --periods_left_ == 0)
      read(report);
  }
  JointMeasurements take() { return std::move(readings_); }

 private:
  void follow(const JointVec& q) {
    for (Eigen::Index i = 0; i < q.size() && last_.size() > 0; ++i)
      if (std::abs(q[i] - last_[i]) > 1e-6)
        direction_[static_cast<std::size_t>(i)] = q[i] > last_[i] ? 1 : -1;
    last_ = q;
  }
  void read(const CycleReport& report) {
    MapContext nominal = report.context;
    nominal.corrections_off = kPlannedBits;
    JointVec wanted, actual = report.q_setpoint;
    if (assembly_.map->map(report.y, nominal, wanted) != KinStatus::kOk) return;
    JointTables(truth_).undo(actual);
    for (const JointTable& table : truth_)
      actual[table.joint] -=
          direction_[static_cast<std::size_t>(table.joint)] * table.gap(actual[table.joint]);
    for (std::size_t i = 0; i < readings_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      readings_[i].push_back({wanted[k], measured(actual[k])});
    }
  }
  double measured(double value) {
    if (config_.noise > 0) value += config_.noise * normal_(random_);
    return config_.resolution > 0 ? config_.resolution * std::round(value / config_.resolution) : value;
  }

  const Assembly& assembly_;
  const std::vector<JointTable>& truth_;
  const JointMeasureConfig& config_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  JointMeasurements readings_;
  std::vector<int> direction_;
  JointVec last_;
  long periods_left_ = 0;
};

std::string measuring_program(const JointMeasureConfig& config) {
  const double unit = config.word < kA ? 1 : kDegPerRad;
  const char letter = kWordLetters[config.word];
  const double step = (config.to - config.from) / (config.places - 1) * unit;
  const double overrun = std::min(kOverrun, std::abs(step)) * (step > 0 ? 1 : -1);
  std::string out = fmt::format("G21 G90 G94 G61 G49 G54\nF{:g}\n", kJointFeedMmMin);
  const auto stand = [&](double at) { out += fmt::format("G1 {}{:.9f}\nG4 P{:g}\n", letter, at, kDwell_s); };
  for (int pass = 0; pass < config.passes; ++pass) {
    out += fmt::format("G1 {}{:.9f}\n", letter, config.from * unit - overrun);
    for (int i = 0; i < config.places; ++i) stand(config.from * unit + i * step);
    out += fmt::format("G1 {}{:.9f}\n", letter, config.to * unit + overrun);
    for (int i = config.places - 1; i >= 0; --i) stand(config.from * unit + i * step);
  }
  return out + "M2\n";
}

bool reachable(const Assembly& assembly, const Words& words) {
  JointVec q;
  if (assembly.map->map(words, {}, q) != KinStatus::kOk) return false;
  for (std::size_t i = 0; i < assembly.plan_joints.size(); ++i) {
    const JointLimit& limit = assembly.plan_joints[i].limit;
    const double value = q[static_cast<Eigen::Index>(i)];
    if (value < limit.min || value > limit.max) return false;
  }
  return true;
}

void drop_resting(JointMeasurements& measurements) {
  for (auto& joint : measurements) {
    const auto [low, high] = std::minmax_element(
        joint.begin(), joint.end(), [](const auto& a, const auto& b) { return a.commanded < b.commanded; });
    if (joint.empty() || high->commanded - low->commanded < kMoved) joint.clear();
  }
}

}  // namespace

std::pair<double, double> word_range(Assembly& assembly, int word) {
  Words start;
  if (assembly.map->words_at(standing_joints(assembly), 0, start) != KinStatus::kOk)
    throw std::runtime_error("the machine stands where its position has no axis words");
  const double step = word < kA ? 1 : kRadPerDeg;
  constexpr int kStepsMax = 3000, kMargin = 10;
  int ends[2] = {0, 0};
  for (const int side : {0, 1})
    for (int i = 1; i < kStepsMax; ++i) {
      Words words = start;
      words[word] += (side ? i : -i) * step;
      if (!reachable(assembly, words)) break;
      ends[side] = i;
    }
  return {start[word] - std::max(0, ends[0] - kMargin) * step,
          start[word] + std::max(0, ends[1] - kMargin) * step};
}

JointMeasurements measure_joints(Assembly& assembly, const std::vector<JointTable>& truth,
                                 const JointMeasureConfig& config, bool corrected,
                                 const std::string& program_path) {
  write_text_file(program_path, measuring_program(config));
  Corrections& corrections = assembly.corrections;
  const int off = corrections.planned_off;
  corrections.planned_off =
      static_cast<std::uint8_t>(corrected ? off & ~kJointTableBit : off | kJointTableBit);
  for (int i = 0; i < corrections.setpoint->size(); ++i)
    if (corrections.setpoint->budget(i).bit == kJointTableBit) corrections.setpoint->enable(i, corrected);
  ProgramStart start{program_path, std::nullopt, standing_joints(assembly)};
  start.switches.corrections_off = corrections.planned_off;
  check_program(assembly, {}, {}, start, {});
  ScaleReader reader(assembly, truth, config);
  run_measurement(assembly, program_path, reader, program_path);
  JointMeasurements measurements = reader.take();
  drop_resting(measurements);
  return measurements;
}

double error_amplitude(const std::vector<AxisMeasurement>& measured) {
  double mean = 0, worst = 0;
  for (const AxisMeasurement& m : measured)
    mean += (m.actual - m.commanded) / static_cast<double>(measured.size());
  for (const AxisMeasurement& m : measured) worst = std::max(worst, std::abs(m.actual - m.commanded - mean));
  return worst;
}

}  // namespace trn
