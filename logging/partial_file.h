// Files that are there whole or not at all.
#pragma once

#include <fstream>
#include <ostream>
#include <string>
#include <string_view>

namespace poise::logging {

/// A file under way: written as part(), which becomes the file at Keep and is removed otherwise, by
/// SIGINT, SIGTERM, SIGHUP and SIGPIPE too where they would end the process. What is no file (a
/// device, a pipe) is written itself.
class PartialFile {
 public:
  /// Throws LogError: `path` is an event log, which nothing replaces; the part cannot be made or
  /// exists.
  explicit PartialFile(const std::string& path);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  /// Path to write to.
  const std::string& part() const { return part_; }
  /// To be called when all is written and closed. Throws LogError.
  void Keep();

 private:
  static void OnSignal(int signal);
  void Enlist();
  void Delist();

  std::string path_;
  std::string part_;
  bool pending_ = false;         // the part is there and is not the file itself
  PartialFile* next_ = nullptr;  // of the list that the signal handler goes through
};

/// A PartialFile and the stream that writes it, which remembers why its first write failed.
class CheckedFile {
 public:
  /// Throws LogError, also for what PartialFile refuses.
  explicit CheckedFile(const std::string& path);

  /// Failures show at Close.
  std::ostream* stream() { return &stream_; }
  /// Throws LogError.
  void Write(std::string_view bytes);
  /// The file is there from here on. Throws LogError when a write has failed.
  void Close();

 private:
  class Buffer final : public std::filebuf {
   public:
    int problem() const { return problem_; }

   protected:
    int_type overflow(int_type c) override;
    std::streamsize xsputn(const char* data, std::streamsize size) override;
    int sync() override;

   private:
    void Note();
    int problem_ = 0;  // errno: later calls change it
  };
  [[noreturn]] void Fail() const;

  std::string path_;
  PartialFile file_;
  Buffer buffer_;
  std::ostream stream_{&buffer_};
};

}  // namespace poise::logging
