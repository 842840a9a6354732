#include "interp/plan/speed/row_passes.h"

#include <algorithm>
#include <cmath>

// The two passes of a Newton step over all rows, (P5), (P9), c_k <= c_max and (P13) of docs/planner.md.
// assemble_rows takes the step that was found last and adds each row's part to the system (P11).
// find_row_steps evaluates (P12) once the system is solved. Rows are not stored: each pass forms them anew
// from the joints' derivatives at the node or interval, since all joints share the same linear forms of c
// there. So the products of a place are summed over the joints by q', q'', q''' first, and the forms are
// multiplied in once a place.
namespace trn::speed {

namespace {

constexpr size_t kSingles = 3;

TRN_VECTOR_INLINE void load(const double* from, Wide& to) { std::memcpy(&to, from, sizeof to); }
TRN_VECTOR_INLINE void add_to(double* at, const Wide& what) {
  Wide sum;
  load(at, sum);
  sum += what;
  std::memcpy(at, &sum, sizeof sum);
}
// Linear forms are differences of neighbouring coefficients and need double precision; slacks, multipliers
// and what else is made of the forms' values do not.
TRN_VECTOR_INLINE void narrow(const Wide& from, Lanes& to) { to = __builtin_convertvector(from, Lanes); }
TRN_VECTOR_INLINE void widen(const Lanes& from, Wide& to) { to = __builtin_convertvector(from, Wide); }

/// A linear form of three neighbouring coefficients, c_k-1, c_k and c_k+1 at k.
struct Form {
  Wide before{}, own{}, after{};
};
/// Values of x (or dx) at k - 1, k and k + 1. They are stored one place further on: x[k + 1] is c_k.
struct Stencil {
  Wide before, own, after;
};
TRN_VECTOR_INLINE void load_stencil(const Doubles& x, size_t sample, Stencil& w) {
  load(&x[sample], w.before);
  load(&x[sample + 1], w.own);
  load(&x[sample + 2], w.after);
}
TRN_VECTOR_INLINE void apply(const Form& f, const Stencil& w, Wide& value) {
  value = f.before * w.before + f.own * w.own + f.after * w.after;
}
TRN_VECTOR_INLINE void apply_narrow(const Form& f, const Stencil& w, Lanes& value) {
  narrow(f.before * w.before + f.own * w.own + f.after * w.after, value);
}

/// The forms that joints share at a group of intervals: a', 3 a and b of P9, which a row multiplies by d1, d2
/// and d3, and the rows P13; at each end.
struct IntervalForms {
  Form of[2][3];
  Form dip[2];
  Wide root, slope;  ///< 1 / sqrt(c), minus its derivative by c
};

// b and a at the nodes of an interval are the forms of SpeedProblem; a' = (a_right - a_left) / h. The jerk
// (P9) is divided by sqrt(c), so each form has its speed over sqrt(c) in it: a' the mean speed, a and b the
// end's own.
TRN_VECTOR_INLINE void set_forms(const PassState& state, size_t sample, IntervalForms& f) {
  const SpeedProblem& p = *state.problem;
  Wide a0, a1, b0, b1, a0_next, a1_next, b0_next, b1_next, h, c, mean, left, right, scale;
  load(&p.node_a0[sample], a0);
  load(&p.node_a1[sample], a1);
  load(&p.node_b0[sample], b0);
  load(&p.node_b1[sample], b1);
  load(&p.node_a0[sample + 1], a0_next);
  load(&p.node_a1[sample + 1], a1_next);
  load(&p.node_b0[sample + 1], b0_next);
  load(&p.node_b1[sample + 1], b1_next);
  load(&p.h[sample], h);
  load(&state.x[sample + 1], c);
  load(&state.root[sample], f.root);
  load(&state.mean[sample], mean);
  load(&state.left[sample], left);
  load(&state.right[sample], right);
  load(&state.dip_scale[sample], scale);
  const Wide by_h = mean / h, zero{};
  Wide dip;
  load(&p.dip[sample], dip);
  f.slope = 0.5 * f.root / c;
  f.of[0][0] = f.of[1][0] = {-a0 * by_h, (a0_next - a1) * by_h, a1_next * by_h};
  f.of[0][1] = {3 * left * a0, 3 * left * a1, zero};
  f.of[0][2] = {left * b0, left * b1, zero};
  f.of[1][1] = {zero, 3 * right * a0_next, 3 * right * a1_next};
  f.of[1][2] = {zero, right * b0_next, right * b1_next};
  f.dip[0] = {scale * b0, scale * (b1 - dip * (1 + b0_next)), -dip * scale * b1_next};
  f.dip[1] = {-dip * scale * b0, scale * (b0_next - dip * (1 + b1)), scale * b1_next};
}

/// Sums over the joints' rows (P9) at one end: mij of weight times d_i d_j, for d d^T in (P11); yi of force
/// times d_i, for the right side; ei, weight and force for the room's own slope, as J / sqrt(c) depends on c,
/// too.
struct JerkSums {
  Wide m11{}, m12{}, m13{}, m22{}, m23{}, m33{}, e1{}, e2{}, e3{}, weight{};
  Lanes y1{}, y2{}, y3{}, force{}, dual{};
};

/// PassStep as the rows use it.
struct LaneStep {
  float mu, alpha, alpha_dual;
};

/// What one inequality with the gradient d adds to P11: weight d d^T to the matrix, -force d to the right
/// side, where weight = z / w and force = mu / w + z / w (g + w).
struct NewtonTerms {
  Lanes weight, force;
};

// Takes the step P12 that was found last. The slack becomes at least -g, what the row really leaves: a
// smaller one would shorten later steps for nothing.
TRN_VECTOR_INLINE void take_step(RowState& r, const Lanes& g, const LaneStep& step) {
  const Lanes slack = r.slack + step.alpha * r.slack_step;
  r.slack = slack > -g ? slack : -g;
  r.dual += step.alpha_dual * r.dual_step;
}

TRN_VECTOR_INLINE void newton_terms(const RowState& r, const Lanes& g, const Lanes& inverse,
                                    const LaneStep& step, Lanes& worst, NewtonTerms& terms) {
  const Lanes residual = g + r.slack;
  raise(worst, residual);
  terms.weight = r.dual * inverse;
  terms.force = step.mu * inverse + terms.weight * residual;
}

TRN_VECTOR_INLINE void update_row(RowState& r, const Lanes& g, const LaneStep& step, Lanes& worst,
                                  NewtonTerms& terms) {
  take_step(r, g, step);
  newton_terms(r, g, 1 / r.slack, step, worst, terms);
}

// Both sides of a row, v <= room and -v <= room. One division gives both inverses of the slacks.
TRN_VECTOR_INLINE void update_row(TwoSided& r, const Lanes& v, const Lanes& room, const LaneStep& step,
                                  Lanes& worst, NewtonTerms& up, NewtonTerms& low) {
  const Lanes above = v - room, below = -v - room;
  take_step(r[0], above, step);
  take_step(r[1], below, step);
  const Lanes both = 1 / (r[0].slack * r[1].slack);
  newton_terms(r[0], above, both * r[1].slack, step, worst, up);
  newton_terms(r[1], below, both * r[0].slack, step, worst, low);
}

// Both sides of a row P9 of one joint.
TRN_VECTOR_INLINE void add_jerk_row(const JerkRow& d, const Lanes* value, const Lanes& room, TwoSided& state,
                                    const LaneStep& step, Lanes& worst, JerkSums& s) {
  const Lanes v = d.d1 * value[0] + d.d2 * value[1] + d.d3 * value[2];
  NewtonTerms up, low;
  update_row(state, v, room, step, worst, up, low);
  const Lanes y = low.force - up.force;
  // From here on in double: along an active row the weight is huge, and the matrix nearly singular across it.
  // Its entries are products that must cancel to the last digits.
  Wide w, e, d1, d2, d3;
  widen(up.weight + low.weight, w);
  widen(up.weight - low.weight, e);
  widen(d.d1, d1);
  widen(d.d2, d2);
  widen(d.d3, d3);
  const Wide w1 = w * d1, w2 = w * d2;
  s.m11 += w1 * d1;
  s.m12 += w1 * d2;
  s.m13 += w1 * d3;
  s.m22 += w2 * d2;
  s.m23 += w2 * d3;
  s.m33 += w * d3 * d3;
  s.e1 += e * d1;
  s.e2 += e * d2;
  s.e3 += e * d3;
  s.y1 += y * d.d1;
  s.y2 += y * d.d2;
  s.y3 += y * d.d3;
  s.weight += w;
  s.force += up.force + low.force;
  s.dual += state[0].dual + state[1].dual;
}

/// The part of P11 that belongs to a group of intervals: matrix entries between c_k-1 (b), c_k (o) and c_k+1
/// (a), and the right sides.
struct LocalMatrix {
  Wide bb{}, bo{}, ba{}, oo{}, oa{}, aa{}, rb{}, ro{}, ra{};
};

TRN_VECTOR_INLINE void add_product(const Form& f, const Form& g, LocalMatrix& p) {  // f g^T, symmetric half
  p.bb += f.before * g.before;
  p.bo += f.before * g.own;
  p.ba += f.before * g.after;
  p.oo += f.own * g.own;
  p.oa += f.own * g.after;
  p.aa += f.after * g.after;
}
TRN_VECTOR_INLINE void add_force(const Form& f, const Lanes& narrow_y, LocalMatrix& p) {
  Wide y;
  widen(narrow_y, y);
  p.rb += f.before * y;
  p.ro += f.own * y;
  p.ra += f.after * y;
}
// The form w0 f0 + w1 f1 + w2 f2.
TRN_VECTOR_INLINE void combine(const Form* f, const Wide& w0, const Wide& w1, const Wide& w2, Form& out) {
  out.before = w0 * f[0].before + w1 * f[1].before + w2 * f[2].before;
  out.own = w0 * f[0].own + w1 * f[1].own + w2 * f[2].own;
  out.after = w0 * f[0].after + w1 * f[1].after + w2 * f[2].after;
}

// Adds all joints' rows P9 at one end: sum over i, j of mij f_i f_j^T, and what the slope of the room adds,
// which belongs to c_k alone. (The room shrinks as c grows, so the gradient of v - room is that of v plus
// `slope`.)
TRN_VECTOR_INLINE void add_jerk_sums(const Form* f, const JerkSums& s, const Wide& slope, LocalMatrix& p) {
  Form m;
  Wide force;
  widen(s.force, force);
  combine(f, s.m11, s.m12, s.m13, m);
  add_product(f[0], m, p);
  combine(f, s.m12, s.m22, s.m23, m);
  add_product(f[1], m, p);
  combine(f, s.m13, s.m23, s.m33, m);
  add_product(f[2], m, p);
  combine(f, s.e1, s.e2, s.e3, m);
  p.bo += slope * m.before;
  p.oo += slope * (2 * m.own + slope * s.weight);
  p.oa += slope * m.after;
  add_force(f[0], s.y1, p);
  add_force(f[1], s.y2, p);
  add_force(f[2], s.y3, p);
  p.ro -= slope * force;
}

TRN_VECTOR_INLINE void add_single(const Form& f, RowState& r, const Wide& value, const LaneStep& step,
                                  Lanes& worst, LocalMatrix& p) {
  NewtonTerms terms;
  Lanes g;
  narrow(value, g);
  update_row(r, g, step, worst, terms);
  Wide weight;
  widen(terms.weight, weight);
  Form weighted{f.before * weight, f.own * weight, f.after * weight};
  add_product(f, weighted, p);
  add_force(f, -terms.force, p);
}

TRN_VECTOR_INLINE void store(const LocalMatrix& p, size_t sample, PassState& state) {
  add_to(&state.diag[sample], p.bb);
  add_to(&state.diag[sample + 1], p.oo);
  add_to(&state.diag[sample + 2], p.aa);
  add_to(&state.off1[sample], p.bo);
  add_to(&state.off1[sample + 1], p.oa);
  add_to(&state.off2[sample], p.ba);
  add_to(&state.rhs[sample], p.rb);
  add_to(&state.rhs[sample + 1], p.ro);
  add_to(&state.rhs[sample + 2], p.ra);
}

// c_k / c_max of the row c_k <= c_max, from P4.
TRN_VECTOR_INLINE void bound_form(const PassState& state, size_t sample, Form& f) {
  Wide c_max;
  load(&state.problem->c_max[sample], c_max);
  f = Form{};
  f.own = 1 / c_max;
}

// Updates the rows P9, c_k <= c_max and P13 of a group of intervals and adds them to P11.
TRN_VECTOR_INLINE void assemble_intervals(PassState& state, const LaneStep& step, size_t group,
                                          Lanes& worst) {
  const size_t joints = state.problem->joints, sample = group * kLanes;
  IntervalForms f;
  set_forms(state, sample, f);
  Stencil w;
  load_stencil(state.x, sample, w);
  LocalMatrix part;
  Lanes dual{}, worst_jerk{}, root;
  narrow(f.root, root);
  for (size_t end = 0; end < 2; ++end) {
    Lanes value[3];
    for (size_t i = 0; i < 3; ++i) apply_narrow(f.of[end][i], w, value[i]);
    const size_t at = (2 * group + end) * joints;
    JerkSums sums;
    for (size_t j = 0; j < joints; ++j)
      add_jerk_row(state.problem->jerk[at + j], value, root, state.jerk[at + j], step, worst_jerk, sums);
    add_jerk_sums(f.of[end], sums, f.slope, part);
    dual += sums.dual;
  }
  // Rows of the jerk are in units of 1 / sqrt(c): times sqrt(c) their violation is a share of the joint's
  // limit.
  Lanes speed;
  narrow(w.own * f.root, speed);
  raise(worst, worst_jerk * speed);
  RowState* single = &state.single[group * kSingles];
  Form bound;
  bound_form(state, sample, bound);
  add_single(bound, single[0], w.own * bound.own - 1, step, worst, part);
  for (size_t end = 0; end < 2; ++end) {
    Wide value;
    apply(f.dip[end], w, value);
    add_single(f.dip[end], single[1 + end], value, step, worst, part);
  }
  store(part, sample, state);
  Wide duals;
  widen(dual, duals);
  std::memcpy(&state.jerk_duals[sample], &duals, sizeof duals);
}

/// The forms of a = b'/2 and b at a group of nodes, of the coefficients before and after: those of P5.
struct NodeForms {
  Wide a0, a1, b0, b1;
};
TRN_VECTOR_INLINE void set_forms(const SpeedProblem& p, size_t node, NodeForms& f) {
  load(&p.node_a0[node], f.a0);
  load(&p.node_a1[node], f.a1);
  load(&p.node_b0[node], f.b0);
  load(&p.node_b1[node], f.b1);
}

// Updates the rows P5 of a group of nodes and adds them to P11. A node's a and b depend on the two
// coefficients beside it, so only two diagonals are touched.
TRN_VECTOR_INLINE void assemble_nodes(PassState& state, const LaneStep& step, size_t group, Lanes& worst) {
  const size_t joints = state.problem->joints, node = group * kLanes;
  NodeForms f;
  set_forms(*state.problem, node, f);
  Wide before, after;
  load(&state.x[node], before);
  load(&state.x[node + 1], after);
  Lanes a, b, z1{}, z2{};
  Wide m11{}, m12{}, m22{}, y1, y2;
  narrow(f.a0 * before + f.a1 * after, a);
  narrow(f.b0 * before + f.b1 * after, b);
  for (size_t j = 0; j < joints; ++j) {
    const AccelerationRow& d = state.problem->acceleration[group * joints + j];
    TwoSided& row = state.acceleration[group * joints + j];
    const Lanes v = d.d1 * a + d.d2 * b;
    NewtonTerms up, low;
    update_row(row, v, Lanes{} + 1, step, worst, up, low);
    const Lanes y = low.force - up.force;
    Wide w, d1, d2;
    widen(up.weight + low.weight, w);
    widen(d.d1, d1);
    widen(d.d2, d2);
    m11 += w * d1 * d1;
    m12 += w * d1 * d2;
    m22 += w * d2 * d2;
    z1 += y * d.d1;
    z2 += y * d.d2;
  }
  widen(z1, y1);
  widen(z2, y2);
  const Wide ma0 = m11 * f.a0 + m12 * f.b0, ma1 = m11 * f.a1 + m12 * f.b1;
  const Wide mb0 = m12 * f.a0 + m22 * f.b0, mb1 = m12 * f.a1 + m22 * f.b1;
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

// The steps P12, and what they do to the sums. g: the inequality's value now; change: of g along dx; both:
// 1 / (slack dual), from which each inverse is one product.
TRN_VECTOR_INLINE void find_step(RowState& r, const Lanes& g, const Lanes& change, const Lanes& both,
                                 float mu, LaneSums& s) {
  const Lanes slack_inverse = both * r.dual;
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

TRN_VECTOR_INLINE void find_step(RowState& r, const Lanes& g, const Lanes& change, float mu, LaneSums& s) {
  find_step(r, g, change, 1 / (r.slack * r.dual), mu, s);
}

// Both sides, v <= room and -v <= room; dv, -less_room: how v and room change along dx.
TRN_VECTOR_INLINE void find_steps(TwoSided& r, const Lanes& v, const Lanes& room, const Lanes& dv,
                                  const Lanes& less_room, float mu, LaneSums& s) {
  const Lanes up = r[0].slack * r[0].dual, low = r[1].slack * r[1].dual, both = 1 / (up * low);
  find_step(r[0], v - room, dv + less_room, both * low, mu, s);
  find_step(r[1], -v - room, less_room - dv, both * up, mu, s);
}

// The second pass over a group of intervals: the same rows as assemble_intervals, at x and along dx.
TRN_VECTOR_INLINE void step_intervals(PassState& state, float mu, size_t group, LaneSums& sums) {
  const size_t joints = state.problem->joints, sample = group * kLanes;
  IntervalForms f;
  set_forms(state, sample, f);
  Stencil w, dw;
  load_stencil(state.x, sample, w);
  load_stencil(state.dx, sample, dw);
  Lanes room_change, root;
  narrow(f.slope * dw.own, room_change);
  narrow(f.root, root);
  for (size_t end = 0; end < 2; ++end) {
    Lanes value[3], change[3];
    for (size_t i = 0; i < 3; ++i) {
      apply_narrow(f.of[end][i], w, value[i]);
      apply_narrow(f.of[end][i], dw, change[i]);
    }
    const size_t at = (2 * group + end) * joints;
    for (size_t j = 0; j < joints; ++j) {
      const JerkRow& d = state.problem->jerk[at + j];
      const Lanes v = d.d1 * value[0] + d.d2 * value[1] + d.d3 * value[2];
      const Lanes dv = d.d1 * change[0] + d.d2 * change[1] + d.d3 * change[2];
      find_steps(state.jerk[at + j], v, root, dv, room_change, mu, sums);
    }
  }
  RowState* single = &state.single[group * kSingles];
  Form bound;
  bound_form(state, sample, bound);
  Lanes g, dg;
  narrow(w.own * bound.own - 1, g);
  narrow(dw.own * bound.own, dg);
  find_step(single[0], g, dg, mu, sums);
  for (size_t end = 0; end < 2; ++end) {
    apply_narrow(f.dip[end], w, g);
    apply_narrow(f.dip[end], dw, dg);
    find_step(single[1 + end], g, dg, mu, sums);
  }
}

// The second pass over a group of nodes.
TRN_VECTOR_INLINE void step_nodes(PassState& state, float mu, size_t group, LaneSums& sums) {
  const size_t joints = state.problem->joints, node = group * kLanes;
  NodeForms f;
  set_forms(*state.problem, node, f);
  Wide before, after, step_before, step_after;
  load(&state.x[node], before);
  load(&state.x[node + 1], after);
  load(&state.dx[node], step_before);
  load(&state.dx[node + 1], step_after);
  Lanes a, b, da, db;
  narrow(f.a0 * before + f.a1 * after, a);
  narrow(f.b0 * before + f.b1 * after, b);
  narrow(f.a0 * step_before + f.a1 * step_after, da);
  narrow(f.b0 * step_before + f.b1 * step_after, db);
  for (size_t j = 0; j < joints; ++j) {
    const AccelerationRow& d = state.problem->acceleration[group * joints + j];
    const Lanes v = d.d1 * a + d.d2 * b, dv = d.d1 * da + d.d2 * db;
    find_steps(state.acceleration[group * joints + j], v, Lanes{} + 1, dv, Lanes{}, mu, sums);
  }
}

double total(const Lanes& v) {
  double out = 0;
  for (size_t i = 0; i < kLanes; ++i) out += v[i];
  return out;
}

void start_row(RowState& r, float mu, const Lanes& least) {
  r = RowState{};
  r.slack = least;
  r.dual = mu / least;
}

// 1 / sqrt(c) of a group: the room of its jerk rows.
TRN_VECTOR_INLINE void room_of(const PassState& state, size_t group, Lanes& root) {
  Wide wide;
  load(&state.root[group * kLanes], wide);
  narrow(wide, root);
}

// A row of an earlier search, made fit to go on from: slack and multiplier near the central path z w = mu
// (P10), so that the first steps are not cut short by rows that were active under other limits.
TRN_VECTOR_INLINE void centre(RowState& r, const Lanes& least, float mu) {
  r.slack = r.slack > least ? r.slack : least;
  const Lanes centred = mu / r.slack, low = 0.1F * centred, high = 10 * centred;
  r.dual = r.dual > low ? r.dual : low;
  r.dual = r.dual < high ? r.dual : high;
  r.slack_step = r.dual_step = Lanes{};
}

}  // namespace

void start_rows(PassState& state, double mu, double least) {
  const SpeedProblem& p = *state.problem;
  const size_t intervals = lane_groups(p.intervals), nodes = lane_groups(p.intervals + 1);
  state.acceleration.resize(nodes * p.joints);
  state.jerk.resize(2 * intervals * p.joints);
  state.single.resize(kSingles * intervals);
  const Lanes zero{};
  const auto mu_row = static_cast<float>(mu), least_row = static_cast<float>(least);
  // Slack at the start is the room that the row has, and at least a share of it: assemble_rows raises it.
  for (TwoSided& row : state.acceleration)
    for (RowState& side : row) start_row(side, mu_row, zero + least_row);
  for (RowState& row : state.single) start_row(row, mu_row, zero + least_row);
  for (size_t i = 0; i < state.jerk.size(); ++i) {
    Lanes root;
    room_of(state, i / (2 * p.joints), root);
    for (RowState& side : state.jerk[i]) start_row(side, mu_row, least_row * root);
  }
}

TRN_VECTOR_CLONES void centre_rows(PassState& state, double mu, double least) {
  const auto mu_row = static_cast<float>(mu), least_row = static_cast<float>(least);
  for (TwoSided& row : state.acceleration)
    for (RowState& side : row) centre(side, Lanes{} + least_row, mu_row);
  for (RowState& row : state.single) centre(row, Lanes{} + least_row, mu_row);
  for (size_t i = 0; i < state.jerk.size(); ++i) {
    Lanes root;
    room_of(state, i / (2 * state.problem->joints), root);
    for (RowState& side : state.jerk[i]) centre(side, least_row * root, mu_row);
  }
}

// Speeds at an interval's ends and mean over its time, over sqrt(c). The mean is h over the time that
// constant jerk takes (crossing_time in time_law.cc): half of v0 + sqrt(b0 + 2/3 h (2 a0 + a1)). All are kept
// within bounds, since b may be negative at a node of a poor iterate.
TRN_VECTOR_CLONES void update_speeds(PassState& state) {
  const SpeedProblem& p = *state.problem;
  const double *const x = state.x.data(), *const b0 = p.node_b0.data(), *const b1 = p.node_b1.data();
  double *const root = state.root.data(), *const left = state.left.data(), *const right = state.right.data(),
                *const mean = state.mean.data();
  const auto sane = [](double ratio) {
    const double up = ratio > 0.5 ? ratio : 0.5;
    return up < 1.6 ? up : 1.6;
  };
#pragma GCC ivdep
  for (size_t k = 0; k < p.intervals; ++k) {
    const double r = 1 / std::sqrt(x[k + 1]);
    const double first = b0[k] * x[k] + b1[k] * x[k + 1];
    const double last = b0[k + 1] * x[k + 1] + b1[k + 1] * x[k + 2];
    const double end = (2 * (x[k + 1] + last) - first) / 3;
    const double v0 = std::sqrt(first);
    root[k] = r;
    left[k] = sane(v0 * r);
    right[k] = sane(std::sqrt(last) * r);
    mean[k] = sane((v0 + std::sqrt(end > 0 ? end : 0)) / 2 * r);
  }
}

TRN_VECTOR_CLONES double assemble_rows(PassState& state, PassStep step) {
  for (Doubles* v : {&state.diag, &state.off1, &state.off2, &state.rhs}) v->assign(state.x.size(), 0);
  const size_t n = state.problem->intervals;
  Lanes worst{};
  const LaneStep lane{static_cast<float>(step.mu), static_cast<float>(step.alpha),
                      static_cast<float>(step.alpha_dual)};
  for (size_t g = 0; g < lane_groups(n); ++g) assemble_intervals(state, lane, g, worst);
  for (size_t g = 0; g < lane_groups(n + 1); ++g) assemble_nodes(state, lane, g, worst);
  return largest(worst);
}

TRN_VECTOR_CLONES StepSums find_row_steps(PassState& state, double mu) {
  const size_t n = state.problem->intervals;
  LaneSums s;
  for (size_t g = 0; g < lane_groups(n); ++g) step_intervals(state, static_cast<float>(mu), g, s);
  for (size_t g = 0; g < lane_groups(n + 1); ++g) step_nodes(state, static_cast<float>(mu), g, s);
  return {largest(s.worst),         largest(s.worst_dual),    total(s.slack_dual),
          total(s.slack_dual_step), total(s.slack_step_dual), total(s.steps)};
}

}  // namespace trn::speed
