#include "components/robot/urdf_document.h"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <tinyxml2.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <map>
#include <mutex>

#include "components/robot/robot_model.h"
#include "components/robot/xml_text.h"

namespace poise::robot {
namespace {

constexpr int kMaxLinks = 1000;  // urdfdom recurses over chains of links

std::string RequiredAttribute(const tinyxml2::XMLElement& element, const char* name,
                              const std::string& what) {
  const std::string value = Attribute(element, name);
  if (value.empty()) {
    throw RobotError(fmt::format("URDF line {}: {} has no {}: add {}=\"...\"", element.GetLineNum(),
                                 what, name, name));
  }
  if (value != element.Attribute(name)) {
    throw RobotError(
        fmt::format("URDF line {}: {} '{}' of {} is too long or has control characters: rename it",
                    element.GetLineNum(), name, value, what));
  }
  return value;
}

void RemoveChildren(tinyxml2::XMLElement* element, const char* name) {
  while (tinyxml2::XMLElement* child = element->FirstChildElement(name))
    element->DeleteChild(child);
}

void CheckLinks(tinyxml2::XMLElement* robot, std::map<std::string, int>* link_line) {
  for (tinyxml2::XMLElement* link = robot->FirstChildElement("link"); link;
       link = link->NextSiblingElement("link")) {
    const std::string name = RequiredAttribute(*link, "name", "a link");
    if (!link_line->emplace(name, link->GetLineNum()).second) {
      throw RobotError(
          fmt::format("URDF line {}: link '{}' stands already at line {}: rename or remove one",
                      link->GetLineNum(), name, link_line->at(name)));
    }
    RemoveChildren(link, "visual");
    RemoveChildren(link, "collision");
  }
  if (link_line->empty()) throw RobotError("URDF has no <link>: a robot needs at least its base");
  if (link_line->size() > kMaxLinks) {
    throw RobotError(
        fmt::format("URDF has {} links, more than {}: simplify it", link_line->size(), kMaxLinks));
  }
}

double Number(const tinyxml2::XMLElement& element, const char* name, double missing) {
  const char* const text = element.Attribute(name);
  if (text == nullptr) return missing;
  double value = 0;
  if (element.QueryDoubleAttribute(name, &value) != tinyxml2::XML_SUCCESS ||
      !std::isfinite(value)) {
    throw RobotError(fmt::format("URDF line {}: {} '{}' is no finite number: correct it",
                                 element.GetLineNum(), name, OneLine(text)));
  }
  return value;
}

Mimic ReadMimic(const tinyxml2::XMLElement& mimic, const std::string& joint) {
  return {RequiredAttribute(mimic, "joint", fmt::format("<mimic> of joint '{}'", joint)),
          Number(mimic, "multiplier", 1), Number(mimic, "offset", 0)};
}

std::vector<std::string> CheckJoints(tinyxml2::XMLElement* robot,
                                     const std::map<std::string, int>& link_line,
                                     std::map<std::string, int>* joint_lines,
                                     std::map<std::string, Mimic>* mimics) {
  std::vector<std::string> order;
  std::map<std::string, int>& joint_line = *joint_lines;
  std::map<std::string, std::string> parent_joint;
  for (tinyxml2::XMLElement* joint = robot->FirstChildElement("joint"); joint;
       joint = joint->NextSiblingElement("joint")) {
    const std::string name = RequiredAttribute(*joint, "name", "a joint");
    if (!joint_line.emplace(name, joint->GetLineNum()).second) {
      throw RobotError(
          fmt::format("URDF line {}: joint '{}' stands already at line {}: rename or remove one",
                      joint->GetLineNum(), name, joint_line.at(name)));
    }
    for (const char* end : {"parent", "child"}) {
      const tinyxml2::XMLElement* element = joint->FirstChildElement(end);
      if (!element) {
        throw RobotError(fmt::format("URDF line {}: joint '{}' has no {}: add <{} link=\"...\"/>",
                                     joint->GetLineNum(), name, end, end));
      }
      const std::string link =
          RequiredAttribute(*element, "link", fmt::format("{} of joint '{}'", end, name));
      if (!link_line.contains(link)) {
        throw RobotError(
            fmt::format("URDF line {}: joint '{}' names {} link '{}', which does not exist: "
                        "correct the name or add the link",
                        element->GetLineNum(), name, end, link));
      }
      if (std::string_view(end) == "child" && !parent_joint.emplace(link, name).second) {
        throw RobotError(fmt::format(
            "URDF line {}: link '{}' has two parents, through joints '{}' and '{}': closed loops "
            "are not supported, remove one joint",
            joint->GetLineNum(), link, parent_joint.at(link), name));
      }
    }
    if (const tinyxml2::XMLElement* mimic = joint->FirstChildElement("mimic")) {
      (*mimics)[name] = ReadMimic(*mimic, name);
      RemoveChildren(joint, "mimic");
    }
    // Not ours, and urdfdom refuses a robot for what is missing in them.
    RemoveChildren(joint, "safety_controller");
    RemoveChildren(joint, "calibration");
    order.push_back(name);
  }
  return order;
}

void CheckConnected(const std::map<std::string, int>& link_line, tinyxml2::XMLElement* robot) {
  std::map<std::string, std::string> parent;
  for (tinyxml2::XMLElement* joint = robot->FirstChildElement("joint"); joint;
       joint = joint->NextSiblingElement("joint")) {
    parent[Attribute(*joint->FirstChildElement("child"), "link")] =
        Attribute(*joint->FirstChildElement("parent"), "link");
  }
  std::string root;
  for (const auto& entry : link_line) {
    std::string top = entry.first;
    for (size_t steps = 0; parent.contains(top); ++steps) {
      top = parent.at(top);
      if (steps > link_line.size()) {
        throw RobotError(fmt::format(
            "URDF line {}: link '{}' is part of a closed loop of joints: closed loops are not "
            "supported, remove one joint of the loop",
            link_line.at(top), top));
      }
    }
    if (root.empty()) root = top;
    if (top != root) {
      throw RobotError(fmt::format(
          "URDF: links '{}' and '{}' have no parent and are not connected: join them with a "
          "joint, fixed if need be",
          root, top));
    }
  }
}

// Leaves elements and attributes only. urdfdom hands texts to printf as its format: no % may reach
// it.
void Strip(tinyxml2::XMLElement* element) {
  for (const tinyxml2::XMLAttribute* a = element->FirstAttribute(); a; a = a->Next()) {
    if (std::string_view(a->Value()).find('%') != std::string::npos) {
      throw RobotError(fmt::format("URDF line {}: {} '{}' has a '%': remove it",
                                   element->GetLineNum(), a->Name(), OneLine(a->Value())));
    }
  }
  for (tinyxml2::XMLNode* node = element->FirstChild(); node;) {
    tinyxml2::XMLNode* next = node->NextSibling();
    if (tinyxml2::XMLElement* child = node->ToElement()) {
      Strip(child);
    } else {
      element->DeleteChild(node);
    }
    node = next;
  }
}

// What describes no link or joint: materials, simulators' and controllers' extensions.
void RemoveForeign(tinyxml2::XMLElement* robot) {
  for (tinyxml2::XMLElement* child = robot->FirstChildElement(); child;) {
    tinyxml2::XMLElement* next = child->NextSiblingElement();
    const std::string_view kind = child->Value();
    if (kind != "link" && kind != "joint") robot->DeleteChild(child);
    child = next;
  }
}

// urdfdom reports through a global handler: taken over while it runs, one parse at a time.
class CapturedConsole : public console_bridge::OutputHandler {
 public:
  CapturedConsole() : level_(console_bridge::getLogLevel()) {
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_WARN);
    console_bridge::useOutputHandler(this);
  }
  ~CapturedConsole() override {
    console_bridge::restorePreviousOutputHandler();
    console_bridge::setLogLevel(level_);
  }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) {
      errors.push_back(OneLine(text));
    } else {
      warnings.push_back(OneLine(text));
    }
  }
  std::vector<std::string> errors, warnings;

 private:
  console_bridge::LogLevel level_;
};

