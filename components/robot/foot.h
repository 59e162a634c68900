// The feet as a type, and arrays over them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace poise::robot {

/// A foot, in the order of a robot's file.
enum class Foot : int8_t { kRight = 0, kLeft = 1 };

inline constexpr std::array<Foot, 2> kFeet{Foot::kRight, Foot::kLeft};

constexpr Foot Other(Foot foot) { return foot == Foot::kRight ? Foot::kLeft : Foot::kRight; }
/// Place in a list of the robot's feet.
constexpr size_t Index(Foot foot) { return static_cast<size_t>(foot); }
constexpr Foot FootAt(int place) { return static_cast<Foot>(place); }
/// Sign of the foot's own side along y: 1 left, −1 right.
constexpr double Side(Foot foot) { return foot == Foot::kLeft ? 1 : -1; }

/// One value a foot, right first.
template <class T>
class FootArray : public std::array<T, kFeet.size()> {
 public:
  using Base = std::array<T, kFeet.size()>;
  constexpr FootArray() : Base{} {}
  constexpr FootArray(const Base& values) : Base(values) {}
  explicit constexpr FootArray(const T& both) : Base{both, both} {}
  constexpr FootArray(const T& right, const T& left) : Base{right, left} {}

  using Base::operator[];
  constexpr T& operator[](Foot foot) { return Base::operator[](Index(foot)); }
  constexpr const T& operator[](Foot foot) const { return Base::operator[](Index(foot)); }
};

/// How many of the feet it holds for.
constexpr int Count(const FootArray<bool>& feet) { return feet[Foot::kRight] + feet[Foot::kLeft]; }

}  // namespace poise::robot
