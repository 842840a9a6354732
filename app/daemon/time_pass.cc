#include "app/daemon/time_pass.h"

#include <pthread.h>
#include <sys/resource.h>

#include <string>
#include <utility>

namespace trn {

namespace {
// Of priorities that are not real-time: beside other work a tenth of a processor. With the least one (19) a
// busy computer keeps the next load waiting until this thread has heard that it shall end.
constexpr int kNice = 10;
}  // namespace

void TimePass::begin(const ProgramStart& start, const Parameters& parameters, const ToolTable& tools,
                     std::function<void(const ProgramTime&)> told) {
  end();
  end_ = false;
  ProgramStart own = start;
  own.open = [this](const std::string& path, bool may_be_missing) {
    return files_.open(path, may_be_missing);
  };
  thread_ = std::thread([this, own = std::move(own), parameters, tools, told = std::move(told)] {
    pthread_setname_np(pthread_self(), "time pass");
    setpriority(PRIO_PROCESS, 0, kNice);  // of this thread alone, on Linux
    const ProgramTime time = time_program(assembly_, parameters, tools, own, &end_);
    if (time.known && !end_) told(time);
  });
}

void TimePass::end() {
  end_ = true;
  if (thread_.joinable()) thread_.join();
}

}  // namespace trn
