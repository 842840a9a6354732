#include "tests/world/clients.h"

#include <fmt/format.h>

#include <chrono>
#include <system_error>
#include <thread>

#include "hal/local_socket.h"
#include "hal/message_codec.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "tests/world/programs.h"
#include "tests/world/promises.h"

namespace trn::world {

namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;

struct Dice {
  std::mt19937_64 random;
  explicit Dice(std::uint64_t seed) : random(seed) {}
  int below(int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  }
  void think(int most_ms) { std::this_thread::sleep_for(std::chrono::milliseconds(below(most_ms))); }
};

command_t command_of(std::int8_t verb, double value = 0, const std::string& text = "", int joint = 0) {
  command_t command{};
  command.verb = verb;
  command.value = value;
  command.text = text;
  command.joint = joint;
  return command;
}

class Operator {
 public:
  Operator(ClientWorld& world, KeptOffsets& offsets, std::uint64_t seed)
      : world_(world), offsets_(offsets), dice_(seed), client_(world.config) {}

  void work() {
    if (world_.home_first) {
      client_.wait_status([](const auto& status) { return status.state == "idle"; }, 0.5);
      tell(command_of(command_t::HOME, 0, "", -1));
      client_.wait_status([](const auto& status) { return status.state != "homing"; }, 3);
    }
    while (!world_.closing) {
      dice_.think(dice_.below(4) == 0 ? 600 : 60);
      act();
    }
  }

 private:
  bool tell(const command_t& command) {
    const acknowledge_t answer = client_.send(command);
    Chronicle::note(fmt::format("operator: verb {} '{}' {:g}: outcome {} {}", command.verb,
                                command.text.substr(0, command.text.find('\n')), command.value,
                                answer.outcome, answer.message));
    return answer.outcome == acknowledge_t::ACCEPTED;
  }

  void keep_offset() {
    if (tell(command_of(command_t::MDI, 0, offsets_.next_line()))) offsets_.accepted();
  }

  const std::string& one_of(const std::vector<std::string>& texts) {
    return texts[static_cast<std::size_t>(dice_.below(static_cast<int>(texts.size())))];
  }

  void run_program() {
    if (!tell(command_of(command_t::LOAD, 0, one_of(world_.programs)))) {
      tell(command_of(dice_.below(2) == 0 ? command_t::STOP : command_t::RESET));
      return;
    }
    tell(command_of(command_t::START));
  }

  void act() {
    switch (dice_.below(22)) {
      case 0:
      case 1:
      case 2:
      case 3:
        return run_program();
      case 4:
        tell(command_of(command_t::HOLD));
        dice_.think(200);
        tell(command_of(command_t::RESUME));
        return;
      case 5:
        tell(command_of(command_t::RESUME));
        return;
      case 6:
        tell(command_of(command_t::MDI, 0, draw_line(dice_.random, world_.means)));
        return;
      case 7:
        return jog();
      case 8:
        tell(command_of(command_t::OVERRIDE, dice_.below(5) == 0 ? 0 : dice_.between(0.1, 2)));
        return;
      case 9:
        tell(command_of(command_t::OVERRIDE, 1));
        return;
      case 10:
        tell(command_of(command_t::RAPID_OVERRIDE, dice_.between(0.05, 1)));
        return;
      case 11:
        return turn_a_switch();
      case 12:
        tell(command_of(dice_.below(3) == 0 ? command_t::STOP : command_t::RESET));
        return;
      case 13:
        tell(command_of(command_t::HOME, 0, "", dice_.below(4) - 1));
        return;
      case 14:
      case 15:
        return go_aside();
      case 16:
        return go_on(command_of(command_t::LOAD, -1));
      case 17:
        return go_on(command_of(command_t::LOAD, 2 + dice_.below(20), one_of(world_.programs)));
      case 18:
        return note();
      default:
        return keep_offset();
    }
  }

  // A step; or a button that is held, and let go by the next jog or by silence.
  void jog() {
    command_t command = command_of(command_t::JOG, dice_.between(-20, 20), "", dice_.below(3));
    if (dice_.below(2) == 0) command.alive_ms = 20 + dice_.below(200);
    if (dice_.below(5) == 0) command.value = 0;
    tell(command);
  }

  void turn_a_switch() {
    const std::int8_t kSwitches[] = {command_t::SINGLE_BLOCK, command_t::OPTIONAL_STOP,
                                     command_t::BLOCK_DELETE, command_t::DRY_RUN, command_t::MACHINE_LOCK};
    tell(command_of(kSwitches[dice_.below(5)], dice_.below(4) == 0));
  }

  // Holds, looks at the work from the side or goes back along the path, and goes on; or tries to.
  void go_aside() {
    static const std::vector<std::string> kLines = {"M5", "M3 S900", "M8", "M9", "G10 L20 P3 X0"};
    static const std::vector<std::string> kWords = {"X", "Y", "Z"};
    if (!tell(command_of(command_t::HOLD))) {
      run_program();
      dice_.think(900);
      tell(command_of(command_t::HOLD));
    }
    for (int i = 1 + dice_.below(4); i > 0 && !world_.closing; --i) {
      dice_.think(250);
      command_t command = command_of(command_t::JOG, dice_.between(-10, 10));
      switch (dice_.below(4)) {
        case 0:
          command = command_of(command_t::MDI, 0, one_of(kLines));
          break;
        case 1:
          command.text = one_of(kWords);
          command.frame = static_cast<std::int8_t>(1 + dice_.below(3));
          if (dice_.below(2) == 0) command.alive_ms = 20 + dice_.below(200);
          break;
        case 2:
          command.frame = command_t::PATH;
          break;
        default:
          command.joint = dice_.below(3);
          break;
      }
      tell(command);
    }
    dice_.think(250);
    if (!world_.closing) tell(command_of(command_t::RESUME));
  }

