#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "app/cli/client_session.h"
#include "app/cli/commands.h"
#include "core/axes.h"
#include "core/letter_case.h"
#include "core/machine.h"
#include "core/units.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;

constexpr std::int32_t kAliveMs = 100;  // the jog ends when this client has been silent for so long
constexpr auto kRenewEvery = std::chrono::milliseconds(25);
constexpr double kListen_s = 0.02;  // to the daemon, between two looks for a turn of the wheel
constexpr int kLookMs = 5;

struct JogOptions {
  ClientOptions client;
  std::string axis, distance, along;
  double speed = 0, percent = 0;
};

volatile std::sig_atomic_t let_go = 0;
void hear_let_go(int) { let_go = 1; }

bool is_held(const JogOptions& options) { return options.distance == "+" || options.distance == "-"; }

bool read_number(const std::string& text, double& value) {
  const char* begin = text.data() + (text.rfind('+', 0) == 0 ? 1 : 0);
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(begin, end, value);
  return read.ec == std::errc() && read.ptr == end && std::isfinite(value);
}

double distance_of(const std::string& text) {
  double value = 0;
  if (!read_number(text, value))
    throw CLI::ValidationError("distance",
                               fmt::format("'{}' is no number of mm, inch or degrees, as 10 or -0.5, "
                                           "and not + or - to jog until Ctrl-C",
                                           text));
  return value;
}

// By axis word, as a program means it; the daemon knows which joint moves. A joint that is called otherwise
// moves in its own direction.
command_t jog_command(const Machine& machine, const JogOptions& options, bool inch) {
  command_t command = command_of(command_t::JOG);
  const std::string upper = upper_case(options.axis);
  const std::size_t word = std::string_view(kWordLetters).find(upper);
  const bool by_word = upper.size() == 1 && word != std::string_view::npos;
  bool rotary = by_word && word >= static_cast<std::size_t>(kA);
  if (!options.along.empty() && !by_word)
    throw CLI::ValidationError(
        "axis", fmt::format("'{}' is no word; --along takes X, Y, Z, A, B or C", options.axis));
  command.frame = options.along == "machine" ? command_t::MACHINE
                  : options.along == "work"  ? command_t::WORK
                  : options.along == "tool"  ? command_t::TOOL
                                             : command_t::OWN;
  if (by_word) {
    command.text = upper;
  } else {
    command.joint = joint_index(machine, options.axis);
    rotary = machine.joints[static_cast<std::size_t>(command.joint)].kind == JointKind::kRotary;
  }
  const double unit = rotary ? kRadPerDeg : inch ? kMmPerInch : 1;
  if (is_held(options)) {
    command.value = options.distance == "+" ? 1 : -1;
    command.alive_ms = kAliveMs;
  } else {
    command.value = unit * distance_of(options.distance);
  }
  command.speed = unit * options.speed;
  command.speed_share = options.percent / 100;
  return command;
}

// As under a button: the daemon hears every 25 ms that it is still held. It stops the joint when it hears
// nothing for longer, as of a command that was suspended; that one does not begin again by itself. The answer
// to the first word comes when the way is planned, and the time that this takes is not this command's
// silence.
Exit jog_until_let_go(ClientSession& session, const JogOptions& options, command_t command) {
  std::signal(SIGINT, hear_let_go);
  std::signal(SIGTERM, hear_let_go);
  fmt::print(stderr, "{} moves {} until Ctrl-C, or its limit\n", options.axis, options.distance);
  using Clock = std::chrono::steady_clock;
  const std::chrono::milliseconds alive(command.alive_ms);
  Clock::time_point told = Clock::now();
  for (bool begun = false; let_go == 0; begun = true, std::this_thread::sleep_for(kRenewEvery)) {
    Clock::duration silent = Clock::now() - std::exchange(told, Clock::now());
    if (silent <= alive) {
      const acknowledge_t answer = session.client.send(command);
      if (answer.outcome != acknowledge_t::ACCEPTED) return exit_of(answer);
      if (!begun) {
        silent = session.client.longest_look();
        told = Clock::now();
      }
    }
    if (silent > alive) {
      fmt::print(stderr, "{} stopped, for this command stood still for {:.2f} s; jog anew\n", options.axis,
                 std::chrono::duration<double>(silent).count());
      return Exit::kMachineFault;
    }
  }
  command.value = 0;
  command.alive_ms = 0;
  ClientOptions to_rest = options.client;
  to_rest.wait = true;
  return send(session, to_rest, command);
}

// The unit of the next line of MDI, as the status shows positions.
bool in_inch(ClientSession& session, const ClientOptions& options) {
  const auto any = [](const trunnion::status_t&) { return true; };
  if (!session.client.last_status()) session.client.wait_status(any, options.timeout_s);
  return session.client.last_status() && session.client.last_status()->inch;
}

Exit jog(const JogOptions& options) {
  ClientSession session(options.client);
  const command_t command = jog_command(session.machine, options, in_inch(session, options.client));
  return is_held(options) ? jog_until_let_go(session, options, command)
                          : send(session, options.client, command);
}

