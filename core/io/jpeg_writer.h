// A JPEG file from a picture: strips compressed side by side by TurboJPEG, joined by restart
// markers. For encode().
//
// Over OpenImageIO, which writes with the same library: that one takes whole pictures of finished
// bytes on one thread. Decoded numbers are the same for both.
#pragma once

#include <string>
#include <vector>

#include "core/io/encode.h"

namespace relit {

/// Takes a picture some rows at a time. Baseline, all components in full resolution.
class JpegWriter {
public:
    /// @pre 1 or 3 channels, at most 65500 pixels a side (asserted)
    JpegWriter(int width, int height, int channels, int quality);

    /// Rows that are compressed together.
    [[nodiscard]] int strip_rows() const { return strip_rows_; }

    /// The next rows from the top: strips of them, or all that are left (asserted).
    /// @throws Error cancelled; std::runtime_error when the encoder fails
    void add(const Image& rows, const EncodeControl& control);

    /// The file, when all rows have been added (asserted).
    [[nodiscard]] std::string finished();

private:
    int width_, height_, channels_, quality_;
    int strip_rows_;
    int done_ = 0;                     // rows that have been added
    std::vector<std::string> strips_;  // files of their own
};

}  // namespace relit
