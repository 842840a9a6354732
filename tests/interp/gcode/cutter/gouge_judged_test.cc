#include <fmt/format.h>

#include <cstdlib>
#include <polyclipping/clipper.hpp>
#include <random>

#include "core/units.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/cutter/plane_curve.h"
#include "interp/gcode/error.h"
#include "interp/gcode/program_config.h"
#include "tests/interp/gcode/run_program.h"
#include "tests/support/rounds.h"

// Seeded contours with their ways in and out, judged by an independent offset of the part's outline
// (Clipper). The tool's centre, as the interpreter gives it, may not lie where the offset outline does not
// let it. TRN_LONG=10000: so many contours instead of 600.
namespace trn {
namespace {

using test::Session;
using Point = PlaneCurve::Point;

constexpr double kUnits_mm = 4e6;  // Clipper's integers

int contours() { return test::rounds(600); }

double uniform(std::mt19937& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}
int whole(std::mt19937& rng, int low, int high) { return std::uniform_int_distribution<int>(low, high)(rng); }

double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }
Point turned_left(const Point& t) { return {-t.y(), t.x()}; }

// As a program writes it: four decimals.
double written(double v) { return std::round(v * 1e4) / 1e4; }
Point written(const Point& p) { return {written(p.x()), written(p.y())}; }

// Outlines, counterclockwise, about 100 mm wide.

std::vector<Point> star(std::mt19937& rng, int corners, double least) {
  std::vector<Point> outline;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * kPi * (i + uniform(rng, 0.1, 0.9)) / corners;
    outline.emplace_back(uniform(rng, least, 50) * Point(std::cos(angle), std::sin(angle)));
  }
  return outline;
}

std::vector<Point> convex(std::mt19937& rng) {
  const double wide = uniform(rng, 15, 50), high = uniform(rng, 15, 50);
  const int corners = whole(rng, 3, 9);
  std::vector<Point> outline;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * kPi * (i + uniform(rng, 0.2, 0.8)) / corners;
    outline.emplace_back(wide * std::cos(angle), high * std::sin(angle));
  }
  return outline;
}

// Teeth and slots of many widths, turned by any angle.
std::vector<Point> comb(std::mt19937& rng) {
  std::vector<Point> outline{{0, 0}};
  const int teeth = whole(rng, 2, 4);
  std::vector<double> x{0};
  for (int i = 0; i < 2 * teeth - 1; ++i) x.push_back(x.back() + uniform(rng, 2, 25));
  outline.emplace_back(x.back(), 0);
  for (std::size_t i = x.size() - 1; i > 0; i -= 2) {
    const double high = uniform(rng, 15, 40);
    outline.emplace_back(x[i], high);
    outline.emplace_back(x[i - 1], high);
    if (i < 2) break;
    const double low = uniform(rng, 3, 14);
    outline.emplace_back(x[i - 1], low);
    outline.emplace_back(x[i - 2], low);
  }
  const Eigen::Rotation2Dd turn(whole(rng, 0, 1) ? uniform(rng, 0, 2 * kPi) : 0);
  for (Point& p : outline) p = turn * p;
  return outline;
}

// One contour with everything about it.
struct Job {
  std::vector<PlaneCurve> outline;  ///< as it is walked
  double radius = 0;
  bool left = true, pocket = false, convex = false;
  int way_in = 0, laps = 1;
  std::string program;
  std::vector<Point> corners;
  std::vector<PlaneCurve> walk;  ///< everything behind the entry move
};

// Fillets at some of the corners, where they fit.
std::vector<PlaneCurve> rounded(const std::vector<Point>& corners, std::mt19937& rng, double share) {
  const std::size_t n = corners.size();
  std::vector<Point> in(corners), out(corners), centre(n);
  std::vector<int> turn(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    const Point& before = corners[(i + n - 1) % n];
    const Point& after = corners[(i + 1) % n];
    const Point t1 = (corners[i] - before).normalized(), t2 = (after - corners[i]).normalized();
    const double angle = std::atan2(cross(t1, t2), t1.dot(t2));
    if (uniform(rng, 0, 1) > share || std::abs(angle) < 0.3 || std::abs(angle) > 2.8) continue;
    const double room = 0.4 * std::min((corners[i] - before).norm(), (after - corners[i]).norm());
    const double size = uniform(rng, 0.1, 1) * room / std::tan(std::abs(angle) / 2);
    turn[i] = angle > 0 ? 1 : -1;
    const double cut = size * std::tan(std::abs(angle) / 2);
    in[i] = corners[i] - cut * t1;
    out[i] = corners[i] + cut * t2;
    centre[i] = in[i] + turn[i] * size * turned_left(t1);
  }
  std::vector<PlaneCurve> curves;
  for (std::size_t i = 0; i < n; ++i) {
    if (turn[i] != 0) curves.push_back({in[i], out[i], centre[i], turn[i]});
    curves.push_back({out[i], in[(i + 1) % n], Point::Zero(), 0});
  }
  return curves;
}

