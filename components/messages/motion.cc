#include "components/messages/motion.h"

#include "components/messages/conversions.h"

namespace poise {
namespace {

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace

void SetMotion(const PointMotion& motion, point_motion_t* message) {
  SetVector3(motion.position, message->position);
  SetVector3(motion.velocity, message->velocity);
  SetVector3(motion.acceleration, message->acceleration);
}

PointMotion GetMotion(const point_motion_t& message) {
  return {.position = GetVector3(message.position),
          .velocity = GetVector3(message.velocity),
          .acceleration = GetVector3(message.acceleration)};
}

void SetMotion(const RotationMotion& motion, rotation_motion_t* message) {
  Eigen::Map<RowMajor>(message->rotation) = motion.rotation;
  SetVector3(motion.angular_velocity, message->angular_velocity);
  SetVector3(motion.angular_acceleration, message->angular_acceleration);
}

RotationMotion GetMotion(const rotation_motion_t& message) {
  return {.rotation = Eigen::Map<const RowMajor>(message.rotation),
          .angular_velocity = GetVector3(message.angular_velocity),
          .angular_acceleration = GetVector3(message.angular_acceleration)};
}

}  // namespace poise
