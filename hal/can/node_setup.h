#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "hal/can/sdo.h"

namespace trn {

/// One thing that a node is told or asked before it starts.
struct SetupStep {
  enum class Kind : std::uint8_t {
    kWrite,
    kWriteIfThere,  ///< a node without the object does without it
    kWish,          ///< a refusal is a warning
    kSetBits,       ///< reads, and writes with the bits of `bytes`, if the node has the object
    kCheck,         ///< what it answers must be `bytes`
    kCheckIfThere,  ///< a node without the object passes
    kAtMost,        ///< warns if it is more than `bound`
    kAtLeast,       ///< warns if it is less
  };
  Kind kind = Kind::kWrite;
  ObjectKey key;
  std::vector<std::uint8_t> bytes;
  std::string what;    ///< "mapping of TPDO 1", for messages
  std::string remedy;  ///< when it is refused
  std::int64_t bound = 0;
  bool is_signed = false, zero_passes = false;  ///< of a bound
};

/// Brings one node from wherever it stands to Operational: pre-operational, is it the one, has it been
/// restarted, every step, start, wait for its heartbeat. Pure: frames and time in, frames out.
class NodeSetup {
 public:
  struct Config {
    int id = 1;
    std::string name;  ///< "can0 node 3 (joint Z)"
    std::vector<SetupStep> steps;
    SetupStep
        signature;  ///< an object that only a node that was set up by us, and not restarted since, holds
    bool wait_for_heartbeat = true;
    bool guards = false;  ///< it tells its state when it is asked
    std::int64_t sdo_timeout_ns = 500'000'000, boot_timeout_ns = 3'000'000'000;
    int retries = 1;  ///< of a step that was not answered
  };

  NodeSetup(const Config& config, std::int64_t now_ns);

  void receive(const CanFrame& frame, std::int64_t now_ns);
  void poll(std::int64_t now_ns);
  bool next_frame(CanFrame& frame);

  bool finished() const { return phase_ == Phase::kDone || phase_ == Phase::kFailed; }
  const std::string& error() const { return error_; }
  /// What was refused and can be done without.
  const std::vector<std::string>& warnings() const { return warnings_; }
  bool was_restarted() const { return restarted_; }

 private:
  enum class Phase : std::uint8_t { kSignature, kSteps, kStart, kDone, kFailed };

  void begin_step(std::int64_t now_ns);
  void finish_signature(std::int64_t now_ns);
  void finish_step(std::int64_t now_ns);
  void judge_value(std::int64_t now_ns);
  void go_on(std::int64_t now_ns);
  void judge_bound(const SetupStep& step);
  bool may_pass(const SetupStep& step) const;
  std::string refusal(const SetupStep& step) const;
  void start(std::int64_t now_ns);
  void fail(const std::string& what);
  std::string abort_text() const;

  Config config_;
  SdoClient sdo_;
  Phase phase_ = Phase::kSignature;
  std::vector<CanFrame> nmt_;
  std::size_t step_ = 0;
  int tries_ = 0;
  bool restarted_ = true, set_bits_read_ = false;
  std::int64_t deadline_ns_ = 0, next_guard_ns_ = 0;
  std::string error_;
  std::vector<std::string> warnings_;
  std::vector<std::uint8_t> found_;  ///< what stood in the object of a kSetBits
};

}  // namespace trn
