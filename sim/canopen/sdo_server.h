#pragma once

#include <vector>

#include "hal/can/frame.h"
#include "hal/can/sdo.h"
#include "sim/canopen/frame_queue.h"
#include "sim/canopen/object_store.h"

namespace trn {

/// The server's side of SDO transfers: expedited, segmented and block, both ways (CiA 301, 7.2.4). Written
/// from the standard, apart from the client.
class SdoServer {
 public:
  using Written = std::function<void(ObjectKey)>;

  SdoServer(int node, ObjectStore& store, Written written)
      : node_(node), store_(store), written_(std::move(written)) {}

  /// A request; answers are put into `answers`.
  void receive(const CanFrame& frame, FrameQueue& answers);
  void reset() { mode_ = Mode::kIdle; }
  void set_node(int node) { node_ = node; }
  /// Objects of this index abort with `code` from now on; 0: no more.
  void refuse(std::uint16_t index, std::uint32_t code) {
    refused_index_ = index;
    refused_code_ = code;
  }

 private:
  enum class Mode : std::uint8_t {
    kIdle,
    kDownload,
    kUpload,
    kBlockDownload,
    kBlockDownloadEnd,
    kBlockUpload
  };

  void answer(std::initializer_list<std::uint8_t> head, std::span<const std::uint8_t> rest = {});
  void abort(std::uint32_t code);
  std::uint32_t load();
  void store();
  void start_download(const CanFrame& frame);
  void take_segment(const CanFrame& frame);
  void start_upload();
  void give_segment(const CanFrame& frame);
  void start_block_download(const CanFrame& frame);
  void take_block_segment(const CanFrame& frame);
  void end_block_download(const CanFrame& frame);
  void block_upload(const CanFrame& frame);
  void give_block();

  int node_;
  ObjectStore& store_;
  Written written_;
  FrameQueue* answers_ = nullptr;
  Mode mode_ = Mode::kIdle;
  ObjectKey key_;
  std::vector<std::uint8_t> data_;
  std::size_t position_ = 0, block_start_ = 0;
  int block_size_ = 127, sequence_ = 0;
  bool toggle_ = false;
  std::uint16_t refused_index_ = 0;
  std::uint32_t refused_code_ = 0;
};

}  // namespace trn
