#include "logging/derived/told.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "logging/derived/definitions.h"
#include "poise/bus_status_t.hpp"
#include "poise/drive_feedback_t.hpp"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr wrench_t kNoWrench{{kNone, kNone, kNone}, {kNone, kNone, kNone}};

// Each returns whether it has left out anything.

template <class Message>  // with feet's sensors
bool LeaveOut(Message* message) {
  bool any = false;
  for (size_t f = 0; f < message->foot_sensor.size(); ++f) {
    if (message->foot_sensor[f] == drive_feedback_t::SENSOR_OK) continue;
    message->foot_wrench[f] = kNoWrench;
    any = true;
  }
  return any;
}

bool LeaveOut(joint_command_t* message) {
  bool told[2] = {false, false}, any = false;
  const size_t feet = std::min<size_t>(message->in_contact.size(), 2);
  for (size_t f = 0; f < feet; ++f) told[f] = TellsFoot(*message, f);
  for (size_t f = 0; f < feet; ++f) {
    if (!told[0] && !told[1]) message->foot_wrench[f] = kNoWrench;
    if (told[f] && message->in_contact[f] != 0) continue;
    message->margins[f] = {kNone, kNone, kNone, kNone, kNone};
    any = true;
  }
  if (TellsRatio(*message)) return any;
  message->eta = message->eta_optimal = message->eta_min = message->eta_max = kNone;
  return true;
}

bool LeaveOut(estimator_status_t* message) {
  if (message->has_covariance != 0) return false;
  std::ranges::fill(message->covariance, kNone);
  return true;
}

bool LeaveOut(planner_status_t* message) {
  if (message->step_needed != 0) return false;
  std::ranges::fill(message->step_position, kNone);
  message->step_time = kNone;
  return true;
}

bool LeaveOut(bus_status_t* message) {
  std::ranges::replace(message->temperature, 0.0, kNone);
  std::ranges::replace(message->voltage, 0.0, kNone);
  return true;
}

template <class Message>
bool Rewrite(const MessageType& type, std::span<const uint8_t> data, std::vector<uint8_t>* buffer) {
  Message message;
  if (std::string_view(type.name) != MessageTraits<Message>::kName ||
      !DecodeChecked(data.data(), static_cast<int64_t>(data.size()), &message) ||
      !LeaveOut(&message)) {
    return false;
  }
  buffer->resize(data.size());
  message.encode(buffer->data(), 0, static_cast<int>(buffer->size()));
  return true;
}

}  // namespace

std::span<const uint8_t> WithoutUntold(const MessageType& type, std::span<const uint8_t> data,
                                       std::vector<uint8_t>* buffer) {
  const bool rewritten = Rewrite<robot_sensors_t>(type, data, buffer) ||
                         Rewrite<drive_feedback_t>(type, data, buffer) ||
                         Rewrite<joint_command_t>(type, data, buffer) ||
                         Rewrite<estimator_status_t>(type, data, buffer) ||
                         Rewrite<planner_status_t>(type, data, buffer) ||
                         Rewrite<bus_status_t>(type, data, buffer);
  return rewritten ? std::span<const uint8_t>(*buffer) : data;
}

}  // namespace poise::logging
