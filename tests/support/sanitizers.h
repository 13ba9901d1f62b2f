// Whether a sanitizer watches this process.
#pragma once

namespace pneuma::support {

#if defined(__has_feature)
inline constexpr bool is_address_sanitized = __has_feature(address_sanitizer);
inline constexpr bool is_thread_sanitized = __has_feature(thread_sanitizer);
#else
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool is_address_sanitized = true;
#else
inline constexpr bool is_address_sanitized = false;
#endif
#if defined(__SANITIZE_THREAD__)
inline constexpr bool is_thread_sanitized = true;
#else
inline constexpr bool is_thread_sanitized = false;
#endif
#endif
inline constexpr bool is_sanitized = is_address_sanitized || is_thread_sanitized;

}  // namespace pneuma::support
