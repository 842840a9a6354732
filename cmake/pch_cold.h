// What the parts that are compiled quickly use beside that: commands, and what reads and writes JSON.
#pragma once
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "pch.h"
