// Mutated URDF texts: each loads or is refused with one line; nothing crashes, nothing is printed.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "tests/robot/robot_test_support.h"
#include "tests/test_seed.h"

namespace poise::robot {
namespace {

constexpr int kMutations = 6000;

constexpr std::array kTokens = {"nan",        "-inf",       "1e308",
                                "-1e308",     "1e999",      "0",
                                "-0",         "1e-320",     "",
                                " ",          "\"",         "<",
                                ">",          "/>",         "</link>",
                                "<link",      "<joint ",    "<inertial/>",
                                "<mass/>",    "<limit/>",   "<axis/>",
                                "&#0;",       "&#x110000;", "&quot;",
                                "&",          "<!--",       "-->",
                                "<![CDATA[",  "]]>",        "<?xml",
                                "%s%n%s",     "\xff\xfe",   "\xef\xbb\xbf",
                                "fixed",      "floating",   "prismatic",
                                "planar",     "continuous", "revolute",
                                "right_foot", "upper_body", "<mimic joint=\"x\"/>",
                                "<robot>",    "</robot>",   "99999999999999999999",
                                "0x10",       "1,5",        "--1"};

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(TestSeed(seed)) {}

  size_t Below(size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random_); }

  std::string Mutated(std::string text) {
    for (size_t edits = 1 + Below(3); edits > 0 && !text.empty(); --edits) {
      const size_t at = Below(text.size());
      const size_t length = std::min(text.size() - at, Below(1 + (Below(4) == 0 ? 400 : 8)));
      switch (Below(6)) {
        case 0:
          text[at] = static_cast<char>(Below(256));
          break;
        case 1:
          text.erase(at, length);
          break;
        case 2:
          text.insert(at, text.substr(Below(text.size()), length));
          break;
        case 3:
          text.insert(at, kTokens[Below(kTokens.size())]);
          break;
        case 4:
          ReplaceQuoted(&text, at);
          break;
        default:
          if (Below(20) == 0) text.resize(at);
      }
    }
    return text;
  }

 private:
  // The attribute value at or after `at` becomes a token or another value of the text.
  void ReplaceQuoted(std::string* text, size_t at) {
    const size_t begin = text->find("=\"", at);
    if (begin == std::string::npos) return;
    const size_t end = text->find('"', begin + 2);
    if (end == std::string::npos) return;
    std::string value = kTokens[Below(kTokens.size())];
    const size_t other = text->find("=\"", Below(text->size()));
    if (Below(2) == 0 && other != std::string::npos) {
      value = text->substr(other + 2, text->find('"', other + 2) - other - 2);
    }
    text->replace(begin + 2, end - begin - 2, value);
  }

  std::mt19937 random_;
};

TEST(HostileUrdf, LoadsOrIsRefused) {
  int loaded = 0, refused = 0;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  for (const TestRobot which : {TestRobot::kDyros, TestRobot::kMantis}) {
    const std::string robot = ReadWhole(RobotPath(which));
    const std::string urdf = ReadWhole(UrdfPath(which));
    Mutator mutator(which == TestRobot::kDyros ? 1 : 2);
    for (int i = 0; i < kMutations / 2; ++i) {
      const std::string text = mutator.Mutated(urdf);
      try {
        const RobotModel model = LoadRobotTexts(robot, text);
        ++loaded;
        // What is accepted can be computed with.
        std::mt19937 random(TestSeed(7));
        const RobotData data = Evaluate(model, RandomState(model, &random));
        EXPECT_TRUE(std::isfinite(data.mass_matrix.trace())) << text;
        EXPECT_GT(model.total_mass(), 0) << text;
      } catch (const RobotError& error) {
        ++refused;
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
        EXPECT_FALSE(std::string(error.what()).empty());
      }
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  // The mutations must reach both sides of the gate.
  EXPECT_GT(loaded, kMutations / 20);
  EXPECT_GT(refused, kMutations / 20);
}

TEST(HostileUrdf, MutatedRobotFiles) {
  const std::string robot = ReadWhole(RobotPath(TestRobot::kDyros));
  const std::string urdf = ReadWhole(UrdfPath(TestRobot::kDyros));
  Mutator mutator(3);
  int loaded = 0;
  for (int i = 0; i < 1000; ++i) {
    try {
      LoadRobotTexts(mutator.Mutated(robot), urdf);
      ++loaded;
    } catch (const RobotError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(loaded, 50);
  EXPECT_LT(loaded, 950);
}

TEST(HostileUrdf, LongChainsAndManyLinks) {
  std::string chain = "<robot name=\"chain\"><link name=\"l0\"/>";
  for (int i = 1; i < 50000; ++i) {
    const std::string n = std::to_string(i);
    chain += "<link name=\"l" + n + "\"/><joint name=\"j" + n +
             "\" type=\"fixed\"><parent link=\"l" + std::to_string(i - 1) + "\"/><child link=\"l" +
             n + "\"/></joint>";
  }
  EXPECT_THROW(LoadRobotTexts("", chain + "</robot>"), RobotError);
}

}  // namespace
}  // namespace poise::robot
