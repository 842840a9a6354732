#pragma once

#include <optional>
#include <string>

namespace trn {

/// What a scope waits for.
struct ScopeTrigger {
  enum class Kind : unsigned char {
    kRising,   ///< the signal goes from below the level to it or above
    kFalling,  ///< from above to it or below
    kAbove,    ///< it is above
    kBelow,    ///< it is below
    kLine      ///< the motion comes to a source line
  };
  Kind kind = Kind::kRising;
  std::string signal;
  double level = 0;
};

/// "rising X.velocity 100", "falling", "above", "below", "fault", "line 120". std::invalid_argument that says
/// what would be right.
ScopeTrigger parse_trigger(const std::string& text);

/// Watches the trigger's signal, period by period.
class TriggerWatch {
 public:
  explicit TriggerWatch(const ScopeTrigger& trigger) : trigger_(trigger) {}
  /// True in the period in which the trigger fires.
  bool fires(double value);

 private:
  ScopeTrigger trigger_;
  std::optional<double> before_;
};

}  // namespace trn
