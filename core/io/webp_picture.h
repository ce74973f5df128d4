// A picture as libwebp takes it, for its encoders of stills and of animations.
#pragma once

#include <stop_token>

#include <webp/encode.h>

#include "core/base/parallel.h"
#include "core/image/image.h"

namespace relit {

/// libwebp's picture, which frees what it holds.
struct WebpPicture : WebPPicture {
    /// @throws std::runtime_error when libwebp is of another version
    WebpPicture();
    ~WebpPicture() { WebPPictureFree(this); }
    WebpPicture(const WebpPicture&) = delete;
    WebpPicture& operator=(const WebpPicture&) = delete;

    /// Takes the picture in 8 bits, grey as three equal channels.
    /// @param picture  1 to 4 channels, as encode() takes them
    /// @throws Error cancelled; invalid_value above max_side_of(PictureFormat::webp);
    ///         std::runtime_error (out of memory)
    void import(const Image& picture, const Executor& executor, const std::stop_token& stop = {});
};

}  // namespace relit
