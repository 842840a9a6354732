#include "app/check/deviation_meter.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kRoundingMm = 1e-6;  // what exact means
constexpr double kRoundingDeg = 1e-5;
constexpr double kNothingMm = 1e-10;  // smaller deviations need no better place
constexpr double kNothingDeg = 1e-8;
constexpr double kJumpMm = 1e-9;
constexpr double kLostMm = 1.0;  // beyond the tolerance
constexpr std::size_t kMovesMax = 65536;
constexpr std::size_t kMovesOfWindow = 4096;  // such as turn about the tool itself have no length

// The length of path that is searched, of the tip's way and of the axis', whichever ends first. A smooth
// motion may cut a spike of the path that is many tolerances deep.
constexpr double kWindowMm = 0.1, kWindowDeg = 0.1;
constexpr double kWindowTolerances = 50;
constexpr double kWindowSteps = 8;
constexpr double kBehindTolerances = 2;
constexpr double kMuchWorse = 2;  // than the best, out of tolerance

void count(DeviationHistogram& histogram, double share) {
  // The last bin takes all that is out of tolerance.
  const double bin = std::min(share * (DeviationHistogram().size() - 1), DeviationHistogram().size() - 1.0);
  ++histogram[static_cast<std::size_t>(bin)];
}

void keep_worst(WorstDeviation& worst, double value, std::uint32_t line) {
  if (value > worst.value) worst = {value, line};
}

}  // namespace

void DeviationMeter::programmed(const ProgramMove& move) {
  Entry entry{ProgrammedLeg(move, kinematics_), move.context};
  if (!entry.leg.moves()) return;
  const Vec3 start = move.from.head<3>();
  entry.new_context = !legs_.empty() && !(move.context == legs_.back().context);
  // Between two programs, or where the operator has jogged, the next move begins elsewhere. The motion in
  // between belongs to neither.
  entry.jump_before = !legs_.empty() && (start - legs_.back().leg.end()).norm() > kJumpMm;
  legs_.push_back(std::move(entry));
  if (legs_.size() <= kMovesMax) return;
  legs_.pop_front();
  if (here_ > 0)
    --here_;
  else
    share_ = 0;
}

void DeviationMeter::enter(const MapContext& context) {
  std::size_t at = here_;
  while (at < legs_.size() && !(legs_[at].context == context)) ++at;
  if (at == here_ || at == legs_.size()) return;
  legs_.erase(legs_.begin(), legs_.begin() + static_cast<std::ptrdiff_t>(at));
  legs_.front().new_context = false;
  here_ = 0;
  share_ = 0;
  sampled_ = false;
}

DeviationMeter::Window DeviationMeter::tolerance_ahead() const {
  Window out;
  // For the length of the search the looser one of two neighbours counts, since a blend between them may use
  // its tolerance.
  for (std::size_t i = here_; i < std::min(here_ + 2, legs_.size()); ++i)
    out = {std::max(out.tip_mm, legs_[i].leg.tolerance_mm()),
           std::max(out.axis_deg, legs_[i].leg.tolerance_deg())};
  return out;
}

void DeviationMeter::sample(const Vec3& p, const Vec3& u, std::uint32_t line, const Left& left) {
  if (legs_.empty()) return;
  ++report_.samples;
  const double step_mm = sampled_ ? (p - p_last_).norm() : 0;
  const double step_deg = sampled_ ? angle_deg(u, u_last_) : 0;
  sampled_ = true;
  p_last_ = p;
  u_last_ = u;
  left_ = left;
  const Window tolerance = tolerance_ahead();
  search(p, u,
         {kWindowMm + kWindowSteps * step_mm + kWindowTolerances * (tolerance.tip_mm + left.tip_mm),
          kWindowDeg + kWindowSteps * step_deg + kWindowTolerances * (tolerance.axis_deg + left.axis_deg)});
  const std::size_t ahead = candidates_.size();
  TRN_CHECK(!candidates_.empty());
  // A corner that is cut may bring the tip nearest to a place just behind the earliest allowed one, as
  // rounding has set it. So the search goes back by two tolerances, for the figures only.
  if (!settled_) search_behind(p, u, {tolerance.tip_mm + kRoundingMm, tolerance.axis_deg + kRoundingDeg});
  record(line, left);
  // The place moves on by what lies ahead. Going back would let it wander.
  candidates_.resize(ahead, Candidate());
  const double nearest_mm =
      std::min_element(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
        return a.tip_mm < b.tip_mm;
      })->tip_mm;
  if (nearest_mm > tolerance.tip_mm + kLostMm) {
    ++report_.lost;
    find_anew(p, u);
  }
  advance();
}

