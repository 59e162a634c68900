// The classes of MJCF's <default>: what an element that says nothing itself takes.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>

namespace tinyxml2 {
class XMLElement;
}

namespace poise::robot {

class MjcfDefaults {
 public:
  enum class Kind { kJoint, kGeom };

  /// Reads a <default> within the class `parent` (empty: the outermost) and appends to `xml` what
  /// MuJoCo is to see of it. Throws RobotError.
  void Read(const tinyxml2::XMLElement& element, const std::string& parent, std::string* xml);

  /// The attribute `name` ("class", "childclass") as MuJoCo is to see it. Throws RobotError for a
  /// class that there is not.
  std::string ClassAttribute(const tinyxml2::XMLElement& element, const char* name) const;
  /// An attribute of a joint or geom or, where it has none, of its class; empty: none has.
  std::string Resolved(const tinyxml2::XMLElement& element, const char* name,
                       const std::string& child_class, Kind kind) const;
  /// N·m, actuatorfrcrange of a joint's class; null: none.
  const std::array<double, 2>* ForceRange(const tinyxml2::XMLElement& joint,
                                          const std::string& child_class) const;
  /// The scale that a mesh's class gives; null: it gives none.
  const std::array<double, 3>* MeshScale(const tinyxml2::XMLElement& mesh) const;

 private:
  struct Class {
    std::string parent;
    std::map<std::string, std::string> joint, geom;
  };

  std::string ClassOf(const tinyxml2::XMLElement& element, const std::string& child_class) const;
  template <typename T>
  const T* Inherited(const std::map<std::string, T>& known, const std::string& name) const;

  std::string main_;
  std::map<std::string, Class> classes_;
  std::map<std::string, size_t> class_index_;
  std::map<std::string, std::array<double, 2>> force_range_;  // by class
  std::map<std::string, std::array<double, 3>> mesh_scale_;   // by class
};

}  // namespace poise::robot
