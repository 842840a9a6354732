#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "hal/can/bus.h"
#include "hal/can/frame.h"

namespace trn {

/// An interface as the kernel knows it.
struct CanInterface {
  std::string name;
  bool up = false, fd = false, is_virtual = false;
  int queue_length = 0;  ///< frames that wait for the controller at most
};
/// The CAN interfaces of this host.
std::vector<CanInterface> can_interfaces();

/// A raw SocketCAN socket (Linux, PF_CAN): never waits but in `wait`, one system call for all frames of a
/// send, the kernel's time stamps on reception, error frames taken for the state of the controller.
class SocketCan final : public CanEndpoint {
 public:
  /// std::runtime_error with the remedy. `filters` empty: hears everything.
  SocketCan(const std::string& interface, const std::vector<CanFilter>& filters);
  ~SocketCan() override;
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  int send(std::span<const CanFrame> frames) TRN_RT override;
  int receive(std::span<CanFrame> frames) TRN_RT override;
  BusState state() const TRN_RT override { return state_; }
  std::int64_t now_ns() const TRN_RT override;
  std::int64_t confirmed_ns() const TRN_RT override { return confirmed_ns_; }
  void confirm_sends() override;
  bool carries_fd() const override { return fd_frames_; }
  void wait(std::int64_t timeout_ns) override;
  std::string recover() override;
  /// For poll.
  int fd() const { return fd_; }

 private:
  struct Buffers;
  /// Own frames of four full batches may stand between the others: more than a period sends.
  static constexpr int kRoundsMax = 4;

  int read_batch(std::size_t room) TRN_RT;
  bool take_message(std::size_t i, CanFrame& frame) TRN_RT;
  void take_error_frame(const CanFrame& frame) TRN_RT;
  void take_errno(int error) TRN_RT;

  std::string interface_;
  int fd_ = -1;
  bool fd_frames_ = false;
  BusState state_ = BusState::kOnline;
  std::int64_t confirmed_ns_ = 0, clock_offset_ns_ = 0;  ///< monotonic less real time, at the last send
  std::unique_ptr<Buffers> buffers_;
};

class SocketCanOpener final : public CanOpener {
 public:
  std::unique_ptr<CanEndpoint> open(const std::string& interface,
                                    const std::vector<CanFilter>& filters) override {
    return std::make_unique<SocketCan>(interface, filters);
  }
};

}  // namespace trn
