// A descriptor of the system, closed with its owner.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <utility>

namespace poise {

/// Owns a file or socket; below 0 none, as what a call that failed gives. Closing leaves errno.
class FileDescriptor {
 public:
  FileDescriptor(int fd = -1) : fd_(fd) {}  // NOLINT: what a call gives is owned
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    FileDescriptor taken(std::move(other));  // what was owned is closed with it
    std::swap(fd_, taken.fd_);
    return *this;
  }
  ~FileDescriptor() {
    const int error = errno;
    if (fd_ >= 0) close(fd_);
    errno = error;
  }
  operator int() const& { return fd_; }  // NOLINT: calls take it
  operator int() && = delete;            // it would be closed already

 private:
  int fd_;
};

}  // namespace poise
