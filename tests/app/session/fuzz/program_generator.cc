#include "tests/app/session/fuzz/program_generator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/ports.h"
#include "core/units.h"
#include "tests/support/program_words.h"

namespace trn::fuzz {

namespace {

constexpr double kLinearReachMm = 120, kRotaryReachDeg = 700;
constexpr double kPlatformReachMm = 50, kPlatformReachDeg = 10;
constexpr double kRtcpReachMm = 40, kRtcpReachDeg = 50;
constexpr double kBlockLastsMaxS = 6;

bool rotary(int word) { return word >= kA; }

Words in_radians(Words words) {
  words.tail<3>() *= kRadPerDeg;
  return words;
}

}  // namespace

std::string Program::text() const {
  std::string out = "G21 G17 G40 G49 G90 G94\n";
  for (const Step& step : steps) out += step.text + "\n";
  return out + "M2\n";
}

ProgramGenerator::ProgramGenerator(const Assembly& assembly, const JointVec& q_start, std::uint64_t seed)
    : assembly_(assembly), rng_(seed), mask_(program_words(assembly)) {
  assembly.map->words_at(q_start, assembly.corrections.planned_off, start_);
  start_.tail<3>() /= kRadPerDeg;
}

bool ProgramGenerator::words_are_joints(const Assembly& assembly, const Words& words) {
  const unsigned mask = program_words(assembly);
  JointVec q0, q1;
  if (assembly.kinematics->joints_from_words(words, q0) != KinStatus::kOk) return false;
  for (int k = 0; k < 6; ++k) {
    if (!(mask >> k & 1)) continue;
    Words moved = words;
    moved[k] += 0.1;
    if (assembly.kinematics->joints_from_words(moved, q1) != KinStatus::kOk) return false;
    const JointVec step = (q1 - q0).cwiseAbs();
    if (std::abs(step.maxCoeff() - 0.1) > 1e-9 || std::abs(step.sum() - 0.1) > 1e-9) return false;
  }
  return true;
}

// How far each word may go: to the joints' limits where a word is a joint, else around the start.
void ProgramGenerator::find_ranges() {
  const bool direct = words_are_joints(assembly_, in_radians(start_));
  JointVec q0, q1;
  assembly_.kinematics->joints_from_words(in_radians(start_), q0);
  for (int k = 0; k < 6; ++k) {
    double reach = rotary(k) ? kPlatformReachDeg : kPlatformReachMm;
    if (direct) reach = rotary(k) ? kRotaryReachDeg : kLinearReachMm;
    if (rtcp_) reach = std::min(reach, rotary(k) ? kRtcpReachDeg : kRtcpReachMm);
    low_[k] = start_[k] - reach;
    high_[k] = start_[k] + reach;
    if (!direct || !(mask_ >> k & 1)) continue;
    Words moved = in_radians(start_);
    moved[k] += 0.1;
    assembly_.kinematics->joints_from_words(moved, q1);
    Eigen::Index joint = 0;
    (q1 - q0).cwiseAbs().maxCoeff(&joint);
    const JointLimit& limit = assembly_.plan_joints[static_cast<std::size_t>(joint)].limit;
    const double sense = q1[joint] > q0[joint] ? 1 : -1, unit = rotary(k) ? kRadPerDeg : 1;
    const double a = start_[k] + sense * (limit.min - q0[joint]) / unit;
    const double b = start_[k] + sense * (limit.max - q0[joint]) / unit;
    low_[k] = std::max(low_[k], std::min(a, b));
    high_[k] = std::min(high_[k], std::max(a, b));
  }
}

double ProgramGenerator::rounded(double value) const {
  const double scale = std::pow(10.0, digits_);
  return std::round(value * scale) / scale;
}

std::string ProgramGenerator::number(double value) const { return fmt::format("{:.{}f}", value, digits_); }

// Somewhere in the word's range; now and then at its end.
double ProgramGenerator::place(int word) {
  const double inset = 2 * std::pow(10.0, -digits_);
  if (chance(0.02)) return rounded(low_[word] + inset);
  if (chance(0.02)) return rounded(high_[word] - inset);
  return rounded(uniform(low_[word] + inset, high_[word] - inset));
}

void ProgramGenerator::setting(const std::string& text) {
  Step step;
  step.text = text;
  step.exact = text.rfind("G61", 0) == 0;
  add(step);
}

void ProgramGenerator::path_mode() {
  const int kind = below(10);
  if (kind == 0) return setting("G61");
  if (kind == 1) return setting("G61.1");
  if (kind == 2) return setting("G64");
  const double position_mm = std::min(log_uniform(0.0005, 0.5), assembly_.planner.tolerance_mm_max);
  if (kind == 3) return setting(fmt::format("G64 P{:.5f} R{:.4f}", position_mm, log_uniform(0.002, 1)));
  setting(fmt::format("G64 P{:.5f}", position_mm));
}

// Writes the feed: per minute, or as inverse time (then in every line).
void ProgramGenerator::finish_feed(Step& step, double length_mm, double turn_deg) {
  // A linear word may be written and not move: F then means degrees, so the longer of the two is bounded.
  const double way = std::max(length_mm, turn_deg);
  if (chance(0.12)) {
    const double feed = rounded(60 / log_uniform(0.02, 2));
    step.text = "G93 " + step.text + fmt::format(" F{:.{}f}", feed, digits_);
    step.time_s = 60 / feed;
    return;
  }
  double feed = chance(0.7) ? feed_typical_ : log_uniform(30, 60000);
  if (chance(0.04)) feed = log_uniform(0.1, 30);
  feed = std::max(feed, 60 * way / kBlockLastsMaxS);
  feed = std::max(0.001, std::round(1000 * feed) / 1000);
  step.feed = feed;
  step.text = "G94 " + step.text + fmt::format(" F{:.3f}", feed);
}

// A straight line to `target` (mm, deg) that writes these words.
void ProgramGenerator::move_to(const Words& target, unsigned words) {
  Step step;
  step.kind = chance(0.12) ? Step::Kind::kTraverse : Step::Kind::kFeed;
  step.incremental = chance(0.15);
  step.words = words & mask_;
  if (!step.words) return;
  step.text = step.incremental ? "G91" : "G90";
  step.text += step.kind == Step::Kind::kTraverse ? " G0" : " G1";
  Words delta = Words::Zero();
  for (int k = 0; k < 6; ++k) {
    if (!(step.words >> k & 1)) continue;
    step.value[k] = rounded(step.incremental ? target[k] - at_[k] : target[k]);
    delta[k] = step.incremental ? step.value[k] : step.value[k] - at_[k];
    step.text += fmt::format(" {}{}", kWordLetters[k], number(step.value[k]));
  }
  if (step.kind == Step::Kind::kFeed) finish_feed(step, delta.head<3>().norm(), delta.tail<3>().norm());
  before_ = at_;
  at_ += delta;
  add(step);
}

void ProgramGenerator::stroke() {
  Words target = at_;
  unsigned words = 0;
  for (int k = 0; k < 6; ++k)
    if (chance(rotary(k) ? 0.4 : 0.6)) {
      target[k] = place(k);
      words |= 1u << k;
    }
  if (chance(0.5))  // not far
    target = at_ + (target - at_) * log_uniform(1e-3, 1);
  move_to(target, words);
}

void ProgramGenerator::rotary_stroke() {
  Words target = at_;
  for (int k = kA; k <= kC; ++k) target[k] = at_[k] + (place(k) - at_[k]) * log_uniform(1e-5, 1);
  move_to(target, 7u << kA);
}

// What rounding leaves between two moves: much less than any tolerance.
void ProgramGenerator::residual() {
  for (int n = 1 + below(chance(0.3) ? 10 : 1); n > 0; --n) {
    Words target = at_;
    unsigned words = 0;
    for (int k = 0; k < 6; ++k) {
      if (!chance(0.35)) continue;
      const double size = chance(0.7) ? std::pow(10.0, -digits_) : log_uniform(1e-6, 2e-3);
      target[k] = std::clamp(at_[k] + (chance(0.5) ? size : -size), low_[k], high_[k]);
      words |= 1u << k;
    }
    move_to(target, words);
  }
}

void ProgramGenerator::back() { move_to(before_, mask_); }

// A pass of a surface as a CAM program writes it: short chords of a smooth curve, sometimes with noise.
void ProgramGenerator::pass() {
  const Words from = at_;
  Words amplitude, phase;
  for (int k = 0; k < 6; ++k) {
    const double room = std::min(from[k] - low_[k], high_[k] - from[k]);
    amplitude[k] = chance(0.6) ? std::min(room, rotary(k) ? uniform(0, 15) : uniform(0, 20)) / 2 : 0;
    phase[k] = uniform(0, 2 * kPi);
  }
  const double length = amplitude.head<3>().norm() * 2 + 0.5;
  const double chord = log_uniform(0.02, 2), noise = chance(0.3) ? log_uniform(1e-4, 5e-3) : 0;
  const double step = std::min(0.4, chord / length);
  double t = 0;
  for (int n = 5 + below(50); n > 0; --n) {
    t += step;
    Words target;
    for (int k = 0; k < 6; ++k)
      target[k] = std::clamp(from[k] + amplitude[k] * (std::sin(phase[k] + t) - std::sin(phase[k])) +
                                 (rotary(k) ? 0 : noise * uniform(-1, 1)),
                             low_[k], high_[k]);
    move_to(target, mask_);
  }
}

// plane: 0 XY, 1 ZX, 2 YZ. The centre lies at at_ + `centre` in it; `along` is the way across the plane, mm.
void ProgramGenerator::put_arc(const Vec3& centre, double sweep_rad, int plane, double along) {
  static constexpr int kFirst[] = {kX, kZ, kY}, kSecond[] = {kY, kX, kZ}, kAcross[] = {kZ, kY, kX};
  static constexpr const char* kPlane[] = {"G17", "G18", "G19"};
  const int first = kFirst[plane], second = kSecond[plane], across = kAcross[plane];
  const double i = rounded(centre[0]), j = rounded(centre[1]), c = std::cos(sweep_rad),
               s = std::sin(sweep_rad);
  Step step;
  step.kind = Step::Kind::kArc;
  step.radius_mm = std::hypot(i, j);
  step.sweep_rad = sweep_rad;
  step.across = across;
  if (step.radius_mm == 0) return;
  step.value[first] = rounded(at_[first] + i - (c * i - s * j));
  step.value[second] = rounded(at_[second] + j - (s * i + c * j));
  step.value[across] = rounded(at_[across] + along);
  step.words = 7;
  for (int k = 0; k < 3; ++k)
    if (step.value[k] < low_[k] || step.value[k] > high_[k]) return;
  if (step.value[first] == rounded(at_[first]) && step.value[second] == rounded(at_[second]))
    step.sweep_rad = 2 * kPi;
  step.text = fmt::format("{} G90 {} X{} Y{} Z{} {}{} {}{}", kPlane[plane], sweep_rad > 0 ? "G3" : "G2",
                          number(step.value[0]), number(step.value[1]), number(step.value[2]), "IKJ"[plane],
                          number(i), "JIK"[plane], number(j));
  finish_feed(step, std::hypot(std::abs(step.sweep_rad) * step.radius_mm, along), 0);
  before_ = at_;
  at_.head<3>() = step.value.head<3>();
  add(step);
}

void ProgramGenerator::arc() {
  const double radius = log_uniform(chance(0.2) ? 1e-4 : 0.05, 40), angle = uniform(0, 2 * kPi);
  const double sweep = (chance(0.1) ? 2 * kPi : log_uniform(0.01, 6)) * (chance(0.5) ? 1 : -1);
  put_arc(radius * Vec3(std::cos(angle), std::sin(angle), 0), sweep, chance(0.7) ? 0 : below(3),
          chance(0.4) ? uniform(-2, 2) : 0);
}

// Arcs that go on in the direction in which the one before ended, with other radii.
void ProgramGenerator::tangent_arcs() {
  double heading = uniform(0, 2 * kPi);
  for (int n = 2 + below(5); n > 0; --n) {
    const double turn = chance(0.5) ? 1 : -1, radius = log_uniform(0.2, 15), sweep = uniform(0.2, 3);
    const double to_centre = heading + turn * kPi / 2;
    put_arc(radius * Vec3(std::cos(to_centre), std::sin(to_centre), 0), turn * sweep, 0, 0);
    heading += turn * sweep;
  }
}

// A short way with a feed of a hundredth or less between two fast ones.
void ProgramGenerator::slow_block() {
  const unsigned words = mask_ & 7u;
  Words direction = Words::Zero();
  for (int k = 0; k < 3; ++k) direction[k] = uniform(-1, 1);
  direction.normalize();
  const double way = log_uniform(0.001, 0.3), sides = uniform(1, 10);
  for (const double length : {sides, way, sides}) {
    const Words target = (at_ + length * direction).cwiseMax(low_).cwiseMin(high_);
    const std::size_t count = program_.steps.size();
    feed_typical_ = length == way ? log_uniform(1, 40) : log_uniform(2000, 10000);
    move_to(target, words);
    if (program_.steps.size() == count) return;
  }
  feed_typical_ = log_uniform(200, 12000);
}

// What a job needs beside moves: tools, offsets, cycles, outputs.
void ProgramGenerator::shop_floor() {
  program_.plain = false;
  Step step;
  step.kind = Step::Kind::kOther;
  const auto at = [&](int k) { return number(std::clamp(start_[k] + uniform(-15, 15), low_[k], high_[k])); };
  switch (below(12)) {
    case 0:
      step.text = fmt::format("T{} M6", 1 + below(3));
      break;
    case 1:
      step.text = fmt::format("G43 H{}", 1 + below(3));
      break;
    case 2:
      step.text = "G49";
      break;
    case 3:
      step.text = fmt::format("G92 X{} Y{}", at(0), at(1));
      break;
    case 4:
      step.text = "G92.1";
      break;
    case 5:
      step.text = fmt::format("G10 L2 P{} X{:.3f} Y{:.3f} R{:.2f}", 1 + below(3), uniform(-4, 4),
                              uniform(-4, 4), chance(0.3) ? uniform(-20, 20) : 0.0);
      break;
    case 6:
      step.text = fmt::format("G{}", 54 + below(3));
      break;
    case 7:
      step.text = fmt::format("M3 S{}\nM{} P{}", 500 + below(2000), 48 + below(2), 0);
      break;
    case 8:
      step.text = fmt::format("G90 G94 G17 G{} X{} Y{} Z{:.3f} R{:.3f} F{}\nG80", chance(0.5) ? 81 : 82,
                              at(0), at(1), start_[2] - 3, start_[2] + 2, 300 + below(3000));
      break;
    case 9:
      step.text = fmt::format("G90 G94 G17 G83 X{} Y{} Z{:.3f} R{:.3f} Q{:.2f} L{} F{}\nG80", at(0), at(1),
                              start_[2] - 3, start_[2] + 2, uniform(0.4, 3), 1 + below(2), 800);
      break;
    case 10:
      step.text = fmt::format("G90 G53 G0 X{} Y{}", at(0), at(1));
      break;
    default:
      step.text = fmt::format("G52 X{:.2f} Y{:.2f}", uniform(-3, 3), uniform(-3, 3));
      break;
  }
  if (step.text.rfind("M3", 0) == 0) step.text = step.text.substr(0, step.text.rfind(" P"));
  add(step);
}

Program ProgramGenerator::make() {
  program_ = {};
  at_ = before_ = start_;
  rtcp_ = (mask_ >> kA) && chance(0.3);
  digits_ = chance(0.7) ? 4 : 3 + below(4);
  feed_typical_ = log_uniform(200, 12000);
  find_ranges();
  if (chance(0.8)) path_mode();
  if (rtcp_) {
    setting("M428");
    program_.steps.back().rtcp_on = true;
  }
  const bool shop = chance(0.2);
  for (int n = 3 + below(22); n > 0; --n) {
    switch (below(shop ? 24 : 20)) {
      case 0:
        path_mode();
        break;
      case 1:
      case 2:
        residual();
        break;
      case 3:
        rotary_stroke();
        break;
      case 4:
        back();
        break;
      case 5:
      case 6:
        pass();
        break;
      case 7:
      case 8:
      case 9:
        arc();
        break;
      case 10:
        tangent_arcs();
        break;
      case 11:
        slow_block();
        break;
      case 12: {
        Step dwell;
        dwell.kind = Step::Kind::kDwell;
        dwell.time_s = 0.01 * (1 + below(10));
        dwell.text = fmt::format("G4 P{:.2f}", dwell.time_s);
        add(dwell);
        break;
      }
      case 20:
      case 21:
      case 22:
      case 23:
        shop_floor();
        break;
      default:
        stroke();
        break;
    }
  }
  return program_;
}

}  // namespace trn::fuzz
