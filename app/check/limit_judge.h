#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "app/check/trace_reader.h"
#include "core/axes.h"
#include "core/differencer.h"

namespace trn {

/// What a joint is judged for.
enum class Quantity : unsigned char { kPosition = 0, kVelocity, kAcceleration, kJerk };
inline constexpr std::size_t kQuantityCount = 4;
const char* to_string(Quantity quantity);

/// The largest value of one quantity of one joint against its limit.
struct Peak {
  double value = 0;  ///< signed; mm or rad, per s, s2, s3
  double ratio = 0;  ///< |value| / limit; position: distance from the middle / half range, or / that of the
                     ///< start outside
  double t_s = 0;    ///< of the row that completes the difference
  std::uint32_t line = 0;       ///< source line of that row
  std::uint64_t over = 0;       ///< rows with a ratio over LimitJudge::kRatioMax
  double resolution_ratio = 0;  ///< what rounding of the recorded digits alone can add to `ratio`
};

struct JointVerdict {
  std::array<Peak, kQuantityCount> peaks;
  const Peak& peak(Quantity quantity) const { return peaks[static_cast<std::size_t>(quantity)]; }
};

/// Judges a setpoint stream against the limits of the joints, from the sampled positions alone: position, and
/// first, second and third backward differences over the step. A difference is a weighted mean of the
/// derivative over its rows, so a stream within limits never shows a ratio over 1 but for rounding. Before
/// the first and after the last row the joints are at rest: a stream that starts or ends with a jump is
/// caught.
/// A joint that is outside its range where a piece begins may stay there and come in; its place counts
/// against the farthest that it may be, and a row farther out is over.
///
/// Nothing is subtracted for rounding. `resolution_ratio` says what rounding can do: half a unit in the last
/// place (the double's own, or that of the digits written) in each row, with the weights 1 1, 1 2 1, 1 3 3 1.
class LimitJudge {
 public:
  static constexpr double kRatioMax = 1.000001;

  /// step_s: time between rows.
  LimitJudge(const Joints& joints, double step_s);

  void row(const TraceRow& row);
  /// The next row begins a new piece, at rest where it is: in between the drives had no power.
  void next_piece() { fresh_ = true; }

  /// Judges the stand-still after the last row, and the resolution.
  void finish();

  bool within_limits() const;
  const std::vector<JointVerdict>& verdicts() const { return verdicts_; }
  std::uint64_t rows() const { return rows_; }

 private:
  struct History {
    Differencer q;
    double q_abs_max = 0;
    double farthest = 1;  ///< ratio of a place that it may have
  };
  double rounding(std::size_t joint) const;
  void judge(std::size_t joint, double q, double t_s, std::uint32_t line);
  void offer(std::size_t joint, Quantity quantity, double value, double ratio, double t_s,
             std::uint32_t line);

  Joints joints_;
  double step_s_;
  std::vector<History> history_;
  std::vector<JointVerdict> verdicts_;
  std::uint64_t rows_ = 0;
  bool fresh_ = true;  ///< no row of this piece yet
  double t_last_s_ = 0;
  std::uint32_t line_last_ = 0;
  WrittenDigits digits_max_;
};

}  // namespace trn
