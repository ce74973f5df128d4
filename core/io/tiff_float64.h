// Texels of TIFF files in 64-bit floats, by libtiff: OpenImageIO 2.4 opens such files and hands out
// zeros.
#pragma once

#include <cstddef>
#include <memory>
#include <string_view>

struct tiff;

namespace relit {

/// The first picture of a file whose header has been checked; channels interleaved.
class Float64Tiff {
public:
    /// @param bytes  outlives the object
    /// @throws Error image_broken
    explicit Float64Tiff(std::string_view bytes);
    ~Float64Tiff();
    Float64Tiff(const Float64Tiff&) = delete;
    Float64Tiff& operator=(const Float64Tiff&) = delete;

    /// Rows have to be asked for from the top on, each once.
    /// @throws Error image_broken
    void read_row(int y, std::byte* out);

    /// The whole tile with its top left texel at (x, y).
    /// @throws Error image_broken
    void read_tile(int x, int y, std::byte* out);

    struct Source;

private:
    std::unique_ptr<Source> source_;
    ::tiff* tiff_ = nullptr;
};

}  // namespace relit
