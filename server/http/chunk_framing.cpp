#include "server/http/chunk_framing.h"

#include <algorithm>
#include <charconv>

namespace relit::server {
namespace {

constexpr int max_digits = 16;
constexpr std::size_t max_extension_bytes = 256;
constexpr std::size_t max_trailer_bytes = 8192;

}  // namespace

bool ChunkFraming::follow(std::string_view bytes) {
    while (!bytes.empty()) {
        if (next_ == Next::data) {
            const auto count = std::size_t(std::min<std::uint64_t>(size_, bytes.size()));
            size_ -= count;
            bytes.remove_prefix(count);
            if (size_ == 0) next_ = Next::data_cr;
        } else {
            if (!follow(bytes.front())) return false;
            bytes.remove_prefix(1);
        }
    }
    return true;
}

bool ChunkFraming::follow(char c) {
    switch (next_) {
        case Next::size:
        case Next::more_size:
            return follow_size(c);
        case Next::extension:
            if (c == '\r') return expect('\r', c, Next::size_lf);
            return follow_text(c, max_extension_bytes);
        case Next::size_lf:
            text_ = 0;
            return expect('\n', c, size_ > 0 ? Next::data : Next::trailer);
        case Next::data_cr:
            return expect('\r', c, Next::data_lf);
        case Next::data_lf:
            digits_ = 0;
            return expect('\n', c, Next::size);
        case Next::trailer:
            if (c == '\r') return expect('\r', c, Next::end_lf);
            next_ = Next::more_trailer;
            return c != ' ' && c != '\t' && follow_text(c, max_trailer_bytes);
        case Next::more_trailer:
            if (c == '\r') return expect('\r', c, Next::trailer_lf);
            return follow_text(c, max_trailer_bytes);
        case Next::trailer_lf:
            return expect('\n', c, Next::trailer);
        case Next::end_lf:
            return expect('\n', c, Next::nothing);
        case Next::data:
        case Next::nothing:
            break;
    }
    return false;
}

bool ChunkFraming::follow_size(char c) {
    if (next_ == Next::more_size && c == '\r') return expect('\r', c, Next::size_lf);
    if (next_ == Next::more_size && c == ';') {
        next_ = Next::extension;
        return true;
    }
    std::uint64_t digit = 0;
    if (std::from_chars(&c, &c + 1, digit, 16).ec != std::errc() || ++digits_ > max_digits)
        return false;
    size_ = size_ << 4 | digit;
    next_ = Next::more_size;
    return true;
}

bool ChunkFraming::follow_text(char c, std::size_t limit) {
    const bool is_control = (c >= 0 && c < ' ' && c != '\t') || c == 0x7f;
    return !is_control && ++text_ <= limit;
}

bool ChunkFraming::expect(char wanted, char c, Next next) {
    next_ = next;
    return c == wanted;
}

}  // namespace relit::server
