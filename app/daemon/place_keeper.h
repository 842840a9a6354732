#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "app/session/place_record.h"

namespace trn {

/// Keeps the newest place of the program on disk, in a thread of its own: a disk that is slow keeps nobody.
/// Of places that come faster than kGap the newest is written.
class PlaceKeeper {
 public:
  static constexpr double kGap_s = 0.05;    ///< between two records on disk
  static constexpr double kPatience_s = 2;  ///< with a disk that is slow

  explicit PlaceKeeper(std::string path);
  /// What was noted is on disk then.
  ~PlaceKeeper();
  PlaceKeeper(const PlaceKeeper&) = delete;
  PlaceKeeper& operator=(const PlaceKeeper&) = delete;

  /// Any thread.
  void note(PlaceRecord place);
  /// Any thread: until what was noted before is on disk or could not be written, for kPatience_s at most.
  void wait_until_kept();
  /// The last that was noted; else what the file holds. As read_place.
  PlaceRecord read() const;

 private:
  void run();

  std::string path_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, kept_;
  std::optional<PlaceRecord> next_, last_;  ///< to be written; noted last. Guarded by mutex_
  bool writes_ = false, closing_ = false;   ///< the same
  std::thread thread_;                      ///< the same, until closing_
};

}  // namespace trn
