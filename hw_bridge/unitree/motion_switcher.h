// The robot's motion switcher: which of the maker's controllers moves the robot.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hw_bridge/unitree/dds.h"

namespace poise::unitree {

inline constexpr int64_t kCheckMode = 1001, kReleaseMode = 1003;  ///< api_id of requests

/// Name of the active controller in an answer to kCheckMode ({"form": "0", "name": "ai"}); empty:
/// none is. nullopt: not such an answer.
std::optional<std::string> ModeOf(std::string_view answer);

/// Asks. Blocks.
class MotionSwitcherClient {
 public:
  explicit MotionSwitcherClient(const Participant& participant);
  ~MotionSwitcherClient();
  MotionSwitcherClient(const MotionSwitcherClient&) = delete;
  MotionSwitcherClient& operator=(const MotionSwitcherClient&) = delete;

  /// nullopt without an answer by the deadline of MonotonicNow.
  std::optional<std::string> ActiveMode(int64_t deadline);
  /// Whether the robot has answered that it does, by the deadline.
  bool Release(int64_t deadline);

 private:
  /// Data of the answer with status 0, asked for until there is one: who is new to a domain is not
  /// heard at first.
  std::optional<std::string> Call(int64_t api, int64_t deadline);

  Writer<Request> writer_;
  Reader<Response> reader_;
  Response response_{};
  int64_t last_id_;
};

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
