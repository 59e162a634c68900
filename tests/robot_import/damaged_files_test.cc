// Thousands of damaged URDF, MJCF, SRDF and robot files: each is imported or refused with a reason
// that names the place; none ends the process, prints, or takes for ever. Built with the preset
// sanitize, the same files must not leak or read what is not theirs.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <regex>

#include "components/robot_files/robot_files.h"
#include "tests/robot/robot_test_support.h"
#include "tests/robot_import/file_damage.h"
#include "tests/robot_import/import_support.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr int kFiles = 300;                // URDF and MJCF; POISE_DAMAGED_FILES asks for more
constexpr double kMostProcessorTime = 20;  // s a file, under sanitizers: beyond it, it hangs

int Files() {
  const char* const told = std::getenv("POISE_DAMAGED_FILES");
  return told != nullptr ? std::max(1, std::atoi(told)) : kFiles;
}

double ProcessorTime() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

fs::path Heron(const char* ending) {
  return fs::path(POISE_SOURCE_DIR) / "deploy/robots/heron" / (std::string("heron") + ending);
}

/// Whether a reason says where: a line, a name in quotes, "12:3:", or a field, "motor[2].joint".
bool NamesThePlace(const std::string& reason) {
  static const std::regex kPlace("line \\d|'|^(text:)?\\d+:\\d+:|^[a-z_]+(\\[\\d+\\])?(\\.[a-z_]+)?:? ");
  return std::regex_search(reason, kPlace);
}

class Trial {
 public:
  explicit Trial(std::string what) : what_(std::move(what)) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
  }
  ~Trial() {
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    fmt::print(
        "{}: {} files, {} taken ({} of them with defects told), {} refused, {} of the reasons name "
        "line or element; slowest {:.2f} s of processor time ({})\n",
        what_, taken_ + refused_, taken_, told_, refused_, named_, slowest_, slowest_damage_);
    for (const auto& [reason, count] : unnamed_) fmt::print("  {} x {}\n", count, reason);
    if (taken_ + refused_ < 40) return;  // of a few files nothing follows
    EXPECT_GT(taken_, (taken_ + refused_) / 50);
    EXPECT_GT(refused_, (taken_ + refused_) / 50);
    EXPECT_GE(named_, refused_ * 9 / 10);
  }

  /// `read` takes a damaged file or throws.
  template <typename Read>
  void Run(const std::string& damage, const Read& read) {
    const double begin = ProcessorTime();
    try {
      told_ += read() > 0;
      ++taken_;
    } catch (const std::runtime_error& error) {
      ++refused_;
      const std::string reason = error.what();
      EXPECT_GT(reason.size(), 10u) << damage;
      EXPECT_LT(reason.size(), 2000u) << damage;
      EXPECT_TRUE(std::ranges::none_of(reason, [](unsigned char c) { return c < ' '; }))
          << damage << ": " << reason;
      if (NamesThePlace(reason)) {
        ++named_;
      } else {
        ++unnamed_[reason.substr(0, 160)];
      }
    }
    const double took = ProcessorTime() - begin;
    EXPECT_LT(took, kMostProcessorTime) << damage;
    if (took > slowest_) slowest_ = took, slowest_damage_ = damage;
  }

 private:
  std::string what_, slowest_damage_;
  int taken_ = 0, refused_ = 0, named_ = 0, told_ = 0;
  double slowest_ = 0;
  std::map<std::string, int> unnamed_;
};

/// A tetrahedron as STL, for meshes that are there.
std::string Stl() {
  std::string text = "solid x\n";
  for (const char* v : {"0 0 0 vertex 1 0 0 vertex 0 1 0", "0 0 0 vertex 0 1 0 vertex 0 0 1",
                        "0 0 0 vertex 0 0 1 vertex 1 0 0", "1 0 0 vertex 0 1 0 vertex 0 0 1"}) {
    text += std::string("facet normal 0 0 1 outer loop vertex ") + v + " endloop endfacet\n";
  }
  return text + "endsolid x\n";
}

