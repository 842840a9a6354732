// What the parts use that run seldom: the commands, the daemon around its tick, the panel.
#pragma once
#include <nlohmann/json.hpp>

#include "pch.h"
