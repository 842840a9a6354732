#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace trn {

/// Discrete Fourier transform in place; the size is a power of two (radix 2, Cooley and Tukey 1965).
void transform(std::vector<std::complex<double>>& x);

/// Of a window of the signal (Hann), with its mean taken away.
std::vector<std::complex<double>> window_spectrum(const std::vector<double>& signal, std::size_t from,
                                                  std::size_t size);

}  // namespace trn
