#include "panel/server/log_in.h"

#include <fmt/format.h>
#include <sodium.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <utility>

#include "app/client/signing_key.h"

namespace trn {

namespace {

using namespace std::chrono_literals;

constexpr std::size_t kKnownMax = 4096, kComparedMax = 8, kSessionsMax = 1000, kTokenBytes = 32;
constexpr int kWrongOfAddress = 5, kWrongOfName = 20;
constexpr auto kForgetAddress = 60s, kForgetName = 600s;
constexpr auto kLookEvery = 500ms;
constexpr int kNice = 10;  // the machine's own work goes first

// Of all that `read_users` looks at.
std::string mark_of(const std::string& path) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0) return "";
  return fmt::format("{} {} {} {} {}.{}", info.st_ino, info.st_mode, info.st_uid, info.st_size,
                     info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
}

}  // namespace

bool WrongTries::may(const std::string& who, Clock::time_point now) {
  const auto found = wrong_.find(who);
  if (found == wrong_.end()) return true;
  if (now - found->second.last >= forget_) {
    wrong_.erase(found);
    return true;
  }
  return found->second.times < wrong_max_;
}

void WrongTries::failed(const std::string& who, Clock::time_point now) {
  if (wrong_.size() >= kKnownMax && !wrong_.contains(who))
    wrong_.erase(std::min_element(wrong_.begin(), wrong_.end(), [](const auto& one, const auto& other) {
      return one.second.last < other.second.last;
    }));
  Wrong& wrong = wrong_[who];
  ++wrong.times;
  wrong.last = now;
}

LogIn::LogIn(std::string users_file, std::chrono::seconds session_life)
    : path_(std::move(users_file)),
      life_(session_life),
      nobody_(hash_of_nobody()),
      users_(read_users(path_)),
      file_mark_(mark_of(path_)),
      looked_(Clock::now()),
      of_address_(kWrongOfAddress, kForgetAddress),
      of_name_(kWrongOfName, kForgetName),
      thread_([this] { work(); }) {}

LogIn::~LogIn() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  news_.notify_all();
  thread_.join();
}

const User* LogIn::find(const std::string& name) const {
  const auto found =
      std::find_if(users_.begin(), users_.end(), [&](const User& user) { return user.name == name; });
  return found == users_.end() ? nullptr : &*found;
}

// Each try counts as a failure until it is none, so that many at once are not more than one after the other.
LogIn::Begun LogIn::begin(std::uint64_t ticket, const std::string& said, std::string password,
                          const std::string& address) {
  const auto now = Clock::now();
  const std::string name = refuse_key_name(said).empty() ? said : "?";  // it goes into the log
  if (!of_address_.may(address, now) || !of_name_.may(name, now)) return Begun::kTooOften;
  const User* user = find(name);
  {
    const std::lock_guard lock(mutex_);
    if (asked_.size() >= kComparedMax) return Begun::kBusy;
    asked_.push_back({ticket, name, std::move(password), user ? user->hash : nobody_});
  }
  of_address_.failed(address, now);
  of_name_.failed(name, now);
  addresses_[ticket] = address;
  news_.notify_all();
  return Begun::kWorks;
}

void LogIn::work() {
  setpriority(PRIO_PROCESS, 0, kNice);  // of this thread, on Linux
  std::unique_lock lock(mutex_);
  for (;;) {
    news_.wait(lock, [this] { return ends_ || !asked_.empty(); });
    if (ends_) return;
    Task task = std::move(asked_.front());
    asked_.pop_front();
    lock.unlock();
    task.right = is_password(task.hash, task.password);
    sodium_memzero(task.password.data(), task.password.size());
    lock.lock();
    done_.push_back(std::move(task));
  }
}

std::vector<LogIn::Result> LogIn::take_results() {
  std::deque<Task> done;
  {
    const std::lock_guard lock(mutex_);
    done.swap(done_);
  }
  std::vector<Result> results;
  for (const Task& task : done) {
    const std::string address = addresses_.extract(task.ticket).mapped();
    const User* user = find(task.name);
    const bool right = task.right && user && user->hash == task.hash;
    if (right) {
      of_address_.succeeded(address);
      of_name_.succeeded(task.name);
    }
    fmt::print(stderr, "panel: {} of '{}' from {}\n", right ? "log-in" : "refused log-in", task.name,
               address);
    results.push_back({task.ticket, task.name, right ? open_session(task) : ""});
  }
  return results;
}

std::string LogIn::open_session(const Task& task) {
  std::array<unsigned char, kTokenBytes> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  std::array<char, 2 * kTokenBytes + 1> text{};
  sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
  if (sessions_.size() >= kSessionsMax)
    sessions_.erase(std::min_element(
        sessions_.begin(), sessions_.end(),
        [](const auto& one, const auto& other) { return one.second.ends < other.second.ends; }));
  sessions_[id_of(text.data())] = {task.name, task.hash, Clock::now() + life_};
  return text.data();
}

// What a map compares byte by byte tells by its time nothing of a token that made this hash.
LogIn::SessionId LogIn::id_of(std::string_view token) {
  std::array<unsigned char, crypto_generichash_BYTES> hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(token.data()),
                     token.size(), nullptr, 0);
  return {reinterpret_cast<const char*>(hash.data()), hash.size()};
}

std::optional<Visitor> LogIn::visitor(const SessionId& id) const {
  const auto found = sessions_.find(id);
  if (found == sessions_.end() || Clock::now() >= found->second.ends) return std::nullopt;
  const User* user = find(found->second.name);
  if (!user || user->hash != found->second.hash) return std::nullopt;
  return Visitor{user->name, user->role};
}

void LogIn::step() {
  const auto now = Clock::now();
  if (now - looked_ < kLookEvery) return;
  looked_ = now;
  std::erase_if(sessions_, [&](const auto& one) { return now >= one.second.ends; });
  if (std::string mark = mark_of(path_); mark != file_mark_) {
    file_mark_ = std::move(mark);
    try {
      users_ = read_users(path_);
    } catch (const UserError& error) {
      // Who was removed must not stay because the file is not sound: nobody has a session then.
      users_.clear();
      fmt::print(stderr, "panel: nobody can log in: {}\n", error.what());
    }
  }
}

}  // namespace trn
