#include "components/robot_files/mjcf_cleaning.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <set>

#include "components/robot/robot_model.h"
#include "components/robot/xml_text.h"
#include "components/robot_files/mjcf_attributes.h"
#include "components/robot_files/mjcf_defaults.h"

namespace poise::robot {
namespace {

constexpr size_t kMaxElements = 20000;
constexpr size_t kFreeCoordinates = 7;  // position and quaternion

class Cleaner {
 public:
  Cleaner(std::vector<std::string>* warnings, CleanMjcf* result)
      : warnings_(warnings), result_(*result) {}

  void Clean(const tinyxml2::XMLElement& root) {
    if (std::string_view(root.Value()) != "mujoco") {
      FailMjcf(root, "<{}> is no MJCF: its outermost element must be <mujoco>", Shown(root));
    }
    if (const tinyxml2::XMLElement* const e = root.FirstChildElement("include")) {
      FailMjcf(*e, "<include file='{}'> is not followed: import that file, if it has the robot",
               Attribute(*e, "file"));
    }
    result_.model = Attribute(root, "model");
    Sections(root, "compiler", [&](const tinyxml2::XMLElement& e) { Compiler(e); });
    std::string xml = "<mujoco><compiler autolimits='true'" + compiler_ +
                      " balanceinertia='true' boundmass='1e-9' boundinertia='1e-12'/>"
                      "<size njmax='1' nconmax='1'/>";
    Sections(root, "default", [&](const tinyxml2::XMLElement& e) { defaults_.Read(e, "", &xml); });
    Sections(root, "asset", [&](const tinyxml2::XMLElement& e) { Assets(e); });
    const Place robot = RobotBody(root);
    xml += "<worldbody>";
    std::string child_class;
    for (const tinyxml2::XMLElement* frame : robot.frames) {
      if (frame->Attribute("childclass")) child_class = Attribute(*frame, "childclass");
      xml += BodyTag("", *frame);
    }
    Body(*robot.body, -1, child_class, &xml);
    for (size_t i = 0; i < robot.frames.size(); ++i) xml += "</body>";
    xml += "</worldbody><actuator>";
    Sections(root, "actuator", [&](const tinyxml2::XMLElement& e) { Actuators(e, &xml); });
    xml += "</actuator></mujoco>";
    result_.xml = std::move(xml);
    Sections(root, "equality", [&](const tinyxml2::XMLElement& e) { Equalities(e); });
    Sections(root, "sensor", [&](const tinyxml2::XMLElement& e) { Sensors(e); });
    Sections(root, "keyframe", [&](const tinyxml2::XMLElement& e) { Keys(e); });
    for (const tinyxml2::XMLElement* e = root.FirstChildElement(); e; e = e->NextSiblingElement()) {
      const std::string name = e->Value();
      if (name == "tendon" || name == "extension" || name == "deformable") {
        Note(*e, "<{}> is left out", name);
      }
    }
  }

 private:
  template <typename... Args>
  void Note(const tinyxml2::XMLElement& at, fmt::format_string<Args...> text, Args&&... args) {
    if (warnings_ == nullptr) return;
    warnings_->push_back(fmt::format("MJCF line {}: {}", at.GetLineNum(),
                                     fmt::format(text, std::forward<Args>(args)...)));
  }

  static void Sections(const tinyxml2::XMLElement& root, const char* name,
                       const std::function<void(const tinyxml2::XMLElement&)>& read) {
    for (const tinyxml2::XMLElement* e = root.FirstChildElement(name); e;
         e = e->NextSiblingElement(name)) {
      read(*e);
    }
  }

  // The last one's attributes hold where there are several <compiler>.
  void Merge(const std::string& attributes) {
    for (size_t at = 0; at < attributes.size();) {
      const size_t value = attributes.find('\'', at) + 1;
      Forget(attributes.substr(at, value - at));
      at = attributes.find('\'', value) + 1;
    }
    compiler_ += attributes;
  }

