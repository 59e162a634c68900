// What a person at the robot asks for in the page of a run.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

namespace poise {

/// One act, read and bounded, not yet decided: who receives it does that.
struct OperatorAct {
  enum class Kind : uint8_t {
    kPush,         ///< body, force, point, duration
    kSet,          ///< field, value
    kStep,         ///< foot
    kWalk,         ///< velocity
    kStopWalking,  ///< stands side by side
    kStop,         ///< emergency stop, latched
    kReset,        ///< ends a latched stop
    kPause,        ///< from here on of an interactive run alone
    kGo,
    kTick,     ///< ticks
    kSpeed,    ///< factor
    kBack,     ///< to tick `ticks`
    kRestart,  ///< to the start, and on from there at once
  };

  Kind kind = Kind::kStop;
  int64_t client = 0;  ///< the page's own number, and that of the act within it: they name it
  int64_t id = 0;
  std::string name;                                    ///< body, field or foot
  Eigen::Vector3d force = Eigen::Vector3d::Zero();     ///< N, world axes
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     ///< m, body frame
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s forward and left, rad/s
  double duration = 0;                                 ///< s
  double value = 0;                                    ///< of a field; of kSpeed, a factor
  int64_t ticks = 0;
};

/// "push", "set", ...
std::string_view ActName(OperatorAct::Kind kind);

/// Reads an act from a page's text (docs/reference/interactive.md#what-a-page-sends). Any bytes are
/// allowed: what is none gives false and says why in `problem`. All numbers are finite, names short
/// and printable.
bool ReadAct(std::string_view text, OperatorAct* act, std::string* problem);

}  // namespace poise
