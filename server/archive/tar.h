// Archives that any tar can unpack (POSIX ustar), as the bytes between the files in them. Files are
// streamed, so nothing here sees their content.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace relit::server {

/// What stands before a file.
/// @param name       up to 100 bytes
/// @param size_bytes below 8 GiB
/// @param time_s     when it was written, in seconds since 1970
[[nodiscard]] std::string tar_head(std::string_view name, std::uint64_t size_bytes,
                                   std::int64_t time_s);

/// What stands behind a file of that size.
[[nodiscard]] std::string tar_padding(std::uint64_t size_bytes);

/// What stands behind the last one.
[[nodiscard]] std::string tar_end();

}  // namespace relit::server
