#include "components/framework/runners/state_store.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>

namespace poise {

struct StateStore::Layout {
  struct Copy {
    int64_t tick;
    uint64_t size;
    uint8_t bytes[kCapacity];
  };
  std::atomic<int64_t> commits;  // copy (commits - 1) % 2 is the latest; 0: none
  std::atomic<int32_t> restarts;
  std::atomic<int32_t> standby;
  Copy copies[2];
};

static_assert(std::atomic<int64_t>::is_always_lock_free);

StateStore::StateStore(const std::string& path) {
  const FileDescriptor fd = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), path);
  void* memory = MAP_FAILED;
  if (lseek(fd, 0, SEEK_END) >= static_cast<off_t>(sizeof(Layout))) {
    memory = mmap(nullptr, sizeof(Layout), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  } else {
    errno = EINVAL;  // not one of MakeMemoryFile
  }
  if (memory == MAP_FAILED) throw std::system_error(errno, std::generic_category(), path);
  layout_ = static_cast<Layout*>(memory);
}

StateStore::~StateStore() { munmap(layout_, sizeof(Layout)); }

FileDescriptor StateStore::MakeMemoryFile(const std::string& name) {
  FileDescriptor fd = memfd_create(name.c_str(), MFD_CLOEXEC);
  if (fd < 0 || ftruncate(fd, sizeof(Layout)) != 0) {
    throw std::system_error(errno, std::generic_category(), "memory for the state of " + name);
  }
  return fd;
}

std::span<uint8_t> StateStore::Next() {
  return layout_->copies[layout_->commits.load(std::memory_order_relaxed) % 2].bytes;
}

void StateStore::Commit(int64_t tick, size_t size) {
  const int64_t commits = layout_->commits.load(std::memory_order_relaxed);
  Layout::Copy& copy = layout_->copies[commits % 2];
  copy.tick = tick;
  copy.size = size;
  layout_->commits.store(commits + 1, std::memory_order_release);
}

int64_t StateStore::tick() const {
  const int64_t commits = layout_->commits.load(std::memory_order_acquire);
  return commits == 0 ? -1 : layout_->copies[(commits - 1) % 2].tick;
}

std::span<const uint8_t> StateStore::latest() const {
  const int64_t commits = layout_->commits.load(std::memory_order_acquire);
  if (commits == 0) return {};
  const Layout::Copy& copy = layout_->copies[(commits - 1) % 2];
  return {copy.bytes, std::min<size_t>(copy.size, kCapacity)};
}

int32_t StateStore::restarts() const { return layout_->restarts.load(); }
void StateStore::CountRestart() { layout_->restarts.fetch_add(1); }
int32_t StateStore::standby() const { return layout_->standby.load(); }
void StateStore::set_standby(int32_t pid) { layout_->standby.store(pid); }

}  // namespace poise
