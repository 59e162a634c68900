// Messages of the bus to and from the types of robot and balance.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/balance/contact_conditions.h"
#include "components/balance/distribution_ratio.h"
#include "components/messages/contact_limits.pb.h"
#include "components/robot/robot_model.h"
#include "poise/contact_margins_t.hpp"
#include "poise/pose_t.hpp"
#include "poise/robot_state_t.hpp"
#include "poise/wrench_t.hpp"

namespace poise {

/// Copies the configuration and velocity, the quaternion normalised. `state` must be sized. False,
/// and `state` is then not to be used, when a number is not finite or the message's quaternion is
/// not of unit length (to 1e-6).
bool ReadState(const robot_state_t& message, robot::RobotState* state);

void SetPose(const Eigen::Isometry3d& pose, pose_t* message);
Eigen::Isometry3d GetPose(const pose_t& message);

/// [force; moment]; frame and sign as the field says.
void SetWrench(const Eigen::Ref<const balance::Vector6d>& wrench, wrench_t* message);
balance::Vector6d GetWrench(const wrench_t& message);

void SetMargins(const balance::ContactMargins& margins, contact_margins_t* message);

void SetVector3(const Eigen::Vector3d& vector, double (&array)[3]);
Eigen::Vector3d GetVector3(const double (&array)[3]);

/// In the messages' order: w, x, y, z.
void SetQuaternion(const Eigen::Quaterniond& quaternion, double (&array)[4]);

/// m, off the edges of a sole, that its own centre of pressure keeps: the sole rocks on its edge.
double SoleMargin(const robot::RobotModel& model);
/// m, off the edges of the soles' hull, that the centre of pressure of both keeps, so that it can
/// be shared: near the outer edge the other sole still carries its least share.
double HullMargin(const robot::RobotModel& model);
/// `config`; the half length and half width that it does not give are the smaller sole's, less
/// `margin` (m). Soles that are no rectangles count as the largest rectangle about the frames'
/// origins that lies `margin` inside both.
ContactLimitsConfig WithinSoles(ContactLimitsConfig config, const robot::RobotModel& model,
                                double margin);
/// m, of the smaller sole: InnerRadius.
double SoleRadius(const robot::RobotModel& model);

/// Limits of a contact patch. Throws ConfigError "<field>.half_length" ...: missing, not positive
/// or not finite.
balance::ContactLimits ReadLimits(const ContactLimitsConfig& config, const std::string& field);
/// Limits of the right and the left sole: WithinSoles of rectangles. A polygon's own edges moved
/// inwards by `margin` (m), and cut at the half length and half width that `config` gives. Throws
/// ConfigError likewise, and when nothing is left of a sole.
balance::SoleLimits ReadSoleLimits(const ContactLimitsConfig& config,
                                   const robot::RobotModel& model, double margin,
                                   const std::string& field);

}  // namespace poise
