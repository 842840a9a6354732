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
    kCheck,         ///< what it answers must be `bytes`
  };
  Kind kind = Kind::kWrite;
  ObjectKey key;
  std::vector<std::uint8_t> bytes;
  std::string what;    ///< "mapping of TPDO 1", for messages
  std::string remedy;  ///< when it is refused
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
    std::int64_t sdo_timeout_ns = 500'000'000, boot_timeout_ns = 3'000'000'000;
    int retries = 1;  ///< of a step that was not answered
  };

  NodeSetup(const Config& config, std::int64_t now_ns);

  void receive(const CanFrame& frame, std::int64_t now_ns);
  void poll(std::int64_t now_ns);
  bool next_frame(CanFrame& frame);

  bool finished() const { return phase_ == Phase::kDone || phase_ == Phase::kFailed; }
  const std::string& error() const { return error_; }
  bool was_restarted() const { return restarted_; }

 private:
  enum class Phase : std::uint8_t { kSignature, kSteps, kStart, kDone, kFailed };

  void begin_step(std::int64_t now_ns);
  void finish_signature(std::int64_t now_ns);
  void finish_step(std::int64_t now_ns);
  void judge_value(std::int64_t now_ns);
  void start(std::int64_t now_ns);
  void fail(const std::string& what);
  std::string abort_text() const;

  Config config_;
  SdoClient sdo_;
  Phase phase_ = Phase::kSignature;
  std::vector<CanFrame> nmt_;
  std::size_t step_ = 0;
  int tries_ = 0;
  bool restarted_ = true;
  std::int64_t deadline_ns_ = 0;
  std::string error_;
};

}  // namespace trn
