#include "components/framework/configuration/configuration.h"

#include <gtest/gtest.h>

#include <fstream>

#include "components/framework/configuration/field_path.h"
#include "components/framework/configuration/suggest.h"
#include "tests/framework/toy.pb.h"

namespace poise {
namespace {

/// what() of the ConfigError that `f` throws.
template <class F>
std::string ErrorOf(F&& f) {
  try {
    f();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

std::string ParseError(const std::string& text) {
  return ErrorOf([&] {
    ToyConfig config;
    ParseTextProto(text, "toy.pbtxt", &config);
  });
}

std::string SetError(const std::string& path, const std::string& value) {
  ToyConfig config;
  config.add_phase();
  const std::string before = config.DebugString();
  const std::string error = ErrorOf([&] { SetField(&config, path, value); });
  return error;
}

TEST(ParseTextProto, NamesLineAndColumn) {
  EXPECT_EQ(ParseError("joints: 3\njoint: 4\n").substr(0, 17), "toy.pbtxt:2:6: Me");
  EXPECT_NE(ParseError("joints: 3\njoint: 4\n").find("has no field named \"joint\""),
            std::string::npos);
  EXPECT_EQ(ParseError("\n\nmode: SIDEWAYS").substr(0, 12), "toy.pbtxt:3:");
  EXPECT_NE(ParseError("mode: SIDEWAYS").find("SIDEWAYS"), std::string::npos);
  EXPECT_EQ(ParseError("gains {\n kp: high }").substr(0, 13), "toy.pbtxt:2:6");
  EXPECT_EQ(ParseError("joints: 1\njoints: 2").substr(0, 11), "toy.pbtxt:2");
  EXPECT_EQ(ParseError("gains { kp: 1").substr(0, 11), "toy.pbtxt:1");
  EXPECT_EQ(ParseError("joints: 3 mode: LOOP"), "no error");
}

TEST(ReadTextProto, NamesTheFileThatCannotBeRead) {
  ToyConfig config;
  EXPECT_EQ(ErrorOf([&] { ReadTextProto("/no/such.pbtxt", &config); }),
            "/no/such.pbtxt: cannot be read: No such file or directory");
  EXPECT_EQ(ErrorOf([&] { ReadTextProto("/tmp", &config); }), "/tmp: is a folder, not a file");
  const std::string path =
      testing::TempDir() + "/toy_config_" + std::to_string(getpid()) + ".pbtxt";
  std::ofstream(path) << "joints: 7\n";
  ReadTextProto(path, &config);
  EXPECT_EQ(config.joints(), 7);
  std::remove(path.c_str());
}

TEST(LocateField, FindsTheLineOrTheNearestEnclosingOne) {
  const std::string text =
      "joints: 3\n"        // 1
      "gains {\n"          // 2
      "  kp: 5\n"          // 3
      "}\n"                // 4
      "phase { kp: 1 }\n"  // 5
      "phase {\n"          // 6
      "  kd: 2\n"          // 7
      "}\n";
  const ToyConfig prototype;
  EXPECT_EQ(LocateField(text, "joints", prototype), 1);
  EXPECT_EQ(LocateField(text, "gains.kp", prototype), 3);
  EXPECT_EQ(LocateField(text, "gains.kd", prototype), 2);  // not in the text: its group
  EXPECT_EQ(LocateField(text, "phase[1].kd", prototype), 7);
  EXPECT_EQ(LocateField(text, "phase[1].kp", prototype), 6);
  EXPECT_EQ(LocateField(text, "phase[2].kp", prototype), 0);
  EXPECT_EQ(LocateField(text, "label", prototype), 0);
  EXPECT_EQ(LocateField(text, "phase[", prototype), 0);
}

TEST(SetField, SetsEveryKindOfField) {
  ToyConfig config;
  SetField(&config, "joints", "12");
  SetField(&config, "finish_at", "123456789012");
  SetField(&config, "fail", "true");
  SetField(&config, "mode", "LOOP");
  SetField(&config, "gains.kp", "-2.5e3");
  SetField(&config, "label", "two words");
  SetField(&config, "small", "7");
  SetField(&config, "phase[0].kd", "4");
  SetField(&config, "phase[1].name", "second");
  SetField(&config, "phase[0].kp", "+8");
  SetField(&config, "weight[0]", "1");
  SetField(&config, "weight[1]", "2");
  SetField(&config, "weight[0]", "3");
  ToyConfig expected;
  ParseTextProto(
      R"(joints: 12 finish_at: 123456789012 fail: true mode: LOOP gains { kp: -2500 } label: "two words" small: 7
                    phase { kp: 8 kd: 4 } phase { name: "second" } weight: 3 weight: 2)",
      "expected", &expected);
  EXPECT_EQ(config.DebugString(), expected.DebugString());
}

TEST(SetField, FindsAnElementByItsName) {
  ToyConfig config;
  ParseTextProto(
      "phase { name: \"stand\" kp: 1 } phase { name: \"lift\" kp: 2 } phase { name: \"lift\" }",
      "text", &config);
  SetField(&config, "phase[stand].kp", "8");
  EXPECT_EQ(config.phase(0).kp(), 8);
  SetField(&config, "fail", "true");
  SetField(&config, "fail", "");  // no default: unset; what has one is not emptied by accident
  EXPECT_FALSE(config.has_fail());
  EXPECT_EQ(ResolvePath(config, "phase[stand].kp"), "phase[0].kp");
  EXPECT_EQ(ResolvePath(config, "phase[1].kp"), "phase[1].kp");
  EXPECT_EQ(ResolvePath(config, "nothing.kp"), "nothing.kp");
  const auto error = [&](const std::string& path) {
    try {
      SetField(&config, path, "3");
    } catch (const ConfigError& problem) {
      return problem.problem();
    }
    return std::string("none");
  };
  EXPECT_EQ(error("phase[stnad].kp"), "no phase is called 'stnad'; did you mean stand?");
  EXPECT_EQ(error("phase[lift].kp"),
            "2 elements are called 'lift'; write one of phase[1], phase[2]");
  EXPECT_EQ(error("weight[heavy]"), "elements of weight have no names; write an index, weight[0]");
}

TEST(SetField, SaysWhatIsWrongAndWhatWouldBeRight) {
  EXPECT_EQ(SetError("joint", "3"), "joint: ToyConfig has no field 'joint'; did you mean joints?");
  EXPECT_EQ(SetError("gains.kx", "3"), "gains.kx: gains has no field 'kx'; did you mean kd or kp?");
  EXPECT_EQ(SetError("gains.stiffness", "3"),
            "gains.stiffness: gains has no field 'stiffness'; use one of kd, kp, name");
  EXPECT_EQ(SetError("gains", "3"),
            "gains: gains is a group of fields; name one of them: kp, kd, name");
  EXPECT_EQ(SetError("joints.x", "3"),
            "joints.x: joints is a whole number (int32), not a group of fields");
  EXPECT_EQ(
      SetError("phase.kp", "3"),
      "phase.kp: phase is a list of 1; write phase[0].kp, or the element's name for its number; "
      "phase[1].kp adds an element");
  EXPECT_EQ(SetError("phase[2].kp", "3"),
            "phase[2].kp: phase has 1 element; the index may be 0 to 1");
  EXPECT_EQ(SetError("gains[0].kp", "3"), "gains[0].kp: gains is not a list; leave out the index");
  EXPECT_EQ(SetError("joints", "3.5"), "joints: '3.5' is not a whole number (int32)");
  EXPECT_EQ(SetError("joints", "3000000000"), "joints: '3000000000' is not a whole number (int32)");
  EXPECT_EQ(SetError("small", "-1"), "small: '-1' is not a whole number (uint32)");
  EXPECT_EQ(SetError("gains.kp", "1,5"), "gains.kp: '1,5' is not a number");
  EXPECT_EQ(SetError("gains.kp", ""), "gains.kp: '' is not a number");
  EXPECT_EQ(SetError("fail", "yes"), "fail: 'yes' is not true or false");
  EXPECT_EQ(SetError("mode", "UP"), "mode: 'UP' is not one of NORMAL, LOOP");
  for (const char* path : {"", ".", "a..b", "phase[", "phase[-1].kp", "phase[0]x.kp", "[0]"}) {
    EXPECT_NE(SetError(path, "1").find("not a path"), std::string::npos) << path;
  }
}

TEST(SetField, AnEmptyTextClearsAListOrAGroup) {
  ToyConfig config;
  ParseTextProto("gains { kp: 3 } phase { kp: 8 } phase { kp: 9 } weight: 3 label: 'x'", "config",
                 &config);
  SetField(&config, "gains", "");
  SetField(&config, "phase", "");
  SetField(&config, "weight", "");
  SetField(&config, "label", "");
  ToyConfig expected;
  ParseTextProto("label: ''", "expected", &expected);
  EXPECT_EQ(config.DebugString(), expected.DebugString());
  // A single element is no list.
  EXPECT_NE(SetError("phase[0]", "").find("group of fields"), std::string::npos);
}

TEST(FieldsByPath, AreCountedToldClearedAndMade) {
  ToyConfig config;
  ParseTextProto("gains { kp: 3 } phase { kp: 8 } phase { kp: 9 } fail: true label: 'x'", "config",
                 &config);
  for (const auto& [path, count] : {std::pair{"gains", 1},
                                    {"gains.kp", 1},
                                    {"gains.kd", 0},
                                    {"phase", 2},
                                    {"phase[1]", 1},
                                    {"phase[2]", 0},
                                    {"phase[1].kp", 1},
                                    {"phase.kp", 1},
                                    {"phase[2].kp", 0},
                                    {"weight", 0},
                                    {"gains.kp.kp", 0},
                                    {"nothing", 0},
                                    {"phase[name].kp", 0},
                                    {"", 0}}) {
    EXPECT_EQ(CountField(config, path), count) << path;
    EXPECT_EQ(HasField(config, path), count > 0) << path;
  }
  for (const auto& [path, value] : {std::pair{"phase[1].kp", "9"},
                                    {"fail", "true"},
                                    {"label", R"("x")"},
                                    {"gains", ""},
                                    {"phase[2].kp", ""}}) {
    EXPECT_EQ(ValueText(config, path), value) << path;
  }
  for (const char* path : {"fail", "gains"}) EXPECT_TRUE(IsTrue(config, path)) << path;
  for (const char* path : {"gains.kp", "phase", "nothing"})
    EXPECT_FALSE(IsTrue(config, path)) << path;
  for (const char* path : {"phase[0]", "phase.kp", "gains.kd", "nothing", "fail[0]"}) {
    EXPECT_FALSE(ClearField(&config, path)) << path;
  }
  for (const char* path : {"gains.kp", "phase", "fail"}) {
    EXPECT_TRUE(ClearField(&config, path)) << path;
    EXPECT_FALSE(HasField(config, path)) << path;
  }
  EXPECT_EQ(MutableGroup(&config, "gains"), config.mutable_gains());
}

TEST(SetField, AFailedAppendLeavesTheListAsItWas) {
  ToyConfig config;
  EXPECT_NE(ErrorOf([&] { SetField(&config, "weight[0]", "heavy"); }), "no error");
  EXPECT_EQ(config.weight_size(), 0);
}

TEST(Suggest, NamesTheNearestThreeOrAll) {
  EXPECT_EQ(Suggest("kpp", {"kd", "label", "kp", "kq"}), "did you mean kp or kd or kq?");
  EXPECT_EQ(Suggest("aaaa", {"aaaf", "aaae", "aaad", "aaac"}),
            "did you mean aaac or aaad or aaae?");
  EXPECT_EQ(Suggest("temperature", {"b", "a"}), "use one of a, b");
}

}  // namespace
}  // namespace poise
