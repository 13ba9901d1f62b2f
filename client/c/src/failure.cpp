#include "failure.h"

#include <algorithm>
#include <span>
#include <string>

#include "app/protocol.h"

namespace pneuma::c {

namespace {

// Cut, it may end within a character: of UTF-8 the rest of that goes too.
void copy(const std::string& text, std::span<char> to) {
  std::size_t length = std::min(text.size(), to.size() - 1);
  if (length < text.size()) {
    while (length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U) --length;
  }
  std::ranges::copy_n(text.begin(), static_cast<std::ptrdiff_t>(length), to.begin());
  to[length] = '\0';
}

}  // namespace

pneuma_code fail(const base::Status& status, pneuma_error* error) {
  const auto code = static_cast<pneuma_code>(app::to_error(status).code());
  if (error == nullptr) return code;
  error->code = code;
  copy(status.what(), error->what);
  copy(status.where(), error->where);
  return code;
}

pneuma_code succeed(pneuma_error* error) {
  if (error != nullptr) *error = {};
  return PNEUMA_OK;
}

}  // namespace pneuma::c
