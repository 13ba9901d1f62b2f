// The file operations that persistence rests on, as the system gives them: -1 and errno where one fails. Tests hand in
// a disk that fails.
#pragma once

#include <cstddef>

#include <sys/types.h>

namespace pneuma::persist {

class Files {
 public:
  virtual ~Files() = default;
  virtual int open(const char* path, int flags, mode_t mode);
  virtual ssize_t pread(int file, void* bytes, std::size_t count, off_t offset);
  virtual ssize_t pwrite(int file, const void* bytes, std::size_t count, off_t offset);
  virtual int ftruncate(int file, off_t length);
  virtual int fsync(int file);
  virtual int close(int file);
  virtual int rename(const char* from, const char* to);
  virtual int link(const char* from, const char* to);
  virtual int unlink(const char* path);
  virtual int rmdir(const char* path);
  virtual int mkdir(const char* path, mode_t mode);
};

/// The system itself.
[[nodiscard]] Files& system_files();

}  // namespace pneuma::persist
