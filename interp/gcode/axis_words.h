#pragma once

#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "core/axes.h"
#include "core/check.h"
#include "core/frames.h"
#include "core/units.h"

namespace trn {

struct MachineLength;

/// Values of the six axis words X Y Z A B C whose angles are degrees. What a length is, `LengthUnit` says;
/// words of different units do not mix, nor do they with `Words`, which are mm and rad.
template <typename LengthUnit>
struct DegreeWords {
  Vec3 xyz = Vec3::Zero();
  Vec3 abc_deg = Vec3::Zero();

  /// The value of the axis kX .. kC.
  double& operator[](int axis) { return axis < 3 ? xyz[axis] : abc_deg[axis - 3]; }
  double operator[](int axis) const { return axis < 3 ? xyz[axis] : abc_deg[axis - 3]; }
  bool is_zero() const { return xyz.isZero(0) && abc_deg.isZero(0); }

  DegreeWords& operator+=(const DegreeWords& other) {
    xyz += other.xyz;
    abc_deg += other.abc_deg;
    return *this;
  }
  DegreeWords& operator-=(const DegreeWords& other) {
    xyz -= other.xyz;
    abc_deg -= other.abc_deg;
    return *this;
  }
  // Of two places in M there is no sum: an offset moves a place.
  static constexpr bool kAdds = !std::is_same_v<LengthUnit, MachineLength>;
  friend DegreeWords operator+(DegreeWords a, const DegreeWords& b) requires kAdds { return a += b; }
  friend DegreeWords operator-(DegreeWords a, const DegreeWords& b) requires kAdds { return a -= b; }
  friend bool operator==(const DegreeWords& a, const DegreeWords& b) {
    return a.xyz == b.xyz && a.abc_deg == b.abc_deg;
  }
};

/// As the program writes them: lengths in mm after G21 and inch after G20, angles in degrees. Places are in
/// the program's coordinate system, offsets along the axes that their code names.
using ProgramWords = DegreeWords<struct ProgramLength>;
/// Lengths in mm, angles in degrees, whatever the program's units are: places in the program's coordinate
/// system, offsets and the tool table.
using MmWords = DegreeWords<struct MmLength>;
/// Places in the machine frame M, mm and degrees. `WorkFrame` alone makes them of the program's places, and
/// the other way round.
using MachineWords = DegreeWords<MachineLength>;
/// As they stand in numbered parameters and in the file of the tool table: a length of 1 is
/// ProgramConfig::parameter_unit_mm, angles are degrees.
using TableWords = DegreeWords<struct TableLength>;

/// Of six numbers, as files and messages have them.
inline MmWords mm_words(std::span<const double> six) {
  TRN_CHECK(six.size() == 6);
  return {{six[0], six[1], six[2]}, {six[3], six[4], six[5]}};
}

/// A place moved by an offset along the machine's axes.
inline MachineWords operator+(const MachineWords& place, const MmWords& offset) {
  return {place.xyz + offset.xyz, place.abc_deg + offset.abc_deg};
}
inline MachineWords operator-(const MachineWords& place, const MmWords& offset) {
  return {place.xyz - offset.xyz, place.abc_deg - offset.abc_deg};
}

/// The program's words in mm and degrees; `inch`: G20 is in force.
inline MmWords in_mm(const ProgramWords& words, bool inch) {
  return {inch ? Vec3(words.xyz * kMmPerInch) : words.xyz, words.abc_deg};
}
inline MmWords in_mm(const TableWords& words, double unit_mm) { return {words.xyz * unit_mm, words.abc_deg}; }
/// mm and degrees in the units of the program; `inch`: G20 is in force.
inline ProgramWords in_program_units(const MmWords& words, bool inch) {
  return {inch ? Vec3(words.xyz / kMmPerInch) : words.xyz, words.abc_deg};
}
inline TableWords in_table_units(const MmWords& words, double unit_mm) {
  return {words.xyz / unit_mm, words.abc_deg};
}
/// mm and degrees in mm and rad, the words of path and kinematics; the frame stays.
template <typename Given>
requires(std::is_same_v<Given, MmWords> || std::is_same_v<Given, MachineWords>) Words
    in_radians(const Given& words) {
  Words out;
  out << words.xyz, words.abc_deg * kRadPerDeg;
  return out;
}
/// mm and rad in mm and degrees. The frame stays: the caller says with `MmWords` or `MachineWords` which one
/// it is.
template <typename Out>
requires(std::is_same_v<Out, MmWords> || std::is_same_v<Out, MachineWords>) Out
    in_degrees(const Words& words) {
  return {words.head<3>(), words.tail<3>() * kDegPerRad};
}

/// A place on a move at which a program is entered.
struct EntryPlace {
  MmWords at;            ///< in the program's coordinates
  double arc_share = 0;  ///< how much of the arc lies before it, above 0 and below 1; 0: the move is straight

  bool operator==(const EntryPlace&) const = default;
};
/// As seven numbers, and back; none where they are no such place. Six: on a straight move.
inline std::vector<double> numbers_of(const EntryPlace& place) {
  std::vector<double> out;
  for (int i = kX; i <= kC; ++i) out.push_back(place.at[i]);
  out.push_back(place.arc_share);
  return out;
}
inline std::optional<EntryPlace> entry_place(std::span<const double> numbers) {
  if (numbers.size() != 6 && numbers.size() != 7) return std::nullopt;
  const double share = numbers.size() == 7 ? numbers[6] : 0;
  if (!(share >= 0 && share < 1)) return std::nullopt;
  return EntryPlace{mm_words(numbers.first(6)), share};
}

}  // namespace trn
