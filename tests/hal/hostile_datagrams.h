#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "hal/lcm_messages.h"
#include "hal/wire_layout.h"
#include "tests/support/rounds.h"

// Datagrams that mean harm: well-formed ones of every type, and what malice, noise and other programs make of
// them.
namespace trn::hostile {

using Bytes = std::vector<std::uint8_t>;
using Random = std::mt19937_64;

inline int below(Random& random, int n) { return static_cast<int>(random() % static_cast<std::uint64_t>(n)); }

inline double number(Random& random) {
  constexpr double kOdd[] = {0, -0.0, 1, -1, 1e300, 5e-324, HUGE_VAL, -HUGE_VAL, NAN, 0.5, 100, 3};
  return kOdd[below(random, static_cast<int>(std::size(kOdd)))];
}

inline std::string text(Random& random) {
  constexpr const char* kOdd[] = {"", "G0 X1", "/etc/passwd", "\x1b[31m", "\xff\xfe", "%s%n", "idle", "ok"};
  if (below(random, 3) != 0) return kOdd[below(random, static_cast<int>(std::size(kOdd)))];
  std::string out(static_cast<std::size_t>(below(random, 200)), 'x');
  for (char& c : out) c = static_cast<char>(1 + below(random, 255));
  return out;
}

template <typename Value, typename Make>
std::vector<Value> several(std::int32_t count, Make make) {
  std::vector<Value> out;
  for (std::int32_t i = 0; i < count; ++i) out.push_back(static_cast<Value>(make()));
  return out;
}

inline trunnion::command_t command(Random& random) {
  trunnion::command_t out{};
  out.client = below(random, 4);
  out.sequence = static_cast<std::int32_t>(random());
  out.expires_us = below(random, 2) ? 0 : static_cast<std::int64_t>(random());
  out.verb = static_cast<std::int8_t>(below(random, 4) ? below(random, 18) : below(random, 256));
  out.joint = below(random, 4) ? below(random, 3) - 1 : static_cast<std::int32_t>(random());
  out.value = number(random);
  out.speed = number(random);
  out.text = text(random);
  return out;
}

inline trunnion::acknowledge_t acknowledge(Random& random) {
  trunnion::acknowledge_t out{};
  out.client = below(random, 4);
  out.sequence = below(random, 100);
  out.outcome = static_cast<std::int8_t>(below(random, 7));
  out.message = text(random);
  return out;
}

inline trunnion::sensor_t sensor(Random& random) {
  trunnion::sensor_t out{};
  out.count = below(random, 5);
  out.name = several<std::string>(out.count, [&] { return text(random); });
  out.value = several<double>(out.count, [&] { return number(random); });
  return out;
}

inline trunnion::motion_t motion(Random& random) {
  trunnion::motion_t out{};
  out.joint_count = below(random, 7);
  out.q_setpoint = several<double>(out.joint_count, [&] { return number(random); });
  out.q_measured = several<double>(out.joint_count, [&] { return number(random); });
  for (double& word : out.word) word = number(random);
  return out;
}

inline trunnion::status_t status(Random& random) {
  const auto real = [&] { return number(random); };
  const auto words = [&] { return text(random); };
  const auto flag = [&] { return below(random, 2); };
  trunnion::status_t out{};
  out.pid = below(random, 70000);
  out.machine = out.state = out.fault = out.message = text(random);
  out.warnings = several<std::string>(out.warning_count = below(random, 3), words);
  const std::int32_t corrections = out.correction_count = below(random, 3);
  out.correction_name = several<std::string>(corrections, words);
  out.correction_on = several<std::int8_t>(corrections, flag);
  out.correction_offset = several<double>(corrections, real);
  out.correction_warning = several<std::string>(corrections, words);
  const std::int32_t features = out.feature_count = below(random, 3);
  out.feature_line = out.feature_last_line = several<std::int32_t>(features, flag);
  out.feature_circle = several<std::int8_t>(features, flag);
  out.feature_size_mm = out.feature_bending_mm = out.feature_offset_mm = several<double>(features, real);
  out.feature_predicted_mm = out.feature_unknown = several<double>(features, real);
  const std::int32_t joints = out.joint_count = below(random, 7);
  out.joint_name = several<std::string>(joints, words);
  out.joint_unit = several<std::string>(joints, words);
  out.joint_homed = out.joint_limit_switch = several<std::int8_t>(joints, flag);
  return out;
}

template <typename Message>
Bytes datagram_of(const std::string& channel, const Message& message) {
  Bytes out = datagram_head(7, channel);
  const std::size_t head = out.size();
  out.resize(head + static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(out.data() + head, 0, message.getEncodedSize());
  return out;
}

/// A good one of a random type, on the channels of machine "bench".
inline Bytes sound(Random& random) {
  switch (below(random, 6)) {
    case 0:
      return datagram_of("bench.acknowledge", acknowledge(random));
    case 1:
      return datagram_of("bench.sensor", sensor(random));
    case 2:
      return datagram_of("bench.motion", motion(random));
    case 3:
      return datagram_of("bench.status", status(random));
    default:
      return datagram_of("bench.command", command(random));
  }
}

inline void write_word(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4 && at + i < bytes.size(); ++i)
    bytes[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

/// Behind "LC03": sequence, message size, fragment offset, fragment number, fragments.
inline Bytes fragment(Random& random) {
  constexpr std::uint32_t kOdd[] = {0, 1, 0xffffffff, 0x7fffffff, 0x80000000, 100, 65536, 0x100000};
  const auto odd = [&] { return kOdd[below(random, static_cast<int>(std::size(kOdd)))]; };
  Bytes out(20);
  write_word(out, 0, 0x4c433033);
  write_word(out, 4, static_cast<std::uint32_t>(below(random, 5)));
  for (std::size_t at = 8; at < 20; at += 4) write_word(out, at, odd());
  for (const char c : std::string("bench.command")) out.push_back(static_cast<std::uint8_t>(c));
  out.resize(out.size() + static_cast<std::size_t>(below(random, 300)));
  return out;
}

/// One that means harm, or a good one.
inline Bytes datagram(Random& random) {
  constexpr std::uint32_t kLengths[] = {0xffffffff, 0, 1, 2, 0x7fffffff, 0x80000000, 0x10000, 0xfffffff0, 5};
  Bytes out = sound(random);
  const auto place = [&] { return static_cast<std::size_t>(below(random, static_cast<int>(out.size()))); };
  switch (below(random, 8)) {
    case 0:  // cut
      out.resize(place());
      break;
    case 1:  // longer
      out.resize(out.size() + 1 + static_cast<std::size_t>(below(random, 40)),
                 static_cast<std::uint8_t>(random()));
      break;
    case 2:  // a length or count, wherever it stands
      write_word(out, place(), kLengths[below(random, static_cast<int>(std::size(kLengths)))]);
      break;
    case 3:  // noise behind the head and the right hash
      for (std::size_t at = std::min(out.size(), std::size_t{30}); at < out.size(); ++at)
        out[at] = static_cast<std::uint8_t>(random());
      break;
    case 4:  // single bytes
      for (int i = below(random, 4); i >= 0; --i) out[place()] = static_cast<std::uint8_t>(random());
      break;
    case 5:
      out = fragment(random);
      break;
    case 6:  // nothing but noise
      out.resize(static_cast<std::size_t>(below(random, 64)));
      for (std::uint8_t& byte : out) byte = static_cast<std::uint8_t>(random());
      break;
    default:
      break;
  }
  return out;
}

inline int count() { return test::rounds(20'000); }

}  // namespace trn::hostile
