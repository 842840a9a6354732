#include "sim/canopen/emulated_homing.h"

#include <cmath>
#include <limits>
#include <utility>

namespace trn {

namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

// In the drive's own directions: which switch (-1 and +1 the limit switches, 0 the home switch), the way of
// the search, the edge, the way across it, and whether a limit switch turns the search round. Methods 1 to 14
// go on to the index; 17 to 30 are the same without.
struct MethodRow {
  int which, search, edge, final;
  bool reverses;
};
constexpr MethodRow kMethods[] = {
    {-1, -1, +1, +1, false},  // 1: negative limit switch, index above
    {+1, +1, -1, -1, false},  // 2: positive limit switch, index below
    {0, +1, -1, -1, false},   // 3: positive home switch, index below its edge
    {0, +1, -1, +1, false},   // 4: index above it
    {0, -1, +1, +1, false},   // 5: negative home switch, index above its edge
    {0, -1, +1, -1, false},   // 6: index below it
    {0, +1, -1, -1, true},    // 7: home switch, lower edge, index below
    {0, +1, -1, +1, true},    // 8: lower edge, index above
    {0, +1, +1, -1, true},    // 9: upper edge, index below
    {0, +1, +1, +1, true},    // 10: upper edge, index above
    {0, -1, +1, +1, true},    // 11: as 7, seen from above
    {0, -1, +1, -1, true},    // 12
    {0, -1, -1, +1, true},    // 13
    {0, -1, -1, -1, true},    // 14
};

bool is_index_only(int method) { return method == 33 || method == 34; }
bool is_here(int method) { return method == 35 || method == 37; }

}  // namespace

bool EmulatedHoming::plan_of(int method, bool reverse, Plan& plan) {
  const int sign = reverse ? -1 : 1;
  plan = Plan{};
  if (is_here(method)) return true;
  plan.index = method <= 14 || is_index_only(method);
  if (is_index_only(method)) {
    plan.final = sign * (method == 33 ? -1 : 1);
    return true;
  }
  const int number = method >= 17 ? method - 16 : method;
  if (number < 1 || number > 14 || method == 15 || method == 16) return false;
  const MethodRow& row = kMethods[number - 1];
  const int which = sign * row.which;
  plan.which = which < 0 ? Which::kLow : which > 0 ? Which::kHigh : Which::kHome;
  plan.search = sign * row.search;
  plan.edge = sign * row.edge;
  plan.final = sign * row.final;
  plan.reverses = row.reverses;
  return true;
}

bool EmulatedHoming::knows(int method) {
  Plan plan;
  return plan_of(method, false, plan);
}

EmulatedHoming::Switches EmulatedHoming::at_home(int method, bool reverse, double home, double index_distance,
                                                 double width) {
  Switches out;
  Plan plan;
  plan_of(method, reverse, plan);
  const double edge = plan.index ? home - plan.final * index_distance : home;
  // Methods 3 to 6 have a switch that stays closed up to the end of the axis.
  const double other = plan.reverses ? width : kFar;
  out.home_low = plan.edge < 0 ? edge : edge - other;
  out.home_high = plan.edge < 0 ? edge + other : edge;
  out.index = home;
  return out;
}

void EmulatedHoming::begin(const Run& run, const Switches& switches, double place) {
  run_ = run;
  switches_ = switches;
  failed_ = turned_ = false;
  why_ = "";
  before_ = place;
  phase_ = Phase::kSearch;
  if (!plan_of(run.method, run.reverse, plan_)) {
    fail("there is no emulation of this homing method");
  } else if (is_here(run.method)) {
    home_ = place;
    phase_ = Phase::kStop;
  } else if (is_index_only(run.method)) {
    go_for_index(place);
  }
  way_ = plan_.search;
  was_closed_ = closed(place, false);
}

double EmulatedHoming::fail(const char* why) {
  failed_ = true;
  why_ = why;
  phase_ = Phase::kStop;
  return 0;
}

