#include "tools/robot_import/maker_file.h"

#include <tinyxml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "components/framework/configuration/configuration.h"
#include "components/robot/robot_model.h"
#include "components/robot/urdf_source.h"
#include "components/robot/xml_text.h"
#include "fmt/format.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using robot::Attribute;
using robot::SourceShape;

constexpr int kMostFolders = 8;  // above the maker's file that are searched for meshes

/// Numbers of an attribute; those that are missing or no number stay as in `missing`.
Vector3d Numbers(const TiXmlElement& element, const char* name, Vector3d missing) {
  std::istringstream text(Attribute(element, name));
  for (int i = 0; i < 3; ++i) {
    double number = 0;
    if (!(text >> number) || !std::isfinite(number)) break;
    missing[i] = number;
  }
  return missing;
}

double NumberOf(const TiXmlElement& element, const char* name) {
  return Numbers(element, name, Vector3d::Zero()).x();
}

Isometry3d Origin(const TiXmlElement& element) {
  Isometry3d pose = Isometry3d::Identity();
  const TiXmlElement* const origin = element.FirstChildElement("origin");
  if (origin == nullptr) return pose;
  const Vector3d rpy = Numbers(*origin, "rpy", Vector3d::Zero());
  pose.translation() = Numbers(*origin, "xyz", Vector3d::Zero());
  pose.linear() = (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
                   Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
                      .toRotationMatrix();
  return pose;
}

void AddShape(const TiXmlElement& element, const std::string& link, bool collides,
              std::vector<SourceShape>* shapes) {
  const TiXmlElement* const geometry = element.FirstChildElement("geometry");
  const TiXmlElement* const solid = geometry ? geometry->FirstChildElement() : nullptr;
  if (solid == nullptr) return;
  SourceShape shape;
  shape.link = link;
  shape.pose = Origin(element);
  shape.collides = collides;
  const std::string& kind = solid->ValueStr();
  const double radius = NumberOf(*solid, "radius");
  if (kind == "box") {
    shape.size = Numbers(*solid, "size", Vector3d::Zero());
  } else if (kind == "sphere") {
    shape.kind = SourceShape::Kind::kSphere;
    shape.size = Vector3d(radius, 0, 0);
  } else if (kind == "cylinder" || kind == "capsule") {
    shape.kind = kind == "cylinder" ? SourceShape::Kind::kCylinder : SourceShape::Kind::kCapsule;
    shape.size = Vector3d(radius, NumberOf(*solid, "length"), 0);
  } else if (kind == "mesh") {
    shape.kind = SourceShape::Kind::kMesh;
    shape.mesh = Attribute(*solid, "filename");
    shape.size = Numbers(*solid, "scale", Vector3d::Ones());
  } else {
    return;
  }
  shapes->push_back(shape);
}

/// Shapes, sensors and transmissions of a URDF, which the robot's loader does not look at.
void ReadExtensions(MakerFile* maker) {
  TiXmlDocument document;
  robot::ParseXml(maker->text, "URDF", &document);
  const TiXmlElement* const root = document.FirstChildElement("robot");
  if (root == nullptr) return;
  const auto sensor = [&](const TiXmlElement& element, const std::string& place) {
    const std::string kind = Attribute(element, "type");
    if (!place.empty()) maker->sensors.push_back({kind, place, 0});
  };
  for (const TiXmlElement* e = root->FirstChildElement(); e; e = e->NextSiblingElement()) {
    const std::string& kind = e->ValueStr();
    if (kind == "link") {
      const std::string link = Attribute(*e, "name");
      for (const char* what : {"collision", "visual"}) {
        for (const TiXmlElement* s = e->FirstChildElement(what); s;
             s = s->NextSiblingElement(what)) {
          AddShape(*s, link, std::string_view(what) == "collision", &maker->shapes);
        }
      }
    } else if (kind == "gazebo") {
      const std::string place = Attribute(*e, "reference");
      for (const TiXmlElement* s = e->FirstChildElement("sensor"); s;
           s = s->NextSiblingElement("sensor")) {
        sensor(*s, place);
      }
      // Gazebo measures the force in a joint that gives feedback: a maker asks for it at a sensor.
      if (e->FirstChildElement("provideFeedback")) {
        maker->sensors.push_back({"feedback", place, 0});
      }
    } else if (kind == "sensor") {
      const TiXmlElement* const parent = e->FirstChildElement("parent");
      if (parent == nullptr) continue;
      sensor(*e, Attribute(*parent, parent->Attribute("joint") ? "joint" : "link"));
    } else if (kind == "transmission") {
      for (const TiXmlElement* j = e->FirstChildElement("joint"); j;
           j = j->NextSiblingElement("joint")) {
        maker->actuated.insert(Attribute(*j, "name"));
      }
    }
  }
}

void ReadSrdf(const fs::path& path, MakerFile* maker) {
  TiXmlDocument document;
  robot::ParseXml(ReadFile(path.string()), "SRDF", &document);
  const TiXmlElement* const root = document.RootElement();
  if (root == nullptr || root->ValueStr() != "robot") {
    throw ConfigError(path.string() + ": is no SRDF: its outermost element must be <robot>");
  }
  maker->postures_from = path.filename().string();
  for (const TiXmlElement* e = root->FirstChildElement("group_state"); e;
       e = e->NextSiblingElement("group_state")) {
    robot::MjcfKey key;
    key.name = Attribute(*e, "name");
    for (const TiXmlElement* j = e->FirstChildElement("joint"); j;
         j = j->NextSiblingElement("joint")) {
      std::istringstream values(Attribute(*j, "value"));
      double value = 0, more = 0;
      // Joints with several numbers are the base.
      if (values >> value && std::isfinite(value) && !(values >> more)) {
        key.joint[Attribute(*j, "name")] = value;
      }
    }
    maker->postures.push_back(key);
  }
}

fs::path SrdfBeside(const fs::path& path) {
  fs::path same = path;
  same.replace_extension(".srdf");
  std::error_code error;
  if (fs::is_regular_file(same, error)) return same;
  std::set<fs::path> found;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  for (const fs::path& near : {folder, folder / "srdf", folder.parent_path() / "srdf"}) {
    for (const auto& entry : fs::directory_iterator(near, error)) {
      if (entry.path().extension() == ".srdf") found.insert(entry.path());
    }
  }
  return found.size() == 1 ? *found.begin() : fs::path();
}

}  // namespace

