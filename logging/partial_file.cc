#include "logging/partial_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "fmt/format.h"
#include "logging/log_reader.h"

namespace poise::logging {
namespace {

namespace fs = std::filesystem;

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};

/// Keeps the handler out while the list changes.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : kSignals) sigaddset(&signals, signal);
    pthread_sigmask(SIG_BLOCK, &signals, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_;
};

PartialFile* first = nullptr;

}  // namespace

PartialFile::PartialFile(const std::string& path) : path_(path) {
  std::error_code error;
  if (fs::exists(path, error)) {
    if (!fs::is_regular_file(path)) {
      part_ = path_;
      return;
    }
    path_ = fs::canonical(path).string();  // a link keeps pointing to it
    if (IsEventLog(path_)) {
      throw LogError(fmt::format("{}: is an event log; choose another file", path));
    }
  }
  part_ = path_ + ".part";
  const SignalsBlocked blocked;
  const int fd = open(part_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0 && errno == EEXIST) {
    throw LogError(fmt::format(
        "{}: exists: is it being written, or left from a writer that was killed? If so, remove it",
        part_));
  }
  if (fd < 0) throw LogError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  close(fd);
  Enlist();
}

PartialFile::~PartialFile() {
  if (!pending_) return;
  const SignalsBlocked blocked;
  unlink(part_.c_str());
  Delist();
}

void PartialFile::Keep() {
  if (!pending_) return;
  const SignalsBlocked blocked;
  if (std::rename(part_.c_str(), path_.c_str()) != 0) {
    throw LogError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  }
  Delist();
}

void PartialFile::Enlist() {
  pending_ = true;
  next_ = first;
  first = this;
  if (next_ != nullptr) return;
  for (const int signal : kSignals) {
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler != SIG_DFL) continue;  // ignored, or another's to see to
    action.sa_handler = OnSignal;
    sigaction(signal, &action, nullptr);
  }
}

void PartialFile::Delist() {
  pending_ = false;
  PartialFile** link = &first;
  while (*link != this) link = &(*link)->next_;
  *link = next_;
  if (first != nullptr) return;
  for (const int signal : kSignals) {
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler != OnSignal) continue;
    action.sa_handler = SIG_DFL;
    sigaction(signal, &action, nullptr);
  }
}

void PartialFile::OnSignal(int signal) {
  for (PartialFile* file = first; file != nullptr; file = file->next_) unlink(file->part_.c_str());
  std::signal(signal, SIG_DFL);
  raise(signal);  // delivered as this returns
}

CheckedFile::CheckedFile(const std::string& path) : path_(path), file_(path) {
  if (buffer_.open(file_.part(), std::ios::out | std::ios::binary) == nullptr) Fail();
}

void CheckedFile::Write(std::string_view bytes) {
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!stream_) Fail();
}

void CheckedFile::Close() {
  stream_.flush();
  if (!stream_ || buffer_.close() == nullptr) Fail();
  file_.Keep();
}

void CheckedFile::Fail() const {
  const int problem = buffer_.problem() != 0 ? buffer_.problem() : errno;
  throw LogError(fmt::format("{}: cannot be written: {}", path_, std::strerror(problem)));
}

CheckedFile::Buffer::int_type CheckedFile::Buffer::overflow(int_type c) {
  const int_type result = std::filebuf::overflow(c);
  if (result == traits_type::eof()) Note();
  return result;
}

std::streamsize CheckedFile::Buffer::xsputn(const char* data, std::streamsize size) {
  const std::streamsize written = std::filebuf::xsputn(data, size);
  if (written != size) Note();
  return written;
}

int CheckedFile::Buffer::sync() {
  const int result = std::filebuf::sync();
  if (result != 0) Note();
  return result;
}

void CheckedFile::Buffer::Note() {
  if (problem_ == 0) problem_ = errno;
}

}  // namespace poise::logging