void DeviationMeter::search(const Vec3& p, const Vec3& u, Window left) {
  candidates_.clear();
  settled_ = false;
  for (std::size_t i = here_; i < std::min(legs_.size(), here_ + kMovesOfWindow); ++i) {
    if (i > here_ && (legs_[i].new_context || (legs_[i].jump_before && !legs_[i - 1].end_reached))) return;
    note_end(i, p, u);
    const ProgrammedLeg& leg = legs_[i].leg;
    const double from = i == here_ ? share_ : 0;
    double to = leg.tip_length_mm() > 0 ? std::min(1.0, from + left.tip_mm / leg.tip_length_mm()) : 1;
    to = std::min(to, from + leg.shares_at_once());
    const std::size_t before = candidates_.size();
    search_entry(i, p, u, from, to);
    for (std::size_t k = before; k < candidates_.size() && !settled_; ++k) settled_ = settled(candidates_[k]);
    if (settled_) return;
    left.tip_mm -= (to - from) * leg.tip_length_mm();
    left.axis_deg -= (to - from) * leg.axis_way_deg();
    if (to < 1 || left.tip_mm <= 0 || left.axis_deg <= 0) return;
  }
}

// Where the path was `left` before the earliest allowed place: of the tip's way, or of the axis' where the
// tip rests.
DeviationMeter::Place DeviationMeter::behind(Window left) const {
  Place place{here_, share_};
  for (std::size_t k = 0; k < kMovesOfWindow; ++k) {
    const ProgrammedLeg& leg = legs_[place.entry].leg;
    const bool tip_moves = leg.tip_length_mm() > 0;
    double& budget = tip_moves ? left.tip_mm : left.axis_deg;
    const double way = tip_moves ? leg.tip_length_mm() : leg.axis_way_deg();
    const double shares = way > 0 ? std::min(place.share, budget / way) : place.share;
    budget -= shares * way;
    if (shares < place.share) return {place.entry, place.share - shares};
    const bool first = place.entry == 0 || legs_[place.entry].new_context || legs_[place.entry].jump_before;
    if (first) return {place.entry, 0};
    place = {place.entry - 1, 1};
  }
  return place;
}

void DeviationMeter::search_behind(const Vec3& p, const Vec3& u, Window left) {
  const Place from = behind({kBehindTolerances * left.tip_mm, kBehindTolerances * left.axis_deg});
  for (std::size_t i = from.entry; i <= here_; ++i) {
    const double begin = i == from.entry ? from.share : 0, end = i == here_ ? share_ : 1;
    if (begin < end) search_entry(i, p, u, begin, end);
  }
}

void DeviationMeter::search_entry(std::size_t index, const Vec3& p, const Vec3& u, double from, double to) {
  places_.clear();
  legs_[index].leg.nearest(p, from, to, places_);
  for (const LegPlace& place : places_) candidates_.push_back(judge(index, place, p, u, from, to));
}

