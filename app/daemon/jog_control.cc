#include "app/daemon/jog_control.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

namespace trn {

using trunnion::command_t;

JogOrder JogControl::order(const command_t& command, const CycleReport& report) const {
  const bool moves = report.motion == MotionState::kJogging || report.detour == DetourState::kJogs;
  return plan_jog({command.text, command.joint, command.value, command.speed, command.speed_share,
                   command.alive_ms > 0, moves},
                  kinematics_, joints_, report.q_plan);
}

namespace {

bool is_step(const command_t& command) { return command.value != 0 && command.alive_ms <= 0; }

DirectionWish wish_of(const command_t& command, std::size_t word) {
  const JogFrame frame = command.frame == command_t::MACHINE ? JogFrame::kMachine
                         : command.frame == command_t::WORK  ? JogFrame::kWork
                                                             : JogFrame::kTool;
  return {frame,         static_cast<int>(word), command.value,
          command.speed, command.speed_share,    command.alive_ms > 0};
}

}  // namespace

DirectionOrder JogControl::direction(const command_t& command, const CycleReport& report,
                                     const ProgramStep* step) const {
  DirectionOrder order;
  const std::size_t word = std::string_view(kWordLetters).find(command.text);
  if (command.text.size() != 1 || word == std::string_view::npos) {
    order.refusal = "a jog along machine, work or tool names one of the words X Y Z A B C";
  } else if (!step || !kinematics_ || !map_) {
    order.refusal = "the machine's axes are not known yet; ask again";
  } else {
    order = plan_direction_jog(wish_of(command, word), {*map_, *kinematics_, joints_, *step}, report.q_plan);
  }
  return order;
}

DirectionOrder JogControl::begin_way(const command_t& command, const CycleReport& report,
                                     const ProgramStep* step) {
  DirectionOrder order = direction(command, report, step);
  if (!order.refusal.empty()) return order;
  wish_ = wish_of(command, std::string_view(kWordLetters).find(command.text));
  way_ = order.way;
  way_speed_ = order.speed;
  stretch_.clear();
  return order;
}

const std::vector<JogStretch>& JogControl::next_stretch(const CycleReport& report, const ProgramStep* step) {
  constexpr double kNoWay = 1e-6;  // mm, rad
  stretch_.clear();
  double part = 0;
  if (step && std::abs(way_) > kNoWay)
    stretch_ =
        plan_stretch(wish_, {*map_, *kinematics_, joints_, *step}, report.q_plan, way_, way_speed_, part);
  way_ = stretch_.empty() ? 0 : way_ - part;
  if (way_ == 0 && !stretch_.empty()) way_ = std::copysign(kNoWay / 2, part);  // it is still under way
  return stretch_;
}

std::string JogControl::held_by_other(const JogOrder& order, const command_t& command, Time now) const {
  if (!order.refusal.empty() || command.value == 0) return "";
  const Holder& holder = holders_[static_cast<std::size_t>(order.joint)];
  if (holder.client == command.client || now >= holder.until) return "";
  const bool the_same = command.alive_ms > 0 && holder.back == (order.way < 0);
  return the_same ? ""
                  : fmt::format("somebody else holds {}; ask again when it was let go",
                                joints_[static_cast<std::size_t>(order.joint)].name);
}

// A step is held by nobody, and lengthens the way of a joint that is: it must not take the dead man from it.
void JogControl::hold(const JogOrder& order, const command_t& command, Time now) {
  if (is_step(command)) return;
  const bool held = command.value != 0;
  const Time until = held ? now + std::chrono::milliseconds(command.alive_ms) : Time{};
  holders_[static_cast<std::size_t>(order.joint)] = {command.client, order.way < 0, until};
}

void JogControl::hear(int joint, const command_t& command, Time now) {
  if (is_step(command)) return;
  const bool held = command.value != 0;
  held_.hear(joint, std::chrono::milliseconds(held ? command.alive_ms : 0), now);
}

// There is one at a time: what begins has whoever began it.
void JogControl::hear_direction(const command_t& command, Time now) {
  direction_ = command;
  const bool held = command.value != 0;
  held_.hear(kDirection, std::chrono::milliseconds(held ? command.alive_ms : 0), now);
}

bool JogControl::continues(const command_t& command) const {
  return command.alive_ms > 0 && direction_.alive_ms > 0 && command.frame == direction_.frame &&
         command.text == direction_.text && command.value == direction_.value;
}

}  // namespace trn
