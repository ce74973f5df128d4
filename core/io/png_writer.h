// A PNG file from a picture: the container by hand, the compression by ISA-L (fast) or libdeflate
// (small).
//
// Written here over OpenImageIO's writer because that one adds chunks of its own (oFFs, a tEXt with
// its colour space, gAMA and cHRM beside sRGB), puts UTF-8 into Latin-1 text, and takes many times
// the time; over libpng because what is left of it beside the compression is fewer lines than its
// error handling by longjmp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/io/encode.h"

namespace relit {

/// Takes a picture some rows at a time. Chunks: IHDR, sRGB if `options.srgb` (and nothing else about
/// colour), one tEXt per ASCII or Latin-1 text and one iTXt per other text, IDATs, IEND.
class PngWriter {
public:
    /// @param channels  1 to 4
    /// @param options   `text` holds UTF-8; keywords and texts without zero bytes (asserted)
    PngWriter(int width, int height, int channels, EncodeOptions options);

    /// Rows that are compressed together.
    [[nodiscard]] int strip_rows() const { return strip_rows_; }

    /// The next rows from the top: strips of them, or all that are left (asserted).
    /// @throws Error cancelled
    void add(const Image& rows, const EncodeControl& control);

    /// The file, when all rows have been added (asserted).
    [[nodiscard]] std::string finished();

private:
    struct Strip {
        std::string chunk;  // IDAT
        std::uint32_t checksum = 1;
        std::size_t size = 0;  // of what is deflated
    };
    [[nodiscard]] Strip strip_of(const Image& picture, RowRange rows) const;
    void append_strips();

    int width_, height_, channels_;
    EncodeOptions options_;
    int strip_rows_;
    int done_ = 0;              // rows that have been added
    std::vector<float> above_;  // the last one of them
    std::string file_;
    std::vector<Strip> strips_;
};

}  // namespace relit
