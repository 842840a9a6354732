#include "interp/plan/speed/row_passes.h"

#include <algorithm>

namespace trn::speed {

namespace {

constexpr size_t kSingles = 3;

TRN_VECTOR_INLINE void load(const double* from, Lanes& to) { std::memcpy(&to, from, sizeof to); }
TRN_VECTOR_INLINE void add_to(double* at, const Lanes& what) {
  Lanes sum;
  load(at, sum);
  sum += what;
  std::memcpy(at, &sum, sizeof sum);
}
TRN_VECTOR_INLINE void raise(Lanes& to, const Lanes& by) { to = by > to ? by : to; }

/// A linear form of the coefficients before, of and after a place.
struct Form {
  Lanes before{}, own{}, after{};
};
/// Values of x (or dx) before, at and after a place.
struct Window {
  Lanes before, own, after;
};
TRN_VECTOR_INLINE void window(const Doubles& x, size_t place, Window& w) {
  load(&x[place], w.before);
  load(&x[place + 1], w.own);
  load(&x[place + 2], w.after);
}
TRN_VECTOR_INLINE void apply(const Form& f, const Window& w, Lanes& value) {
  value = f.before * w.before + f.own * w.own + f.after * w.after;
}

/// The forms that joints share at eight intervals: of the row's d1, d2, d3, at each end.
struct IntervalForms {
  Form of[2][3];
  Form dip[2];
  Lanes root, slope;  ///< 1 / sqrt(c), minus its derivative by c
};

TRN_VECTOR_INLINE void set_forms(const PassState& state, size_t place, IntervalForms& f) {
  const SpeedProblem& p = *state.problem;
  Lanes a0, a1, b0, b1, a0_next, a1_next, b0_next, b1_next, h, c, mean, left, right, scale;
  load(&p.node_a0[place], a0);
  load(&p.node_a1[place], a1);
  load(&p.node_b0[place], b0);
  load(&p.node_b1[place], b1);
  load(&p.node_a0[place + 1], a0_next);
  load(&p.node_a1[place + 1], a1_next);
  load(&p.node_b0[place + 1], b0_next);
  load(&p.node_b1[place + 1], b1_next);
  load(&p.h[place], h);
  load(&state.x[place + 1], c);
  load(&state.root[place], f.root);
  load(&state.mean[place], mean);
  load(&state.left[place], left);
  load(&state.right[place], right);
  load(&state.dip_scale[place], scale);
  const Lanes by_h = mean / h, zero{};
  Lanes dip;
  load(&p.dip[place], dip);
  f.slope = 0.5 * f.root / c;
  f.of[0][0] = f.of[1][0] = {-a0 * by_h, (a0_next - a1) * by_h, a1_next * by_h};
  f.of[0][1] = {3 * left * a0, 3 * left * a1, zero};
  f.of[0][2] = {left * b0, left * b1, zero};
  f.of[1][1] = {zero, 3 * right * a0_next, 3 * right * a1_next};
  f.of[1][2] = {zero, right * b0_next, right * b1_next};
  f.dip[0] = {scale * b0, scale * (b1 - dip * (1 + b0_next)), -dip * scale * b1_next};
  f.dip[1] = {-dip * scale * b0, scale * (b0_next - dip * (1 + b1)), scale * b1_next};
}

/// Sums over the joints of one end: weights times products of d1, d2, d3, and the parts of the room.
struct JerkSums {
  Lanes m11{}, m12{}, m13{}, m22{}, m23{}, m33{}, e1{}, e2{}, e3{}, y1{}, y2{}, y3{};
  Lanes weight{}, force{}, dual{};
};

/// What one inequality gives to the matrix and the right side.
struct Pull {
  Lanes weight, force;
};

// The step taken; slack that the row really has is never left unused.
TRN_VECTOR_INLINE void take(RowState& r, const Lanes& g, const PassStep& step, Lanes& worst, Pull& pull) {
  Lanes slack = r.slack + step.alpha * r.slack_step;
  slack = slack > -g ? slack : -g;
  r.slack = slack;
  r.dual += step.alpha_dual * r.dual_step;
  const Lanes residual = g + slack, inverse = 1 / slack;
  raise(worst, residual);
  pull.weight = r.dual * inverse;
  pull.force = step.mu * inverse + pull.weight * residual;
}

TRN_VECTOR_INLINE void add_jerk_row(const JerkRow& d, const Lanes* value, const Lanes& room, TwoSided& state,
                                    const PassStep& step, Lanes& worst, JerkSums& s) {
  const Lanes v = d.d1 * value[0] + d.d2 * value[1] + d.d3 * value[2];
  Pull up, low;
  take(state[0], v - room, step, worst, up);
  take(state[1], -v - room, step, worst, low);
  const Lanes w = up.weight + low.weight, e = up.weight - low.weight, y = low.force - up.force;
  const Lanes w1 = w * d.d1, w2 = w * d.d2;
  s.m11 += w1 * d.d1;
  s.m12 += w1 * d.d2;
  s.m13 += w1 * d.d3;
  s.m22 += w2 * d.d2;
  s.m23 += w2 * d.d3;
  s.m33 += w * d.d3 * d.d3;
  s.e1 += e * d.d1;
  s.e2 += e * d.d2;
  s.e3 += e * d.d3;
  s.y1 += y * d.d1;
  s.y2 += y * d.d2;
  s.y3 += y * d.d3;
  s.weight += w;
  s.force += up.force + low.force;
  s.dual += state[0].dual + state[1].dual;
}

/// Part of the Newton matrix that belongs to eight places and their neighbours.
struct Part {
  Lanes bb{}, bo{}, ba{}, oo{}, oa{}, aa{}, rb{}, ro{}, ra{};
};

TRN_VECTOR_INLINE void add_product(const Form& f, const Form& g, Part& p) {  // f g^T, symmetric half
  p.bb += f.before * g.before;
  p.bo += f.before * g.own;
  p.ba += f.before * g.after;
  p.oo += f.own * g.own;
  p.oa += f.own * g.after;
  p.aa += f.after * g.after;
}
TRN_VECTOR_INLINE void add_force(const Form& f, const Lanes& y, Part& p) {
  p.rb += f.before * y;
  p.ro += f.own * y;
  p.ra += f.after * y;
}
TRN_VECTOR_INLINE void mix(const Form* f, const Lanes& w0, const Lanes& w1, const Lanes& w2, Form& out) {
  out.before = w0 * f[0].before + w1 * f[1].before + w2 * f[2].before;
  out.own = w0 * f[0].own + w1 * f[1].own + w2 * f[2].own;
  out.after = w0 * f[0].after + w1 * f[1].after + w2 * f[2].after;
}

TRN_VECTOR_INLINE void add_jerk_sums(const Form* f, const JerkSums& s, const Lanes& slope, Part& p) {
  Form m;
  mix(f, s.m11, s.m12, s.m13, m);
  add_product(f[0], m, p);
  mix(f, s.m12, s.m22, s.m23, m);
  add_product(f[1], m, p);
  mix(f, s.m13, s.m23, s.m33, m);
  add_product(f[2], m, p);
  mix(f, s.e1 * slope, s.e2 * slope, s.e3 * slope, m);
  p.bo += m.before;
  p.oo += 2 * m.own + slope * slope * s.weight;
  p.oa += m.after;
  add_force(f[0], s.y1, p);
  add_force(f[1], s.y2, p);
  add_force(f[2], s.y3, p);
  p.ro -= slope * s.force;
}

TRN_VECTOR_INLINE void add_single(const Form& f, RowState& r, const Lanes& g, const PassStep& step,
                                  Lanes& worst, Part& p) {
  Pull pull;
  take(r, g, step, worst, pull);
  Form weighted{f.before * pull.weight, f.own * pull.weight, f.after * pull.weight};
  add_product(f, weighted, p);
  add_force(f, -pull.force, p);
}

TRN_VECTOR_INLINE void store(const Part& p, size_t place, PassState& state) {
  add_to(&state.diag[place], p.bb);
  add_to(&state.diag[place + 1], p.oo);
  add_to(&state.diag[place + 2], p.aa);
  add_to(&state.off1[place], p.bo);
  add_to(&state.off1[place + 1], p.oa);
  add_to(&state.off2[place], p.ba);
  add_to(&state.rhs[place], p.rb);
  add_to(&state.rhs[place + 1], p.ro);
  add_to(&state.rhs[place + 2], p.ra);
}

TRN_VECTOR_INLINE void bound_form(const PassState& state, size_t place, Form& f) {
  Lanes c_max;
  load(&state.problem->c_max[place], c_max);
  f = Form{};
  f.own = 1 / c_max;
}

TRN_VECTOR_INLINE void assemble_intervals(PassState& state, const PassStep& step, size_t group,
                                          Lanes& worst) {
  const size_t joints = state.problem->joints, place = group * kLanes;
  IntervalForms f;
  set_forms(state, place, f);
  Window w;
  window(state.x, place, w);
  Part part;
  Lanes dual{}, worst_jerk{};
  for (size_t end = 0; end < 2; ++end) {
    Lanes value[3];
    for (size_t i = 0; i < 3; ++i) apply(f.of[end][i], w, value[i]);
    const size_t at = (2 * group + end) * joints;
    JerkSums sums;
    for (size_t j = 0; j < joints; ++j)
      add_jerk_row(state.problem->jerk[at + j], value, f.root, state.jerk[at + j], step, worst_jerk, sums);
    add_jerk_sums(f.of[end], sums, f.slope, part);
    dual += sums.dual;
  }
  raise(worst, worst_jerk * w.own * f.root);
  RowState* single = &state.single[group * kSingles];
  Form bound;
  bound_form(state, place, bound);
  add_single(bound, single[0], w.own * bound.own - 1, step, worst, part);
  for (size_t end = 0; end < 2; ++end) {
    Lanes value;
    apply(f.dip[end], w, value);
    add_single(f.dip[end], single[1 + end], value, step, worst, part);
  }
  store(part, place, state);
  std::memcpy(&state.taken[place], &dual, sizeof dual);
}

/// The forms of a = b'/2 and b at eight nodes, of the coefficients before and after.
struct NodeForms {
  Lanes a0, a1, b0, b1;
};
TRN_VECTOR_INLINE void set_forms(const SpeedProblem& p, size_t node, NodeForms& f) {
  load(&p.node_a0[node], f.a0);
  load(&p.node_a1[node], f.a1);
  load(&p.node_b0[node], f.b0);
  load(&p.node_b1[node], f.b1);
}

TRN_VECTOR_INLINE void assemble_nodes(PassState& state, const PassStep& step, size_t group, Lanes& worst) {
  const size_t joints = state.problem->joints, node = group * kLanes;
  NodeForms f;
  set_forms(*state.problem, node, f);
  Lanes before, after, m11{}, m12{}, m22{}, y1{}, y2{};
  load(&state.x[node], before);
  load(&state.x[node + 1], after);
  const Lanes a = f.a0 * before + f.a1 * after, b = f.b0 * before + f.b1 * after;
  for (size_t j = 0; j < joints; ++j) {
    const AccelerationRow& d = state.problem->acceleration[group * joints + j];
    TwoSided& row = state.acceleration[group * joints + j];
    const Lanes v = d.d1 * a + d.d2 * b;
    Pull up, low;
    take(row[0], v - 1, step, worst, up);
    take(row[1], -v - 1, step, worst, low);
    const Lanes w = up.weight + low.weight, y = low.force - up.force;
    m11 += w * d.d1 * d.d1;
    m12 += w * d.d1 * d.d2;
    m22 += w * d.d2 * d.d2;
    y1 += y * d.d1;
    y2 += y * d.d2;
  }
  const Lanes ma0 = m11 * f.a0 + m12 * f.b0, ma1 = m11 * f.a1 + m12 * f.b1;
  const Lanes mb0 = m12 * f.a0 + m22 * f.b0, mb1 = m12 * f.a1 + m22 * f.b1;
  add_to(&state.diag[node], f.a0 * ma0 + f.b0 * mb0);
  add_to(&state.off1[node], f.a0 * ma1 + f.b0 * mb1);
  add_to(&state.diag[node + 1], f.a1 * ma1 + f.b1 * mb1);
  add_to(&state.rhs[node], f.a0 * y1 + f.b0 * y2);
  add_to(&state.rhs[node + 1], f.a1 * y1 + f.b1 * y2);
}

/// StepSums by lane.
struct LaneSums {
  Lanes worst{}, worst_dual{}, slack_dual{}, slack_dual_step{}, slack_step_dual{}, steps{};
};

// g: value of the inequality now; change: along dx.
TRN_VECTOR_INLINE void find_step(RowState& r, const Lanes& g, const Lanes& change, double mu, LaneSums& s) {
  const Lanes both = 1 / (r.slack * r.dual), slack_inverse = both * r.dual;
  const Lanes step = -(g + r.slack) - change;
  const Lanes dual_step = (mu - r.dual * step) * slack_inverse - r.dual;
  r.slack_step = step;
  r.dual_step = dual_step;
  raise(s.worst, -step * slack_inverse);
  raise(s.worst_dual, -dual_step * both * r.slack);
  s.slack_dual += r.slack * r.dual;
  s.slack_dual_step += r.slack * dual_step;
  s.slack_step_dual += step * r.dual;
  s.steps += step * dual_step;
}

TRN_VECTOR_INLINE void step_intervals(PassState& state, double mu, size_t group, LaneSums& sums) {
  const size_t joints = state.problem->joints, place = group * kLanes;
  IntervalForms f;
  set_forms(state, place, f);
  Window w, dw;
  window(state.x, place, w);
  window(state.dx, place, dw);
  const Lanes room_change = f.slope * dw.own;
  for (size_t end = 0; end < 2; ++end) {
    Lanes value[3], change[3];
    for (size_t i = 0; i < 3; ++i) {
      apply(f.of[end][i], w, value[i]);
      apply(f.of[end][i], dw, change[i]);
    }
    const size_t at = (2 * group + end) * joints;
    for (size_t j = 0; j < joints; ++j) {
      const JerkRow& d = state.problem->jerk[at + j];
      const Lanes v = d.d1 * value[0] + d.d2 * value[1] + d.d3 * value[2];
      const Lanes dv = d.d1 * change[0] + d.d2 * change[1] + d.d3 * change[2];
      find_step(state.jerk[at + j][0], v - f.root, dv + room_change, mu, sums);
      find_step(state.jerk[at + j][1], -v - f.root, room_change - dv, mu, sums);
    }
  }
  RowState* single = &state.single[group * kSingles];
  Form bound;
  bound_form(state, place, bound);
  find_step(single[0], w.own * bound.own - 1, dw.own * bound.own, mu, sums);
  for (size_t end = 0; end < 2; ++end) {
    Lanes value, change;
    apply(f.dip[end], w, value);
    apply(f.dip[end], dw, change);
    find_step(single[1 + end], value, change, mu, sums);
  }
}

TRN_VECTOR_INLINE void step_nodes(PassState& state, double mu, size_t group, LaneSums& sums) {
  const size_t joints = state.problem->joints, node = group * kLanes;
  NodeForms f;
  set_forms(*state.problem, node, f);
  Lanes before, after, step_before, step_after;
  load(&state.x[node], before);
  load(&state.x[node + 1], after);
  load(&state.dx[node], step_before);
  load(&state.dx[node + 1], step_after);
  const Lanes a = f.a0 * before + f.a1 * after, b = f.b0 * before + f.b1 * after;
  const Lanes da = f.a0 * step_before + f.a1 * step_after, db = f.b0 * step_before + f.b1 * step_after;
  for (size_t j = 0; j < joints; ++j) {
    const AccelerationRow& d = state.problem->acceleration[group * joints + j];
    const Lanes v = d.d1 * a + d.d2 * b, dv = d.d1 * da + d.d2 * db;
    find_step(state.acceleration[group * joints + j][0], v - 1, dv, mu, sums);
    find_step(state.acceleration[group * joints + j][1], -v - 1, -dv, mu, sums);
  }
}

double largest(const Lanes& v) {
  double out = v[0];
  for (size_t i = 1; i < kLanes; ++i) out = std::max(out, v[i]);
  return out;
}
double total(const Lanes& v) {
  double out = 0;
  for (size_t i = 0; i < kLanes; ++i) out += v[i];
  return out;
}

void start_row(RowState& r, double mu, const Lanes& least) {
  r = RowState{};
  r.slack = least;
  r.dual = mu / least;
}

}  // namespace

void start_rows(PassState& state, double mu, double least) {
  const SpeedProblem& p = *state.problem;
  const size_t intervals = lane_groups(p.intervals), nodes = lane_groups(p.intervals + 1);
  state.acceleration.resize(nodes * p.joints);
  state.jerk.resize(2 * intervals * p.joints);
  state.single.resize(kSingles * intervals);
  const Lanes zero{};
  // Slack at the start is the room that the row has, and at least a share of it: assemble_rows raises it.
  for (TwoSided& row : state.acceleration)
    for (RowState& side : row) start_row(side, mu, zero + least);
  for (RowState& row : state.single) start_row(row, mu, zero + least);
  for (size_t i = 0; i < state.jerk.size(); ++i) {
    Lanes root;
    load(&state.root[i / (2 * p.joints) * kLanes], root);
    for (RowState& side : state.jerk[i]) start_row(side, mu, least * root);
  }
}

void centre_rows(PassState& state, double mu, double least) {
  const auto centre = [&](RowState& r, const Lanes& room) {
    for (size_t i = 0; i < kLanes; ++i) {
      r.slack[i] = std::max(r.slack[i], least * room[i]);
      r.dual[i] = std::clamp(r.dual[i], 0.1 * mu / r.slack[i], 10 * mu / r.slack[i]);
    }
    r.slack_step = r.dual_step = Lanes{};
  };
  const Lanes one = Lanes{} + 1;
  for (TwoSided& row : state.acceleration)
    for (RowState& side : row) centre(side, one);
  for (RowState& row : state.single) centre(row, one);
  for (size_t i = 0; i < state.jerk.size(); ++i) {
    Lanes root;
    load(&state.root[i / (2 * state.problem->joints) * kLanes], root);
    for (RowState& side : state.jerk[i]) centre(side, root);
  }
}

TRN_VECTOR_CLONES double assemble_rows(PassState& state, PassStep step) {
  for (Doubles* v : {&state.diag, &state.off1, &state.off2, &state.rhs}) v->assign(state.x.size(), 0);
  const size_t n = state.problem->intervals;
  Lanes worst{};
  for (size_t g = 0; g < lane_groups(n); ++g) assemble_intervals(state, step, g, worst);
  for (size_t g = 0; g < lane_groups(n + 1); ++g) assemble_nodes(state, step, g, worst);
  return largest(worst);
}

TRN_VECTOR_CLONES StepSums find_row_steps(PassState& state, double mu) {
  const size_t n = state.problem->intervals;
  LaneSums s;
  for (size_t g = 0; g < lane_groups(n); ++g) step_intervals(state, mu, g, s);
  for (size_t g = 0; g < lane_groups(n + 1); ++g) step_nodes(state, mu, g, s);
  return {largest(s.worst),         largest(s.worst_dual),    total(s.slack_dual),
          total(s.slack_dual_step), total(s.slack_step_dual), total(s.steps)};
}

}  // namespace trn::speed