MakerFile ReadMakerFile(const fs::path& path, const fs::path& srdf) {
  MakerFile maker;
  maker.path = path;
  maker.text = ReadFile(path.string());
  TiXmlDocument document;
  robot::ParseXml(maker.text, "the file", &document);
  const TiXmlElement* const root = document.RootElement();
  const std::string kind = root ? robot::OneLine(root->ValueStr()) : "";
  if (kind != "robot" && kind != "mujoco") {
    throw ConfigError(fmt::format(
        "{}: begins with <{}>; a URDF begins with <robot>, MJCF with <mujoco> (expand xacro first)",
        path.string(), kind));
  }
  maker.is_mjcf = kind == "mujoco";
  if (maker.is_mjcf) {
    robot::MjcfDocument mjcf = robot::ReadMjcf(maker.text, &maker.left_out);
    maker.source = std::move(mjcf.source);
    maker.shapes = std::move(mjcf.shapes);
    maker.sensors = std::move(mjcf.sensors);
    maker.postures = std::move(mjcf.keys);
    maker.postures_from = "keyframe";
    maker.actuated = std::move(mjcf.actuated);
    maker.root_orientation = mjcf.root_orientation;
    maker.mesh_folder = mjcf.mesh_folder;
    maker.from_shapes = mjcf.from_shapes;
  } else {
    maker.source = robot::ReadUrdf(maker.text, &maker.left_out);
    ReadExtensions(&maker);
  }
  const fs::path states = srdf.empty() ? SrdfBeside(path) : srdf;
  if (!states.empty()) ReadSrdf(states, &maker);
  return maker;
}

fs::path FindMesh(const MakerFile& maker, const std::string& name) {
  std::string relative = name;
  bool package = false;
  for (const std::string_view scheme : {"package://", "model://", "file://"}) {
    if (!relative.starts_with(scheme)) continue;
    relative = relative.substr(scheme.size());
    package = scheme != "file://";
  }
  std::error_code error;
  if (fs::path(relative).is_absolute()) {
    return fs::is_regular_file(relative, error) ? fs::path(relative) : fs::path();
  }
  if (!maker.mesh_folder.empty()) relative = (fs::path(maker.mesh_folder) / relative).string();
  fs::path folder = fs::absolute(maker.path, error).parent_path();
  const size_t slash = relative.find('/');
  for (int i = 0; i < kMostFolders && !folder.empty(); ++i, folder = folder.parent_path()) {
    if (fs::is_regular_file(folder / relative, error)) return folder / relative;
    // The package's own folder may have another name.
    if (package && slash != std::string::npos &&
        fs::is_regular_file(folder / relative.substr(slash + 1), error)) {
      return folder / relative.substr(slash + 1);
    }
    if (folder == folder.root_path()) break;
  }
  return {};
}

}  // namespace poise
