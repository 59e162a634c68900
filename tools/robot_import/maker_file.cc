#include "tools/robot_import/maker_file.h"

#include <tinyxml2.h>

#include <cmath>
#include <sstream>

#include "components/framework/configuration/configuration.h"
#include "components/robot/robot_model.h"
#include "components/robot/urdf_source.h"
#include "components/robot/xml_text.h"
#include "fmt/format.h"
#include "tools/robot/maker_shapes.h"
#include "tools/robot/mesh_file.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using robot::Attribute;

/// Shapes, sensors and transmissions of a URDF, which the robot's loader does not look at.
void ReadExtensions(MakerFile* maker) {
  tinyxml2::XMLDocument document;
  robot::ParseXml(maker->text, "URDF", &document);
  const tinyxml2::XMLElement* const root = document.FirstChildElement("robot");
  if (root == nullptr) return;
  maker->shapes = UrdfShapes(*root);
  const auto sensor = [&](const tinyxml2::XMLElement& element, const std::string& place) {
    const std::string kind = Attribute(element, "type");
    if (!place.empty()) maker->sensors.push_back({kind, place, 0});
  };
  for (const tinyxml2::XMLElement* e = root->FirstChildElement(); e; e = e->NextSiblingElement()) {
    const std::string kind = e->Value();
    if (kind == "gazebo") {
      const std::string place = Attribute(*e, "reference");
      for (const tinyxml2::XMLElement* s = e->FirstChildElement("sensor"); s;
           s = s->NextSiblingElement("sensor")) {
        sensor(*s, place);
      }
      // Gazebo measures the force in a joint that gives feedback: a maker asks for it at a sensor.
      if (e->FirstChildElement("provideFeedback")) {
        maker->sensors.push_back({"feedback", place, 0});
      }
    } else if (kind == "sensor") {
      const tinyxml2::XMLElement* const parent = e->FirstChildElement("parent");
      if (parent == nullptr) continue;
      sensor(*e, Attribute(*parent, parent->Attribute("joint") ? "joint" : "link"));
    } else if (kind == "transmission") {
      for (const tinyxml2::XMLElement* j = e->FirstChildElement("joint"); j;
           j = j->NextSiblingElement("joint")) {
        maker->actuated.insert(Attribute(*j, "name"));
      }
    }
  }
}

/// The text of a file that ends: a pipe or a device may not. Throws ConfigError.
std::string ReadRegularFile(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) {
    throw ConfigError(path.string() + ": is a pipe or a device, no file: name the robot's file");
  }
  std::string text = ReadFile(path.string());
  if (IsLfsPointer(text)) {
    throw ConfigError(path.string() +
                      ": is a Git LFS pointer: fetch the file that it stands for, `git lfs pull`");
  }
  return text;
}

void ReadSrdf(const fs::path& path, MakerFile* maker) {
  tinyxml2::XMLDocument document;
  const std::string format = "SRDF " + path.filename().string();
  robot::ParseXml(ReadRegularFile(path), format.c_str(), &document);
  const tinyxml2::XMLElement* const root = document.RootElement();
  if (root == nullptr || std::string_view(root->Value()) != "robot") {
    throw ConfigError(path.string() + ": is no SRDF: its outermost element must be <robot>");
  }
  maker->postures_from = path.filename().string();
  for (const tinyxml2::XMLElement* e = root->FirstChildElement("group_state"); e;
       e = e->NextSiblingElement("group_state")) {
    robot::MjcfKey key;
    key.name = Attribute(*e, "name");
    for (const tinyxml2::XMLElement* j = e->FirstChildElement("joint"); j;
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

/// Robots' files of a folder, for an error: ", e.g. x.urdf".
std::string FilesWithin(const fs::path& folder) {
  constexpr size_t kNamed = 5;
  std::set<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string ending = entry.path().extension();
    if (ending == ".urdf" || ending == ".xml") names.insert(entry.path().filename());
  }
  std::string list;
  for (const std::string& name : names) {
    if (std::ranges::distance(names.begin(), names.find(name)) == kNamed) return list + ", ...";
    list += (list.empty() ? ": it has " : ", ") + name;
  }
  return list;
}

/// The first element of xacro; null without.
const tinyxml2::XMLElement* Macro(const tinyxml2::XMLElement& element) {
  for (const tinyxml2::XMLElement* e = element.FirstChildElement(); e;
       e = e->NextSiblingElement()) {
    if (std::string_view(e->Value()).starts_with("xacro:")) return e;
    if (const tinyxml2::XMLElement* const within = Macro(*e)) return within;
  }
  return nullptr;
}

}  // namespace

MakerFile ReadMakerFile(const fs::path& path, const fs::path& srdf) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw ConfigError(
        fmt::format("{}: is a folder: name the robot's file{}", path.string(), FilesWithin(path)));
  }
  MakerFile maker;
  maker.path = path;
  maker.text = ReadRegularFile(path);
  const size_t begin = maker.text.find_first_not_of("\xef\xbb\xbf \t\r\n");
  if (begin == std::string::npos) {
    throw ConfigError(path.string() + ": is empty: a URDF or MJCF file is needed");
  }
  if (maker.text[begin] != '<') {
    throw ConfigError(fmt::format(
        "{}: is no XML: a URDF or MJCF file is needed{}", path.string(),
        path.extension() == ".pbtxt" ? "; `poise robot check` takes a robot's text" : ""));
  }
  tinyxml2::XMLDocument document;
  robot::ParseXml(maker.text, "the file", &document);
  const tinyxml2::XMLElement* const root = document.RootElement();
  if (root == nullptr) throw ConfigError(path.string() + ": has no XML element");
  const std::string kind = robot::OneLine(root->Value());
  if (kind != "robot" && kind != "mujoco") {
    throw ConfigError(fmt::format(
        "{}: begins with <{}>; a URDF begins with <robot>, MJCF with <mujoco>{}", path.string(),
        kind, kind == "sdf" ? ": SDF is not read, take the URDF that it was made of" : ""));
  }
  if (const tinyxml2::XMLElement* const macro = Macro(*root)) {
    throw ConfigError(fmt::format(
        "{}: line {}: <{}> is of xacro: expand it first, `xacro {} > robot.urdf`, and import that",
        path.string(), macro->GetLineNum(), robot::OneLine(macro->Value()),
        path.filename().string()));
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

}  // namespace poise
