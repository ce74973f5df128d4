// ZIP archives of stored (not compressed) files, as the bytes between the files in them. Archives of
// more than 4 GiB or 65535 files are ZIP64. Files are streamed, so nothing here sees their content.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace relit::server {

/// Writes one archive, file by file.
class ZipWriter {
public:
    /// What stands before the next file.
    /// @param name        ASCII
    /// @param size_bytes  below 4 GiB
    /// @param crc         its checksum (core/io/deflate.h)
    /// @param time_s      when it was written, in seconds since 1970
    [[nodiscard]] std::string head(std::string_view name, std::uint64_t size_bytes,
                                   std::uint32_t crc, std::int64_t time_s);

    /// What stands behind the last one: the directory.
    [[nodiscard]] std::string end() const;

private:
    struct Entry {
        std::string name;
        std::uint64_t size_bytes = 0;
        std::uint64_t offset = 0;
        std::uint32_t crc = 0;
        std::uint32_t dos_time = 0;
    };
    std::vector<Entry> entries_;
    std::uint64_t offset_ = 0;  // of the next file's head
};

}  // namespace relit::server