// All that the surroundings of one local minimum of the distance have to say.
DeviationMeter::Candidate DeviationMeter::judge(std::size_t index, const LegPlace& place, const Vec3& p,
                                                const Vec3& u, double from, double to) const {
  const ProgrammedLeg& leg = legs_[index].leg;
  Candidate found;
  found.entry = index;
  found.tip_exact = leg.tolerance_mm() <= 0;
  found.axis_exact = leg.tolerance_deg() <= 0;
  const double allowed_mm = found.allowed_mm = leg.tolerance_mm() + kRoundingMm;
  const double allowed_deg = found.allowed_deg = found.axis_exact ? kRoundingDeg : leg.tolerance_deg();
  found.tip_mm = place.distance_mm;
  found.tip_ratio = place.distance_mm / (found.tip_exact ? kRoundingMm : leg.tolerance_mm());
  const double within_mm = allowed_mm + left_.tip_mm;
  found.tip_fits = place.distance_mm <= within_mm;
  const double worst_ratio_deg = report_.axis_ratio.value * allowed_deg;
  const double enough_deg = histograms_        ? kNothingDeg
                            : found.axis_exact ? report_.axis_exact_deg.value
                                               : worst_ratio_deg;
  // Whether a place fits at all must be known, whatever was found before.
  const double enough = std::max(kNothingDeg, std::min({report_.axis_deg.value, enough_deg, allowed_deg}));
  found.axis_deg = angle_deg(u, leg.axis(place.share));
  double end = place.share;
  // The nearest place of the tip need not be the best one of the axis: within the tip's tolerance the motion
  // may lead or lag, and the axis with it.
  if (leg.turn_rad() > 0 && found.axis_deg > enough) {
    const double begin = place.share - leg.reach(p, place, within_mm, -1, place.share - from);
    end = place.share + leg.reach(p, place, within_mm, +1, to - place.share);
    found.axis_deg = std::min(found.axis_deg, leg.smallest_angle_deg(u, begin, end, enough));
  }
  found.axis_ratio = found.axis_deg / allowed_deg;
  found.tip_off = place.distance_mm / ((found.tip_exact ? kRoundingMm : leg.tolerance_mm()) + left_.tip_mm);
  found.axis_off = found.axis_deg / (allowed_deg + left_.axis_deg);
  const double begin = place.share - leg.reach_at_most(p, place, within_mm, -1, place.share - from);
  found.share = earliest_share(leg, found, begin, end, u);
  return found;
}

// Of those whose tip is near enough, from `begin` on, the first whose axis is too, up to `end` at least. An
// axis that fits nowhere must move the place on all the same: where only the axis turns, nothing else does.
double DeviationMeter::earliest_share(const ProgrammedLeg& leg, const Candidate& found, double begin,
                                      double end, const Vec3& u) const {
  if (leg.turn_rad() <= 0) return begin;
  const double within_deg = std::max(found.allowed_deg + left_.axis_deg, kMuchWorse * found.axis_deg);
  return leg.first_share_within(u, begin, end, within_deg);
}

// True when this candidate alone shows that the sample makes no worst figure worse.
bool DeviationMeter::settled(const Candidate& candidate) const {
  if (histograms_ || !candidate.tip_fits || candidate.axis_ratio > 1) return false;
  const bool tip_settled = candidate.tip_exact ? candidate.tip_mm <= report_.tip_exact_mm.value
                                               : candidate.tip_ratio <= report_.tip_ratio.value;
  const bool axis_settled = candidate.axis_exact ? candidate.axis_deg <= report_.axis_exact_deg.value
                                                 : candidate.axis_ratio <= report_.axis_ratio.value;
  const bool tip_fine = tip_settled && candidate.tip_mm <= report_.tip_mm.value;
  const bool axis_fine = axis_settled && candidate.axis_deg <= report_.axis_deg.value;
  return (tip_fine || candidate.tip_mm <= kNothingMm) && (axis_fine || candidate.axis_deg <= kNothingDeg);
}

// Only where the program jumps, or may yet jump, behind the entry.
void DeviationMeter::note_end(std::size_t index, const Vec3& p, const Vec3& u) {
  Entry& entry = legs_[index];
  if (entry.end_reached || (index + 1 < legs_.size() && !legs_[index + 1].jump_before)) return;
  if ((p - entry.leg.end()).norm() > kRoundingMm) return;
  entry.end_reached = angle_deg(u, entry.leg.axis(1)) <= kRoundingDeg;
}

