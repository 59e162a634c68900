#include "tools/robot/robot_json.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "components/balance/support_polygon.h"
#include "components/framework/run.h"
#include "tools/robot/robot_check.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;

// A run's page holds at most so many triangles: the robot is the smaller part of it.
constexpr size_t kRunTriangles = 20'000;

Json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Json PoseJson(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return {{"position", Vector(pose.translation())}, {"orientation", {q.w(), q.x(), q.y(), q.z()}}};
}

Json RobotJson(const logging::RunRecord& run) {
  MeshPlaces places;  // those of the machine that the run was on, if it is this one
  places.maker_file = ResourceOf(run.spec, "urdf").file();
  return RobotJson(run.robot, DrawRobot(run.robot, run.info.urdf, places, kRunTriangles));
}

Json RobotJson(const robot::RobotModel& model, const RobotDrawing& drawing) {
  Json json;
  json["name"] = model.name();
  json["mass"] = model.total_mass();
  json["bodies"] = Json::array();
  for (const robot::Body& body : model.bodies()) {
    Json item = {{"name", body.name}, {"parent", body.parent}, {"joint", body.joint}};
    if (body.joint >= 0) {
      const robot::Joint& joint = model.joints()[static_cast<size_t>(body.joint)];
      item["origin"] = PoseJson(joint.origin);
      item["axis"] = Vector(joint.axis);
    }
    json["bodies"].push_back(std::move(item));
  }
  json["joints"] = Json::array();
  for (size_t i = 0; i < model.joints().size(); ++i) {
    const robot::Joint& joint = model.joints()[i];
    json["joints"].push_back({{"name", joint.name},
                              {"lower", joint.lower},
                              {"upper", joint.upper},
                              {"torque_limit", robot::PeakTorque(model, i)}});
  }
  json["feet"] = Json::array();
  for (const robot::FootModel& foot : model.feet()) {
    Json corners = Json::array();
    const balance::ConvexPolygon sole = balance::SolePolygon(foot, 0);
    for (const Eigen::Vector2d& corner : sole.corners()) {
      corners.push_back({corner.x(), corner.y()});
    }
    json["feet"].push_back({{"name", foot.name},
                            {"body", foot.body},
                            {"sole", PoseJson(foot.sole)},
                            {"force_sensor", foot.force_sensor},
                            {"corners", std::move(corners)}});
  }
  AddDrawing(drawing, &json);
  return json;
}

}  // namespace poise
