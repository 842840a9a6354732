// test_world: sessions of the whole control in a world that one number decides.

#include <fmt/format.h>
#include <malloc.h>
#include <sched.h>
#include <sys/personality.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/world/scheduler_check.h"
#include "tests/world/session.h"

namespace {

// A session takes about a second of the processor. One that takes this much runs in a circle, and one that
// does nothing for this long hangs. The second is long, since a host may have much else to do.
constexpr unsigned kPatience_s = 120, kHangs_s = 1800;

struct Options {
  std::uint64_t first = 1, last = 200;
  bool verbose = false, twice = false, scheduler = false;
};

struct Result {
  bool good = false;
  std::string text;  ///< the finding; digest and length of a good session
};

struct Child {
  pid_t pid = 0;
  int fd = -1;
  std::uint64_t seed = 0;
  std::string folder;
  int processor = 0;
};

std::vector<int> own_processors() {
  cpu_set_t set;
  std::vector<int> out;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return {0};
  for (int i = 0; i < CPU_SETSIZE; ++i)
    if (CPU_ISSET(i, &set)) out.push_back(i);
  return out;
}

// Of a session's threads only one runs at a time, so on one processor the baton goes over without waking
// another. And memory that one life gave back is there for the next. Together a third less time.
void settle(int processor) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(processor, &set);
  sched_setaffinity(0, sizeof set, &set);
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_TOP_PAD, 64 << 20);
  mallopt(M_ARENA_MAX, 1);
}

Child begin(std::uint64_t seed, bool verbose, int processor) {
  std::string folder = (std::filesystem::temp_directory_path() / "trunnion-world-XXXXXX").string();
  if (!mkdtemp(folder.data())) std::exit(5);
  int ends[2];
  if (pipe(ends) != 0) std::exit(5);
  std::fflush(nullptr);
  const pid_t pid = fork();
  if (pid == 0) {
    close(ends[0]);
    settle(processor);
    const rlimit processor_time{kPatience_s, kPatience_s + 1};
    setrlimit(RLIMIT_CPU, &processor_time);
    alarm(kHangs_s);
    trn::world::live(seed, verbose, ends[1], folder);
  }
  close(ends[1]);
  return {pid, ends[0], seed, folder, processor};
}

Result finish(const Child& child, int status) {
  std::string text;
  char part[1024];
  for (ssize_t got; (got = read(child.fd, part, sizeof part)) > 0;)
    text.append(part, static_cast<std::size_t>(got));
  close(child.fd);
  if (!std::getenv("TRN_WORLD_KEEP")) std::filesystem::remove_all(child.folder);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {true, text};
  if (!text.empty()) return {false, text};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return {false, "runs in a circle"};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) return {false, "hangs: no end in real time"};
  if (WIFSIGNALED(status)) return {false, fmt::format("crash: {}", strsignal(WTERMSIG(status)))};
  return {false, fmt::format("ended by itself, exit code {}", WEXITSTATUS(status))};
}

/// Runs all seeds, as many at a time as there are processors.
class Runner {
 public:
  explicit Runner(const Options& options) : options_(options) {}

  int run() {
    if (options_.verbose) idle_.resize(1);
    for (std::uint64_t seed = options_.first; seed <= options_.last; ++seed) {
      const bool twice = options_.twice || seed % 10 == 0;
      for (int i = 0; i < (twice && !options_.verbose ? 2 : 1); ++i) {
        while (idle_.empty()) collect();
        const Child child = begin(seed, options_.verbose, idle_.back());
        idle_.pop_back();
        children_[child.pid] = child;
      }
    }
    while (!children_.empty()) collect();
    fmt::print("{} seeds, {:.0f} s of the machines' time, {} run twice: {}\n",
               options_.last - options_.first + 1, seconds_, compared_,
               findings_ == 0 ? "every promise was kept" : fmt::format("{} findings", findings_));
    return findings_ == 0 ? 0 : 1;
  }

 private:
  void collect() {
    int status = 0;
    const pid_t pid = waitpid(-1, &status, 0);
    const auto found = children_.find(pid);
    if (found == children_.end()) return;
    const Child child = found->second;
    children_.erase(found);
    idle_.push_back(child.processor);
    const Result result = finish(child, status);
    if (!result.good) tell(child.seed, result.text);
    if (result.good && result.text.size() > 17) seconds_ += std::atof(result.text.c_str() + 17);
    const auto [other, fresh] = results_.try_emplace(child.seed, result.text);
    if (fresh) return;
    ++compared_;
    if (other->second != result.text)
      tell(child.seed, fmt::format("two runs differ: {}; {}", other->second, result.text));
    results_.erase(other);
  }

  void tell(std::uint64_t seed, const std::string& text) {
    ++findings_;
    fmt::print("seed {}: {}; again with: test_world --seed {} --verbose\n", seed, text, seed);
    std::fflush(stdout);
  }

  Options options_;
  std::vector<int> idle_ = own_processors();
  std::map<pid_t, Child> children_;
  std::map<std::uint64_t, std::string> results_;
  double seconds_ = 0;
  int findings_ = 0, compared_ = 0;
};

int usage() {
  std::fputs("usage: test_world [--seeds A-B | --seed N] [--twice] [--verbose] | --scheduler\n", stderr);
  return 5;
}

bool read_options(int argc, char** argv, Options& options) {
  if (const char* many = std::getenv("TRN_LONG"))
    options.last = std::min(100'000ull, std::strtoull(many, nullptr, 10));
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const bool has_value = i + 1 < argc;
    if (name == "--verbose") {
      options.verbose = true;
    } else if (name == "--twice") {
      options.twice = true;
    } else if (name == "--scheduler") {
      options.scheduler = true;
    } else if (name == "--seed" && has_value) {
      options.first = options.last = std::strtoull(argv[++i], nullptr, 10);
    } else if (name == "--seeds" && has_value) {
      char* end = nullptr;
      options.first = std::strtoull(argv[++i], &end, 10);
      if (*end != '-') return false;
      options.last = std::strtoull(end + 1, nullptr, 10);
    } else {
      return false;
    }
  }
  return true;
}

// Where memory lies must not differ from run to run. Memory in large pages saves a third of the time: every
// session fills a queue of 30 MB, and in small pages each of them is a fault.
void fix_addresses(char** argv) {
  const int now = personality(0xffffffff);
  if (now < 0 || (now & ADDR_NO_RANDOMIZE)) return;
  setenv("GLIBC_TUNABLES", "glibc.malloc.hugetlb=1", 0);
  if (personality(static_cast<unsigned long>(now) | ADDR_NO_RANDOMIZE) >= 0) execv("/proc/self/exe", argv);
}

}  // namespace

int main(int argc, char** argv) {
  fix_addresses(argv);
  Options options;
  if (!read_options(argc, argv, options)) return usage();
  if (options.scheduler) {
    const std::string bad = trn::world::check_scheduler();
    fmt::print("scheduler: {}\n", bad.empty() ? "ok" : bad);
    return bad.empty() ? 0 : 1;
  }
  return Runner(options).run();
}
