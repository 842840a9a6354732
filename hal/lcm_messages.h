// The generated message types (hal/lcm/*.lcm); generated code does not meet our warnings.
#pragma once
#pragma GCC system_header

#include "lcm_types/trunnion/acknowledge_t.hpp"
#include "lcm_types/trunnion/alarms_t.hpp"
#include "lcm_types/trunnion/command_t.hpp"
#include "lcm_types/trunnion/motion_t.hpp"
#include "lcm_types/trunnion/scope_data_t.hpp"
#include "lcm_types/trunnion/scope_request_t.hpp"
#include "lcm_types/trunnion/scope_signals_t.hpp"
#include "lcm_types/trunnion/sensor_t.hpp"
#include "lcm_types/trunnion/signed_command_t.hpp"
#include "lcm_types/trunnion/status_t.hpp"
#include "lcm_types/trunnion/tables_t.hpp"