// "X 5" or "X 5 0.1" as a jog of 5 counts of 0.1; false: the line is none.
bool read_counts(const std::string& line, JogOptions& options, double step) {
  std::istringstream words(line);
  std::string counts, own_step, more;
  words >> options.axis >> counts >> own_step >> more;
  double count = 0;
  if (!read_number(counts, count) || !more.empty()) return false;
  if (!own_step.empty() && !read_number(own_step, step)) return false;
  options.distance = fmt::format("{}", count * step);
  return count != 0 && step != 0;
}

/// Lines of the standard input, without waiting for long: a client that does not listen to its daemon for
/// long knows its clock no more.
class InputLines {
 public:
  /// The next line, if it is there within `timeout_ms`.
  std::optional<std::string> next(int timeout_ms) {
    pollfd waits{STDIN_FILENO, POLLIN, 0};
    if (text_.find('\n') == std::string::npos && !ended_ && poll(&waits, 1, timeout_ms) > 0) read_on();
    const std::size_t end = text_.find('\n');
    if (end == std::string::npos && !(ended_ && !text_.empty())) return std::nullopt;
    std::string line = text_.substr(0, end);
    text_.erase(0, end == std::string::npos ? end : end + 1);
    return line;
  }
  bool ended() const { return ended_ && text_.empty(); }

 private:
  void read_on() {
    char bytes[4096];
    const ssize_t got = read(STDIN_FILENO, bytes, sizeof bytes);
    if (got > 0) text_.append(bytes, static_cast<std::size_t>(got));
    ended_ = got == 0 || (got < 0 && errno != EINTR);
  }

  std::string text_;
  bool ended_ = false;
};

// A line that cannot be obeyed is told, and the next one is read: a wheel must not die of a limit switch.
Exit turn_wheel(const JogOptions& wheel, double step) {
  ClientSession session(wheel.client);
  session.compare_configs(wheel.client.timeout_s);
  JogOptions options = wheel;
  for (InputLines lines; !lines.ended();) {
    session.client.wait_status([](const trunnion::status_t&) { return true; }, kListen_s);
    while (const auto line = lines.next(kLookMs)) {
      if (line->find_first_not_of(" \t\r") == std::string::npos) continue;
      if (!read_counts(*line, options, step)) {
        fmt::print(stderr, "'{}' is no turn of a wheel: give an axis and counts, as in X 5, or X 5 0.1\n",
                   *line);
        continue;
      }
      try {
        exit_of(session.client.send(jog_command(session.machine, options, in_inch(session, wheel.client))));
      } catch (const CLI::ValidationError& error) {
        fmt::print(stderr, "{}\n", error.what());
      }
    }
  }
  return Exit::kDone;
}

}  // namespace

void add_wheel(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<JogOptions>();
  auto step = std::make_shared<double>(0.01);
  const std::shared_ptr<ClientOptions> client(options, &options->client);
  CLI::App& wheel = add_client(
      app, exit, client, "wheel",
      "Turn axes by the counts of a hand wheel. Reads a line for each turn from its input: the axis, "
      "the counts, and the way of a count if it is not that of --step. For example: "
      "echo 'X 5 0.1' | trunnion wheel. Turns of an axis that still moves add up",
      [options, step](const ClientOptions&) { return turn_wheel(*options, *step); });
  const auto check_step = [](const std::string& text) {
    double value = 0;
    return read_number(text, value) && value > 0
               ? std::string()
               : fmt::format("'{}' is no way of a count; give more than 0, as 0.01", text);
  };
  wheel.add_option("--step", *step, "Way of a count, in mm, inch (G20) or degrees")
      ->check(check_step)
      ->capture_default_str();
  wheel
      .add_option("--percent", options->percent,
                  "The speed in percent of the joint's limit; default: a tenth of it")
      ->check(CLI::Range(0.01, 100.0));
}

void add_jog(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<JogOptions>();
  const std::shared_ptr<ClientOptions> client(options, &options->client);
  CLI::App& jog_app =
      add_client(app, exit, client, "jog",
                 "Move one axis by a distance, as G91 G0 would, or until Ctrl-C. For example: "
                 "trunnion jog Y -0.5; trunnion jog Z + --percent 2",
                 [options](const ClientOptions&) { return jog(*options); });
  jog_app
      .add_option("axis", options->axis,
                  "X, Y, Z, A, B or C, in the word's direction; or a motor joint by its name in the config")
      ->required();
  jog_app
      .add_option("distance", options->distance,
                  "Signed, in mm, inch (G20) or degrees; ends at the axis' limit. + or -: until Ctrl-C; the "
                  "axis also stops a "
                  "tenth of a second after this command has died")
      ->required();
  CLI::Option* const speed =
      jog_app
          .add_option("--speed", options->speed,
                      "mm/s, inch/s (G20) or degrees/s, up to the joint's limit; default: a tenth of it")
          ->check(CLI::PositiveNumber);
  jog_app.add_option("--percent", options->percent, "The speed in percent of the joint's limit, instead")
      ->check(CLI::Range(0.01, 100.0))
      ->excludes(speed);
  jog_app
      .add_option(
          "--along", options->along,
          "work: the program's axes, with its rotation and tilted plane; tool: those of the spindle, Z away "
          "from the work; machine: the machine's axes, also where several joints move for one. Default: "
          "the one joint of the axis")
      ->check(CLI::IsMember({"machine", "work", "tool"}));
  add_wait(jog_app, client);
}

}  // namespace trn
