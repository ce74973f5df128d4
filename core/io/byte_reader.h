// Numbers out of untrusted bytes: every read is checked against the end.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/io/header.h"

namespace relit {

/// Reads forward through `bytes`; a read past the end throws Error image_broken ("it ends too
/// early").
class ByteReader {
public:
    ByteReader(std::string_view bytes, FileFormat format, std::endian order)
        : bytes_(bytes), format_(format), order_(order) {}

    [[nodiscard]] std::size_t position() const { return at_; }
    [[nodiscard]] std::size_t remaining() const { return bytes_.size() - at_; }

    void seek(std::uint64_t position) {
        if (position > bytes_.size()) throw_broken(format_, "it ends too early");
        at_ = std::size_t(position);
    }

    [[nodiscard]] std::string_view take(std::uint64_t count) {
        if (count > remaining()) throw_broken(format_, "it ends too early");
        const std::string_view taken = bytes_.substr(at_, std::size_t(count));
        at_ += taken.size();
        return taken;
    }

    [[nodiscard]] std::uint8_t u8() { return std::uint8_t(number(1)); }
    [[nodiscard]] std::uint16_t u16() { return std::uint16_t(number(2)); }
    [[nodiscard]] std::uint32_t u32() { return std::uint32_t(number(4)); }
    [[nodiscard]] std::int32_t i32() { return std::int32_t(u32()); }
    [[nodiscard]] std::uint64_t u64() { return number(8); }

    /// An unsigned number of `size` bytes, 1 to 8.
    [[nodiscard]] std::uint64_t number(std::size_t size) {
        const std::string_view taken = take(size);
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < size; ++i) {
            const std::size_t from = order_ == std::endian::big ? i : size - 1 - i;
            value = value << 8 | static_cast<unsigned char>(taken[from]);
        }
        return value;
    }

    /// Bytes up to the next zero, which is skipped; at most `limit` of them.
    [[nodiscard]] std::string_view c_string(std::size_t limit) {
        const std::size_t end = bytes_.substr(at_, limit + 1).find('\0');
        if (end == std::string_view::npos) throw_broken(format_, "a name in it does not end");
        const std::string_view taken = take(end);
        ++at_;
        return taken;
    }

private:
    std::string_view bytes_;
    FileFormat format_;
    std::endian order_;
    std::size_t at_ = 0;
};

}  // namespace relit
