#include "server/archive/tar.h"

#include <spdlog/fmt/fmt.h>

#include <cassert>
#include <numeric>

namespace relit::server {
namespace {

constexpr std::size_t block = 512;

void put(std::string& head, std::size_t offset, std::string_view text) {
    head.replace(offset, text.size(), text);
}

}  // namespace

std::string tar_head(std::string_view name, std::uint64_t size_bytes, std::int64_t time_s) {
    assert(name.size() <= 100 && size_bytes < (1ull << 33));
    std::string head(block, '\0');
    put(head, 0, name);
    put(head, 100, "0000644");
    put(head, 108, "0000000");
    put(head, 116, "0000000");
    put(head, 124, fmt::format("{:011o}", size_bytes));
    put(head, 136, fmt::format("{:011o}", time_s));
    put(head, 148, "        ");  // the checksum is made with spaces in its own place
    put(head, 156, "0");         // a regular file
    put(head, 257,
        std::string_view("ustar\0"
                         "00",
                         8));
    const unsigned sum = std::accumulate(head.begin(), head.end(), 0u, [](unsigned total, char c) {
        return total + static_cast<unsigned char>(c);
    });
    put(head, 148, fmt::format("{:06o}", sum) + '\0');
    return head;
}

std::string tar_padding(std::uint64_t size_bytes) {
    return std::string((block - size_bytes % block) % block, '\0');
}

std::string tar_end() { return std::string(2 * block, '\0'); }

}  // namespace relit::server
