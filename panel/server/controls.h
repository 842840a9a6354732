#pragma once

#include <chrono>
#include <cstdint>

namespace trn {

using PageId = std::uint64_t;

/// Which page has the controls, and which asks for them. One page has them at a time. Another one asks; the
/// holder gives or keeps them. Who gets no answer may take them.
class Controls {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kUnanswered{10};  ///< then the asker may take them
  static constexpr std::chrono::seconds kAskEnds{60};

  PageId holder() const { return holder_; }  ///< 0: nobody
  PageId asker() const { return asker_; }    ///< 0: nobody
  bool may_take(Clock::time_point now) const { return asker_ != 0 && now - asked_ >= kUnanswered; }

  enum class Answer { kHas, kAsks, kAnotherAsks };
  /// A page wants them: it gets them where nobody has them or its question was not answered in time.
  Answer want(PageId page, Clock::time_point now);
  /// The holder lets the asker have them, or nobody. False: the page does not have them.
  bool give(PageId page);
  /// The holder keeps them; the asker's question ends. False: the page does not have them, or nobody asks.
  bool keep(PageId page);
  /// A page is closed.
  void gone(PageId page);
  /// True where something is new for pages: a question has ended, or the asker may take them from now on.
  bool step(Clock::time_point now);

 private:
  PageId holder_ = 0, asker_ = 0;
  Clock::time_point asked_;
  bool told_may_take_ = false;
};

}  // namespace trn
