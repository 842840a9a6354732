// What every command uses.
#pragma once
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "pch.h"