// Each figure takes the place that is best for it; the axis only places whose tip fits, unless there is none.
void DeviationMeter::record(std::uint32_t line, const Left& left) {
  const Candidate* tip = &candidates_.front();
  const Candidate *tip_ratio = tip, *axis = nullptr, *axis_ratio = nullptr;
  for (const Candidate& candidate : candidates_) {
    if (candidate.tip_mm < tip->tip_mm) tip = &candidate;
    if (candidate.tip_off < tip_ratio->tip_off) tip_ratio = &candidate;
    // An axis is compared only with places that the tip may stand for.
    if (!candidate.tip_fits) continue;
    if (!axis || candidate.axis_deg < axis->axis_deg) axis = &candidate;
    if (!axis_ratio || candidate.axis_off < axis_ratio->axis_off) axis_ratio = &candidate;
  }
  if (!axis) axis = axis_ratio = tip;
  note_excess(*tip_ratio, *axis_ratio, left, line);
  tip_mm_ = tip->tip_mm;
  keep_worst(report_.tip_mm, tip->tip_mm, line);
  keep_worst(report_.axis_deg, axis->axis_deg, line);
  if (tip_ratio->tip_exact)
    keep_worst(report_.tip_exact_mm, tip_ratio->tip_mm, line);
  else
    keep_worst(report_.tip_ratio, tip_ratio->tip_ratio, line);
  if (histograms_ && !tip_ratio->tip_exact) count(report_.tip_histogram, tip_ratio->tip_ratio);
  if (histograms_ && !axis_ratio->axis_exact) count(report_.axis_histogram, axis_ratio->axis_ratio);
  if (axis_ratio->axis_exact)
    keep_worst(report_.axis_exact_deg, axis_ratio->axis_deg, line);
  else
    keep_worst(report_.axis_ratio, axis_ratio->axis_ratio, line);
}

void DeviationMeter::note_excess(const Candidate& tip, const Candidate& axis, const Left& left,
                                 std::uint32_t line) {
  keep_worst(report_.tip_over_mm, tip.tip_mm - tip.allowed_mm - left.tip_mm, line);
  keep_worst(report_.axis_over_deg, axis.axis_deg - axis.allowed_deg - kRoundingDeg - left.axis_deg, line);
}

// The earliest place that fits. What the corrections leave is no reason to leave a move: a tilt of 0.002
// degree in an exact mode would else belong to the next move with a tolerance that passes nearby. Out of
// tolerance, one not much worse than the best: the nearest itself may lie behind a corner that the motion has
// yet to reach.
void DeviationMeter::advance() {
  const auto by_tip = [](const Candidate& a, const Candidate& b) { return a.tip_off < b.tip_off; };
  const auto best = std::min_element(candidates_.begin(), candidates_.end(), by_tip);
  const double rounding = 1 + kRoundingMm / std::max(kRoundingMm, tolerance_ahead().tip_mm);
  const double tip_most = std::max(rounding, kMuchWorse * best->tip_off);
  double axis_best = best->axis_off;
  for (const Candidate& candidate : candidates_)
    if (candidate.tip_off <= tip_most) axis_best = std::min(axis_best, candidate.axis_off);
  const double axis_most = std::max(1.0, kMuchWorse * axis_best);
  const auto earliest = std::find_if(candidates_.begin(), candidates_.end(), [&](const Candidate& candidate) {
    return candidate.tip_off <= tip_most && candidate.axis_off <= axis_most;
  });
  TRN_CHECK(earliest != candidates_.end());
  TRN_CHECK(earliest->entry < legs_.size());
  here_ = earliest->entry;
  share_ = earliest->share;
  TRN_CHECK(share_ >= 0 && share_ <= 1);
  drop_behind();
}

void DeviationMeter::drop_behind() {
  if (here_ == 0) return;
  const Window tolerance = tolerance_ahead();
  const std::size_t first = behind({kBehindTolerances * (tolerance.tip_mm + kRoundingMm),
                                    kBehindTolerances * (tolerance.axis_deg + kRoundingDeg)})
                                .entry;
  legs_.erase(legs_.begin(), legs_.begin() + static_cast<std::ptrdiff_t>(first));
  here_ -= first;
}

// The deviation is on record; what follows shall be measured against the right part of the path.
void DeviationMeter::find_anew(const Vec3& p, const Vec3& u) {
  candidates_.clear();
  for (std::size_t i = here_; i < legs_.size() && (i == here_ || !legs_[i].new_context); ++i)
    search_entry(i, p, u, i == here_ ? share_ : 0, 1);
}

}  // namespace trn