std::string words(const PlaneCurve& curve, bool arcs_exact) {
  if (curve.turn == 0)
    return arcs_exact ? fmt::format("G1 X{:.9f} Y{:.9f}\n", curve.to.x(), curve.to.y())
                      : fmt::format("G1 X{:.4f} Y{:.4f}\n", curve.to.x(), curve.to.y());
  const Point c = curve.centre - curve.from;
  return fmt::format("G{} X{:.9f} Y{:.9f} I{:.9f} J{:.9f}\n", curve.turn > 0 ? 3 : 2, curve.to.x(),
                     curve.to.y(), c.x(), c.y());
}

// A quarter arc, bent round the tool, that ends at (or begins at) `p` in the direction `t`.
PlaneCurve lead_arc(const Point& p, const Point& t, bool left, double size, bool in) {
  const Point side = left ? turned_left(t) : Point(-turned_left(t));
  const Point centre = p + size * side, far = centre + (in ? -size : size) * t;
  return {in ? far : p, in ? p : far, centre, left ? 1 : -1};
}

enum WayIn { kExtension, kArc, kArcNearCorner, kArcAndOverlap, kStraight, kWays };

// The program of `job`: from a place on the tool's side, round the outline, and back.
void write_program(Job& job, std::mt19937& rng, bool exact) {
  std::vector<std::size_t> lines;
  for (std::size_t i = 0; i < job.outline.size(); ++i)
    if (job.outline[i].turn == 0 && length_of(job.outline[i]) > 1) lines.push_back(i);
  const std::size_t first =
      lines[static_cast<std::size_t>(whole(rng, 0, static_cast<int>(lines.size()) - 1))];
  std::rotate(job.outline.begin(), job.outline.begin() + static_cast<std::ptrdiff_t>(first),
              job.outline.end());
  const PlaneCurve edge = job.outline.front();
  const Point t = direction_of(edge, false);
  const Point side = job.left ? turned_left(t) : Point(-turned_left(t));
  const auto at = [&](double f) { return exact ? point_at(edge, f) : written(point_at(edge, f)); };
  const double size = uniform(rng, 1.1, 3) * job.radius;
  std::vector<PlaneCurve> walk;
  Point start;
  Point p = edge.from;
  if (job.way_in != kExtension) p = at(job.way_in == kArcNearCorner ? 0.03 : uniform(rng, 0.3, 0.7));
  const PlaneCurve from_p{p, edge.to, Point::Zero(), 0}, to_p{edge.from, p, Point::Zero(), 0};
  if (job.way_in == kExtension) {
    walk.push_back({written(Point(edge.from - 3 * job.radius * t)), edge.to, Point::Zero(), 0});
    start = walk.front().from + 2.5 * job.radius * (side - t);
  } else if (job.way_in == kStraight) {
    start = p + 2.5 * job.radius * side;
    walk.push_back(from_p);
  } else {
    walk.push_back(lead_arc(p, t, job.left, size, true));
    walk.push_back(from_p);
    start = walk.front().from + 1.5 * job.radius * side;
  }
  for (int lap = 0; lap < job.laps; ++lap) {
    if (lap > 0 && job.way_in == kExtension) walk.push_back(edge);
    if (lap > 0 && job.way_in != kExtension) walk.push_back({edge.from, edge.to, Point::Zero(), 0});
    walk.insert(walk.end(), job.outline.begin() + 1, job.outline.end());
  }
  Point way_out = t;
  if (job.way_in == kExtension) {
    PlaneCurve& last = walk.back();
    way_out = direction_of(last, true);
    const PlaneCurve out{last.to, written(Point(last.to + 3 * job.radius * way_out)), Point::Zero(), 0};
    if (last.turn == 0)
      last.to = out.to;
    else
      walk.push_back(out);
  } else {
    walk.push_back(to_p);
    if (job.way_in == kArcAndOverlap) {
      const PlaneCurve over{p, at(fraction_of(edge, p) + 0.1), Point::Zero(), 0};
      walk.push_back(over);
      p = over.to;
    }
    if (job.way_in != kStraight) walk.push_back(lead_arc(p, t, job.left, size, false));
  }
  job.walk = walk;
  job.program =
      fmt::format("G21 F500\nG0 X{:.9f} Y{:.9f}\nG4{} D{:.9f}\nG1 X{:.9f} Y{:.9f}\n", start.x(), start.y(),
                  job.left ? "1.1" : "2.1", 2 * job.radius, walk.front().from.x(), walk.front().from.y());
  for (const PlaneCurve& curve : walk) job.program += words(curve, exact || job.way_in != kExtension);
  job.program += "G40 G1 X500 Y500\n";
}