  void Forget(const std::string& beginning) {
    const size_t at = compiler_.find(beginning);
    if (at == std::string::npos) return;
    compiler_.erase(at, compiler_.find('\'', at + beginning.size()) + 1 - at);
  }

  void Compiler(const tinyxml2::XMLElement& element) {
    Merge(KeptAttributes(element, "compiler"));
    Forget(" autolimits='");  // ours is set
    if (Attribute(element, "coordinate") == "global") {
      FailMjcf(element,
               "coordinate='global' is not supported: save the file with local coordinates");
    }
    if (const std::string order = Attribute(element, "eulerseq"); !order.empty()) {
      if (order.size() != 3 || order.find_first_not_of("xyzXYZ") != std::string::npos) {
        FailMjcf(element, "eulerseq is '{}': three of x, y, z, X, Y, Z must stand there", order);
      }
      Merge(fmt::format(" eulerseq='{}'", order));
    }
    if (const auto total = MjcfNumbers(element, "settotalmass"); !total.empty() && total[0] > 0) {
      FailMjcf(element, "settotalmass is not supported: write the masses themselves");
    }
    if (const std::string folder = Attribute(element, "meshdir"); !folder.empty()) {
      result_.mesh_folder = folder;
    } else if (const std::string assets = Attribute(element, "assetdir"); !assets.empty()) {
      result_.mesh_folder = assets;
    }
  }

  void Assets(const tinyxml2::XMLElement& section) {
    Sections(section, "mesh", [&](const tinyxml2::XMLElement& mesh) {
      const std::string file = Attribute(mesh, "file");
      std::string name = Attribute(mesh, "name");
      if (name.empty()) {  // the file's, without folder and ending
        name = file.substr(file.find_last_of('/') + 1);
        name = name.substr(0, name.rfind('.'));
      }
      CleanGeom& entry = meshes_[name];
      entry.mesh = file;
      if (mesh.Attribute("scale")) {
        entry.scale = MjcfNumbers<3>(mesh, "scale");
      } else if (const auto* scale = defaults_.MeshScale(mesh)) {
        entry.scale = *scale;
      }
    });
  }

  /// Numbers in a keyframe of the joints with which a body of the world floats: a free one, or
  /// three slides and a ball or three hinges. 0: it does not.
  size_t BaseCoordinates(const tinyxml2::XMLElement& body, const std::string& child_class) const {
    if (body.FirstChildElement("freejoint")) return kFreeCoordinates;
    std::map<std::string, int> count;
    for (const tinyxml2::XMLElement* j = body.FirstChildElement("joint"); j;
         j = j->NextSiblingElement("joint")) {
      const std::string type =
          defaults_.Resolved(*j, "type", child_class, MjcfDefaults::Kind::kJoint);
      ++count[type.empty() ? "hinge" : type];
    }
    using Count = std::map<std::string, int>;
    if (count == Count{{"free", 1}} || count == Count{{"slide", 3}, {"ball", 1}}) {
      return kFreeCoordinates;
    }
    return count == Count{{"slide", 3}, {"hinge", 3}} ? 6 : 0;
  }

  static bool HasJoints(const tinyxml2::XMLElement& body) {
    if (body.FirstChildElement("joint")) return true;
    for (const tinyxml2::XMLElement* e = body.FirstChildElement(); e; e = e->NextSiblingElement()) {
      if ((std::string_view(e->Value()) == "body" || std::string_view(e->Value()) == "frame") &&
          HasJoints(*e))
        return true;
    }
    return false;
  }

  struct Place {
    const tinyxml2::XMLElement* body = nullptr;
    std::vector<const tinyxml2::XMLElement*> frames = {};  // around it, the outermost first
  };

