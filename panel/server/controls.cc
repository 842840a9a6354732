#include "panel/server/controls.h"

#include <utility>

namespace trn {

Controls::Answer Controls::want(PageId page, Clock::time_point now) {
  if (asker_ != 0 && asker_ != page && holder_ != page) return Answer::kAnotherAsks;
  if (holder_ == page) return Answer::kHas;
  if (holder_ == 0 || (asker_ == page && may_take(now))) {
    holder_ = page;
    asker_ = 0;
    return Answer::kHas;
  }
  if (asker_ == page) return Answer::kAsks;
  asker_ = page;
  asked_ = now;
  told_may_take_ = false;
  return Answer::kAsks;
}

bool Controls::give(PageId page) {
  if (page == 0 || holder_ != page) return false;
  holder_ = std::exchange(asker_, 0);
  return true;
}

bool Controls::keep(PageId page) {
  if (page == 0 || holder_ != page || asker_ == 0) return false;
  asker_ = 0;
  return true;
}

void Controls::gone(PageId page) {
  if (asker_ == page) asker_ = 0;
  if (holder_ != page) return;
  holder_ = asker_ = 0;  // who asked sees that they are free
}

bool Controls::step(Clock::time_point now) {
  if (asker_ == 0) return false;
  if (now - asked_ >= kAskEnds) {
    asker_ = 0;
    return true;
  }
  return may_take(now) && !std::exchange(told_may_take_, true);
}

}  // namespace trn