constexpr std::uint32_t kEntryLine = 4;

Job random_job(int seed) {
  std::mt19937 rng(static_cast<unsigned>(seed));
  Job job;
  const int family = whole(rng, 0, 3);
  std::vector<Point> corners = family == 0   ? convex(rng)
                               : family == 1 ? star(rng, whole(rng, 4, 9), 20)
                               : family == 2 ? star(rng, whole(rng, 8, 30), 35)
                                             : comb(rng);
  for (Point& p : corners) p = written(p);
  job.left = whole(rng, 0, 1) == 1;
  job.pocket = whole(rng, 0, 2) == 0;
  job.convex = family == 0 && !job.pocket;
  if (job.left != job.pocket) std::reverse(corners.begin(), corners.end());
  job.corners = corners;
  const bool fillets = whole(rng, 0, 1) == 1;
  job.outline = rounded(corners, rng, fillets ? 0.6 : 0);
  job.radius = written(std::exp(uniform(rng, std::log(0.02), std::log(8))));
  job.way_in = whole(rng, 0, kWays - 1);
  if (job.pocket && job.way_in == kExtension) job.way_in = kArc;
  job.laps = whole(rng, 0, 4) == 0 ? 2 : 1;
  write_program(job, rng, fillets);
  return job;
}

// Straight pieces of a curve, nowhere further from it than `off`.
void append(const PlaneCurve& curve, double off, ClipperLib::Path& path) {
  int pieces = 1;
  if (curve.turn != 0)
    pieces = static_cast<int>(
        std::ceil(length_of(curve) / curve.radius() / std::sqrt(8 * std::min(off / curve.radius(), 0.05))));
  for (int i = 0; i <= pieces; ++i) {
    const Point p = kUnits_mm * point_at(curve, static_cast<double>(i) / pieces);
    path.push_back({std::llround(p.x()), std::llround(p.y())});
  }
}

/// Keeps the way of the tool's centre behind the entry move, up to the end of the compensation.
class ToolPath : public CanonSink {
 public:
  void put(const CanonCommand& command, std::uint32_t line) override {
    if (std::holds_alternative<canon::Comment>(command)) compensated_ = line == kEntryLine - 1;
    const Point from = at_;
    if (const auto* feed = std::get_if<canon::StraightFeed>(&command))
      go({from, feed->to.xyz.head<2>(), Point::Zero(), 0}, line);
    if (const auto* arc = std::get_if<canon::ArcFeed>(&command))
      go({from, arc->to.xyz.head<2>(), Point(arc->centre1, arc->centre2), arc->turns}, line);
  }
  std::vector<PlaneCurve> curves;

 private:
  void go(const PlaneCurve& curve, std::uint32_t line) {
    if (compensated_ && line > kEntryLine) curves.push_back(curve);
    at_ = curve.to;
  }
  Point at_ = Point::Zero();
  bool compensated_ = false;
};

ClipperLib::Paths offset(const ClipperLib::Path& outline, double by_mm, double off_mm) {
  ClipperLib::ClipperOffset clipper(2, off_mm * kUnits_mm);
  clipper.AddPath(outline, ClipperLib::jtRound, ClipperLib::etClosedPolygon);
  ClipperLib::Paths result;
  clipper.Execute(result, by_mm * kUnits_mm);
  return result;
}

/// Where the tool's centre may not be, by an offset of the outline that is `margin` less than the radius.
struct Judge {
  Judge(const Job& job, double margin) : pocket(job.pocket), off(2e-5 * job.radius) {
    ClipperLib::Path outline;
    for (const PlaneCurve& curve : job.outline) {
      append(curve, off, outline);
      outline.pop_back();
    }
    if (!ClipperLib::Orientation(outline)) ClipperLib::ReversePath(outline);
    border = offset(outline, (pocket ? -1 : 1) * (job.radius - margin), off);
  }
  /// Length of the way where it may not be, mm.
  double inside(const ClipperLib::Path& way) const {
    ClipperLib::Clipper clipper;
    clipper.AddPath(way, ClipperLib::ptSubject, false);
    clipper.AddPaths(border, ClipperLib::ptClip, true);
    ClipperLib::PolyTree tree;
    clipper.Execute(pocket ? ClipperLib::ctDifference : ClipperLib::ctIntersection, tree,
                    ClipperLib::pftNonZero, ClipperLib::pftNonZero);
    ClipperLib::Paths pieces;
    ClipperLib::OpenPathsFromPolyTree(tree, pieces);
    double length = 0;
    for (const ClipperLib::Path& piece : pieces)
      for (std::size_t i = 1; i < piece.size(); ++i)
        length += std::hypot(static_cast<double>(piece[i].X - piece[i - 1].X),
                             static_cast<double>(piece[i].Y - piece[i - 1].Y));
    return length / kUnits_mm;
  }
  bool pocket;
  double off;
  ClipperLib::Paths border;
};

