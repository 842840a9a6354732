#pragma once

// TRN_RT marks a function that runs in the tick: bounded, no allocation, no lock, no exception.
// It is noexcept by construction; tests count allocations under it for every shipped config.
#define TRN_RT noexcept