  /// Bodies of the world in `at`, which is <worldbody> or a <frame> of it.
  void WorldBodies(const tinyxml2::XMLElement& at, const Place& around, std::string child_class,
                   Place* robot, Place* first) {
    for (const tinyxml2::XMLElement* e = at.FirstChildElement(); e; e = e->NextSiblingElement()) {
      CheckStructure(*e);
      const bool is_frame = std::string_view(e->Value()) == "frame";
      if (!is_frame && std::string_view(e->Value()) != "body") continue;
      std::string inner = Attribute(*e, "childclass");
      if (inner.empty()) inner = child_class;
      Place place = around;
      if (is_frame) {
        place.frames.push_back(e);
        WorldBodies(*e, place, inner, robot, first);
        continue;
      }
      place.body = e;
      if (const size_t coordinates = BaseCoordinates(*e, inner); coordinates > 0) {
        if (robot->body != nullptr) {
          FailMjcf(*e, "body '{}' floats, and so does '{}': leave one in the file",
                   Attribute(*e, "name"), Attribute(*robot->body, "name"));
        }
        *robot = place;
        base_coordinates_ = coordinates;
      } else if (first->body == nullptr && HasJoints(*e)) {
        *first = place;
      }
    }
  }

  Place RobotBody(const tinyxml2::XMLElement& root) {
    Place robot, first;
    Sections(root, "worldbody", [&](const tinyxml2::XMLElement& world) {
      WorldBodies(world, {}, "", &robot, &first);
    });
    if (robot.body != nullptr) return robot;
    if (first.body == nullptr) {
      FailMjcf(root, "no body of <worldbody> has joints: where is the robot?");
    }
    Note(*first.body, "body '{}' has no free joint: it floats here",
         Attribute(*first.body, "name"));
    return first;
  }

  // Elements that would put bodies where the reader sees none.
  void CheckStructure(const tinyxml2::XMLElement& element) const {
    static const std::set<std::string> kUnknown = {"replicate", "attach", "composite", "flexcomp",
                                                   "include"};
    if (kUnknown.contains(element.Value())) {
      FailMjcf(element, "<{}> is not supported: save the file as MuJoCo writes it out, without it",
               Shown(element));
    }
  }

  std::string UniqueName(const tinyxml2::XMLElement& element, const char* kind, size_t index,
                         std::set<std::string>* taken) {
    std::string name = Attribute(element, "name");
    if (name.empty()) name = fmt::format("{}_{}", kind, index);
    if (!taken->insert(name).second) {
      FailMjcf(element, "the name '{}' of a {} stands twice: rename one", name, kind);
    }
    return name;
  }

  void Count(const tinyxml2::XMLElement& element) {
    if (++elements_ > kMaxElements)
      FailMjcf(element, "more than {} elements: simplify it", kMaxElements);
  }

  void Body(const tinyxml2::XMLElement& element, int parent, std::string child_class,
            std::string* xml) {
    Count(element);
    const int index = static_cast<int>(result_.bodies.size());
    CleanBody& body = result_.bodies.emplace_back();
    body.name = UniqueName(element, "body", static_cast<size_t>(index), &links_);
    body.parent = parent;
    if (!Attribute(element, "childclass").empty()) {
      defaults_.ClassAttribute(element, "childclass");
      child_class = Attribute(element, "childclass");
    }
    *xml += BodyTag(fmt::format(" name='b{}'", index), element);
    bool has_inertial = false;
    for (const tinyxml2::XMLElement* e = element.FirstChildElement(); e;
         e = e->NextSiblingElement()) {
      const std::string kind = e->Value();
      CheckStructure(*e);
      if (kind == "body" || kind == "frame") continue;
      if (kind == "inertial") {
        if (has_inertial) FailMjcf(*e, "body '{}' has two <inertial>", result_.bodies.back().name);
        has_inertial = true;
        Inertial(*e, &result_.bodies[static_cast<size_t>(index)], xml);
      } else if (kind == "joint" && !(parent < 0 && base_coordinates_ > 0)) {
        Joint(*e, index, child_class, xml);
      } else if (kind == "freejoint" && parent >= 0) {
        FailMjcf(*e, "body '{}' floats within another: move it to <worldbody>",
                 result_.bodies[static_cast<size_t>(index)].name);
      } else if (kind == "geom") {
        Geom(*e, index, child_class, xml);
      } else if (kind == "site") {
        Site(*e, index, xml);
      }
    }
    Within(element, index, has_inertial, child_class, xml);
    *xml += "</body>";
  }