// A piece of the contour that the tool cannot stand beside anywhere.
bool unreachable(const Job& job) {
  const Judge judge(job, 1e-4 * job.radius + 1e-5);
  for (const PlaneCurve& curve : job.outline) {
    const bool hollow = curve.turn != 0 && (curve.turn > 0) == job.left;
    if (hollow && curve.radius() < job.radius) return true;
    bool reached = false;
    for (int i = 0; i <= 40 && !reached; ++i) {
      const PlaneCurve rest = piece_of(curve, 0, std::max(1e-6, i / 40.0));
      const Point t = direction_of(rest, true);
      const Point c = kUnits_mm * Point(rest.to + job.radius * (job.left ? turned_left(t) : -turned_left(t)));
      const ClipperLib::IntPoint at(std::llround(c.x()), std::llround(c.y()));
      int inside = 0;
      for (const ClipperLib::Path& path : judge.border) inside += ClipperLib::PointInPolygon(at, path) != 0;
      reached = (inside % 2 == 1) == job.pocket;
    }
    if (!reached) return true;
  }
  return false;
}

// The first or the last move, an arc of the way in or out, goes through the outline itself.
bool lead_crosses(const Job& job) {
  if (job.way_in == kExtension || job.way_in == kStraight) return false;
  for (const PlaneCurve& lead : {job.walk.front(), job.walk.back()}) {
    for (const PlaneCurve& curve : job.outline) {
      const Meetings meets = meetings(lead, curve, 1e-4);
      for (std::size_t i = 0; i < meets.count; ++i) {
        const Point p = point_at(lead, meets.at[i].one);
        if ((p - lead.from).norm() > 0.05 && (p - lead.to).norm() > 0.05) return true;
      }
    }
  }
  return false;
}

struct Counts {
  int convex = 0, refused_convex = 0;
  int true_gouges = 0, missed = 0, clean = 0, false_alarms = 0, unclear = 0, without_path = 0;
  int crossing_leads = 0, crossing_missed = 0;
};

void judge(int seed, Counts& counts) {
  const Job job = random_job(seed);
  const std::string said = Session().error(job.program);
  const auto context = [&] { return fmt::format("seed {}: '{}'\n{}", seed, said, job.program); };
  if (job.convex) {
    ++counts.convex;
    counts.refused_convex += !said.empty();
    EXPECT_EQ(said, "") << context();
  }
  Session unjudged;
  unjudged.config.gouge_check = GougeCheckMode::kOff;
  ToolPath tool;
  try {
    unjudged.run(job.program + "M2\n", tool);
  } catch (const GcodeError&) {  // no path for the tool beside the contour
    ++counts.without_path;
    EXPECT_NE(said, "") << context();
    EXPECT_TRUE(unreachable(job)) << context();
    return;
  }
  const auto cut = [&](double margin) {
    const Judge strict(job, margin);
    double length = 0;
    for (const PlaneCurve& curve : tool.curves) {
      ClipperLib::Path way;
      append(curve, strict.off, way);
      length += strict.inside(way);
    }
    return length;
  };
  if (lead_crosses(job) && cut(0.0027 * job.radius + 1.01e-3) > 0) {
    ++counts.crossing_leads;
    counts.crossing_missed += said.empty();
    EXPECT_NE(said, "") << context();
  } else if (cut(0.0027 * job.radius + 1.01e-3) > 0) {
    ++counts.true_gouges;
    counts.missed += said.empty();
    EXPECT_NE(said, "") << context();
  } else if (cut(5e-5 * job.radius + 0.99e-3) == 0) {
    ++counts.clean;
    counts.false_alarms += !said.empty();
    EXPECT_EQ(said, "") << context();
  } else {
    ++counts.unclear;
  }
}

TEST(GougeJudged, AgreesWithAnOffsetOfTheOutline) {
  Counts counts;
  for (int seed = 1; seed <= contours(); ++seed) judge(seed, counts);
  fmt::print("{} convex parts, {} refused; {} gouges, {} missed; {} clean, {} false alarms\n", counts.convex,
             counts.refused_convex, counts.true_gouges, counts.missed, counts.clean, counts.false_alarms);
  fmt::print("{} within the margin; {} without a path; {} with leads through the outline, {} missed\n",
             counts.unclear, counts.without_path, counts.crossing_leads, counts.crossing_missed);
  EXPECT_GT(counts.true_gouges, contours() / 50);
  EXPECT_GT(counts.clean, contours() / 5);
}

}  // namespace
}  // namespace trn