bool EmulatedHoming::closed(double place, bool home_dead) const {
  if (plan_.which == Which::kLow) return place < switches_.limit_low;
  if (plan_.which == Which::kHigh) return place > switches_.limit_high;
  return !home_dead && place > switches_.home_low && place < switches_.home_high;
}

double EmulatedHoming::edge_place() const {
  if (plan_.which == Which::kLow) return switches_.limit_low;
  if (plan_.which == Which::kHigh) return switches_.limit_high;
  return plan_.edge < 0 ? switches_.home_low : switches_.home_high;
}

// The first pulse beyond `from` on the way
double EmulatedHoming::next_index(double from) const {
  const double pitch = switches_.index_pitch;
  if (pitch <= 0) return switches_.index;
  const double turns = (from - switches_.index) / pitch;
  // A pulse right at the edge is not beyond it; a millionth of a turn is rounding.
  const double whole = plan_.final > 0 ? std::floor(turns + 1e-6) + 1 : std::ceil(turns - 1e-6) - 1;
  return switches_.index + whole * pitch;
}

void EmulatedHoming::go_for_index(double from) {
  home_ = next_index(from);
  phase_ = Phase::kIndex;
}

bool EmulatedHoming::beyond_limit(double place, int way) const {
  const Which limit = way < 0 ? Which::kLow : Which::kHigh;
  if (plan_.which == limit) return false;  // it is the switch that is looked for
  return way < 0 ? place < switches_.limit_low : place > switches_.limit_high;
}

double EmulatedHoming::search(double place, bool home_dead) {
  if (closed(place, home_dead)) {
    // Across the edge from inside or from outside: from outside the switch must be left first.
    phase_ = plan_.final == plan_.edge ? Phase::kEdge : Phase::kLeave;
    return 0;
  }
  if (!beyond_limit(place, way_)) return way_ * run_.fast;
  if (!plan_.reverses || std::exchange(turned_, true))
    return fail("the emulated axis came to a limit switch before it found the home switch");
  way_ = -way_;
  return way_ * run_.fast;
}

double EmulatedHoming::cross_edge(double place, bool now) {
  const bool onto = plan_.final != plan_.edge;  // the switch closes at the edge
  const bool crossed = was_closed_ != now && now == onto && (place - before_) * plan_.final > 0;
  if (!crossed) return plan_.final * run_.slow;
  home_ = edge_place();
  phase_ = Phase::kStop;
  if (plan_.index) go_for_index(edge_place());
  return plan_.final * run_.slow;
}

double EmulatedHoming::step(double place, bool home_dead) {
  const bool now = closed(place, home_dead);
  double speed = 0;
  switch (phase_) {
    case Phase::kIdle:
    case Phase::kStop:
      break;
    case Phase::kSearch:
      speed = search(place, home_dead);
      break;
    case Phase::kLeave:
      speed = plan_.edge * run_.fast;
      // On its own side: a narrow switch may have been overrun before.
      if (was_closed_ && !now && (place - before_) * plan_.edge > 0) phase_ = Phase::kEdge;
      break;
    case Phase::kEdge:
      speed = cross_edge(place, now);
      break;
    case Phase::kIndex:
      speed = plan_.final * run_.slow;
      if ((place - home_) * plan_.final >= 0) phase_ = Phase::kStop;
      break;
  }
  const bool goes_on = phase_ == Phase::kLeave || phase_ == Phase::kEdge || phase_ == Phase::kIndex;
  const int way = speed < 0 ? -1 : 1;
  if (goes_on && speed != 0 && beyond_limit(place, way) && (place - before_) * way > 0)
    return fail(phase_ == Phase::kIndex
                    ? "the emulated axis came to a limit switch before it found an index; 'start_mm' or "
                      "'start_deg' of [[drives.emulation.joint]] can let it start elsewhere"
                    : "the emulated axis came to a limit switch before it crossed the switch's edge");
  was_closed_ = now;
  before_ = place;
  return speed;
}

}  // namespace trn
