#include "logging/printable.h"

#include <gtest/gtest.h>

namespace poise::logging {
namespace {

TEST(Printable, EscapesWhatCouldDriveATerminal) {
  EXPECT_EQ(Printable("a \"b\"\n\x1b[2J\\\xc3\xa9"), "a \\\"b\\\"\\n\\x1b[2J\\\\\\xc3\\xa9");
  EXPECT_EQ(Printable("\"", "\"\""), "\"\"");
}

TEST(Printable, PlainUtf8StaysForATerminal) {
  EXPECT_EQ(ForTerminal("Poise \"\xc3\xa9\" \\"), "Poise \"\xc3\xa9\" \\");
  EXPECT_EQ(ForTerminal("\x1b]0;\"x\"\x07"), "\\x1b]0;\"x\"\\x07");
  EXPECT_EQ(ForTerminal("a\nb"), "a\\nb");
  EXPECT_EQ(LinesForTerminal("a\n\x1b\n\nb"), "a\n\\x1b\n\nb");
  EXPECT_EQ(LinesForTerminal("a\n"), "a\n");
}

// The vectors of RFC 4648, 10, and bytes with their highest bit.
TEST(Printable, BytesAreBase64) {
  const std::string_view all = "foobar";
  const char* const texts[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"};
  for (size_t size = 0; size <= all.size(); ++size) {
    EXPECT_EQ(Base64(all.substr(0, size)), texts[size]);
  }
  EXPECT_EQ(Base64({"\xff\xfe\x00\xfb", 4}), "//4A+w==");
}

TEST(Printable, TellsPlainUtf8) {
  EXPECT_TRUE(IsPlainUtf8(""));
  EXPECT_TRUE(IsPlainUtf8("\xe2\x80\xa6 \xf0\x9f\x98\x80"));
  for (const char* text : {"\x7f", "\t", "\xc2\x9b", "\xff", "\xc3", "\xed\xa0\x80", "\xc0\xaf"}) {
    EXPECT_FALSE(IsPlainUtf8(text)) << text;
  }
}

}  // namespace
}  // namespace poise::logging
