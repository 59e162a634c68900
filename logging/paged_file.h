// Bytes of files that are too large for memory.
#pragma once

#include <cstdint>
#include <ctime>
#include <memory>
#include <span>
#include <string>

#include "components/framework/file_descriptor.h"

namespace poise::logging {

/// A file's bytes, mapped. Only what was looked at last takes this process's memory: the rest goes
/// back to the system, which reads it again when it is asked for. One thread at a time.
class PagedFile {
 public:
  /// A file to read, as long as it is now. Throws LogError.
  explicit PagedFile(const std::string& path);
  /// A file without a name, empty, in $TMPDIR or /var/tmp: gone with this object. Throws LogError.
  static std::unique_ptr<PagedFile> Scratch();
  ~PagedFile();
  PagedFile(const PagedFile&) = delete;
  PagedFile& operator=(const PagedFile&) = delete;

  uint64_t size() const { return size_; }
  /// Whether somebody has written to the file that is read.
  bool changed() const;
  /// All bytes, for who lets go of what it has looked at; nullptr without any.
  const uint8_t* data() const { return data_; }
  /// The bytes from `offset` on, below size(); they may be looked at until the next Append or
  /// Resize.
  const uint8_t* At(uint64_t offset) {
    Visit(offset);
    return data_ + offset;
  }
  uint8_t* Writable(uint64_t offset) {  ///< of a scratch file
    Visit(offset);
    return data_ + offset;
  }
  /// Appends `bytes` to a scratch file and returns where they stand. Throws LogError: the disk is
  /// full.
  uint64_t Append(std::span<const uint8_t> bytes);
  /// A scratch file's new size; new bytes are 0. Throws LogError.
  void Resize(uint64_t size);

 private:
  PagedFile() = default;
  void Visit(uint64_t offset) {
    const uint64_t window = offset >> kWindowBits;
    if (window != window_) Move(window);
  }
  void Move(uint64_t window);

  static constexpr int kWindowBits = 19;  // 512 KiB
  FileDescriptor fd_;
  timespec modified_{};  // as it was opened
  uint8_t* data_ = nullptr;
  uint64_t size_ = 0;      // bytes in use
  uint64_t capacity_ = 0;  // bytes mapped
  uint64_t window_ = 0;
  int moves_ = 0;  // to another window since pages were let go
};

}  // namespace poise::logging
