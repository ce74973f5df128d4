// Whether this build has a sanitizer: for limits on memory, and for tests that claim something of
// time or memory.
#pragma once

namespace relit {

/// With one, everything takes many times as long, its own memory is counted, and memory that was given
/// back stays in use.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace relit
