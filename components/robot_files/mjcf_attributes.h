// Attributes of MJCF: numbers and words that may reach MuJoCo, and errors that name line and
// element.
#pragma once

#include <fmt/format.h>

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "components/robot/robot_model.h"

namespace tinyxml2 {
class XMLElement;
}

namespace poise::robot {

[[noreturn]] void FailMjcfAt(const tinyxml2::XMLElement& at, const std::string& text);

/// Throws RobotError: "MJCF line 12: ...".
template <typename... Args>
[[noreturn]] void FailMjcf(const tinyxml2::XMLElement& at, fmt::format_string<Args...> text,
                           Args&&... args) {
  FailMjcfAt(at, fmt::format(text, std::forward<Args>(args)...));
}

/// The element's name, one line.
std::string Shown(const tinyxml2::XMLElement& element);

/// The numbers of an attribute, all finite and of at most 1e6; none where it is missing. Throws
/// RobotError.
std::vector<double> MjcfNumbers(const tinyxml2::XMLElement& element, std::string_view name);

[[noreturn]] void FailMjcfLength(const tinyxml2::XMLElement& at, const char* name, size_t has,
                                 size_t needs);

/// Exactly `n` of them. Throws RobotError.
template <size_t n>
std::array<double, n> MjcfNumbers(const tinyxml2::XMLElement& element, const char* name) {
  const std::vector<double> numbers = MjcfNumbers(element, name);
  if (numbers.size() != n) FailMjcfLength(element, name, numbers.size(), n);
  std::array<double, n> result;
  for (size_t i = 0; i < n; ++i) result[i] = numbers[i];
  return result;
}

/// What MuJoCo is to see of an element of this kind ("joint", "geom", "site", "body", "inertial",
/// "actuator", "compiler"), as text. Throws RobotError: numbers that are none, unknown words.
std::string KeptAttributes(const tinyxml2::XMLElement& element, std::string_view kind);

/// Attributes that turn a frame.
inline constexpr std::array<std::string_view, 5> kOrientations = {"quat", "axisangle", "xyaxes",
                                                                  "zaxis", "euler"};

/// Whether MuJoCo is to see solids of that type.
bool IsGeomType(const std::string& type);
bool IsActuator(const std::string& element);

}  // namespace poise::robot
