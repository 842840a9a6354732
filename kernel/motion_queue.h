#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <vector>

#include "core/axes.h"
#include "core/check.h"
#include "core/motion.h"
#include "core/realtime.h"

namespace trn {

/// What the machine answers to an event that the program's planning waits for, in the events' order.
struct ProgramAnswer {
  double value = 0;               ///< kWaitInput: the input, -1: not in time; kProbeEnd: 1 contact, 0 none
  bool probe = false;             ///< kProbeEnd:
  JointVec q_contact;             ///< measured where the probe changed, mm or rad
  Words y_stand = Words::Zero();  ///< where the path now ends, as in PathPiece
};

/// The ring between planner and tick, with what both must know of its content: how much motion it holds, and
/// whether a stop is among it. Blocks belong to a generation (a program); those of a dropped one are skipped.
/// One writer, one reader, nobody waits. The reader may look at everything in the ring, not only at its
/// front, and sees what was there when it last called `look`: all it decides in a period rests on that count.
///
/// Writer and reader may be two processes, where `memory` and this object lie in memory that both have at the
/// same place.
class MotionQueue {
 public:
  /// `past`: so many blocks stay as they are behind the front (`kept`); there is less room ahead of it.
  explicit MotionQueue(std::size_t capacity,
                       std::pmr::memory_resource* memory = std::pmr::get_default_resource(),
                       std::size_t past = 0)
      : items_(capacity, memory), past_(past) {
    TRN_CHECK(past < capacity);
  }
  /// Memory for the blocks of a queue.
  static constexpr std::size_t bytes(std::size_t capacity) { return capacity * sizeof(Item); }

