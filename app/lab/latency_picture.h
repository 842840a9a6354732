#pragma once

#include <string>
#include <vector>

#include "core/time_histogram.h"

namespace trn {

/// Two histograms over one axis of time, counts and time in powers of ten: how late a thread wakes, and how
/// long its work takes. An SVG document.
std::string latency_svg(const std::string& title, const std::vector<TimeHistogram::Bucket>& wake,
                        const std::vector<TimeHistogram::Bucket>& tick);

}  // namespace trn
