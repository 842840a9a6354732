#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <queue>
#include <thread>
#include <vector>

namespace trn {

/// One thread that does jobs in order: whatever may take longer than a command's answer (bring-up, opening
/// and planning a program). A job returns what the owner's thread shall do when it is over.
class Worker {
 public:
  using Done = std::function<void()>;
  using Job = std::function<Done()>;

  Worker();
  /// Finishes the job at hand and drops the others.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void post(Job job);
  /// A job is at work. Until it is over, this cannot be destroyed.
  bool busy() const;
  /// Neither is a job at work nor does one wait.
  bool idle() const;
  /// Waits until all jobs are over.
  void finish();
  /// In the owner's thread: runs what finished jobs have left to do.
  void collect();

 private:
  void run();

  mutable std::mutex mutex_;
  std::condition_variable wake_, idle_;
  std::queue<Job> jobs_;
  std::vector<Done> done_;
  bool closing_ = false, busy_ = false;
  std::thread thread_;
};

}  // namespace trn
