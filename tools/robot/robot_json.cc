#include "tools/robot/robot_json.h"

#include <tinyxml.h>
#include <urdf_exception/exception.h>
#include <urdf_model/pose.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "components/balance/support_polygon.h"
#include "tools/robot/robot_check.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;

Json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json PoseJson(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return {{"position", Vector(pose.translation())}, {"orientation", {q.w(), q.x(), q.y(), q.z()}}};
}

/// Three numbers of an attribute; `missing` when it is absent. Throws urdf::ParseError.
Eigen::Vector3d Numbers(const TiXmlElement& element, const char* name,
                        const Eigen::Vector3d& missing) {
  const char* const text = element.Attribute(name);
  if (text == nullptr) return missing;
  urdf::Vector3 v;
  v.init(text);
  return {v.x, v.y, v.z};
}

Eigen::Isometry3d Origin(const TiXmlElement& visual) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const TiXmlElement* const origin = visual.FirstChildElement("origin");
  if (origin == nullptr) return pose;
  const Eigen::Vector3d rpy = Numbers(*origin, "rpy", Eigen::Vector3d::Zero());
  urdf::Rotation rotation;
  rotation.setFromRPY(rpy.x(), rpy.y(), rpy.z());
  pose.linear() = Eigen::Quaterniond(rotation.w, rotation.x, rotation.y, rotation.z)
                      .normalized()
                      .toRotationMatrix();
  pose.translation() = Numbers(*origin, "xyz", Eigen::Vector3d::Zero());
  return pose;
}

/// Shape of a <geometry>; empty for a mesh and for what is no solid.
std::optional<Json> Shape(const TiXmlElement& visual) {
  const TiXmlElement* const geometry = visual.FirstChildElement("geometry");
  const TiXmlElement* const shape = geometry ? geometry->FirstChildElement() : nullptr;
  if (shape == nullptr) return {};
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  const auto number = [&](const char* name) {
    double value = 0;
    return shape->QueryDoubleAttribute(name, &value) == TIXML_SUCCESS ? value : 0;
  };
  const std::string kind = shape->Value();
  if (kind == "box") {
    const Eigen::Vector3d size = Numbers(*shape, "size", Eigen::Vector3d::Zero());
    if (!size.allFinite() || size.minCoeff() <= 0) return {};
    return Json{{"shape", kind}, {"size", Vector(size)}};
  }
  const double radius = number("radius");
  if (!positive(radius)) return {};
  if (kind == "sphere") return Json{{"shape", kind}, {"radius", radius}};
  const double length = number("length");
  if (kind != "cylinder" || !positive(length)) return {};
  return Json{{"shape", kind}, {"radius", radius}, {"length", length}};
}

Json Visuals(const robot::RobotModel& model, std::string_view urdf) {
  Json visuals = Json::array();
  TiXmlDocument document;
  document.Parse(std::string(urdf).c_str(), nullptr, TIXML_ENCODING_UTF8);
  const TiXmlElement* const robot = document.FirstChildElement("robot");
  if (robot == nullptr) return visuals;
  for (const TiXmlElement* link = robot->FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const char* const name = link->Attribute("name");
    const robot::Frame* const place = name ? model.FindFrame(name) : nullptr;
    if (place == nullptr) continue;
    for (const TiXmlElement* visual = link->FirstChildElement("visual"); visual != nullptr;
         visual = visual->NextSiblingElement("visual")) {
      try {
        std::optional<Json> shape = Shape(*visual);
        if (!shape) continue;
        const Eigen::Isometry3d pose = place->pose * Origin(*visual);
        if (!pose.matrix().allFinite()) continue;
        (*shape)["body"] = place->body;
        (*shape)["pose"] = PoseJson(pose);
        visuals.push_back(std::move(*shape));
      } catch (const urdf::ParseError&) {
        // Not numbers: drawn like a body without a visual.
      }
    }
  }
  return visuals;
}

}  // namespace

Json RobotJson(const logging::RunRecord& run) {
  return RobotJson(run.robot, run.info.urdf);
}

Json RobotJson(const robot::RobotModel& model, std::string_view urdf) {
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
                              {"torque_limit", TorqueLimit(model, i)}});
  }
  json["feet"] = Json::array();
  for (const robot::FootModel& foot : model.feet()) {
    Json corners = Json::array();
    for (const Eigen::Vector2d& corner : balance::SolePolygon(foot, 0).corners()) {
      corners.push_back({corner.x(), corner.y()});
    }
    json["feet"].push_back({{"name", foot.name},
                            {"body", foot.body},
                            {"sole", PoseJson(foot.sole)},
                            {"corners", std::move(corners)}});
  }
  json["visuals"] = Visuals(model, urdf);
  return json;
}

}  // namespace poise