  // Planner's side.
  /// False if the ring is full.
  bool push(const MotionBlock& block) {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    TRN_CHECK(block.segment_count <= MotionBlock::kMaxSegments);
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    const std::uint64_t kept = std::min(head, kept_from_.load(std::memory_order_acquire));
    if (tail - kept >= items_.size() - past_) return false;
    const double block_s = duration_s(block);
    pushed_ns_.fetch_add(static_cast<std::int64_t>(1e9 * block_s), std::memory_order_relaxed);
    if (is_stop(block)) pushed_stops_.fetch_add(1, std::memory_order_relaxed);
    items_[tail % items_.size()] = {
        block, generation_.load(std::memory_order_relaxed), ++number_, pushed_ns_, pushed_stops_, block_s};
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  /// What is pushed from now on belongs to a new program.
  void begin_generation() {
    answers_taken_.store(answers_given_.load(std::memory_order_acquire), std::memory_order_release);
    number_ = 0;
    generation_.fetch_add(1, std::memory_order_acq_rel);
  }
  /// The next answer that the program waits for; false if it has not come yet.
  bool take_answer(ProgramAnswer& answer) {
    const std::uint32_t taken = answers_taken_.load(std::memory_order_relaxed);
    if (taken == answers_given_.load(std::memory_order_acquire)) return false;
    answer = answers_[taken % kAnswersMax];
    answers_taken_.store(taken + 1, std::memory_order_release);
    return true;
  }
  /// The writer has ended, perhaps within `push`; another one takes its place.
  void replace_writer() {
    const std::uint64_t tail = tail_.load(std::memory_order_acquire);
    const Item* const last = tail == 0 ? nullptr : &items_[(tail - 1) % items_.size()];
    pushed_ns_.store(last ? last->end_ns : 0, std::memory_order_release);
    pushed_stops_.store(last ? last->stops : 0, std::memory_order_release);
    number_ = 0;
  }
  /// Plan time behind the block that is being driven.
  double buffered_s() const {
    return 1e-9 * static_cast<double>(pushed_ns_.load(std::memory_order_acquire) -
                                      begun_ns_.load(std::memory_order_acquire));
  }
  bool holds_stop() const {
    return pushed_stops_.load(std::memory_order_acquire) != popped_stops_.load(std::memory_order_acquire);
  }

  // Tick's side.
  void answer(const ProgramAnswer& answer) TRN_RT {
    const std::uint32_t given = answers_given_.load(std::memory_order_relaxed);
    if (given - answers_taken_.load(std::memory_order_acquire) >= kAnswersMax) return;
    answers_[given % kAnswersMax] = answer;
    answers_given_.store(given + 1, std::memory_order_release);
  }
  /// Takes notice of what has been pushed by now.
  void look() TRN_RT {
    const std::uint64_t tail = tail_.load(std::memory_order_acquire);
    TRN_CHECK(tail >= seen_ && tail - head_.load(std::memory_order_relaxed) <= items_.size());
    if (tail != seen_) seen_number_ = items_[(tail - 1) % items_.size()].number;
    seen_ = tail;
  }
  /// The number of the front, counted from the first block ever pushed.
  std::uint64_t front_number() const TRN_RT { return head_.load(std::memory_order_relaxed); }
  /// Blocks from this number on stay where they are, though the tick has passed them: somebody looks at them.
  void keep_from(std::uint64_t number) TRN_RT { kept_from_.store(number, std::memory_order_release); }
  void keep_nothing() TRN_RT { keep_from(std::numeric_limits<std::uint64_t>::max()); }
  /// What is seen now, for a look from beside the tick at what is kept.
  class View {
   public:
    View() = default;
    View(const MotionQueue& queue) TRN_RT : queue_(&queue), seen_(queue.seen_), dropped_(queue.dropped_) {}
    /// The block with this number; null if it was not seen yet.
    const MotionBlock* at(std::uint64_t number) const {
      if (number >= seen_) return nullptr;
      const Item& item = queue_->items_[number % queue_->items_.size()];
      return item.generation > dropped_ ? &item.block : nullptr;
    }

   private:
    const MotionQueue* queue_ = nullptr;
    std::uint64_t seen_ = 0, dropped_ = 0;
  };
  View view() const TRN_RT { return View(*this); }
  /// How many blocks of its program the last one seen completes.
  std::uint32_t seen_number() const TRN_RT { return seen_number_; }
  const MotionBlock* front() TRN_RT {
    for (int skipped = 0; sees(0) && item(0).generation <= dropped_ && skipped < kDropsPerTick; ++skipped)
      pop();
    return ahead(0);
  }
  /// The block with this number: one that is seen, or of the past, as far as that is kept; null else.
  const MotionBlock* kept(std::uint64_t number) const TRN_RT {
    if (number >= seen_ || number < oldest()) return nullptr;
    const Item& item = items_[number % items_.size()];
    return item.generation > dropped_ ? &item.block : nullptr;
  }
  /// The front is the kept block with this number; `begun`: it is being driven.
  void go_to(std::uint64_t number, bool begun) TRN_RT {
    TRN_CHECK(number >= oldest() && number <= seen_ && number > 0);
    floor_ = oldest();
    head_.store(number, std::memory_order_release);
    const Item& before = items_[(number - 1) % items_.size()];
    begun_ = begun;
    begun_ns_.store(begun ? item(0).end_ns : before.end_ns, std::memory_order_release);
    popped_stops_.store(before.stops, std::memory_order_release);
  }
  /// The block `index` places behind the front; null if it is not seen yet.
  const MotionBlock* ahead(std::uint64_t index) const TRN_RT {
    return sees(index) && item(index).generation > dropped_ ? &item(index).block : nullptr;
  }
  /// The same with all that is known of it.
  struct Ahead {
    const MotionBlock* block = nullptr;  ///< null if it is not seen yet
    std::uint32_t number = 0;            ///< its place in its program, from 1
    double duration_s = 0;               ///< of its segments
  };
  Ahead look_ahead(std::uint64_t index) const TRN_RT {
    if (!sees(index)) return {};
    const Item& it = item(index);
    return it.generation > dropped_ ? Ahead{&it.block, it.number, it.duration_s} : Ahead{};
  }
  /// Its place in its program, from 1; 0 if it is not seen yet.
  std::uint32_t number_ahead(std::uint64_t index) const TRN_RT {
    return ahead(index) ? item(index).number : 0;
  }
  /// The front is being driven: its time no longer counts as ahead.
  void begin_front() TRN_RT {
    if (begun_ || !sees(0)) return;
    begun_ = true;
    begun_ns_.store(item(0).end_ns, std::memory_order_release);
  }
  void pop() TRN_RT {
    if (!sees(0)) return;
    begin_front();
    begun_ = false;
    popped_stops_.store(item(0).stops, std::memory_order_release);
    TRN_CHECK(item(0).number > 0);
    head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }
  /// Forgets everything pushed so far.
  void drop_all() TRN_RT { dropped_ = generation_.load(std::memory_order_acquire); }
  /// As `buffered_s` and `holds_stop`, of what is seen.
  double seen_s() const TRN_RT {
    return sees(0) ? 1e-9 * static_cast<double>(last().end_ns - begun_ns_.load(std::memory_order_relaxed))
                   : 0;
  }
  bool sees_stop() const TRN_RT {
    return sees(0) && last().stops != popped_stops_.load(std::memory_order_relaxed);
  }

 private:
  struct Item {
    MotionBlock block;
    std::uint64_t generation = 0;
    std::uint32_t number = 0;            ///< in its program, from 1
    std::int64_t end_ns = 0, stops = 0;  ///< pushed up to and with this one
    double duration_s = 0;
  };
  static constexpr int kDropsPerTick = 64;
  static constexpr std::uint32_t kAnswersMax = 8;  ///< a block of the program asks at most twice

  // One less than `past_`: the writer may be about to fill the one behind.
  std::uint64_t oldest() const TRN_RT {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    return std::max(floor_, head - std::min<std::uint64_t>(head, past_ > 2 ? past_ - 2 : 0));
  }
  bool sees(std::uint64_t index) const TRN_RT {
    return head_.load(std::memory_order_relaxed) + index < seen_;
  }
  const Item& item(std::uint64_t index) const TRN_RT {
    return items_[(head_.load(std::memory_order_relaxed) + index) % items_.size()];
  }
  const Item& last() const TRN_RT { return items_[(seen_ - 1) % items_.size()]; }
  static bool is_stop(const MotionBlock& block) { return block.segment_count == 0 || block.ends_at_rest; }
  static double duration_s(const MotionBlock& block) {
    double sum = 0;
    for (int i = 0; i < block.segment_count; ++i)
      sum += block.segments[static_cast<std::size_t>(i)].duration_s;
    return sum;
  }

  std::pmr::vector<Item> items_;
  std::array<ProgramAnswer, kAnswersMax> answers_;
  std::atomic<std::uint32_t> answers_given_{0}, answers_taken_{0};
  std::atomic<std::uint64_t> head_{0}, tail_{0};  ///< counts of all blocks popped and pushed
  std::atomic<std::uint64_t> kept_from_{std::numeric_limits<std::uint64_t>::max()};
  std::atomic<std::uint64_t> generation_{1};
  std::atomic<std::int64_t> pushed_ns_{0}, begun_ns_{0};
  std::atomic<std::int64_t> pushed_stops_{0}, popped_stops_{0};
  std::uint32_t number_ = 0;              ///< the planner's own
  std::uint64_t seen_ = 0, dropped_ = 0;  ///< the tick's own
  std::uint64_t floor_ = 0;               ///< the same: what was behind this is no longer kept
  std::size_t past_ = 0;
  std::uint32_t seen_number_ = 0;
  bool begun_ = false;
};

}  // namespace trn
