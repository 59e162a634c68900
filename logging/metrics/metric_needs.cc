#include "logging/metrics/metric_needs.h"

#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>

#include "fmt/format.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/schedule_plan.h"
#include "logging/metrics/walk_course.h"

namespace poise::logging {
namespace {

struct Needs {
  const char* metrics;               // patterns with *, of which one fits
  std::array<const char*, 4> needs;  // Metric::needs are these, with "; " between them
};

constexpr char kReference[] = "a reference run";
constexpr char kComputedWrenches[] = "JOINT_COMMAND.in_contact, foot_wrench, margins";
constexpr char kKnownWrenches[] = "ROBOT_SENSORS.foot_wrench | ROBOT_STATE.foot_wrench";
constexpr char kPlacesOfFeet[] =
    "BALANCE_TORQUE.frame_o | PLANNER_STATUS.foot_pose | GROUND_TRUTH.foot_pose";
constexpr char kStand[] = "PLANNER_STATUS.foot_state | JOINT_COMMAND.in_contact";
constexpr char kTrueSteps[] = "GROUND_TRUTH.foot_wrench, com_position";
constexpr char kTrueCourse[] = "GROUND_TRUTH.com_position, base_orientation";

// The first row that fits.
constexpr Needs kNeeds[] = {
    {"duration_reached log_*", {}},
    {"duration_reached_reference", {kReference}},
    {"real_time_factor", {"the run's wall time"}},
    {"packets_refused gaps messages_dropped publish_errors", {"HEALTH"}},
    {"fallen", {"GROUND_TRUTH.fallen, base_orientation, com_position, foot_pose"}},
    {"task_not_ok_ticks", {"TASK_TORQUE.status"}},
    {"balance_not_ok_ticks", {"BALANCE_TORQUE.status"}},
    {"command_not_ok_ticks", {"JOINT_COMMAND.status"}},
    {"waiting_ti*", {"SUPPORT_PLAN.status"}},
    {"last_phase", {"PLANNER_STATUS.phase"}},
    // COM, body, swing foot
    {"com_error_max_?", {"PLANNER_STATUS.com_position", "SUPPORT_PLAN.com_reference"}},
    {"com_error_*", {"GROUND_TRUTH.com_position", "SUPPORT_PLAN.com_reference"}},
    {"com_motion_max", {"GROUND_TRUTH.com_position"}},
    {"com_motion_reference_max com_difference_max", {kReference, "GROUND_TRUTH.com_position"}},
    {"orientation_error_max", {"TASK_TORQUE.body_orientation_error"}},
    {"body_rotation_x_*", {"TASK_TORQUE.body_orientation_error", "SUPPORT_PLAN.in_contact"}},
    {"*_foot_error_max_?", {"SUPPORT_PLAN.in_contact, foot_reference", "PLANNER_STATUS.foot_pose"}},
    // balancing
    {"balancing_*", {"BALANCE_TORQUE.active_x, active_y"}},
    {"cop_max_?", {"BALANCE_TORQUE.cop | JOINT_COMMAND.foot_wrench", kPlacesOfFeet}},
    {"cop_measured_max_?",
     {kKnownWrenches,
      "SUPPORT_PLAN.in_contact | ROBOT_SENSORS.foot_wrench | ROBOT_STATE.foot_wrench",
      kPlacesOfFeet}},
    {"cop_task_max_?", {"BALANCE_TORQUE.cop_task"}},
    {"cop_*", {"BALANCE_TORQUE.cop, cop_limit"}},
    {"capture_margin_min", {"PLANNER_STATUS.capture_margin"}},
    {"step_needed_*", {"PLANNER_STATUS.step_needed"}},
    {"step_warning_time", {"PLANNER_STATUS.step_needed", "GROUND_TRUTH.fallen"}},
    // computed and measured wrenches
    {"violated_ticks", {"JOINT_COMMAND.conditions_met, margins"}},
    {"eta_span", {"JOINT_COMMAND.eta, eta_feasible, eta_max", "JOINT_COMMAND.in_contact"}},
    {"eta_*", {"JOINT_COMMAND.eta, eta_feasible, eta_max"}},
    {"*_foot_*_margin *_foot_load_computed_* *foot_*_computed_max", {kComputedWrenches}},
    {"*_foot_load_measured_* contact_lost_ticks", {kComputedWrenches, kKnownWrenches}},
    {"foot_force_error_*_rms",
     {kComputedWrenches, kKnownWrenches, "SUPPORT_PLAN.in_contact", "PLANNER_STATUS.foot_pose"}},
    {"*foot_*_error_*rms", {kComputedWrenches, kKnownWrenches, "SUPPORT_PLAN.in_contact"}},
    {"*_foot_*_violation_after_contact", {kComputedWrenches, kKnownWrenches, kStand}},
    {"*_foot_*_violation_*", {kComputedWrenches, kKnownWrenches}},
    // joints and drives
    {"joint_torque_* torque_step_max",
     {"GROUND_TRUTH.joint_torque | BRIDGE_STATUS.applied_torque | JOINT_COMMAND.torque"}},
    {"torque_limited", {"BRIDGE_STATUS.saturated"}},
    {"torque_step_at_switch", {"JOINT_COMMAND.in_contact, torque"}},
    {"torque_step_*", {kReference, "JOINT_COMMAND.in_contact, torque"}},
    {"joint_position_beyond", {"GROUND_TRUTH.joint_position | ROBOT_STATE.joint_position"}},
    {"joint_velocity_share", {"GROUND_TRUTH.joint_velocity | ROBOT_STATE.joint_velocity"}},
    {"saturations", {"BRIDGE_STATUS.saturations"}},
    {"bridge_not_running_ticks", {"BRIDGE_STATUS.state"}},
    {"drive_torque_step", {"DRIVE_COMMAND.current"}},
    {"drive_*", {"DRIVE_COMMAND.current", "BRIDGE_STATUS.applied_torque"}},
    {"bus_frames_sent", {"BRIDGE_STATUS.frames_sent"}},
    {"bus_frames_lost", {"BRIDGE_STATUS.frames_lost"}},
    {"bus_working_counter_errors", {"BRIDGE_STATUS.working_counter_errors"}},
    {"bridge_overruns", {"BRIDGE_STATUS.overruns"}},
    // contacts
    {"foot_lift_motion_z", {"JOINT_COMMAND.in_contact", "GROUND_TRUTH.foot_pose"}},
    {"foot_lift_motion_z_reference",
     {kReference, "JOINT_COMMAND.in_contact", "GROUND_TRUTH.foot_pose"}},
    {"*_foot_sink", {kStand, "GROUND_TRUTH.foot_pose"}},
    {"touch_down no_surface_stops", {"PLANNER_STATUS.foot_state"}},
    {"*_contacts",
     {"PLANNER_STATUS.foot_state, foot_pose", "SUPPORT_PLAN.foot_reference",
      "the phases of step_planner"}},
    {"touch_down_delay_max false_touch_downs",
     {"PLANNER_STATUS.foot_state", "GROUND_TRUTH.foot_wrench"}},
    // steps
    {"walk_velocity_error_rms", {kTrueSteps, "PLANNER_STATUS.walk_velocity, step_reason"}},
    {"landing_height_max", {"GROUND_TRUTH.foot_wrench, com_position, foot_pose"}},
    {"walk_course_share", {"a way that step_planner.walk commands", kTrueCourse}},
    {"walk_turn_share", {"a turn that step_planner.walk commands", kTrueCourse}},
    {"walk_cost_of_transport",
     {"GROUND_TRUTH.foot_wrench, com_position, joint_torque, joint_velocity"}},
    {"steps walk_*", {kTrueSteps}},
    {"step_duration", {"PLANNER_STATUS.stepping"}},
    {"foothold_margin_min", {"PLANNER_STATUS.stepping, foothold_margin"}},
    {"step_*", {"PLANNER_STATUS.stepping", "EXTERNAL_PUSH.force"}},
    {"push_*", {"EXTERNAL_PUSH.force"}},
    // estimates
    {"mass_error_*",
     {"TASK_TORQUE", "ROBOT_STATE.load_mass", "GROUND_TRUTH.foot_pose, foot_wrench"}},
    {"com_estimate_error_*", {"PLANNER_STATUS.com_position", "GROUND_TRUTH.com_position"}},
    {"imu_tilt_*", {"ESTIMATOR_STATUS.imu_tilt, calibration"}},
    {"observer_*", {"ESTIMATOR_STATUS.observed_wrench", "GROUND_TRUTH.foot_wrench"}},
    {"foot_sensor_fault_*", {"ESTIMATOR_STATUS.foot_sensor"}},
    {"estimator_*foot_slip_time", {"ESTIMATOR_STATUS.foot_contact"}},
    {"estimator_nees*",
     {"ROBOT_STATE", "ESTIMATOR_STATUS.covariance", "GROUND_TRUTH.base_position"}},
    {"estimator_*", {"ROBOT_STATE.base_position", "GROUND_TRUTH.base_position"}},
};

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (!text.empty()) {
    const size_t end = std::min(text.find(separator), text.size());
    std::string_view part = text.substr(0, end);
    while (part.starts_with(' ')) part.remove_prefix(1);
    while (part.ends_with(' ')) part.remove_suffix(1);
    if (!part.empty()) parts.push_back(part);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

bool AnyCommand(const RunRecord& run, const std::function<bool(const joint_command_t&)>& tells) {
  return std::ranges::any_of(Messages(run.command, run.first_tick, run.num_ticks),
                             [&](const auto& command) { return tells(*command.second); });
}

/// What a controller leaves zero where it computes no wrenches.
bool CommandTells(const RunRecord& run, std::string_view field) {
  if (field.starts_with("eta")) return AnyCommand(run, TellsRatio);
  if (field.starts_with("in_contact, torque") || field == "in_contact") {
    return AnyCommand(run, [](const joint_command_t& command) {
      return command.in_contact[0] != 0 || command.in_contact[1] != 0;
    });
  }
  if (field == "torque" || field == "status") return true;
  return AnyCommand(run, [](const joint_command_t& command) {
    return TellsFoot(command, 0) || TellsFoot(command, 1);
  });
}

bool ObservesFeet(const RunRecord& run) {
  return std::ranges::any_of(
      Messages(run.state, run.first_tick, run.num_ticks), [](const auto& state) {
        const auto& sources = state.second->foot_wrench_source;
        return std::ranges::find(sources, robot_state_t::SOURCE_OBSERVER) != sources.end();
      });
}

/// Whether the run has what "CHANNEL.field, field" names.
bool Has(const RunRecord& run, std::string_view what) {
  if (what == "the phases of step_planner") return ReadSchedulePlan(run).has_value();
  if (what == "a way that step_planner.walk commands") return FollowedCourse(run).commanded_way > 0;
  if (what == "a turn that step_planner.walk commands") {
    return FollowedCourse(run).commanded_turn > 0;
  }
  const size_t dot = std::min(what.find('.'), what.size());
  const std::string_view channel = what.substr(0, dot);
  const std::string_view field = what.substr(std::min(dot + 1, what.size()));
  const std::map<std::string_view, bool> series = {
      {"ROBOT_SENSORS", !run.sensors.empty()},
      {"ROBOT_STATE", !run.state.empty()},
      {"ESTIMATOR_STATUS", !run.estimator.empty()},
      {"SUPPORT_PLAN", !run.plan.empty()},
      {"PLANNER_STATUS", !run.planner.empty()},
      {"TASK_TORQUE", !run.task.empty()},
      {"BALANCE_TORQUE", !run.balance.empty()},
      {"JOINT_COMMAND", !run.command.empty()},
      {"DRIVE_COMMAND", !run.drive.empty()},
      {"BRIDGE_STATUS", !run.bridge.empty()},
      {"EXTERNAL_PUSH", !run.push.empty()},
      {"GROUND_TRUTH", !run.truth.empty()},
      {"HEALTH", !run.health.empty()},
      {"a reference run", run.reference != nullptr},
      {"the run's wall time", false},
  };
  const auto found = series.find(channel);
  if (found == series.end()) return run.other.contains(channel);
  if (!found->second) return false;
  if (channel == "JOINT_COMMAND") return CommandTells(run, field);
  if (field != "foot_wrench") return true;
  if (channel == "ROBOT_STATE") return ObservesFeet(run);
  return channel != "ROBOT_SENSORS" || FeetHaveSensors(run);
}

}  // namespace

std::string NeedsOf(std::string_view metric) {
  const std::string name(metric);
  const auto fits = [&](std::string_view pattern) {
    return fnmatch(std::string(pattern).c_str(), name.c_str(), 0) == 0;
  };
  for (const auto& [metrics, needs] : kNeeds) {
    if (!std::ranges::any_of(Split(metrics, ' '), fits)) continue;
    return fmt::format("{}", fmt::join(needs.begin(), std::ranges::find(needs, nullptr), "; "));
  }
  return "";
}

std::vector<std::string> TellNeeds(const Metric& metric) {
  std::vector<std::string> needs;
  for (const std::string_view need : Split(metric.needs, ';')) {
    needs.push_back(fmt::format("{}", fmt::join(Split(need, '|'), ", else ")));
  }
  return needs;
}

std::vector<std::string> MissingFor(const Metric& metric, const RunRecord& run) {
  std::vector<std::string> missing;
  for (const std::string_view need : Split(metric.needs, ';')) {
    const std::vector<std::string_view> fields = Split(need, '|');
    if (std::ranges::any_of(fields, [&](std::string_view field) { return Has(run, field); })) {
      continue;
    }
    missing.push_back(fmt::format("{}", fmt::join(fields, " or ")));
  }
  return missing;
}

}  // namespace poise::logging
