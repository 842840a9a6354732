#include "kernel/way_out.h"

#include "core/check.h"

namespace trn {

WayOut::WayOut(const Joints& joints) {
  weights_.setZero(static_cast<Eigen::Index>(joints.size()));
  for (std::size_t i = 0; i < joints.size(); ++i)
    weights_[static_cast<Eigen::Index>(i)] =
        1 / (joints[i].kind == JointKind::kRotary ? kZone_rad : kZone_mm);
  before_ = direction_ = weights_;
  corners_.fill(weights_);
}

void WayOut::begin(const JointVec& place) TRN_RT {
  TRN_CHECK(place.size() == weights_.size());
  corners_[0] = before_ = place;
  count_ = 1;
  set_off_anew();
}

void WayOut::turn_at(const JointVec& q) TRN_RT {
  TRN_CHECK(count_ >= 1);
  // Without room the straight from the corner before becomes a little longer; jogs end long before that.
  if (count_ < kCorners) ++count_;
  corners_[static_cast<std::size_t>(count_ - 1)] = before_ = q;
  set_off_anew();
}

// Both ways along the straight: what turns round on it stays where it was free.
double WayOut::distance_from_line(const JointVec& from_corner) const TRN_RT {
  return (from_corner - from_corner.dot(direction_) * direction_).norm();
}

// Along the straight that led to the last corner, and away from that.
bool WayOut::leads_back(const JointVec& q) const TRN_RT {
  if (count_ < 2) return false;
  const JointVec& before_last = corners_[static_cast<std::size_t>(count_ - 2)];
  const JointVec way = weighed(last() - before_last), here = weighed(q - before_last);
  const double length = way.norm();
  if (length < 4) return here.norm() < 1;
  const double along = here.dot(way) / length;
  return along >= 0 && along <= length - 2 && (here - along / length * way).norm() <= 1;
}

void WayOut::visit(const JointVec& q) TRN_RT {
  TRN_CHECK(count_ >= 1 && q.size() == weights_.size());
  if (leads_back(q)) {
    --count_;
    set_off_anew();
  }
  if (has_direction_ && distance_from_line(weighed(q - last())) > 1) {
    // Near the corner only the direction was not known yet.
    const bool near_corner = weighed(before_ - last()).norm() <= 2;
    near_corner ? set_off_anew() : turn_at(before_);
  }
  const JointVec way = weighed(q - last());
  if (!has_direction_ && way.norm() > 1) {
    direction_ = way.normalized();
    has_direction_ = true;
  }
  before_ = q;
}

void WayOut::go_back() TRN_RT {
  before_ = last();
  if (count_ > 1) --count_;
  set_off_anew();
}

}  // namespace trn