/// Imports `options.file`, and computes with what is taken.
size_t ImportAndEvaluate(const ImportOptions& options, std::mt19937* random) {
  const RobotImport result = ImportRobot(options);
  const robot::RobotModel model =
      robot::LoadRobotTexts(RobotText(result), robot::ReadWhole(options.file));
  const robot::RobotData data = robot::Evaluate(model, robot::RandomState(model, random));
  EXPECT_TRUE(data.mass_matrix.allFinite());
  EXPECT_TRUE(data.gravity.allFinite());
  for (const Defect& defect : result.defects) EXPECT_FALSE(defect.what.empty());
  return result.defects.size();
}

void ImportDamaged(const fs::path& whole, int files, unsigned seed) {
  const std::string text = robot::ReadWhole(whole);
  tinyxml2::XMLDocument document;
  document.Parse(text.data(), text.size());
  ASSERT_FALSE(document.Error());
  ImportOptions options;
  options.file = WriteMaker("damaged_" + whole.stem().string(), text);
  ImportRobot(options);  // whole it is taken
  FileDamage damage(TestSeed(seed));
  std::mt19937 random(TestSeed(seed));
  Trial trial(whole.filename().string());
  for (int i = 0; i < files; ++i) {
    std::string done;
    const std::string damaged = damage.Xml(document, &done);
    std::ofstream(options.file, std::ios::binary) << damaged;
    if (damaged.find("damaged.stl") != std::string::npos) {
      std::ofstream(options.file.parent_path() / "damaged.stl", std::ios::binary)
          << (damage.Below(3) == 0 ? Stl() : damage.Bytes(Stl()));
    }
    trial.Run(done, [&] { return ImportAndEvaluate(options, &random); });
  }
}

TEST(DamagedFiles, Urdf) { ImportDamaged(Heron(".urdf"), Files() / 2, 21); }
TEST(DamagedFiles, Mjcf) { ImportDamaged(Heron(".xml"), Files() / 2, 22); }

TEST(DamagedFiles, OfMakers) {
  if (MakersFolder().empty()) GTEST_SKIP() << "the makers' files are not in $POISE_ROBOTS";
  for (const char* name : {"g1_29dof_rev_1_0.urdf", "g1_29dof_rev_1_0.xml", "icub_reduced.urdf",
                           "talos_reduced_box.urdf", "dyros_tocabi.urdf"}) {
    if (exists(MakersFolder() / name)) ImportDamaged(MakersFolder() / name, Files() / 30, 23);
  }
}

TEST(DamagedFiles, Srdf) {
  ImportOptions options;
  options.file = WriteMaker("srdf_damaged", SimpleBiped());
  options.srdf = options.file.parent_path() / "states.srdf";
  tinyxml2::XMLDocument document;
  document.Parse(
      "<robot name='biped'><group name='all'/><group_state name='half_sitting' group='all'>"
      "<joint name='left_hip_pitch_joint' value='-0.5'/><joint name='left_knee_joint' value='1'/>"
      "<joint name='right_hip_pitch_joint' value='-0.5'/><joint name='right_knee_joint' value='1'/>"
      "<joint name='root' value='0 0 1 0 0 0 1'/></group_state>"
      "<group_state name='other' group='all'><joint name='left_knee_joint' value='2'/>"
      "</group_state></robot>");
  ASSERT_FALSE(document.Error());
  FileDamage damage(TestSeed(24));
  std::mt19937 random(TestSeed(24));
  Trial trial("SRDF");
  for (int i = 0; i < Files() / 5; ++i) {
    std::string done;
    std::ofstream(options.srdf, std::ios::binary) << damage.Xml(document, &done);
    trial.Run(done, [&] { return ImportAndEvaluate(options, &random); });
  }
}

TEST(DamagedFiles, RobotText) {
  const std::string text = robot::ReadWhole(Heron(".pbtxt"));
  const std::string maker = robot::ReadWhole(Heron(".urdf"));
  FileDamage damage(TestSeed(25));
  std::mt19937 random(TestSeed(25));
  Trial trial("robot text");
  for (int i = 0; i < Files() / 5; ++i) {
    std::string done;
    const std::string damaged = damage.Text(text, &done);
    trial.Run(done, [&] {
      const robot::RobotModel model = robot::LoadRobotTexts(damaged, maker);
      EXPECT_TRUE(
          robot::Evaluate(model, robot::RandomState(model, &random)).mass_matrix.allFinite());
      return 0;
    });
  }
}

}  // namespace
}  // namespace poise
