#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <random>

#include "core/axes.h"
#include "core/ports.h"

namespace trn::world {

/// What goes wrong with the drives of a session, and where they really stand. One object a session, in the
/// tick's thread.
class Harm {
 public:
  /// share: of the periods, those in which something happens.
  Harm(double share, std::uint64_t seed) : share_(share), random_(seed) {}
  virtual ~Harm() = default;
  Harm(const Harm&) = delete;
  Harm& operator=(const Harm&) = delete;

  /// Before each exchange.
  void step();
  void calm_down() { share_ = 0; }
  /// Encoders' places, mm or rad. A drive that was not heard may tell of a way at once when it is heard
  /// again.
  virtual JointVec places() = 0;
  /// In this period something was broken or mended: a drive that restarts counts its places anew.
  bool acted() const { return acted_; }
  /// Calls of the daemon's worker must be made in the tick's thread: the emulated field lives in one thread.
  virtual bool one_thread() const { return false; }
  /// A bring-up would not wait for the tick, which is its own thread then.
  virtual bool may_bring_up() const { return true; }

 protected:
  virtual void strike() = 0;
  int below(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  /// Tells it, and undoes it some time later.
  void for_a_while(const char* what, std::function<void()> mend);

 private:
  double share_;
  std::mt19937_64 random_;
  std::uint64_t period_ = 0;
  std::multimap<std::uint64_t, std::function<void()>> mends_;
  bool acted_ = false;
};

/// For drives that are simulated or emulated on CAN; null for others.
std::unique_ptr<Harm> make_harm(Drives& drives, Eigen::Index joints, double share, std::uint64_t seed);

}  // namespace trn::world
