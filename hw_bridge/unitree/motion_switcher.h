// The robot's motion switcher: which of the maker's controllers moves the robot.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hw_bridge/unitree/dds.h"

namespace poise::unitree {

inline constexpr int64_t kCheckMode = 1001, kReleaseMode = 1003;  ///< api_id of requests
inline constexpr int32_t kSwitcherDepth = 16;  ///< requests and answers under way

/// Name of the active controller in an answer to kCheckMode ({"form": "0", "name": "ai"}); empty:
/// none is. nullopt: not such an answer.
std::optional<std::string> ModeOf(std::string_view answer);

/// Answers, for an emulated robot.
class MotionSwitcherServer {
 public:
  MotionSwitcherServer(const Participant& participant, std::string mode);
  ~MotionSwitcherServer();
  MotionSwitcherServer(const MotionSwitcherServer&) = delete;
  MotionSwitcherServer& operator=(const MotionSwitcherServer&) = delete;

  /// Answers what has been asked.
  void Serve();
  /// The name of the controller that is active; empty: none.
  const std::string& mode() const { return mode_; }

 private:
  Reader<Request> reader_;
  Writer<Response> writer_;
  Request request_{};
  std::string mode_;
};

}  // namespace poise::unitree
