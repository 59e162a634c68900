#include "components/robot_files/mjcf_defaults.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include "components/robot/xml_text.h"
#include "components/robot_files/mjcf_attributes.h"

namespace poise::robot {

void MjcfDefaults::Read(const tinyxml2::XMLElement& element, const std::string& parent,
                        std::string* xml) {
  std::string name = Attribute(element, "class");
  const bool is_main = parent.empty();
  if (name.empty() && is_main) name = "main";
  if (name.empty()) FailMjcf(element, "<default> within another has no class: add class=\"...\"");
  if (is_main && main_.empty()) main_ = name;
  if (is_main && name != main_) FailMjcf(element, "<default> '{}' stands beside '{}'", name, main_);
  const bool is_new = class_index_.emplace(name, class_index_.size()).second;
  if (!is_new && !is_main) FailMjcf(element, "class '{}' of <default> stands twice", name);
  Class& own = classes_[name];
  own.parent = parent;
  // The outermost class is MuJoCo's "main".
  *xml +=
      is_main ? std::string("<default>") : fmt::format("<default class='c{}'>", class_index_[name]);
  for (const tinyxml2::XMLElement* e = element.FirstChildElement(); e;
       e = e->NextSiblingElement()) {
    const std::string kind = e->Value();
    if (kind == "default") {
      Read(*e, name, xml);
    } else if (kind == "joint" || kind == "geom") {
      auto& known = kind == "joint" ? own.joint : own.geom;
      for (const tinyxml2::XMLAttribute* a = e->FirstAttribute(); a; a = a->Next()) {
        known[a->Name()] = OneLine(a->Value());
      }
      if (e->Attribute("actuatorfrcrange"))
        force_range_[name] = MjcfNumbers<2>(*e, "actuatorfrcrange");
      *xml += fmt::format("<{}{}/>", kind, KeptAttributes(*e, kind));
    } else if (kind == "mesh" && e->Attribute("scale")) {
      mesh_scale_[name] = MjcfNumbers<3>(*e, "scale");
    } else if (kind == "site" || IsActuator(kind)) {
      *xml += kind == "site" ? fmt::format("<site{}/>", KeptAttributes(*e, "site"))
                             : fmt::format("<motor{}/>", KeptAttributes(*e, "actuator"));
    }
  }
  *xml += "</default>";
}

std::string MjcfDefaults::ClassAttribute(const tinyxml2::XMLElement& element,
                                         const char* name) const {
  const std::string value = Attribute(element, name);
  if (value.empty()) return "";
  const auto known = class_index_.find(value);
  if (known == class_index_.end()) {
    FailMjcf(element, "{} '{}' of <{}> is no class of <default>", name, value, Shown(element));
  }
  return value == main_ ? fmt::format(" {}='main'", name)
                        : fmt::format(" {}='c{}'", name, known->second);
}

std::string MjcfDefaults::ClassOf(const tinyxml2::XMLElement& element,
                                  const std::string& child_class) const {
  const std::string own = Attribute(element, "class");
  if (!own.empty()) return own;
  return child_class.empty() ? main_ : child_class;
}

// What a class or the nearest above it has; null where none has.
template <typename T>
const T* MjcfDefaults::Inherited(const std::map<std::string, T>& known,
                                 const std::string& name) const {
  for (auto c = classes_.find(name); c != classes_.end(); c = classes_.find(c->second.parent)) {
    if (const auto found = known.find(c->first); found != known.end()) return &found->second;
  }
  return nullptr;
}

std::string MjcfDefaults::Resolved(const tinyxml2::XMLElement& element, const char* name,
                                   const std::string& child_class, Kind kind) const {
  if (element.Attribute(name)) return Attribute(element, name);
  for (auto c = classes_.find(ClassOf(element, child_class)); c != classes_.end();
       c = classes_.find(c->second.parent)) {
    const auto& known = kind == Kind::kJoint ? c->second.joint : c->second.geom;
    if (const auto found = known.find(name); found != known.end()) return found->second;
  }
  return "";
}

const std::array<double, 2>* MjcfDefaults::ForceRange(const tinyxml2::XMLElement& joint,
                                                      const std::string& child_class) const {
  return Inherited(force_range_, ClassOf(joint, child_class));
}

const std::array<double, 3>* MjcfDefaults::MeshScale(const tinyxml2::XMLElement& mesh) const {
  return Inherited(mesh_scale_, ClassOf(mesh, ""));
}

}  // namespace poise::robot
