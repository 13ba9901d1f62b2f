#include "formats/scratch_file.h"

#include <array>

#include "formats/exporter.h"

namespace pneuma::client {

namespace {

base::Status failure() {
  return write_failure("a temporary file");
}

}  // namespace

base::Status ScratchFile::append(std::string_view bytes) {
  if (file_ == nullptr || std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) return failure();
  return {};
}

base::Status ScratchFile::copy_to(std::ostream& out) {
  if (file_ == nullptr || std::fseek(file_.get(), 0, SEEK_SET) != 0) return failure();
  std::array<char, 65536> chunk{};
  std::size_t count = 0;
  while ((count = std::fread(chunk.data(), 1, chunk.size(), file_.get())) > 0) {
    out.write(chunk.data(), static_cast<std::streamsize>(count));
  }
  return std::ferror(file_.get()) == 0 ? base::Status() : failure();
}

}  // namespace pneuma::client