  std::string BodyTag(const std::string& name, const tinyxml2::XMLElement& element) const {
    return fmt::format("<body{}{}{}>", name, defaults_.ClassAttribute(element, "childclass"),
                       KeptAttributes(element, "body"));
  }

  /// Bodies and frames of a body or a frame.
  void Within(const tinyxml2::XMLElement& element, int owner, bool weighed,
              const std::string& child_class, std::string* xml) {
    for (const tinyxml2::XMLElement* e = element.FirstChildElement(); e;
         e = e->NextSiblingElement()) {
      if (std::string_view(e->Value()) == "body") Body(*e, owner, child_class, xml);
      if (std::string_view(e->Value()) == "frame") Frame(*e, owner, weighed, child_class, xml);
    }
  }

  /// A <frame>, which newer MuJoCo dissolves, is a body without a joint: that moves what it holds
  /// as well. `weighed`: the body around it has an <inertial>, and shapes then weigh nothing.
  void Frame(const tinyxml2::XMLElement& element, int parent, bool weighed, std::string child_class,
             std::string* xml) {
    Count(element);
    const int index = static_cast<int>(result_.bodies.size());
    CleanBody& frame = result_.bodies.emplace_back();
    frame.name = Attribute(element, "name");
    if (frame.name.empty()) frame.name = fmt::format("frame_{}", index);
    while (!links_.insert(frame.name).second) frame.name += "_frame";
    frame.parent = parent;
    frame.has_inertial = weighed;
    if (element.Attribute("childclass")) child_class = Attribute(element, "childclass");
    *xml += BodyTag(fmt::format(" name='b{}'", index), element);
    for (const tinyxml2::XMLElement* e = element.FirstChildElement(); e;
         e = e->NextSiblingElement()) {
      const std::string kind = e->Value();
      CheckStructure(*e);
      if (kind == "geom") {
        Geom(*e, index, child_class, xml);
      } else if (kind == "site") {
        Site(*e, index, xml);
      } else if (kind == "joint" || kind == "freejoint" || kind == "inertial") {
        FailMjcf(*e, "<{}> within <frame> is not supported: move it out, turned as the frame is",
                 Shown(*e));
      }
    }
    Within(element, index, weighed, child_class, xml);
    *xml += "</body>";
  }

  void Inertial(const tinyxml2::XMLElement& element, CleanBody* body, std::string* xml) {
    body->has_inertial = true;
    body->mass = MjcfNumbers<1>(element, "mass")[0];
    std::string place = KeptAttributes(element, "inertial");
    if (element.Attribute("fullinertia")) {
      body->full = MjcfNumbers<6>(element, "fullinertia");
      for (const std::string_view name : kOrientations) {
        if (element.Attribute(std::string(name).c_str())) {
          FailMjcf(element, "<inertial> has fullinertia and {}: leave one out", name);
        }
      }
    } else if (element.Attribute("diaginertia")) {
      body->diagonal = MjcfNumbers<3>(element, "diaginertia");
    }
    *xml += "<inertial mass='1' diaginertia='1 1 1'" +
            (element.Attribute("pos") ? place : " pos='0 0 0'" + place) + "/>";
  }

