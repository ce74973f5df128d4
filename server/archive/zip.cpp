#include "server/archive/zip.h"

#include <algorithm>
#include <cassert>
#include <ctime>

namespace relit::server {
namespace {

// APPNOTE.TXT, sections 4.3 to 4.5.
constexpr std::uint64_t largest_32 = 0xffffffff;
constexpr std::uint64_t largest_16 = 0xffff;
constexpr int stored_version = 20, zip64_version = 45;

void put(std::string& bytes, std::uint64_t number, int size) {
    for (int i = 0; i < size; ++i) bytes += char(number >> (8 * i) & 0xff);
}

// Date and time of MS-DOS, in UTC: there is no field for a zone.
std::uint32_t dos_time_of(std::int64_t time_s) {
    const std::time_t time = time_s;
    std::tm utc{};
    ::gmtime_r(&time, &utc);
    const int years = std::clamp(utc.tm_year - 80, 0, 127);
    const int date = years << 9 | (utc.tm_mon + 1) << 5 | utc.tm_mday;
    return std::uint32_t(date) << 16 |
           std::uint32_t(utc.tm_hour << 11 | utc.tm_min << 5 | utc.tm_sec / 2);
}

}  // namespace

std::string ZipWriter::head(std::string_view name, std::uint64_t size_bytes, std::uint32_t crc,
                            std::int64_t time_s) {
    assert(size_bytes < largest_32);
    const Entry& entry = entries_.emplace_back(
        Entry{std::string(name), size_bytes, offset_, crc, dos_time_of(time_s)});
    std::string bytes = "PK\3\4";
    put(bytes, stored_version, 2);
    put(bytes, 0, 2);  // flags
    put(bytes, 0, 2);  // method: stored
    put(bytes, entry.dos_time, 4);
    put(bytes, crc, 4);
    put(bytes, size_bytes, 4);
    put(bytes, size_bytes, 4);
    put(bytes, name.size(), 2);
    put(bytes, 0, 2);
    bytes += name;
    offset_ += bytes.size() + size_bytes;
    return bytes;
}

std::string ZipWriter::end() const {
    std::string bytes;
    for (const Entry& entry : entries_) {
        const bool far = entry.offset >= largest_32;
        bytes += "PK\1\2";
        put(bytes, 3 << 8 | (far ? zip64_version : stored_version), 2);  // made on Unix
        put(bytes, far ? zip64_version : stored_version, 2);
        put(bytes, 0, 2);
        put(bytes, 0, 2);
        put(bytes, entry.dos_time, 4);
        put(bytes, entry.crc, 4);
        put(bytes, entry.size_bytes, 4);
        put(bytes, entry.size_bytes, 4);
        put(bytes, entry.name.size(), 2);
        put(bytes, far ? 12 : 0, 2);
        put(bytes, 0, 2);                 // no comment
        put(bytes, 0, 2);                 // disk
        put(bytes, 0, 2);                 // internal attributes
        put(bytes, 0100644ull << 16, 4);  // a file that its owner may write
        put(bytes, far ? largest_32 : entry.offset, 4);
        bytes += entry.name;
        if (far) {
            put(bytes, 1, 2);
            put(bytes, 8, 2);
            put(bytes, entry.offset, 8);
        }
    }
    const std::uint64_t size = bytes.size();
    const std::uint64_t count = entries_.size();
    if (count >= largest_16 || offset_ >= largest_32 || size >= largest_32) {
        const std::uint64_t record = offset_ + size;
        bytes += "PK\6\6";
        put(bytes, 44, 8);
        put(bytes, zip64_version, 2);
        put(bytes, zip64_version, 2);
        put(bytes, 0, 8);  // disks
        put(bytes, count, 8);
        put(bytes, count, 8);
        put(bytes, size, 8);
        put(bytes, offset_, 8);
        bytes += "PK\6\7";
        put(bytes, 0, 4);
        put(bytes, record, 8);
        put(bytes, 1, 4);
    }
    bytes += "PK\5\6";
    put(bytes, 0, 4);  // disks
    put(bytes, std::min(count, largest_16), 2);
    put(bytes, std::min(count, largest_16), 2);
    put(bytes, std::min(size, largest_32), 4);
    put(bytes, std::min(offset_, largest_32), 4);
    put(bytes, 0, 2);
    return bytes;
}

}  // namespace relit::server
