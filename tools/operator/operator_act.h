// What a person asks of a run, and what became of it: of the page, the terminal and Python alike.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace poise {

/// One act, and how it was answered: who receives it decides.
struct OperatorAct {
  enum class Kind : uint8_t {
    kPush,         ///< body (empty: the root), force, point, duration
    kSet,          ///< field, value
    kAsk,          ///< field; the answer's value is the present one
    kStep,         ///< foot; empty: any
    kWalk,         ///< velocity
    kStopWalking,  ///< stands side by side
    kNextPhase,    ///< ends the scenario's phase, whose moves are over
    kMove,         ///< joint, value, duration
    kStop,         ///< emergency stop, latched
    kReset,        ///< ends a latched stop
    kPause,        ///< from here on of an interactive run alone
    kGo,
    kTick,     ///< ticks
    kSpeed,    ///< factor
    kBack,     ///< to tick `ticks`
    kRestart,  ///< to the start, and on from there at once
  };
  enum class State : uint8_t { kSent, kAccepted, kRefused };

  Kind kind = Kind::kStop;
  int64_t client = 0;  ///< the sender's own number, and that of the act within it: they name it
  int64_t id = 0;
  std::string name;                                    ///< body, field, foot or joint
  Eigen::Vector3d force = Eigen::Vector3d::Zero();     ///< N, world axes
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     ///< m, body frame
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s forward and left, rad/s
  double duration = 0;  ///< s; below 0: until the next push of this body
  double value = 0;     ///< of a field; of kSpeed, a factor; of kMove, rad
  int64_t ticks = 0;

  State state = State::kSent;
  int64_t tick = -1;   ///< of the answer: kAccepted, in which it took effect; -1: nobody answered
  std::string reason;  ///< why it was refused
};

/// "push", "set", ...
std::string_view ActName(OperatorAct::Kind kind);
/// operate::act_t::KIND_* of the message that carries it; 0: it goes another way.
int8_t MessageKind(OperatorAct::Kind kind);
/// Those that a page may send, in the order in which it is told of them.
const std::vector<OperatorAct::Kind>& PageActs();

/// Reads an act from a page's text (docs/reference/interactive.md#what-a-page-sends). Any bytes are
/// allowed: what is none gives false and says why in `problem`. All numbers are finite, names short
/// and printable.
bool ReadAct(std::string_view text, OperatorAct* act, std::string* problem);
/// The act as a page is told of it (docs/reference/interactive.md#what-a-page-is-told).
nlohmann::ordered_json ActJson(const OperatorAct& act);

}  // namespace poise
