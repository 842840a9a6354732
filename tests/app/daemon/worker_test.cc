#include "app/daemon/worker.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <thread>

namespace trn {
namespace {

TEST(Worker, IsBusyAsLongAsAJobIsAtWork) {
  Worker worker;
  EXPECT_FALSE(worker.busy());
  std::promise<void> begun, gate;
  worker.post([&] {
    begun.set_value();
    gate.get_future().wait();
    return Worker::Done();
  });
  begun.get_future().wait();
  EXPECT_TRUE(worker.busy());
  gate.set_value();
  while (worker.busy()) std::this_thread::yield();
  worker.collect();  // a job may leave nothing to do
}

// Nobody waits for jobs that have not begun when the worker goes.
TEST(Worker, FinishesTheJobAtHandAndDropsTheOthers) {
  std::atomic<int> begun = 0, ended = 0, finished = 0;
  std::promise<void> gate;
  std::shared_future<void> open = gate.get_future().share();
  auto worker = std::make_unique<Worker>();
  for (int i = 0; i < 3; ++i)
    worker->post([&, open] {
      ++begun;
      open.wait();
      ++ended;
      return Worker::Done([&] { ++finished; });
    });
  while (begun == 0) std::this_thread::yield();
  std::thread closing([&] { worker.reset(); });
  gate.set_value();
  closing.join();
  EXPECT_GE(ended, 1);
  EXPECT_EQ(begun, ended) << "what has begun is finished";
  EXPECT_EQ(finished, 0) << "the owner's part is the owner's";
}

TEST(Worker, TheOwnersPartRunsInTheOwnersThreadOnce) {
  Worker worker;
  std::atomic<bool> done = false;
  std::thread::id job, finish;
  int count = 0;
  worker.post([&] {
    job = std::this_thread::get_id();
    done = true;
    return Worker::Done([&] {
      finish = std::this_thread::get_id();
      ++count;
    });
  });
  while (count == 0) worker.collect();
  worker.collect();
  EXPECT_EQ(count, 1);
  EXPECT_EQ(finish, std::this_thread::get_id());
  EXPECT_NE(job, finish);
}

}  // namespace
}  // namespace trn