// " line 12" of the link or joint that urdfdom names in brackets; empty when it names none.
std::string LineOf(const std::string& text, const std::map<std::string, int>& link_line,
                   const std::map<std::string, int>& joint_line) {
  for (size_t open = text.find('['); open != std::string::npos; open = text.find('[', open + 1)) {
    const size_t close = text.find(']', open);
    if (close == std::string::npos) break;
    const std::string name = text.substr(open + 1, close - open - 1);
    const bool joint_first = std::string_view(text).substr(0, open).ends_with("oint ");
    for (const auto* lines :
         {joint_first ? &joint_line : &link_line, joint_first ? &link_line : &joint_line}) {
      const auto line = lines->find(name);
      if (line != lines->end()) return fmt::format(" line {}", line->second);
    }
  }
  return "";
}

urdf::ModelInterfaceSharedPtr ParseWithUrdfdom(const std::string& xml,
                                               const std::map<std::string, int>& link_line,
                                               const std::map<std::string, int>& joint_line,
                                               std::vector<std::string>* warnings) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  CapturedConsole console;
  urdf::ModelInterfaceSharedPtr model;
  std::string thrown;
  try {
    model = urdf::parseURDF(xml);
  } catch (const std::exception& error) {
    thrown = OneLine(error.what());
  }
  // urdfdom goes on with defaults after some errors: an error is a refusal here.
  if (!console.errors.empty() || !thrown.empty() || !model) {
    std::string text = thrown;
    for (const std::string& error : console.errors) {
      if (text.size() < 300) text += (text.empty() ? "" : "; ") + error;
    }
    throw RobotError(fmt::format("URDF{}: {}: correct that element",
                                 LineOf(text, link_line, joint_line),
                                 text.empty() ? "refused by urdfdom" : OneLine(text)));
  }
  if (warnings) {
    for (const std::string& warning : console.warnings) warnings->push_back("URDF: " + warning);
  }
  return model;
}

}  // namespace

UrdfDocument ParseUrdf(std::string_view xml, std::vector<std::string>* warnings) {
  tinyxml2::XMLDocument document;
  ParseXml(xml, "URDF", &document);
  tinyxml2::XMLElement* robot = document.FirstChildElement("robot");
  if (!robot) throw RobotError("URDF has no <robot> element: is it a URDF (xacro expanded)?");

  UrdfDocument result;
  std::map<std::string, int> link_line, joint_line;
  CheckLinks(robot, &link_line);
  result.joint_order = CheckJoints(robot, link_line, &joint_line, &result.mimics);
  CheckConnected(link_line, robot);
  RemoveForeign(robot);
  Strip(robot);

  tinyxml2::XMLPrinter printer;
  robot->Accept(&printer);
  result.model = ParseWithUrdfdom(printer.CStr(), link_line, joint_line, warnings);
  return result;
}

}  // namespace poise::robot
