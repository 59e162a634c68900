// Groups that a message type gets at run time, against protobuf's own rules of text.
#include "components/framework/configuration/added_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_path.h"
#include "tests/framework/toy.pb.h"

namespace poise {
namespace {

using testing::HasSubstr;

class AddedFieldsTest : public testing::Test {
 protected:
  AddedFieldsTest() {
    AddField(*ToyConfig::descriptor(), "walker", *ToyGains::descriptor());
    AddField(*ToyConfig::descriptor(), "arms", *ToyConfig::descriptor());
  }

  static const ToyGains& Walker(const ToyConfig& config) {
    const auto* field = FindField(*ToyConfig::descriptor(), "walker");
    return dynamic_cast<const ToyGains&>(config.GetReflection()->GetMessage(config, field));
  }
};

constexpr char kText[] =
    "joints: 4  # walker { kp: 9 }\n"
    "walker {\n"
    "  name: \"walker\"\n"
    "  kp: 2.5\n"
    "}\n"
    "\tlabel: \"walker { } arms\"\t gains { kp: 3 } arms < joints: 7 >\n";

TEST_F(AddedFieldsTest, AreReadLikeAnyOther) {
  ToyConfig config;
  ParseTextProto(kText, "file", &config);
  EXPECT_EQ(Walker(config).kp(), 2.5);
  EXPECT_EQ(Walker(config).name(), "walker");
  EXPECT_EQ(config.joints(), 4);
  EXPECT_EQ(config.label(), "walker { } arms");
  EXPECT_EQ(config.gains().kp(), 3);
}

TEST_F(AddedFieldsTest, AreWrittenAsTheyAreRead) {
  ToyConfig config;
  ParseTextProto(kText, "file", &config);
  const std::string text = TextOf(config);
  EXPECT_THAT(text, HasSubstr("walker {\n  kp: 2.5\n"));
  ToyConfig again;
  ParseTextProto(text, "written", &again);
  EXPECT_EQ(TextOf(again), text);
  ToyConfig line;
  ParseTextProto(TextOf(config, true), "line", &line);
  EXPECT_EQ(TextOf(line), text);
}

TEST_F(AddedFieldsTest, HaveLinesAndPaths) {
  EXPECT_EQ(LocateField(kText, "walker.kp", ToyConfig()), 4);
  EXPECT_EQ(LocateField(kText, "arms.joints", ToyConfig()), 6);
  ToyConfig config;
  SetField(&config, "walker.kp", "8");
  EXPECT_EQ(Walker(config).kp(), 8);
  SetField(&config, "walker", "");
  EXPECT_FALSE(
      config.GetReflection()->HasField(config, FindField(*ToyConfig::descriptor(), "walker")));
  try {
    SetField(&config, "walkr.kp", "1");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("walker"));
  }
}

TEST_F(AddedFieldsTest, AreReadWithinOthers) {
  ToyConfig config;
  ParseTextProto(
      "gains { kp: 1 } phase: [{ kp: 1 }, { kp: 2 }] arms { walker { kp: 3 } joints: 5 }\n"
      "walker { kp: 4 }",
      "file", &config);
  EXPECT_EQ(config.phase(1).kp(), 2);
  EXPECT_EQ(Walker(config).kp(), 4);
  const auto* arms = FindField(*ToyConfig::descriptor(), "arms");
  const auto& inner =
      dynamic_cast<const ToyConfig&>(config.GetReflection()->GetMessage(config, arms));
  EXPECT_EQ(Walker(inner).kp(), 3);
  EXPECT_EQ(inner.joints(), 5);
  EXPECT_THAT(TextOf(config, true), HasSubstr("arms { joints: 5 walker { kp: 3 } }"));
}

TEST_F(AddedFieldsTest, ErrorsStandInTheirLine) {
  ToyConfig config;
  for (const auto& [text, where] :
       std::map<std::string, std::string>{{"joints: 1\nwalker {\n  kd: 1\n  kx: 2\n}", "file:4:"},
                                          {"walker { kp: }", "file:1:"},
                                          {"walker {", "file:1:"},
                                          {"gains { walker { kp: 1 } }", "file:1:"},
                                          {"runner { kp: 1 }", "file:1:"},
                                          {"\"unended\nwalker { kp: 1 }", "file:1:"}}) {
    try {
      ParseTextProto(text, "file", &config);
      ADD_FAILURE() << text;
    } catch (const ConfigError& error) {
      EXPECT_THAT(error.what(), testing::StartsWith(where)) << text;
    }
  }
}

TEST_F(AddedFieldsTest, ANameStandsForOneThing) {
  AddField(*ToyConfig::descriptor(), "walker", *ToyGains::descriptor());  // the same again
  EXPECT_EQ(AddedFields(*ToyConfig::descriptor()).size(), 2u);
  EXPECT_THROW(AddField(*ToyConfig::descriptor(), "walker", *ToyConfig::descriptor()), ConfigError);
  EXPECT_THROW(AddField(*ToyConfig::descriptor(), "label", *ToyGains::descriptor()), ConfigError);
  EXPECT_THROW(AddField(*ToyConfig::descriptor(), "no name", *ToyGains::descriptor()), ConfigError);
}

}  // namespace
}  // namespace poise
