#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <ctime>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "app/client/command_rights.h"
#include "panel/server/user_file.h"

namespace trn {

/// Who looks at a page, or asks for something. Without a log-in nobody has a name.
struct Visitor {
  std::string name;
  Role role = Role::kLook;
  bool operator==(const Visitor&) const = default;
};

/// How often somebody may be wrong: after `wrong_max` failures within `forget` nothing is looked at until
/// that long after the last of them.
class WrongTries {
 public:
  using Clock = std::chrono::steady_clock;
  WrongTries(int wrong_max, Clock::duration forget) : wrong_max_(wrong_max), forget_(forget) {}

  bool may(const std::string& who, Clock::time_point now);
  void failed(const std::string& who, Clock::time_point now);
  void succeeded(const std::string& who) { wrong_.erase(who); }

 private:
  struct Wrong {
    int times = 0;
    Clock::time_point last;
  };
  int wrong_max_;
  Clock::duration forget_;
  std::map<std::string, Wrong> wrong_;  ///< at most kKnownMax
};

/// The door of a panel that others reach over a network: users of a file, their sessions, and the limit on
/// failed log-ins. A password is compared in a thread of its own, one at a time, so that no page waits for
/// it; all else is called from one thread.
class LogIn {
 public:
  using Clock = std::chrono::steady_clock;
  using SessionId = std::string;  ///< a hash of the token, which itself is in the cookie only

  /// UserError where the file of users cannot be used.
  LogIn(std::string users_file, std::chrono::seconds session_life);
  ~LogIn();
  LogIn(const LogIn&) = delete;
  LogIn& operator=(const LogIn&) = delete;

  enum class Begun { kWorks, kTooOften, kBusy };
  /// `ticket` comes back with the result.
  Begun begin(std::uint64_t ticket, const std::string& name, std::string password,
              const std::string& address);

  struct Result {
    std::uint64_t ticket = 0;
    std::string name;
    std::string token;  ///< of the new session; "": name or password is wrong
  };
  /// Those that are new.
  std::vector<Result> take_results();

  /// Takes the file of users up again where it has changed, and forgets sessions that are over.
  void step();

  static SessionId id_of(std::string_view token);
  /// Whose session this is; nothing where it is none, is over, or its user is gone.
  std::optional<Visitor> visitor(const SessionId& id) const;
  void end(const SessionId& id) { sessions_.erase(id); }
  std::chrono::seconds session_life() const { return life_; }

 private:
  struct Task {
    std::uint64_t ticket = 0;
    std::string name, password, hash;
    bool right = false;
  };
  struct Session {
    std::string name, hash;  ///< of the password with which it was opened
    Clock::time_point ends;
  };

  void work();
  std::string open_session(const Task& task);
  const User* find(const std::string& name) const;

  std::string path_;
  std::chrono::seconds life_;
  std::string nobody_;
  std::vector<User> users_;
  std::string file_mark_;  ///< tells one state of the file from another
  Clock::time_point looked_;
  std::map<SessionId, Session> sessions_;
  WrongTries of_address_, of_name_;
  std::map<std::uint64_t, std::string> addresses_;  ///< of what is compared now

  std::mutex mutex_;
  std::condition_variable news_;
  bool ends_ = false;
  std::deque<Task> asked_, done_;
  std::thread thread_;
};

}  // namespace trn
