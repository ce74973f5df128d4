// The framing of a chunked body (RFC 9112, 7.1), held to the letter: "0x5", "+5", "5 " or "5zz" is a
// size to one reader and none to the next, and what a proxy in front takes for the end of a body
// would be the next request here. For the transport, whose library reads sizes leniently.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace relit::server {

class ChunkFraming {
public:
    /// Follows the body on by what came next of it, the framing with the data, however it is cut.
    /// @return false from the first byte on that must not be there: in place of hex digits (16 of
    ///         them at most), of CR LF, or, in extensions and trailers, of text; and where an
    ///         extension has more than 256 bytes or the trailers have more than 8192 together,
    ///         and after the body's end
    [[nodiscard]] bool follow(std::string_view bytes);

private:
    enum class Next {
        size,
        more_size,
        extension,
        size_lf,
        data,
        data_cr,
        data_lf,
        trailer,  // its first byte, or the empty line that ends the body
        more_trailer,
        trailer_lf,
        end_lf,
        nothing
    };

    [[nodiscard]] bool follow(char c);
    [[nodiscard]] bool follow_size(char c);
    [[nodiscard]] bool follow_text(char c, std::size_t limit);
    [[nodiscard]] bool expect(char wanted, char c, Next next);

    Next next_ = Next::size;
    std::uint64_t size_ = 0;  // of a chunk; what is still to come of it
    int digits_ = 0;
    std::size_t text_ = 0;  // bytes of the extension, or of all trailers
};

}  // namespace relit::server
