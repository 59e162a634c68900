#include "logging/partial_file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "logging/event_log_writer.h"
#include "tests/logging/small_log.h"

namespace poise::logging {
namespace {

namespace fs = std::filesystem;

class PartialFileTest : public testing::Test {
 protected:
  std::string Refusal() const {
    try {
      PartialFile file(path_);
    } catch (const LogError& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path("file");
  std::string part_ = path_ + ".part";
};

TEST_F(PartialFileTest, ACheckedFileIsThereOnceItIsClosed) {
  CheckedFile file(path_);
  file.Write("some ");
  *file.stream() << "text";
  EXPECT_FALSE(fs::exists(path_));
  file.Close();
  EXPECT_EQ(ReadBytes(path_), "some text");
}

TEST_F(PartialFileTest, ACheckedFileSaysWhyItsFirstWriteFailed) {
  CheckedFile file("/dev/full");
  *file.stream() << std::string(1 << 20, 'x');
  errno = EPERM;
  try {
    file.Close();
    FAIL() << "has written";
  } catch (const LogError& error) {
    EXPECT_STREQ(error.what(), "/dev/full: cannot be written: No space left on device");
  }
}

TEST_F(PartialFileTest, ReplacesTheFileOnlyWhenKept) {
  WriteBytes(path_, "before");
  {
    PartialFile file(path_);
    WriteBytes(file.part(), "half");
    EXPECT_EQ(ReadBytes(path_), "before");
  }
  EXPECT_EQ(ReadBytes(path_), "before");
  EXPECT_FALSE(fs::exists(part_));
  {
    PartialFile file(path_);
    WriteBytes(file.part(), "whole");
    file.Keep();
  }
  EXPECT_EQ(ReadBytes(path_), "whole");
  EXPECT_FALSE(fs::exists(part_));
}

TEST_F(PartialFileTest, LinkIsWrittenThrough) {
  WriteBytes(folder_.path("target"), "before");
  fs::create_symlink(folder_.path("target"), path_);
  PartialFile file(path_);
  WriteBytes(file.part(), "after");
  file.Keep();
  EXPECT_TRUE(fs::is_symlink(path_));
  EXPECT_EQ(ReadBytes(folder_.path("target")), "after");
}

TEST_F(PartialFileTest, EventLogIsNotReplaced) {
  WriteRawLog(path_, SmallLog(3));
  const std::string bytes = ReadBytes(path_);
  EXPECT_NE(Refusal().find(path_ + ": is an event log"), std::string::npos);
  EXPECT_EQ(ReadBytes(path_), bytes);
  EXPECT_FALSE(fs::exists(part_));
}

TEST_F(PartialFileTest, PartOfAnotherWriterIsLeftAlone) {
  WriteBytes(part_, "another's");
  EXPECT_NE(Refusal().find(part_ + ": exists"), std::string::npos);
  EXPECT_EQ(ReadBytes(part_), "another's");
}

TEST_F(PartialFileTest, DeviceIsWrittenItself) {
  PartialFile file("/dev/null");
  EXPECT_EQ(file.part(), "/dev/null");
  file.Keep();
  EXPECT_TRUE(fs::exists("/dev/null"));
}

TEST_F(PartialFileTest, SignalsRemoveEveryPart) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) {
    const pid_t child = fork();
    if (child == 0) {
      PartialFile first(path_);
      std::optional<PartialFile> second(folder_.path("second"));
      PartialFile third(folder_.path("third"));
      WriteBytes(third.part(), "half");
      second.reset();
      if (!fs::exists(part_) || !fs::exists(third.part())) _exit(3);
      raise(signal);
      _exit(4);  // it has not ended the process
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status)) << WEXITSTATUS(status);
    EXPECT_EQ(WTERMSIG(status), signal);
    EXPECT_TRUE(fs::is_empty(fs::path(path_).parent_path()));
  }
}

TEST_F(PartialFileTest, IgnoredSignalStaysIgnored) {
  const auto before = std::signal(SIGHUP, SIG_IGN);
  {
    PartialFile file(path_);
    raise(SIGHUP);
    EXPECT_TRUE(fs::exists(part_));
  }
  EXPECT_EQ(std::signal(SIGHUP, before), SIG_IGN);
}

}  // namespace
}  // namespace poise::logging
