#include "tests/robot_import/file_damage.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <sstream>

namespace poise {
namespace {

constexpr std::array kTokens = {"nan",      "inf",       "-inf",
                                "1e308",    "-1e308",    "1e999",
                                "1e-320",   "0",         "-0",
                                "-1",       "1e-12",     "1e6",
                                "",         " ",         "1,5",
                                "0x10",     "--1",       "1e",
                                "%s%n",     "true",      "fixed",
                                "mimic",    "free",      "ball",
                                "hinge",    "slide",     "revolute",
                                "floating", "prismatic", "planar",
                                "mesh",     "plane",     "nobody",
                                "\xff\xfe", "'",         "\n",
                                "world",    "main",      "99999999999999999999",
                                "1 2",      "0 0 0",     "0 0 0 0",
                                "degree",   "global",    "x",
                                "../../..", "continuous"};
constexpr std::array kNumbers = {"nan", "inf", "-inf", "1e308", "-1e308", "1e200", "1e-320",
                                 "0",   "-0",  "-1",   "1e9",   "1e-9",   "1e999", "x"};
constexpr std::array kRaw = {"<",
                             ">",
                             "/>",
                             "\"",
                             "'",
                             "&",
                             "&#0;",
                             "&#x110000;",
                             "<!--",
                             "-->",
                             "<![CDATA[",
                             "]]>",
                             "<?xml",
                             "<robot>",
                             "</robot>",
                             "<mujoco>",
                             "</body>",
                             "<body>",
                             "<link",
                             "\xef\xbb\xbf",
                             "<!DOCTYPE x>",
                             "<joint ",
                             "%s%n"};
constexpr std::array kForeign = {
    "<include file='heron.xml'/>",
    "<frame name='x'><body name='y'/></frame>",
    "<replicate count='1000000000'><body name='z'><geom size='1'/></body></replicate>",
    "<composite type='grid' count='100000 100000 1'/>",
    "<freejoint/>",
    "<joint type='ball' name='ball'/>",
    "<geom type='box'/>",
    "<geom type='hfield' hfield='nobody'/>",
    "<inertial/>",
    "<inertial><mass value='-3'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' "
    "izz='0'/></inertial>",
    "<default class='x'><default class='x'><joint range='1'/></default></default>",
    "<body childclass='nobody'/>",
    "<equality><joint joint1='nobody' joint2='left_knee_pitch' "
    "polycoef='nan'/><connect/></equality>",
    "<keyframe><key name='home' qpos='1 nan 2'/></keyframe>",
    "<compiler angle='degree' eulerseq='abc' settotalmass='3' inertiagrouprange='5 1'/>",
    "<mimic joint='nobody' multiplier='1e308'/>",
    "<mimic/>",
    "<limit/>",
    "<axis xyz='0 0 0'/>",
    "<xacro:property name='x' value='${1/0}'/>",
    "<gazebo reference='nobody'><sensor type='imu'/><provideFeedback/></gazebo>",
    "<sensor type='force_torque'><parent joint='nobody'/></sensor>",
    "<transmission><joint name='nobody'/></transmission>",
    "<actuator><motor/><motor joint='nobody'/><position tendon='t' kp='-1'/></actuator>",
    "<collision><geometry><box size='1e308 -1 nan'/></geometry></collision>",
    "<visual><origin xyz='1e308 1e308 1e308' rpy='1e308 nan "
    "0'/><geometry><sphere/></geometry></visual>"};
constexpr int kMostNesting = 400, kMostCopies = 1500;

void Collect(tinyxml2::XMLElement* element,
             std::map<std::string, std::vector<tinyxml2::XMLElement*>>* found) {
  for (tinyxml2::XMLElement* e = element->FirstChildElement(); e; e = e->NextSiblingElement()) {
    (*found)[e->Value()].push_back(e);
    Collect(e, found);
  }
}

std::vector<std::string> Words(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

void Remove(tinyxml2::XMLElement* element) { element->Parent()->DeleteChild(element); }

/// A copy with all that is in it, to be inserted into its document.
tinyxml2::XMLElement* Copy(const tinyxml2::XMLElement& element, tinyxml2::XMLDocument* document) {
  return element.DeepClone(document)->ToElement();
}

}  // namespace

size_t FileDamage::Below(size_t n) { return n < 2 ? 0 : random_() % n; }

tinyxml2::XMLElement* FileDamage::Any(tinyxml2::XMLDocument* document) {
  std::map<std::string, Elements> found;
  if (document->RootElement() != nullptr) Collect(document->RootElement(), &found);
  if (found.empty()) return nullptr;
  const Elements& of_name =
      std::next(found.begin(), static_cast<long>(Below(found.size())))->second;
  return of_name[Below(of_name.size())];
}

std::string FileDamage::AnyAttribute(const tinyxml2::XMLElement& element) {
  std::vector<std::string> names;
  for (const tinyxml2::XMLAttribute* a = element.FirstAttribute(); a; a = a->Next()) {
    names.push_back(a->Name());
  }
  return names.empty() ? "" : names[Below(names.size())];
}

std::string FileDamage::AnyToken() { return kTokens[Below(kTokens.size())]; }

std::string FileDamage::AnyNameOf(tinyxml2::XMLDocument* document) {
  for (int i = 0; i < 20; ++i) {
    const tinyxml2::XMLElement* const element = Any(document);
    const char* const name = element ? element->Attribute("name") : nullptr;
    if (name != nullptr) return name;
  }
  return "nobody";
}

void FileDamage::DropElement(tinyxml2::XMLDocument* document) {
  if (tinyxml2::XMLElement* const element = Any(document)) Remove(element);
}

void FileDamage::DuplicateElement(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLElement* const element = Any(document);
  if (element == nullptr) return;
  element->Parent()->InsertAfterChild(element, Copy(*element, document));
}

void FileDamage::RenameElement(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLElement* const element = Any(document);
  const tinyxml2::XMLElement* const other = Any(document);
  if (element == nullptr) return;
  element->SetValue(Below(3) == 0 ? "xacro:macro" : other->Value());
}

void FileDamage::MoveElement(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLElement* const element = Any(document);
  if (element == nullptr) return;
  tinyxml2::XMLElement* const copy = Copy(*element, document);
  Remove(element);
  tinyxml2::XMLElement* const to = Below(4) == 0 ? document->RootElement() : Any(document);
  (to ? to : document->RootElement())->InsertEndChild(copy);
}

void FileDamage::DropAttribute(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLElement* const element = Any(document);
  if (element == nullptr) return;
  const std::string name = AnyAttribute(*element);
  if (!name.empty()) element->DeleteAttribute(name.c_str());
}

void FileDamage::RenameAttribute(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLElement* const element = Any(document);
  const tinyxml2::XMLElement* const other = Any(document);
  if (element == nullptr) return;
  const std::string name = AnyAttribute(*element), wanted = AnyAttribute(*other);
  if (name.empty() || wanted.empty()) return;
  const std::string value = element->Attribute(name.c_str());
  element->DeleteAttribute(name.c_str());
  element->SetAttribute(wanted.c_str(), value.c_str());
}

void FileDamage::SetAttribute(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLElement* const element = Any(document);
  if (element == nullptr) return;
  const std::string name = AnyAttribute(*element);
  if (!name.empty()) element->SetAttribute(name.c_str(), AnyToken().c_str());
}

void FileDamage::SetNumber(tinyxml2::XMLDocument* document) {
  for (int i = 0; i < 20; ++i) {
    tinyxml2::XMLElement* const element = Any(document);
    if (element == nullptr) return;
    const std::string name = AnyAttribute(*element);
    if (name.empty()) continue;
    std::vector<std::string> words = Words(element->Attribute(name.c_str()));
    if (words.empty() || words[0].find_first_of("0123456789") > 1) continue;
    words[Below(words.size())] = kNumbers[Below(kNumbers.size())];
    element->SetAttribute(name.c_str(), Joined(words).c_str());
    return;
  }
}

void FileDamage::ChangeLength(tinyxml2::XMLDocument* document) {
  for (int i = 0; i < 20; ++i) {
    tinyxml2::XMLElement* const element = Any(document);
    if (element == nullptr) return;
    const std::string name = AnyAttribute(*element);
    if (name.empty()) continue;
    std::vector<std::string> words = Words(element->Attribute(name.c_str()));
    if (words.size() < 2) continue;
    const size_t length = Below(10) == 0 ? 100000 : Below(12);
    words.resize(length, "1");
    element->SetAttribute(name.c_str(), Joined(words).c_str());
    return;
  }
}

void FileDamage::SetName(tinyxml2::XMLDocument* document) {
  constexpr std::array kReferences = {"name",   "link",   "joint",  "class", "childclass", "mesh",
                                      "joint1", "joint2", "parent", "site",  "material",   "type"};
  for (int i = 0; i < 20; ++i) {
    tinyxml2::XMLElement* const element = Any(document);
    if (element == nullptr) return;
    const char* const reference = kReferences[Below(kReferences.size())];
    if (element->Attribute(reference) == nullptr) continue;
    const std::string name = Below(3) == 0 ? "nobody" : AnyNameOf(document);
    element->SetAttribute(reference,
                          Below(40) == 0 ? std::string(5000, 'n').c_str() : name.c_str());
    return;
  }
}

void FileDamage::CloseLoop(tinyxml2::XMLDocument* document) {
  Elements joints;
  tinyxml2::XMLElement* const root = document->RootElement();
  for (tinyxml2::XMLElement* j = root->FirstChildElement("joint"); j;
       j = j->NextSiblingElement("joint")) {
    if (j->FirstChildElement("parent") && j->FirstChildElement("child")) joints.push_back(j);
  }
  if (joints.empty()) return MoveElement(document);  // MJCF's tree cannot close
  tinyxml2::XMLElement* const joint = joints[Below(joints.size())];
  const auto link = [](tinyxml2::XMLElement* j, const char* end) {
    const char* const name = j->FirstChildElement(end)->Attribute("link");
    return std::string(name ? name : "");
  };
  const std::string child = link(joint, "child");
  switch (Below(3)) {
    case 0:  // its own parent
      joint->FirstChildElement("parent")->SetAttribute("link", child.c_str());
      break;
    case 1: {  // below another link
      const std::string other = link(joints[Below(joints.size())], "child");
      joint->FirstChildElement("parent")->SetAttribute("link", other.c_str());
      break;
    }
    default: {  // a second way to a link
      tinyxml2::XMLElement* const more = Copy(*joint, document);
      more->SetAttribute("name", "closing");
      more->FirstChildElement("parent")->SetAttribute(
          "link", link(joints[Below(joints.size())], "child").c_str());
      root->InsertEndChild(more);
    }
  }
}

void FileDamage::NestDeeply(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLElement* const element = Any(document);
  if (element == nullptr) return;
  const size_t depth = 1 + Below(kMostNesting);
  tinyxml2::XMLElement* nested = Copy(*element, document);
  for (size_t i = 0; i < depth; ++i) {
    tinyxml2::XMLElement* const outer = document->NewElement(element->Value());
    if (const char* const name = element->Attribute("name")) {
      outer->SetAttribute("name", (name + std::to_string(i)).c_str());
    }
    outer->InsertEndChild(nested);
    nested = outer;
  }
  element->Parent()->InsertAfterChild(element, nested);
  Remove(element);
}

void FileDamage::RepeatOften(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLElement* const element = Any(document);
  if (element == nullptr) return;
  const size_t copies = Below(6) == 0 ? kMostCopies : 1 + Below(40);
  const std::string name = element->Attribute("name") ? element->Attribute("name") : "";
  for (size_t i = 0; i < copies; ++i) {
    tinyxml2::XMLElement* const copy = element->ShallowClone(document)->ToElement();
    for (const tinyxml2::XMLElement* c = element->FirstChildElement(); c;
         c = c->NextSiblingElement()) {
      if (std::string_view(c->Value()) != "body") copy->InsertEndChild(Copy(*c, document));
    }
    tinyxml2::XMLElement* const child = copy->FirstChildElement("child");
    const std::string number = std::to_string(i);
    if (!name.empty()) copy->SetAttribute("name", (name + number).c_str());
    if (child != nullptr && child->Attribute("link") && !name.empty()) {
      // A joint brings a link of its own, so that the tree grows.
      const std::string link = name + number + "_end";
      child->SetAttribute("link", link.c_str());
      tinyxml2::XMLElement* const added = document->NewElement("link");
      added->SetAttribute("name", link.c_str());
      document->RootElement()->InsertEndChild(added);
    }
    element->Parent()->InsertEndChild(copy);
  }
}

void FileDamage::BreakMass(tinyxml2::XMLDocument* document) {
  std::map<std::string, Elements> found;
  Collect(document->RootElement(), &found);
  const Elements& inertials = found["inertial"];
  if (inertials.empty()) return;
  tinyxml2::XMLElement* const inertial = inertials[Below(inertials.size())];
  const char* const number = kNumbers[Below(kNumbers.size())];
  if (tinyxml2::XMLElement* const mass = inertial->FirstChildElement("mass")) {
    tinyxml2::XMLElement* const inertia = inertial->FirstChildElement("inertia");
    if (Below(2) == 0 || inertia == nullptr) {
      mass->SetAttribute("value", number);
    } else {
      for (const char* entry : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
        if (Below(2) == 0) inertia->SetAttribute(entry, number);
      }
    }
  } else if (Below(2) == 0) {
    inertial->SetAttribute("mass", number);
  } else {
    const std::string value = Joined(std::vector<std::string>(Below(2) == 0 ? 6 : 3, number));
    inertial->SetAttribute(Below(2) == 0 ? "fullinertia" : "diaginertia", value.c_str());
  }
}

void FileDamage::PutMesh(tinyxml2::XMLDocument* document) {
  std::map<std::string, Elements> found;
  Collect(document->RootElement(), &found);
  constexpr std::array kFiles = {"package://nobody/meshes/x.stl",
                                 "x.dae",
                                 "/dev/null",
                                 "../../x.obj",
                                 "damaged.stl",
                                 "file:///",
                                 "model://",
                                 "",
                                 "."};
  const char* const file = kFiles[Below(kFiles.size())];
  if (const Elements& geometries = found["geometry"]; !geometries.empty()) {
    tinyxml2::XMLElement* const geometry = geometries[Below(geometries.size())];
    geometry->DeleteChildren();
    tinyxml2::XMLElement* const mesh = document->NewElement("mesh");
    mesh->SetAttribute("filename", file);
    if (Below(3) == 0) mesh->SetAttribute("scale", kNumbers[Below(kNumbers.size())]);
    geometry->InsertEndChild(mesh);
  } else if (const Elements& geoms = found["geom"]; !geoms.empty()) {
    tinyxml2::XMLElement* const geom = geoms[Below(geoms.size())];
    geom->SetAttribute("type", "mesh");
    geom->SetAttribute("mesh", "nobody");
    if (Below(2) == 0) return;
    tinyxml2::XMLElement* const asset = document->NewElement("asset");
    tinyxml2::XMLElement* const mesh = document->NewElement("mesh");
    mesh->SetAttribute("name", "nobody");
    mesh->SetAttribute("file", file);
    asset->InsertEndChild(mesh);
    document->RootElement()->InsertEndChild(asset);
  }
}

void FileDamage::AddForeign(tinyxml2::XMLDocument* document) {
  tinyxml2::XMLDocument foreign;
  foreign.Parse(kForeign[Below(kForeign.size())]);
  tinyxml2::XMLElement* const to = Below(3) == 0 ? document->RootElement() : Any(document);
  if (to != nullptr && foreign.RootElement() != nullptr)
    to->InsertEndChild(Copy(*foreign.RootElement(), document));
}

std::string FileDamage::EntityBomb(std::string text) {
  std::string bomb = "<!DOCTYPE bomb [<!ENTITY a0 \"ha\">";
  for (int i = 1; i < 12; ++i) {
    bomb += "<!ENTITY a" + std::to_string(i) + " \"";
    for (int k = 0; k < 10; ++k) bomb += "&a" + std::to_string(i - 1) + ";";
    bomb += "\">";
  }
  bomb += "<!ENTITY file SYSTEM \"file:///etc/passwd\">]>\n";
  const size_t root = text.find(text.find("<mujoco") < text.size() ? "<mujoco" : "<robot");
  text.insert(root == std::string::npos ? 0 : root, bomb);
  const size_t value = text.find("=\"", Below(text.size()));
  if (value != std::string::npos) text.insert(value + 2, Below(2) == 0 ? "&a11;" : "&file;");
  return text;
}

std::string FileDamage::Bytes(std::string text) {
  for (size_t edits = 1 + Below(3); edits > 0 && !text.empty(); --edits) {
    const size_t at = Below(text.size());
    const size_t length = std::min(text.size() - at, Below(1 + (Below(4) == 0 ? 400 : 8)));
    switch (Below(6)) {
      case 0:
        text[at] = static_cast<char>(Below(256));
        break;
      case 1:
        text[at] = static_cast<char>(text[at] ^ (1 << Below(8)));
        break;
      case 2:
        text.erase(at, length);
        break;
      case 3:
        text.insert(at, text.substr(Below(text.size()), length));
        break;
      case 4:
        text.insert(at, kRaw[Below(kRaw.size())]);
        break;
      default:
        if (Below(4) == 0) text.resize(at);
    }
  }
  return text;
}

std::string FileDamage::Xml(const tinyxml2::XMLDocument& whole, std::string* done) {
  struct Kind {
    const char* name;
    void (FileDamage::*damage)(tinyxml2::XMLDocument*);
  };
  constexpr std::array kKinds = {Kind{"drop element", &FileDamage::DropElement},
                                 Kind{"duplicate element", &FileDamage::DuplicateElement},
                                 Kind{"rename element", &FileDamage::RenameElement},
                                 Kind{"move element", &FileDamage::MoveElement},
                                 Kind{"drop attribute", &FileDamage::DropAttribute},
                                 Kind{"rename attribute", &FileDamage::RenameAttribute},
                                 Kind{"token", &FileDamage::SetAttribute},
                                 Kind{"number", &FileDamage::SetNumber},
                                 Kind{"length", &FileDamage::ChangeLength},
                                 Kind{"name", &FileDamage::SetName},
                                 Kind{"loop", &FileDamage::CloseLoop},
                                 Kind{"nesting", &FileDamage::NestDeeply},
                                 Kind{"copies", &FileDamage::RepeatOften},
                                 Kind{"mass", &FileDamage::BreakMass},
                                 Kind{"mesh", &FileDamage::PutMesh},
                                 Kind{"foreign", &FileDamage::AddForeign}};
  done->clear();
  const auto did = [&](const char* name) {
    *done += (done->empty() ? "" : ", ") + std::string(name);
  };
  tinyxml2::XMLDocument document;
  whole.DeepCopy(&document);
  for (size_t edits = 1 + Below(3); edits > 0 && document.RootElement(); --edits) {
    const Kind& kind = kKinds[Below(kKinds.size())];
    (this->*kind.damage)(&document);
    did(kind.name);
  }
  tinyxml2::XMLPrinter printer;
  document.Accept(&printer);
  std::string text = printer.CStr();
  if (Below(10) == 0) {
    text = Bytes(std::move(text));
    did("bytes");
  }
  if (Below(40) == 0) {
    text.resize(Below(text.size()));
    did("truncated");
  }
  if (Below(60) == 0) {
    text = EntityBomb(std::move(text));
    did("entities");
  }
  return text;
}

std::string FileDamage::Text(const std::string& whole, std::string* done) {
  std::vector<std::string> lines;
  std::istringstream in(whole);
  for (std::string line; std::getline(in, line);) lines.push_back(line + "\n");
  *done = "lines";
  for (size_t edits = 1 + Below(3); edits > 0; --edits) {
    const size_t at = Below(lines.size());
    switch (Below(6)) {
      case 0:
        lines[at].clear();
        break;
      case 1:
        lines[at] += lines[at];
        break;
      case 2:
        lines[at] = lines[Below(lines.size())];
        break;
      case 3:
        lines[at] = Bytes(lines[at]);
        break;
      case 4:
        for (int i = 0; i < (Below(3) == 0 ? 3000 : 20); ++i) lines[at] += "foot { ";
        break;
      default: {  // the value
        const size_t colon = lines[at].find(": ");
        if (colon == std::string::npos) continue;
        lines[at] = lines[at].substr(0, colon + 2) +
                    (Below(2) == 0 ? "\"" + AnyToken() + "\"" : kNumbers[Below(kNumbers.size())]) +
                    "\n";
      }
    }
  }
  std::string text;
  for (const std::string& line : lines) text += line;
  return text;
}

}  // namespace poise
