#include "logging/paged_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "fmt/format.h"
#include "logging/event_log_writer.h"

namespace poise::logging {
namespace {

constexpr int kMostMoves = 8;                      // windows held: 4 MiB
constexpr uint64_t kLeastCapacity = 1ull << 20;    // bytes
constexpr const char* kScratchPlace = "/var/tmp";  // on a disk, unlike many systems' /tmp

[[noreturn]] void Fail(const std::string& what) {
  throw LogError(fmt::format("{}: {}", what, std::strerror(errno)));
}

std::string ScratchPlace() {
  const char* const place = std::getenv("TMPDIR");
  return place != nullptr && *place != '\0' ? place : kScratchPlace;
}

}  // namespace

PagedFile::PagedFile(const std::string& path) {
  fd_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd_ < 0) Fail(fmt::format("{}: cannot be read", path));
  struct stat status {};
  if (fstat(fd_, &status) != 0 || !S_ISREG(status.st_mode)) {
    throw LogError(fmt::format("{}: is not a file", path));
  }
  size_ = capacity_ = static_cast<uint64_t>(status.st_size);
  modified_ = status.st_mtim;
  if (size_ == 0) return;
  void* const map = mmap(nullptr, capacity_, PROT_READ, MAP_PRIVATE, fd_, 0);
  if (map == MAP_FAILED) Fail(fmt::format("{}: cannot be read", path));
  data_ = static_cast<uint8_t*>(map);
}

bool PagedFile::changed() const {
  struct stat status {};
  return fstat(fd_, &status) != 0 || static_cast<uint64_t>(status.st_size) != size_ ||
         status.st_mtim.tv_sec != modified_.tv_sec || status.st_mtim.tv_nsec != modified_.tv_nsec;
}

std::unique_ptr<PagedFile> PagedFile::Scratch() {
  std::unique_ptr<PagedFile> file(new PagedFile);
  std::string path = ScratchPlace() + "/poise-XXXXXX";
  file->fd_ = mkostemp(path.data(), O_CLOEXEC);
  if (file->fd_ < 0) {
    Fail(fmt::format("{}: no file for what memory cannot hold; set TMPDIR", ScratchPlace()));
  }
  unlink(path.c_str());
  return file;
}

PagedFile::~PagedFile() {
  if (data_ != nullptr) munmap(data_, capacity_);
}

void PagedFile::Resize(uint64_t size) {
  if (size > capacity_) {
    const uint64_t capacity = std::max({size, capacity_ + capacity_ / 2, kLeastCapacity});
    // A place on the disk is taken now: a page that found none when it is written would end the
    // process.
    const int problem = posix_fallocate(fd_, static_cast<off_t>(capacity_),
                                        static_cast<off_t>(capacity - capacity_));
    if (problem != 0) {
      errno = problem;
      Fail(fmt::format("{}: a file for what memory cannot hold; set TMPDIR", ScratchPlace()));
    }
    void* const map = data_ == nullptr
                          ? mmap(nullptr, capacity, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0)
                          : mremap(data_, capacity_, capacity, MREMAP_MAYMOVE);
    if (map == MAP_FAILED) Fail(fmt::format("{}: cannot be mapped", ScratchPlace()));
    data_ = static_cast<uint8_t*>(map);
    capacity_ = capacity;
  }
  size_ = size;
}

uint64_t PagedFile::Append(std::span<const uint8_t> bytes) {
  const uint64_t offset = size_;
  Resize(size_ + bytes.size());
  if (!bytes.empty()) std::memcpy(Writable(offset), bytes.data(), bytes.size());
  return offset;
}

void PagedFile::Move(uint64_t window) {
  window_ = window;
  if (++moves_ < kMostMoves) return;
  moves_ = 0;
  // Shared and unchanged pages alike stay in the system's cache, from where they come back.
  madvise(data_, capacity_, MADV_DONTNEED);
}

}  // namespace poise::logging
