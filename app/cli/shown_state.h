#pragma once

#include <string>

#include "hal/lcm_messages.h"

namespace trn {

/// State of machine and daemon for people, several lines: what it does and waits for, where it is, what is in
/// force, how the daemon keeps its time.
std::string status_text(const trunnion::status_t& status, const trunnion::motion_t& motion);

/// What went wrong: when, the cure, what the machine did, in which line, and who caused it; "" if nothing.
std::string alarms_text(const trunnion::alarms_t& alarms);

/// The status in the lines that change while it moves, for a screen of `columns` characters.
std::string screen_text(const trunnion::status_t& status, const trunnion::motion_t& motion, int columns);

/// One line of where the motors are.
std::string motion_line(const trunnion::status_t& status, const trunnion::motion_t& motion);

}  // namespace trn