  // A program from the place where one was given up, or from a line.
  void go_on(command_t load) {
    if (load.value < 0) load.speed = dice_.between(0, 5);
    if (tell(load)) tell(command_of(command_t::START));
  }

  // What moves nothing.
  void note() {
    const std::int8_t kNotes[] = {command_t::ACKNOWLEDGE, command_t::PARTS, command_t::SPINDLE_OVERRIDE,
                                  command_t::ADAPTIVE_FEED};
    const std::int8_t verb = kNotes[dice_.below(4)];
    tell(command_of(verb, verb >= command_t::ACKNOWLEDGE ? dice_.below(3) : dice_.between(0.5, 1)));
  }

  ClientWorld& world_;
  KeptOffsets& offsets_;
  Dice dice_;
  CommandClient client_;
};

// Whose daemon has gone leaves; one that was not told to end must answer.
template <typename Work>
void as_client(const ClientWorld& world, const char* who, const Work& work) {
  try {
    work();
  } catch (const std::exception& error) {
    if (!world.closing) Chronicle::finding("answer", fmt::format("{}: {}", who, error.what()));
    Chronicle::note(fmt::format("{} leaves: {}", who, error.what()));
  }
}

}  // namespace

std::string KeptOffsets::next_line() {
  last_ += 0.125;  // exact in binary and in the file
  perhaps_.insert(last_);
  return fmt::format("G10 L2 P2 X{:.3f}", last_);
}

std::string KeptOffsets::judge(bool there, const std::string& text) const {
  if (!there) return "the file of variables is gone";
  Parameters parameters;
  try {
    parse_parameters(text, "variables", parameters);
  } catch (const std::exception& error) {
    return error.what();
  }
  const double found = std::as_const(parameters)[kParameter];
  if (found == sure_ || perhaps_.contains(found)) return "";
  return fmt::format("#{} is {:.3f}; {:.3f} was acknowledged", kParameter, found, sure_);
}

void operate(ClientWorld& world, KeptOffsets& offsets, std::uint64_t seed) {
  as_client(world, "operator", [&] { Operator(world, offsets, seed).work(); });
}

void doubt(ClientWorld& world, std::uint64_t seed) {
  Dice dice(seed);
  as_client(world, "doubter", [&] {
    LocalClient link(world.config.access.socket);
    std::map<int, acknowledge_t> answers;
    link.subscribe<acknowledge_t>(world.config.lcm.acknowledge_channel(), [&](const acknowledge_t& answer) {
      // a flood is turned away without a word that binds
      if (answer.client != 77 || answer.outcome == acknowledge_t::WORKING ||
          answer.message.starts_with("too many"))
        return;
      const auto [first, fresh] = answers.try_emplace(answer.sequence, answer);
      if (!fresh && (first->second.outcome != answer.outcome || first->second.message != answer.message))
        Chronicle::finding("one answer", fmt::format("command {}: {} '{}', and later {} '{}'",
                                                     answer.sequence, first->second.outcome,
                                                     first->second.message, answer.outcome, answer.message));
    });
    std::vector<command_t> sent;
    while (!world.closing && !link.closed()) {
      const bool again = !sent.empty() && dice.below(2) == 0;
      command_t command = again ? sent[sent.size() - 1 -
                                       static_cast<std::size_t>(dice.below(
                                           static_cast<int>(std::min<std::size_t>(sent.size(), 20))))]
                                : command_of(dice.below(3) == 0 ? command_t::HOLD : command_t::OVERRIDE,
                                             dice.between(0.3, 1.5));
      if (!again) {
        if (dice.below(3) == 0) command = command_of(command_t::MDI, 0, "G4 P0.01");
        command.client = 77;
        command.sequence = static_cast<std::int32_t>(sent.size()) + 1;
        sent.push_back(command);
      }
      if (!link.publish(world.config.lcm.command_channel(), command)) break;
      const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(dice.below(80));
      while (std::chrono::steady_clock::now() < until) link.handle(5);
    }
  });
}

void harass(ClientWorld& world, std::uint64_t seed) {
  Dice dice(seed);
  while (!world.closing) {
    try {
      LocalClient link(world.config.access.socket);
      const int packets = dice.below(20);
      for (int i = 0; i < packets && !world.closing; ++i) {
        command_t command = command_of(command_t::JOG, dice.between(-5, 5), "", dice.below(3));
        command.client = 66;
        command.sequence = dice.below(1000);
        std::vector<std::uint8_t> packet =
            encode_message(static_cast<std::uint32_t>(i), world.config.lcm.command_channel(), command)
                .datagram;
        if (dice.below(3) == 0) packet.resize(static_cast<std::size_t>(1 + dice.below(3000)));
        for (int k = dice.below(4); k > 0; --k)
          packet[dice.random() % packet.size()] = static_cast<std::uint8_t>(dice.random());
        if (!link.send_packet(packet)) break;
        if (dice.below(3) == 0) link.handle(dice.below(20));
        dice.think(30);
      }
    } catch (const std::system_error&) {  // the daemon may be full, or gone
    }
    dice.think(400);
  }
}

void guard(ClientWorld& world, std::uint64_t seed) {
  Dice dice(seed);
  as_client(world, "guard", [&] {
    CommandClient client(world.config);
    while (!world.closing) {
      dice.think(3000);
      if (world.closing) return;
      Chronicle::note("guard: emergency stop");
      world.drives.expect_stop();
      client.send(command_of(command_t::ESTOP));
      dice.think(300);
      if (!world.closing) client.send(command_of(command_t::RESET));
    }
  });
}

}  // namespace trn::world
