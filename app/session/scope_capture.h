#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "app/session/scope_record.h"
#include "app/session/scope_trigger.h"

namespace trn {

/// What a scope records.
struct ScopeWish {
  double seconds = 1;                   ///< from the trigger on; rolling: the last ones
  double before_s = 0;                  ///< the same, before the trigger
  std::optional<ScopeTrigger> trigger;  ///< none: from the first period on
  bool rolling = false;                 ///< never done: keeps the last `seconds`
};

/// Takes rows as they come and keeps those that are wished. Its memory is bounded.
class ScopeCapture {
 public:
  /// `columns`: machine, period and signals, without rows.
  ScopeCapture(const ScopeWish& wish, ScopeRecord columns);

  /// Rows in the order of time. `values`: one of each column, and behind them the trigger's signal where
  /// there is a trigger. `old`: from before the scope was started, so that it triggers nothing.
  void take(std::uint64_t period, const double* values, bool old);

  bool triggered() const { return record_.trigger_period.has_value(); }
  bool done() const;
  /// Complete when `done`; while it rolls, at any time.
  const ScopeRecord& record();

 private:
  std::uint64_t periods_of(double seconds) const;
  void forget_before(std::uint64_t period);

  ScopeWish wish_;
  ScopeRecord record_;
  std::optional<TriggerWatch> watch_;
};

}  // namespace trn
