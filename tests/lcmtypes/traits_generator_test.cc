// The generator refuses messages that could not be checked before decoding, and says where.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

namespace {

/// What the generator prints for one file NAME.lcm with this text; "exit 0" when it accepts it.
std::string Generate(const std::string& name, const std::string& text) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("traits_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / (name + ".lcm");
  std::ofstream(file) << text;
  const std::string command = std::string(POISE_TRAITS_GENERATOR) + " poise " + folder.string() +
                              " " + file.string() + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  std::string output;
  std::array<char, 512> buffer;
  while (fgets(buffer.data(), buffer.size(), pipe) != nullptr) output += buffer.data();
  const int status = pclose(pipe);
  std::filesystem::remove_all(folder);
  if (status == 0) return "exit 0";
  const size_t at = output.find(name + ".lcm");
  return at == std::string::npos ? output : output.substr(at);
}

TEST(TraitsGenerator, AcceptsAMessageWithCountsAndHeader) {
  EXPECT_EQ(
      Generate("a_t",
               "package poise;\nstruct a_t {\n int32_t num_a;\n int64_t run_id, tick, utime;\n"
               " double x[num_a]; /* m */ int8_t y[4];\n const int8_t K = 1, L = 2;\n}\n"),
      "exit 0");
}

TEST(TraitsGenerator, RefusesAnArrayWhoseSizeDoesNotLead) {
  EXPECT_EQ(
      Generate("a_t",
               "package poise;\nstruct a_t {\n int64_t run_id;\n int64_t tick;\n int64_t utime;\n"
               " int32_t num_a;\n double x[num_a];\n}\n"),
      "a_t.lcm:7: field x: dimension num_a must be one of the leading int32_t num_... fields, "
      "which are "
      "checked before decoding\n");
}

TEST(TraitsGenerator, RefusesAMissingOrMisplacedHeader) {
  EXPECT_EQ(
      Generate(
          "a_t",
          "package poise;\nstruct a_t {\n int64_t run_id;\n int64_t utime;\n int64_t tick;\n}\n"),
      "a_t.lcm:3: a_t: int64_t run_id, tick, utime must follow the counts\n");
  EXPECT_EQ(
      Generate(
          "a_t",
          "package poise;\nstruct a_t {\n int32_t run_id;\n int64_t tick;\n int64_t utime;\n}\n"),
      "a_t.lcm:3: a_t: int64_t run_id, tick, utime must follow the counts\n");
}

TEST(TraitsGenerator, RefusesWhatItCannotRead) {
  EXPECT_EQ(
      Generate("a_t",
               "package poise;\nstruct a_t {\n int64_t run_id, tick, utime;\n complex z;\n}\n"),
      "a_t.lcm:4: field z: unknown type complex\n");
  EXPECT_EQ(
      Generate(
          "a_t",
          "package poise;\nstruct a_t {\n int64_t run_id, tick, utime;\n double z[2][2];\n}\n"),
      "a_t.lcm:4: field z: one dimension only\n");
  EXPECT_EQ(Generate("a_t", "package poise;\nstruct b_t {\n int64_t run_id, tick, utime;\n}\n"),
            "a_t.lcm:2: struct b_t must stand in b_t.lcm\n");
  EXPECT_EQ(Generate("a_t", "package other;\nstruct a_t {\n int64_t run_id, tick, utime;\n}\n"),
            "a_t.lcm:1: package must be poise\n");
  EXPECT_EQ(
      Generate("a_t",
               "package poise;\nstruct a_t {\n int32_t num_a;\n int64_t run_id, tick, utime;\n}\n"),
      "a_t.lcm:2: count num_a sizes no array\n");
  EXPECT_EQ(Generate("a_t", "package poise;\nstruct a_t {\n int64_t run_id"),
            "a_t.lcm:3: unexpected end of file\n");
}

/// What the generator prints for a set `lab` of one file that may use structs of Poise's.
std::string GenerateLab(const std::string& text) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("lab_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "a_t.lcm") << text;
  const std::string command = std::string(POISE_TRAITS_GENERATOR) + " lab " + folder.string() +
                              " " + (folder / "a_t.lcm").string() +
                              " --import " POISE_SOURCE_DIR "/lcmtypes/wrench_t.lcm 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  std::string output;
  std::array<char, 512> buffer;
  while (fgets(buffer.data(), buffer.size(), pipe) != nullptr) output += buffer.data();
  if (pclose(pipe) == 0) {
    std::ifstream in(folder / "lab/message_traits.hpp");
    output.assign(std::istreambuf_iterator<char>(in), {});
  }
  std::filesystem::remove_all(folder);
  return output;
}

TEST(TraitsGenerator, TakesAnyPackageAndStructsOfPoise) {
  const std::string traits = GenerateLab(
      "package gait.lab;\nstruct a_t {\n int64_t run_id, tick, utime;\n poise.wrench_t w;\n}\n");
  EXPECT_NE(traits.find("#include \"gait/lab/a_t.hpp\""), std::string::npos) << traits;
  EXPECT_NE(traits.find("struct MessageTraits<::gait::lab::a_t>"), std::string::npos);
  EXPECT_NE(traits.find("kName = \"gait.lab.a_t\""), std::string::npos);
  // 8 bytes of fingerprint, three of 8, and six doubles of a wrench.
  EXPECT_NE(traits.find("return 80;"), std::string::npos) << traits;
}

TEST(TraitsGenerator, KeepsPoisesPackageToItself) {
  EXPECT_NE(GenerateLab("package poise;\nstruct a_t {\n int64_t run_id, tick, utime;\n}\n")
                .find("a_t.lcm:1: package poise is Poise's own; choose another"),
            std::string::npos);
  EXPECT_NE(
      GenerateLab("package lab;\nstruct a_t {\n int64_t run_id, tick, utime;\n wrench_t w;\n}\n")
          .find("unknown type lab.wrench_t"),
      std::string::npos);
}

}  // namespace
