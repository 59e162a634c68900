// Damaged URDF and MJCF files: each is imported or refused with a reason; none ends the process.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <random>

#include "components/robot_files/robot_files.h"
#include "tests/robot/robot_test_support.h"
#include "tests/robot_import/import_support.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

constexpr int kFiles = 500;  // of each run; POISE_DAMAGED_FILES asks for more

constexpr std::array kTokens = {"nan",
                                "-inf",
                                "1e308",
                                "1e999",
                                "0",
                                "-1",
                                "1e-320",
                                "",
                                " ",
                                "\"",
                                "<",
                                ">",
                                "/>",
                                "</body>",
                                "<body>",
                                "<joint ",
                                "<joint type=\"ball\"/>",
                                "<geom type=\"box\"/>",
                                "<inertial/>",
                                "<freejoint/>",
                                "<default class=\"x\">",
                                "</default>",
                                "&#0;",
                                "&",
                                "<!--",
                                "<![CDATA[",
                                "%s%n",
                                "\xff\xfe",
                                "fixed",
                                "prismatic",
                                "mesh",
                                "true",
                                "99999999999999999999",
                                "1,5",
                                "class=\"main\"",
                                "childclass=\"x\"",
                                "<equality><joint joint1=\"x\"/></equality>",
                                "<keyframe><key qpos=\"1\"/></keyframe>",
                                "<mimic joint=\"x\"/>",
                                "fromto=\"0 0 0 0 0 0\"",
                                "euler=\"1 2\"",
                                "quat=\"0 0 0 0\""};

// The same biped as MJCF, with what such files have besides.
std::string BipedMjcf() {
  std::string text =
      "<mujoco model='biped'><compiler angle='radian'/><default><joint armature='0.02' "
      "damping='0.1'/>"
      "<default class='leg'><joint range='-2 2' actuatorfrcrange='-100 100'/><geom contype='1'/>"
      "</default></default><worldbody><body name='base' pos='0 0 1'><freejoint/>"
      "<inertial pos='0 0 0.1' mass='20' diaginertia='0.3 0.25 0.2'/><site name='imu' pos='0 0 "
      "0.1'/>";
  for (const auto& [s, y] : {std::pair{"left", 0.1}, std::pair{"right", -0.1}}) {
    const std::string side = s;
    // Masses lie above the sole, 0.08 m below the ankle: the foot alone reaches lowest.
    const auto body = [&](const std::string& name, const std::string& at, const std::string& axis) {
      return "<body name='" + side + name + "' pos='" + at +
             "' childclass='leg'><inertial pos='0 0 -0.05' "
             "mass='2' diaginertia='0.02 0.02 0.01'/><joint name='" +
             side + name + "_joint' axis='" + axis + "'/>";
    };
    text +=
        body("_hip_yaw", "0 " + std::to_string(y) + " -0.1", "0 0 1") +
        body("_hip_roll", "0 0 0", "1 0 0") + body("_thigh", "0 0 0", "0 1 0") +
        body("_shin", "0 0 -0.4", "0 1 0") + body("_ankle", "0 0 -0.4", "0 1 0") +
        body("_foot", "0 0 0", "1 0 0") +
        "<geom type='box' size='0.12 0.05 0.01' pos='0.06 0 -0.07'/></body></body></body></body>"
        "</body></body>";
  }
  text += "</body></worldbody><actuator>";
  for (const char* side : {"left", "right"}) {
    for (const char* joint : {"hip_yaw", "hip_roll", "thigh", "shin", "ankle", "foot"}) {
      text += std::string("<motor joint='") + side + "_" + joint + "_joint' ctrlrange='-80 80'/>";
    }
  }
  return text + "</actuator><sensor><gyro site='imu'/></sensor></mujoco>";
}

std::string Damaged(std::string text, std::mt19937* random) {
  const auto below = [&](size_t n) {
    return std::uniform_int_distribution<size_t>(0, n - 1)(*random);
  };
  for (size_t edits = 1 + below(3); edits > 0 && !text.empty(); --edits) {
    const size_t at = below(text.size());
    const size_t length = std::min(text.size() - at, below(1 + (below(4) == 0 ? 400 : 8)));
    switch (below(6)) {
      case 0:
        text[at] = static_cast<char>(below(256));
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(at, text.substr(below(text.size()), length));
        break;
      case 3:
        text.insert(at, kTokens[below(kTokens.size())]);
        break;
      case 4: {  // the value of an attribute
        const size_t begin = text.find("='", at);
        const size_t end = begin == std::string::npos ? begin : text.find('\'', begin + 2);
        if (end != std::string::npos) {
          text.replace(begin + 2, end - begin - 2, kTokens[below(kTokens.size())]);
        }
        break;
      }
      default:
        if (below(20) == 0) text.resize(at);
    }
  }
  return text;
}

TEST(DamagedFiles, AreImportedOrRefusedWithAReason) {
  const char* const told = std::getenv("POISE_DAMAGED_FILES");
  const int files = told != nullptr ? std::atoi(told) : kFiles;
  int imported = 0, refused = 0;
  std::mt19937 random(TestSeed(21));
  const std::array whole = {SimpleBiped(), BipedMjcf()};
  ImportText("whole", whole[0]);
  ImportText("whole", whole[1]);
  ImportOptions options;
  options.file = WriteMaker("damaged", whole[0]);
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  for (int i = 0; i < files; ++i) {
    const std::string text = Damaged(whole[static_cast<size_t>(i % 2)], &random);
    std::ofstream(options.file, std::ios::binary) << text;
    try {
      const RobotImport result = ImportRobot(options);
      ++imported;
      // What is accepted can be computed with.
      const robot::RobotModel model = robot::LoadRobotTexts(RobotText(result), text);
      const robot::RobotData data = robot::Evaluate(model, robot::RandomState(model, &random));
      EXPECT_TRUE(data.mass_matrix.allFinite()) << text;
    } catch (const std::runtime_error& error) {
      ++refused;
      EXPECT_GT(std::string(error.what()).size(), 10u);
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_GT(imported, files / 20);
  EXPECT_GT(refused, files / 20);
}

}  // namespace
}  // namespace poise
