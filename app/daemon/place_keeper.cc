#include "app/daemon/place_keeper.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "core/safe_file.h"
#include "interp/move.h"

namespace trn {

PlaceKeeper::PlaceKeeper(std::string path) : path_(std::move(path)) {}

PlaceKeeper::~PlaceKeeper() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void PlaceKeeper::note(PlaceRecord place) {
  const std::lock_guard lock(mutex_);
  last_ = place;
  next_ = std::move(place);
  wake_.notify_one();
  // Not before: by now the process has blocked the signals that shall not end it.
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
}

void PlaceKeeper::wait_until_kept() {
  std::unique_lock lock(mutex_);
  kept_.wait_for(lock, std::chrono::duration<double>(kPatience_s), [this] { return !next_ && !writes_; });
}

PlaceRecord PlaceKeeper::read() const {
  std::optional<PlaceRecord> last;
  {
    const std::lock_guard lock(mutex_);
    last = last_;
  }
  if (!last) return read_place(path_);
  return parse_place(place_file_text(*last), path_);
}

void PlaceKeeper::run() {
  pthread_setname_np(pthread_self(), "place");
  bool told = false;
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return next_ || closing_; });
    if (!next_) return;
    const PlaceRecord place = *std::exchange(next_, std::nullopt);
    writes_ = true;
    lock.unlock();
    try {
      write_file_safely(path_, place_file_text(place));
      told = false;
    } catch (const FileError& error) {
      if (!std::exchange(told, true))
        spdlog::error("where the program is cannot be recorded: {}; 'start --resume' will not find it",
                      error.what());
    }
    lock.lock();
    writes_ = false;
    kept_.notify_all();
    wake_.wait_for(lock, std::chrono::duration<double>(kGap_s), [this] { return closing_; });
  }
}

}  // namespace trn
