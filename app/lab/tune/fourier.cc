#include "app/lab/tune/fourier.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace trn {

void transform(std::vector<std::complex<double>>& x) {
  const std::size_t n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(x[i], x[j]);
  }
  for (std::size_t length = 2; length <= n; length <<= 1) {
    const std::complex<double> turn = std::polar(1.0, -2 * std::numbers::pi / static_cast<double>(length));
    for (std::size_t i = 0; i < n; i += length) {
      std::complex<double> w = 1;
      for (std::size_t k = 0; k < length / 2; ++k, w *= turn) {
        const std::complex<double> u = x[i + k], v = w * x[i + k + length / 2];
        x[i + k] = u + v;
        x[i + k + length / 2] = u - v;
      }
    }
  }
}

std::vector<std::complex<double>> window_spectrum(const std::vector<double>& signal, std::size_t from,
                                                  std::size_t size) {
  double mean = 0;
  const auto n = static_cast<double>(size);
  for (std::size_t i = 0; i < size; ++i) mean += signal[from + i] / n;
  std::vector<std::complex<double>> out(size);
  for (std::size_t i = 0; i < size; ++i) {
    const double hann = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / n);
    out[i] = hann * (signal[from + i] - mean);
  }
  transform(out);
  return out;
}

}  // namespace trn
