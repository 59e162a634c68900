#include "tools/robot/maker_shapes.h"

#include <tinyxml2.h>

#include <cmath>
#include <sstream>

#include "components/robot/xml_text.h"
#include "components/robot_files/mjcf_source.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using robot::Attribute;
using robot::SourceShape;

constexpr int kMostFolders = 8;  // above the maker's file that are searched for meshes

/// Numbers of an attribute; those that are missing or no number stay as in `missing`.
Vector3d Numbers(const tinyxml2::XMLElement& element, const char* name, Vector3d missing) {
  std::istringstream text(Attribute(element, name));
  for (int i = 0; i < 3; ++i) {
    double number = 0;
    if (!(text >> number) || !std::isfinite(number)) break;
    missing[i] = number;
  }
  return missing;
}

double NumberOf(const tinyxml2::XMLElement& element, const char* name) {
  return Numbers(element, name, Vector3d::Zero()).x();
}

Isometry3d Origin(const tinyxml2::XMLElement& element) {
  Isometry3d pose = Isometry3d::Identity();
  const tinyxml2::XMLElement* const origin = element.FirstChildElement("origin");
  if (origin == nullptr) return pose;
  const Vector3d rpy = Numbers(*origin, "rpy", Vector3d::Zero());
  pose.translation() = Numbers(*origin, "xyz", Vector3d::Zero());
  pose.linear() = (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
                   Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
                      .toRotationMatrix();
  return pose;
}

void AddShape(const tinyxml2::XMLElement& element, const std::string& link, bool collides,
              std::vector<SourceShape>* shapes) {
  const tinyxml2::XMLElement* const geometry = element.FirstChildElement("geometry");
  const tinyxml2::XMLElement* const solid = geometry ? geometry->FirstChildElement() : nullptr;
  if (solid == nullptr) return;
  SourceShape shape;
  shape.link = link;
  shape.pose = Origin(element);
  shape.collides = collides;
  const std::string kind = solid->Value();
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

/// `relative` below `folder`, or what is left of it without its first folders.
fs::path Below(const fs::path& folder, const fs::path& relative) {
  std::error_code error;
  for (auto first = relative.begin(); first != relative.end(); ++first) {
    fs::path path = folder;
    for (auto part = first; part != relative.end(); ++part) path /= *part;
    if (fs::is_regular_file(path, error)) return path;
  }
  return {};
}

}  // namespace

std::vector<SourceShape> UrdfShapes(const tinyxml2::XMLElement& robot) {
  std::vector<SourceShape> shapes;
  for (const tinyxml2::XMLElement* e = robot.FirstChildElement("link"); e;
       e = e->NextSiblingElement("link")) {
    const std::string link = Attribute(*e, "name");
    for (const char* what : {"collision", "visual"}) {
      for (const tinyxml2::XMLElement* s = e->FirstChildElement(what); s;
           s = s->NextSiblingElement(what)) {
        AddShape(*s, link, std::string_view(what) == "collision", &shapes);
      }
    }
  }
  return shapes;
}

MakerShapes ReadShapes(std::string_view maker_text) {
  tinyxml2::XMLDocument document;
  robot::ParseXml(maker_text, "the maker's file", &document);
  const tinyxml2::XMLElement* const root = document.RootElement();
  if (root == nullptr) return {};
  if (std::string_view(root->Value()) == "mujoco") {
    robot::MjcfDocument mjcf = robot::ReadMjcf(maker_text, nullptr);
    return {std::move(mjcf.shapes), mjcf.mesh_folder};
  }
  return {UrdfShapes(*root), ""};
}

bool HasSize(const SourceShape& shape) {
  if (!shape.size.allFinite() || !shape.pose.matrix().allFinite()) return false;
  switch (shape.kind) {
    case SourceShape::Kind::kBox:
      return shape.size.minCoeff() > 0;
    case SourceShape::Kind::kMesh:
      return shape.size.cwiseAbs().minCoeff() > 0;
    case SourceShape::Kind::kSphere:
      return shape.size.x() > 0;
    default:
      return shape.size.x() > 0 && shape.size.y() > 0;
  }
}

fs::path FindMesh(const MeshPlaces& places, const std::string& name) {
  std::string relative = name;
  bool package = false;
  for (const std::string_view scheme : {"package://", "model://", "file://"}) {
    if (!relative.starts_with(scheme)) continue;
    relative = relative.substr(scheme.size());
    package = scheme != "file://";
  }
  if (relative.empty()) return {};
  std::error_code error;
  for (const fs::path& folder : places.folders) {
    if (fs::path found = Below(folder, fs::path(relative).relative_path()); !found.empty()) {
      return found;
    }
  }
  if (places.maker_file.empty()) return {};
  if (fs::path(relative).is_absolute()) {
    return fs::is_regular_file(relative, error) ? fs::path(relative) : fs::path();
  }
  if (!places.mesh_folder.empty()) relative = (fs::path(places.mesh_folder) / relative).string();
  fs::path folder = fs::absolute(places.maker_file, error).parent_path();
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
