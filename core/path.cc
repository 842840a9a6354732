#include "core/path.h"

#include <cmath>

#include "core/check.h"

namespace trn {

namespace {

PathPoint polynomial_derivatives(const PathPiece& piece, double s) TRN_RT {
  TRN_CHECK(piece.length > 0);
  // The polynomial runs over u from 0 to 1 and not over s: its coefficients are then all lengths of the size
  // of the piece, and u^7 of a piece of 500 mm does not swamp the lower powers.
  const double inv = 1.0 / piece.length, u = s * inv;
  PathPoint p;
  p.y = piece.c[7];
  p.d1.setZero();
  p.d2.setZero();
  p.d3.setZero();
  for (int k = 6; k >= 0; --k) {  // Horner on value and derivatives together; d_n holds d^n / n!
    p.d3 = p.d3 * u + p.d2;
    p.d2 = p.d2 * u + p.d1;
    p.d1 = p.d1 * u + p.y;
    p.y = p.y * u + piece.c[static_cast<size_t>(k)];
  }
  // From derivatives by u to derivatives by s; the factors 2 and 6 are the factorials that Horner's scheme
  // has left out.
  p.d1 *= inv;
  p.d2 *= 2 * inv * inv;
  p.d3 *= 6 * inv * inv * inv;
  return p;
}

}  // namespace

Words PathPiece::at(double s) const TRN_RT {
  if (kind == Kind::kLine) return c[0] + c[1] * s;
  if (kind == Kind::kArc) {
    const double w = omega * s;
    return c[0] + c[1] * s + c[2] * std::cos(w) + c[3] * std::sin(w);
  }
  const double u = s / length;
  Words y = c[7];
  for (int k = 6; k >= 0; --k) y = y * u + c[static_cast<size_t>(k)];
  return y;
}

PathPoint PathPiece::derivatives(double s) const TRN_RT {
  if (kind == Kind::kPolynomial) return polynomial_derivatives(*this, s);
  PathPoint p;
  p.y = c[0] + c[1] * s;
  p.d1 = c[1];
  p.d2.setZero();
  p.d3.setZero();
  if (kind == Kind::kLine) return p;
  const double cw = std::cos(omega * s), sw = std::sin(omega * s);
  const Words radial = c[2] * cw + c[3] * sw;
  const Words tangential = c[3] * cw - c[2] * sw;
  p.y += radial;
  p.d1 += omega * tangential;
  // Every derivative turns radius and tangent by a quarter and brings one more omega.
  p.d2 = -omega * omega * radial;
  p.d3 = -omega * omega * omega * tangential;
  return p;
}

double path_norm(const Words& dy) {
  // A length over mm and rad together, so that a move of the rotary axes alone has a length as well.
  return std::sqrt(dy.head<3>().squaredNorm() +
                   kMmPerRadInPath * kMmPerRadInPath * dy.tail<3>().squaredNorm());
}

PathPiece make_line(const Words& from, const Words& to) {
  PathPiece piece;
  piece.kind = PathPiece::Kind::kLine;
  piece.length = path_norm(to - from);
  TRN_CHECK(piece.length > 0);
  piece.c.fill(Words::Zero());
  piece.c[0] = from;
  piece.c[1] = (to - from) / piece.length;
  return piece;
}

PathPiece make_arc(const Words& from, const Words& to, const Vec3& centre, const Vec3& axis,
                   double sweep_rad) {
  TRN_CHECK(std::abs(axis.norm() - 1) < 1e-9);
  TRN_CHECK(std::isfinite(sweep_rad));
  // What lies along the axis belongs to the rise of a helix and not to its radius.
  const Vec3 r_from = from.head<3>() - centre;
  const Vec3 radial = r_from - axis * axis.dot(r_from);
  Words rest = to - from;
  const Vec3 along = axis * axis.dot(to.head<3>() - from.head<3>());
  rest.head<3>() = along;
  PathPiece piece;
  piece.kind = PathPiece::Kind::kArc;
  const double arc = radial.norm() * sweep_rad;
  // Arc, rise and rotary words go at constant rates of their own, so they are the sides of a right angle when
  // the helix is unrolled.
  piece.length = std::hypot(arc, path_norm(rest));
  TRN_CHECK(piece.length > 0);
  piece.omega = sweep_rad / piece.length;
  piece.c.fill(Words::Zero());
  piece.c[0] = from;
  // The centre at the start; c[2] and c[3] are the radius and the direction a quarter turn ahead.
  piece.c[0].head<3>() -= radial;
  piece.c[1] = rest / piece.length;
  piece.c[2].head<3>() = radial;
  piece.c[3].head<3>() = axis.cross(radial);
  return piece;
}

PathPiece make_hermite(const PathPoint& from, const PathPoint& to, double length) {
  TRN_CHECK(length > 0);
  TRN_CHECK(from.y.allFinite() && to.y.allFinite());
  // Eight coefficients for eight conditions: place and three derivatives at each end. The lower four follow
  // from the beginning alone.
  const double h = length, h2 = h * h, h3 = h2 * h;
  PathPiece piece;
  piece.kind = PathPiece::Kind::kPolynomial;
  piece.length = length;
  auto& c = piece.c;
  c[0] = from.y;
  c[1] = from.d1 * h;
  c[2] = from.d2 * (h2 / 2);
  c[3] = from.d3 * (h3 / 6);
  // What the upper four coefficients must add at u = 1 in value and derivatives by u.
  const Words e0 = to.y - (c[0] + c[1] + c[2] + c[3]);
  const Words e1 = to.d1 * h - (c[1] + 2 * c[2] + 3 * c[3]);
  const Words e2 = to.d2 * h2 - (2 * c[2] + 6 * c[3]);
  const Words e3 = to.d3 * h3 - 6 * c[3];
  // The inverse of the system (1 1 1 1; 4 5 6 7; 12 20 30 42; 24 60 120 210), whose rows are value and
  // derivatives of u^4 to u^7 at 1.
  c[4] = 35 * e0 - 15 * e1 + 2.5 * e2 - e3 / 6;
  c[5] = -84 * e0 + 39 * e1 - 7 * e2 + e3 / 2;
  c[6] = 70 * e0 - 34 * e1 + 6.5 * e2 - e3 / 2;
  c[7] = -20 * e0 + 10 * e1 - 2 * e2 + e3 / 6;
  return piece;
}

PathPiece cut(const PathPiece& piece, double s0, double s1) {
  TRN_CHECK(s0 >= 0 && s1 > s0);
  PathPiece out = piece;
  out.length = s1 - s0;
  TRN_CHECK(out.length > 0);
  // A part of a polynomial of degree 7 is a polynomial of degree 7 again, and its place and derivatives at
  // both ends fix it.
  if (piece.kind == PathPiece::Kind::kPolynomial)
    return make_hermite(piece.derivatives(s0), piece.derivatives(s1), out.length);
  out.c[0] = piece.c[0] + piece.c[1] * s0;
  if (piece.kind == PathPiece::Kind::kArc) {
    const double cw = std::cos(piece.omega * s0), sw = std::sin(piece.omega * s0);
    // The arc begins anew at angle 0, so radius and direction are turned to the place of the cut.
    out.c[2] = piece.c[2] * cw + piece.c[3] * sw;
    out.c[3] = piece.c[3] * cw - piece.c[2] * sw;
  }
  return out;
}

}  // namespace trn