  void Joint(const tinyxml2::XMLElement& element, int body, const std::string& child_class,
             std::string* xml) {
    Count(element);
    CleanBody& owner = result_.bodies[static_cast<size_t>(body)];
    const size_t index = result_.joints.size();
    CleanJoint& joint = result_.joints.emplace_back();
    joint.name = UniqueName(element, "joint", index, &joint_names_);
    joint.body = body;
    if (owner.joint >= 0) {
      FailMjcf(element, "body '{}' has two joints, '{}' and '{}': give each a body of its own",
               owner.name, result_.joints[static_cast<size_t>(owner.joint)].name, joint.name);
    }
    if (body == 0) {
      FailMjcf(element,
               "joint '{}' holds the root body '{}' to the world: a robot that balances floats",
               joint.name, owner.name);
    }
    owner.joint = static_cast<int>(index);
    if (element.Attribute("actuatorfrcrange")) {
      joint.force_range = MjcfNumbers<2>(element, "actuatorfrcrange");
    } else if (const auto* range = defaults_.ForceRange(element, child_class)) {
      joint.force_range = *range;
    }
    if (const auto k =
            defaults_.Resolved(element, "stiffness", child_class, MjcfDefaults::Kind::kJoint);
        !k.empty() && std::strtod(k.c_str(), nullptr) != 0) {
      Note(element, "the spring of joint '{}' is left out", joint.name);
    }
    *xml +=
        fmt::format("<joint name='j{}'{}{}/>", index, defaults_.ClassAttribute(element, "class"),
                    KeptAttributes(element, "joint"));
  }

  void Geom(const tinyxml2::XMLElement& element, int body, const std::string& child_class,
            std::string* xml) {
    Count(element);
    const std::string type =
        defaults_.Resolved(element, "type", child_class, MjcfDefaults::Kind::kGeom);
    const std::string mesh =
        defaults_.Resolved(element, "mesh", child_class, MjcfDefaults::Kind::kGeom);
    CleanGeom geom;
    const bool is_mesh = !mesh.empty() || type == "mesh";
    if (is_mesh) {
      const auto known = meshes_.find(mesh);
      if (known == meshes_.end()) return;
      geom = known->second;
    } else if (!type.empty() && !IsGeomType(type)) {
      return;  // a plane, a height field
    }
    geom.body = body;
    std::string kept = KeptAttributes(element, "geom");
    if (is_mesh) {  // a sphere without mass holds its place
      kept.clear();
      for (const char* name : {"pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "contype",
                               "conaffinity", "group"}) {
        const std::vector<double> numbers = MjcfNumbers(element, name);
        if (numbers.empty()) continue;
        kept += fmt::format(" {}='", name);
        for (const double number : numbers) kept += fmt::format("{:.17g} ", number);
        kept.back() = '\'';
      }
      kept += " type='sphere' size='0.001' mass='0'";
    }
    *xml += fmt::format("<geom name='g{}'{}{}/>", result_.geoms.size(),
                        defaults_.ClassAttribute(element, "class"), kept);
    result_.geoms.push_back(geom);
  }

  void Site(const tinyxml2::XMLElement& element, int body, std::string* xml) {
    Count(element);
    if (Attribute(element, "name").empty()) return;
    const size_t index = result_.sites.size();
    CleanSite& site = result_.sites.emplace_back();
    site.name = Attribute(element, "name");
    site.body = body;
    // A body may have the same name: the site then takes another.
    if (!links_.insert(site.name).second) site.name = UniqueSite(site.name);
    *xml += fmt::format("<site name='s{}'{}{}/>", index, defaults_.ClassAttribute(element, "class"),
                        KeptAttributes(element, "site"));
  }

  std::string UniqueSite(const std::string& name) {
    for (int i = 0;; ++i) {
      const std::string other = name + "_site" + (i == 0 ? "" : std::to_string(i));
      if (links_.insert(other).second) return other;
    }
  }

  int JointIndex(const std::string& name) const {
    for (size_t j = 0; j < result_.joints.size(); ++j) {
      if (result_.joints[j].name == name) return static_cast<int>(j);
    }
    return -1;
  }

