#include "app/session/word_directions.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

namespace trn {

namespace {

constexpr double kStep = 1e-3;  // mm, rad
constexpr double kSeen = 0.05;  // of a unit: less of a motion is not worth a word
constexpr double kAlong = 0.9;  // of a unit: along an axis

struct Stand {
  JointVec q;
  Pose X_BS;
};

std::optional<Stand> place_of_words(const Kinematics& kinematics, const Words& words) {
  Stand out;
  if (kinematics.joints_from_words(words, out.q) != KinStatus::kOk) return std::nullopt;
  if (kinematics.forward(out.q, out.X_BS) != KinStatus::kOk) return std::nullopt;
  return out;
}

// The vector of a small rotation: half of what R differs from its transpose.
Vec3 small_turn(const Mat3& R) { return 0.5 * Vec3(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)); }

std::string axis_text(const Vec3& v) {
  std::string out;
  for (int i = 0; i < 3; ++i)
    if (std::abs(v[i]) > kSeen)
      out += fmt::format("{}{}{}", out.empty() ? "" : " and ", v[i] > 0 ? "+" : "-", "XYZ"[i]);
  return out.empty() ? "nowhere" : out;
}

}  // namespace

bool WordDirection::as_iso_841() const {
  if (!known) return true;
  return word <= kZ ? tip[word] > kAlong : turn[word - kA] > kAlong;
}

std::vector<WordDirection> word_directions(const Kinematics& kinematics, const Words& from) {
  std::vector<WordDirection> out;
  const Mat3 R_MB = kinematics.home_X_BM().R.transpose();
  const auto before = place_of_words(kinematics, from);
  for (int word = kX; word <= kC; ++word) {
    if (!(kinematics.word_mask() >> word & 1u)) continue;
    WordDirection direction;
    direction.word = word;
    Words there = from;
    there[word] += kStep;
    const auto after = place_of_words(kinematics, there);
    direction.known = before && after;
    if (direction.known) {
      direction.joints = (after->q - before->q) / kStep;
      direction.tip = R_MB * (after->X_BS.p - before->X_BS.p) / kStep;
      direction.turn = R_MB * small_turn(after->X_BS.R * before->X_BS.R.transpose()) / kStep;
    }
    out.push_back(direction);
  }
  return out;
}

std::string describe(const WordDirection& direction, const Machine& machine) {
  if (!direction.known) return "the machine cannot go there";
  std::string joints;
  for (Eigen::Index i = 0; i < direction.joints.size(); ++i)
    if (std::abs(direction.joints[i]) > kSeen)
      joints += fmt::format("{}{}{}", joints.empty() ? "" : ", ", direction.joints[i] > 0 ? "+" : "-",
                            machine.joints[static_cast<std::size_t>(i)].name);
  const std::string what =
      direction.word <= kZ ? fmt::format("the tool goes towards {} of the work", axis_text(direction.tip))
                           : fmt::format("the tool turns about {} of the work", axis_text(direction.turn));
  return fmt::format("{} (joint {})", what, joints.empty() ? "none" : joints);
}

}  // namespace trn
