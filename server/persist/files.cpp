#include "persist/files.h"

#include <cstdio>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace pneuma::persist {

int Files::open(const char* path, int flags, mode_t mode) {
  return ::open(path, flags, mode);
}
ssize_t Files::pread(int file, void* bytes, std::size_t count, off_t offset) {
  return ::pread(file, bytes, count, offset);
}
ssize_t Files::pwrite(int file, const void* bytes, std::size_t count, off_t offset) {
  return ::pwrite(file, bytes, count, offset);
}
int Files::ftruncate(int file, off_t length) {
  return ::ftruncate(file, length);
}
int Files::fsync(int file) {
  return ::fsync(file);
}
int Files::close(int file) {
  return ::close(file);
}
int Files::rename(const char* from, const char* to) {
  return ::rename(from, to);
}
int Files::link(const char* from, const char* to) {
  return ::link(from, to);
}
int Files::unlink(const char* path) {
  return ::unlink(path);
}
int Files::rmdir(const char* path) {
  return ::rmdir(path);
}
int Files::mkdir(const char* path, mode_t mode) {
  return ::mkdir(path, mode);
}

Files& system_files() {
  static Files files;
  return files;
}

}  // namespace pneuma::persist
