#include <cstdio>
#include <cstring>
#include <string>

#include "tests/world/scheduler_check.h"

int main(int argc, char** argv) {
  if (argc > 1 && std::strcmp(argv[1], "--scheduler") == 0) {
    const std::string bad = trn::world::check_scheduler();
    std::printf("scheduler: %s\n", bad.empty() ? "ok" : bad.c_str());
    return bad.empty() ? 0 : 1;
  }
  return 5;
}