  void Actuators(const tinyxml2::XMLElement& section, std::string* xml) {
    for (const tinyxml2::XMLElement* e = section.FirstChildElement(); e;
         e = e->NextSiblingElement()) {
      Count(*e);
      const std::string kind = e->Value();
      const int joint = JointIndex(Attribute(*e, "joint"));
      if (!IsActuator(kind) || joint < 0) {
        Note(*e, "<{}> '{}' moves no joint of the robot directly: it is left out", Shown(*e),
             Attribute(*e, "name"));
        continue;
      }
      // Every kind becomes a motor: gear and ranges are the same attributes of all.
      *xml += fmt::format("<motor name='a{}' joint='j{}'{}{}/>", result_.actuators.size(), joint,
                          defaults_.ClassAttribute(*e, "class"), KeptAttributes(*e, "actuator"));
      result_.actuators.push_back({joint, kind == "motor"});
    }
  }

  void Equalities(const tinyxml2::XMLElement& section) {
    for (const tinyxml2::XMLElement* e = section.FirstChildElement(); e;
         e = e->NextSiblingElement()) {
      if (std::string_view(e->Value()) != "joint") {
        Note(*e, "equality <{}> '{}' closes a loop: it is left out", Shown(*e),
             Attribute(*e, "name"));
        continue;
      }
      const int joint = JointIndex(Attribute(*e, "joint1"));
      if (joint < 0) {
        FailMjcf(*e, "equality names joint1 '{}', which the robot does not have",
                 Attribute(*e, "joint1"));
      }
      const std::vector<double> coefficients =
          e->Attribute("polycoef") ? MjcfNumbers(*e, "polycoef") : std::vector<double>{0, 1};
      Mimic mimic;
      mimic.joint = Attribute(*e, "joint2");
      mimic.offset = coefficients.empty() ? 0 : coefficients[0];
      mimic.multiplier = coefficients.size() > 1 && !mimic.joint.empty() ? coefficients[1] : 0;
      result_.joints[static_cast<size_t>(joint)].mimic = mimic;
    }
  }

  void Sensors(const tinyxml2::XMLElement& section) {
    for (const tinyxml2::XMLElement* e = section.FirstChildElement(); e;
         e = e->NextSiblingElement()) {
      const std::string site = Attribute(*e, "site");
      if (site.empty()) continue;
      const std::vector<double> noise = MjcfNumbers(*e, "noise");
      result_.sensors.push_back({Shown(*e), site, noise.empty() ? 0 : noise[0]});
    }
  }

  void Keys(const tinyxml2::XMLElement& section) {
    Sections(section, "key", [&](const tinyxml2::XMLElement& element) {
      const std::vector<double> position = MjcfNumbers(element, "qpos");
      const std::string name = Attribute(element, "name");
      const size_t joints = result_.joints.size();
      if (position.empty()) return;
      const size_t base = position.size() - std::min(position.size(), joints);
      if (position.size() != joints + base ||
          (base != 0 && base != kFreeCoordinates && base != base_coordinates_)) {
        Note(element, "keyframe '{}' has {} numbers for {} joints: it is left out", name,
             position.size(), joints);
        return;
      }
      MjcfKey& key = result_.keys.emplace_back();
      key.name = name;
      for (size_t j = 0; j < joints; ++j) {
        key.joint[result_.joints[j].name] = position[j + base];
      }
    });
  }

  std::vector<std::string>* warnings_;
  CleanMjcf& result_;
  std::string compiler_;  // attributes
  MjcfDefaults defaults_;
  std::map<std::string, CleanGeom> meshes_;
  std::set<std::string> links_, joint_names_;
  size_t base_coordinates_ = 0;  // in a keyframe; 0: no joint floats the robot
  size_t elements_ = 0;
};

}  // namespace

CleanMjcf CleanedMjcf(std::string_view xml, std::vector<std::string>* warnings) {
  tinyxml2::XMLDocument document;
  ParseXml(xml, "MJCF", &document);
  const tinyxml2::XMLElement* const root = document.RootElement();
  if (root == nullptr) throw RobotError("MJCF has no element: is it an MJCF file?");
  CleanMjcf result;
  Cleaner(warnings, &result).Clean(*root);
  return result;
}

}  // namespace poise::robot
