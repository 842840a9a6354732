#include "app/check/trace_check.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "app/check/trace_reader.h"

namespace trn {

namespace {

constexpr double kStepSlack = 1e-6;  // of the step
constexpr std::uint64_t kProgressRows = 500'000;

std::vector<std::string> joint_names(const Joints& joints) {
  std::vector<std::string> names;
  for (const Joint& joint : joints) names.push_back(joint.name);
  return names;
}

double ulp(double t) { return std::nextafter(std::abs(t), HUGE_VAL) - std::abs(t); }

// The step of the first two rows, taken as the period's exact fraction where it is one but for rounding.
double step_of(const TraceRow& first, const TraceRow& second, double period_s, const TraceReader& reader) {
  const double step_s = second.t_s - first.t_s;
  if (!(step_s > 0))
    throw reader.error(1, fmt::format("time does not advance: {} s follows {} s", second.t_s, first.t_s));
  const double parts = std::round(period_s / step_s);
  if (parts < 1 || step_s > period_s * (1 + kStepSlack) + 4 * ulp(second.t_s))
    throw reader.error(
        1, fmt::format("rows are {} s apart, but the machine's period is {} s: peaks would be missed", step_s,
                       period_s));
  const bool fraction = std::abs(step_s - period_s / parts) <= kStepSlack * step_s + 4 * ulp(second.t_s);
  // Times in a trace are rounded. A step that is off by a millionth would put the jerk off by three, and the
  // exact fraction of the period is known.
  return fraction ? period_s / parts : step_s;
}

// Between pieces time goes on, for as long as it takes; so does their number.
void expect_new_piece(const TraceRow& before, const TraceRow& row, const TraceReader& reader) {
  if (row.t_s > before.t_s && row.piece > before.piece) return;
  throw reader.error(1, fmt::format("pieces are out of order: piece {} at {} s follows piece {} at {} s",
                                    row.piece, row.t_s, before.piece, before.t_s));
}

void expect_step(double t_before_s, double t_s, double step_s, const TraceReader& reader) {
  const double step_here_s = t_s - t_before_s;
  if (std::abs(step_here_s - step_s) <= kStepSlack * step_s + 4 * ulp(t_s)) return;
  throw reader.error(1, fmt::format("rows are missing or out of order: {} s follows {} s, the step is {} s",
                                    t_s, t_before_s, step_s));
}

}  // namespace

TraceVerdict check_trace(const std::string& path, const Machine& machine,
                         const std::function<void(std::uint64_t)>& progress) {
  TraceReader reader(path, joint_names(machine.joints));
  TraceRow before, row;
  if (!reader.next(before)) throw reader.error(1, "the trace has a header but no rows");
  bool more = reader.next(row);
  const bool stepped = more && row.piece == before.piece;
  const double step_s = stepped ? step_of(before, row, machine.period_s, reader) : machine.period_s;
  const double t_first_s = before.t_s;
  std::uint64_t pieces = 1;
  LimitJudge judge(machine.joints, step_s);
  judge.row(before);
  for (; more; more = reader.next(row)) {
    if (row.piece == before.piece) {
      expect_step(before.t_s, row.t_s, step_s, reader);
    } else {
      expect_new_piece(before, row, reader);
      judge.next_piece();
      ++pieces;
    }
    judge.row(row);
    std::swap(before, row);
    if (judge.rows() % kProgressRows == 0) progress(judge.rows());
  }
  judge.finish();
  return {step_s, before.t_s - t_first_s, judge.rows(), pieces, judge.within_limits(), judge.verdicts()};
}

}  // namespace trn
